"""Why two simulations differ: settings made the same one by one, and both run again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ...errors import EndedEarlyError, StateMachineError, unknown_name
from ...interface import Model
from ...measures import Deviation
from ...runs.drive import Progress, silent
from ...runs.scenarios import Scenario
from ..one_step import one_step
from ..perturbed import EXACT, Uncertainty, rerun_of
from ..stages import FOUND
from .factors import FACTORS, OFF_ORDER, PARITY_ORDER, Factor
from .results import ROUNDING, Attribution, Detection, FactorTrial, Way, bounds_of, telling
from .runs import Runs
from .sides import Change, Changes, same, side_of

_NOTHING = 1e-6  # of the first gap: what is less is left alone
# What is left out on both makes another motion, whose gap may be smaller for that reason. So
# it stays in the ladder only if it takes away this part of what was left, and if one still
# moves by this part of what it moves as it comes.
_MOST, _MOVES = 0.5, 0.1

ORDER = (
    "First the settings that differ: {two} gets those of {one}, and {one} moves as "
    "before. Gravity and the timestep come first, then the robot: its damping before the servo "
    "law, its armature after it.",
    "Then what is set alike but computed by each engine in its own way: it is left out on both "
    "sides, and what acts only at times is left out first. That is another motion, so it counts "
    "only where it removes more than half of the gap that was left.",
)


def attribute(
    one: Model,
    two: Model,
    scenario: Scenario,
    *,
    seconds: float | None = None,
    seed: int = 0,
    quantity: str | None = None,
    uncertain: Uncertainty | None = EXACT,
    progress: Progress = silent,
) -> Attribution:
    """Run an experiment on two sides, again and again, with ever less between them.

    Args:
        one: A Model as loaded; the side that two is brought to.
        two: Another, with joints of the same names. Of a Model with `defaults="engine"`
            each setting is one that can be brought to the model's; if it is `one`, the two
            change places.
        scenario: What is run.
        seconds: Simulated time; None for the scenario's own.
        seed: Of what the scenario draws.
        quantity: What the gap is measured in; None for the joints, or for what is in the hand.
        uncertain: What is not known of the start, for the chaos floor; None for no floor.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: The models have other joints, or one of them cannot do the experiment.
        EndedEarlyError: As they come, one of them does not reach the end.
        UnknownNameError: There is no such quantity.
    """
    scenario = scenario.on(one)
    sides = [side_of(model, scenario.options) for model in (one, two)]
    models = one, two
    if sides[0].fresh and not sides[1].fresh:
        sides.reverse()
        models = two, one
    runs = Runs(sides, scenario, scenario.seconds if seconds is None else seconds, seed, progress)
    names = runs.ruler.units
    if quantity is not None and quantity not in names:
        raise unknown_name("quantity", quantity, names)
    first = runs.gaps({}, {})
    if not first:
        raise EndedEarlyError(
            f"as they come, a side does not reach the end: {runs.ended}", ended=runs.ended
        )
    perturbed = {} if uncertain is None else runs.floor(uncertain)
    floors = {name: each.worst for name, each in perturbed.items()}
    bounds = bounds_of(names, floors)
    gaps = {name: each.worst for name, each in first.items()}
    runs.quantity = quantity or telling(gaps, bounds, runs.natural)
    nothing = gaps[runs.quantity] <= bounds[runs.quantity]
    ladder, parity = ((), ({}, {})) if nothing else _ladder(runs)
    alone = () if nothing else _alone(runs, *parity)
    steps = [trial.worst for trial in ladder if trial.explains is not None]
    detection = None
    if not nothing and runs.touch is not None:
        detection = _detection(models, scenario, seconds=runs.seconds, seed=seed)
    runs.done()
    return Attribution(
        experiment=scenario.name,
        says=scenario.says,
        seconds=runs.seconds,
        one=sides[0].label,
        two=sides[1].label,
        names=runs.names,
        quantity=runs.quantity,
        unit=names[runs.quantity],
        first=first,
        alone=alone,
        ladder=ladder,
        left=next((worst for worst in reversed(steps) if worst is not None), runs.first),
        negligible=ROUNDING[names[runs.quantity]],
        floor=floors.get(runs.quantity, 0.0),
        extent=runs.extent({}),
        touch=runs.touch,
        moments=len(runs.ruler.time),
        between=runs.ruler.between,
        order=(ORDER[0].format(one=runs.names[0], two=runs.names[1]), ORDER[1]),
        runs=runs.count,
        provenance=runs.provenance,
        detection=detection,
    )


def _detection(
    models: tuple[Model, Model], scenario: Scenario, *, seconds: float, seed: int
) -> Detection | None:
    """The contacts that each engine finds at the states of the first one's run."""
    one, two = models
    if one.backend == two.backend:
        return None
    try:
        rerun = rerun_of(scenario, one, seconds=seconds, seed=seed)
        other = two.replace(**scenario.options) if scenario.options else two
        found = one_step(rerun, other)
    except StateMachineError:
        return None
    (gap,) = [stage for stage in found.stages if stage.stage == FOUND]
    if not gap.told:
        return None
    return Detection(found.moments, gap.beyond, gap.first, gap.where, gap.worst)


@dataclass(frozen=True)
class _Move:
    """What can be done with one factor: the changes of both sides, or why there are none."""

    way: Way
    one: Change | None = None
    two: Change | None = None
    did: str = ""
    note: str = ""


def _move(runs: Runs, factor: Factor, one: Changes, two: Changes) -> _Move:
    """What brings a factor to the same, on top of changes that are made already."""
    ours, theirs = runs.one.values(factor, one), runs.two.values(factor, two)
    if ours is not None and theirs is not None:
        if _differ(ours, theirs):
            return _bring(runs, factor, ours, theirs, one, two)
        if runs.one.makes == runs.two.makes:
            return _Move("alike", did="alike already")
    return _leave_out(runs, factor, theirs is None)


def _differ(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> bool:
    if "as it comes" in ours or "as it comes" in theirs:
        return dict(ours) != dict(theirs)
    return any(not same(ours[name], theirs[name]) for name in ours if name in theirs)


def _bring(
    runs: Runs,
    factor: Factor,
    ours: Mapping[str, Any],
    theirs: Mapping[str, Any],
    one: Changes,
    two: Changes,
) -> _Move:
    shared = {name: ours[name] for name in ours if name in theirs or "as it comes" in theirs}
    refusal = runs.two.refuses(factor, "parity", shared, two)
    if not refusal:
        return _Move("parity", two=Change("parity", shared), did=f"as {runs.names[0]}")
    shared = {name: theirs[name] for name in theirs if name in ours}
    if shared and not runs.one.refuses(factor, "parity", shared, one):
        return _Move("parity", one=Change("parity", shared), did=f"as {runs.names[1]}")
    left_out = _leave_out(runs, factor, False)
    return left_out if left_out.way == "off" else _Move("none", note=refusal)


def _leave_out(runs: Runs, factor: Factor, two_has_none: bool) -> _Move:
    off = Change("off", {})
    refusal = runs.one.refuses(factor, "off", {}, {})
    if not refusal and not two_has_none:
        refusal = runs.two.refuses(factor, "off", {}, {})
    if refusal:
        return _Move("none", note=refusal)
    did = f"{factor.off}, {'as ' + runs.names[1] if two_has_none else 'both'}"
    return _Move("off", one=off, two=None if two_has_none else off, did=did)


def _alone(runs: Runs, one: Changes, two: Changes) -> tuple[FactorTrial, ...]:
    """Each factor by itself; then as it came, where all other settings are the same."""
    found = []
    for factor in runs.listed:
        move = _move(runs, factor, {}, {})
        if move.way == "none" and factor.name == "integrator":
            move = _one_sided(runs, factor) or move
        changes = _with({}, factor, move.one), _with({}, factor, move.two)
        gaps = {} if move.way in ("none", "alike") else runs.gaps(*changes)
        note = move.note
        if not gaps and not note and move.way != "alike":
            note = runs.ended
        trial = _trial(runs, factor, move, gaps, runs.first, changes[0], note)
        gap, along = _put_back(runs, factor, one, two)
        found.append(replace(trial, put_back=gap, along=along))
    return tuple(found)


def _put_back(
    runs: Runs, factor: Factor, one: Changes, two: Changes
) -> tuple[float | None, tuple[str, ...]]:
    """The gap with one factor as it came, all other settings the same; what went with it."""
    if factor.name not in one and factor.name not in two:
        return None, ()
    without = [runs.one.without(factor, one), runs.two.without(factor, two)]
    kept = {factor.name, *without[0], *without[1]}
    along = tuple(name for name in FACTORS if name in {*one, *two} - kept)
    gaps = runs.gaps(*without)
    return (gaps[runs.quantity].worst if gaps else None), along


def _one_sided(runs: Runs, factor: Factor, integrator: str = "euler") -> _Move | None:
    """Another integrator on the side that has several."""
    known = runs.one.build({}).capabilities.integrators
    if integrator not in known:
        return None
    change = Change("parity", {"integrator": integrator})
    word = "Euler" if integrator == "euler" else integrator
    return _Move("one side", one=change, did=f"{word}, {runs.names[0]} only")


def _integrator(
    runs: Runs, one: Changes, two: Changes, last: float
) -> tuple[FactorTrial | None, dict[str, Change]]:
    """The integrator of the side that has several, by which both do the same.

    The other side cannot be asked for the file's, so the first is brought to what the other does,
    if that takes away more than half of what was left.
    """
    factor, best, kept = FACTORS["integrator"], None, dict(one)
    if factor not in runs.listed or factor.name in one or runs.one.makes == runs.two.makes:
        return None, kept
    for name in runs.one.build({}).capabilities.integrators:
        move = _one_sided(runs, factor, name)
        tried = _with(one, factor, move.one if move else None)
        gaps = runs.gaps(tried, two)
        least = last * (1 - _MOST) if best is None or best.worst is None else best.worst
        if move and gaps and gaps[runs.quantity].worst < least:
            best, kept = _trial(runs, factor, move, gaps, last, tried), tried
    return best, kept


def _with(changes: Changes, factor: Factor, change: Change | None) -> dict[str, Change]:
    return {**changes, factor.name: change} if change else dict(changes)


def _trial(
    runs: Runs,
    factor: Factor,
    move: _Move,
    gaps: dict[str, Deviation],
    before: float,
    changes: Changes,
    note: str = "",
) -> FactorTrial:
    worst = gaps[runs.quantity].worst if gaps else None
    explains = None if worst is None else (before - worst) / runs.first if runs.first else 0.0
    if move.way == "alike":
        worst, explains = before, 0.0
    return FactorTrial(
        factor=factor.name,
        way=move.way,
        had=(runs.one.words(factor), runs.two.words(factor)),
        did=move.did,
        gaps=gaps,
        worst=worst,
        explains=explains,
        moved=runs.moved(changes) if gaps else None,
        note=note,
    )


def _ladder(runs: Runs) -> tuple[tuple[FactorTrial, ...], tuple[Changes, Changes]]:
    """One factor on top of the other, and the changes with which all settings are the same."""
    found: list[FactorTrial] = []
    one: dict[str, Change] = {}
    two: dict[str, Change] = {}
    last = runs.first
    for name in PARITY_ORDER:
        factor = FACTORS[name]
        move = _move(runs, factor, one, two) if factor in runs.listed else _Move("none")
        if move.way != "parity":
            continue
        one, two = _with(one, factor, move.one), _with(two, factor, move.two)
        gaps = runs.gaps(one, two)
        note = "" if gaps else f"{runs.ended}; together with the next"
        found.append(_trial(runs, factor, move, gaps, last, one, note))
        last = last if found[-1].worst is None else found[-1].worst
    if last > _NOTHING * runs.first:
        rung, changed = _integrator(runs, one, two, last)
        if rung is not None and rung.worst is not None:
            found.append(rung)
            one, last = changed, rung.worst
    parity = one, two
    for name in OFF_ORDER:
        if last <= _NOTHING * runs.first:
            break
        factor = FACTORS[name]
        move = _move(runs, factor, one, two)
        if move.way != "off" or name in one or name in two:
            continue
        tried = _with(one, factor, move.one), _with(two, factor, move.two)
        gaps = runs.gaps(*tried)
        trial = _trial(runs, factor, move, gaps, last, tried[0], runs.ended)
        if trial.worst is None:
            found.append(trial)
        elif runs.extent(tried[0]) < _MOVES * runs.extent({}):
            found.append(replace(trial, explains=None, note="nothing moves: not kept"))
        elif trial.worst > (1 - _MOST) * last:
            found.append(replace(trial, explains=None, note="not kept"))
        else:
            found.append(replace(trial, note=""))
            one, two = tried
            last = trial.worst
    return tuple(found), parity
