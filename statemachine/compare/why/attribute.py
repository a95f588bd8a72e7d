"""Why two simulations differ: settings made the same one by one, and both run again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from ...errors import BadInputError, DivergedError, EngineError, UnsupportedError, unknown_name
from ...experiments._common import (
    Progress,
    Provenance,
    moved_by_actuators,
    provenance,
    silent,
    touching,
)
from ...experiments.scenarios import Scenario
from ...interface import Data, Model
from ...traces import Trace, record
from .factors import FACTORS, OFF_ORDER, PARITY_ORDER, Factor
from .gap import Curves, Gap, Ruler
from .sides import Change, Changes, Side, same, side_of

_NOTHING = 1e-6  # of the first gap: what is less is left alone
# What is left out on both makes another motion, whose gap may be smaller for that reason. So
# it stays in the ladder only if it takes away this part of what was left, and if one still
# moves by this part of what it moves as it comes.
_MOST, _MOVES = 0.5, 0.1
# Rounding, after it has grown for some seconds: less than this is no gap to be explained.
_ROUNDING = {"rad": 1e-8, "m": 1e-9}
Way = Literal["parity", "off", "one side", "alike", "none"]


@dataclass(frozen=True)
class Trial:
    """One factor brought to the same, alone or on top of others, and what became of the gap.

    Attributes:
        factor: Its name.
        way: "parity": two takes one's setting, or one two's; "off": left out on both;
            "one side": tried on one alone, since the other has nothing to set; "alike":
            the same engine with the same setting, nothing to bring; "none": it cannot be.
        had: What one and two had, in a few words.
        did: What was done, in a few words.
        gaps: The gap in each quantity after it; empty if there is none.
        worst: Of these, that of the attribution's quantity; None if there is none.
        explains: The part of the first gap that it took away: below zero if it made it wider;
            None where nothing was run, or in a rung that stands only with the next.
        moved: How far one's own motion is then from its motion as it comes; above the gap,
            the experiment has become another.
        put_back: The gap if all is as at the end of the settings of the ladder, and this
            factor alone (with what cannot be without it) is as it came; None where nothing
            was set.
        note: Why there is no gap, or what else is to be said.
    """

    factor: str
    way: Way
    had: tuple[str, str]
    did: str
    gaps: dict[str, Gap]
    worst: float | None
    explains: float | None
    moved: float | None
    put_back: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Touch:
    """The first contact of the robot, and how far apart the runs were until then.

    Attributes:
        time: Since the start [s].
        what: What touched what.
        before: The gap of the runs as they come, at the moments until then.
        moments: How many these are.
    """

    time: float
    what: str
    before: float
    moments: int


@dataclass(frozen=True)
class Attribution:
    """How much of the gap between two simulations each of their differences explains.

    Attributes:
        experiment, says, seconds: What was run.
        one, two: The sides; two is brought to one. names: what they are called for short.
        quantity: What the gap is measured in; unit: of it.
        first: The gap in each quantity, as they come.
        alone: Each factor by itself; empty where the gap is rounding.
        ladder: All of them, one on top of the other; what is left telescopes to `left`.
        left: What stays unexplained; None if nothing could be run.
        negligible: Gaps below this are taken for rounding, in `unit`.
        extent: How far one moves from where it starts, in `unit`.
        touch: The first contact of the robot; None without one, or with one from the start.
        moments: How many moments the runs are compared at; between: whether rows had to be
            interpolated there.
        order: How the ladder was ordered, and why.
        runs: How many runs it took.
    """

    experiment: str
    says: str
    seconds: float
    one: str
    two: str
    names: tuple[str, str]
    quantity: str
    unit: str
    first: dict[str, Gap]
    alone: tuple[Trial, ...]
    ladder: tuple[Trial, ...]
    left: float
    negligible: float
    extent: float
    touch: Touch | None
    moments: int
    between: bool
    order: tuple[str, str]
    runs: int
    provenance: tuple[Provenance, Provenance]

    @property
    def gap(self) -> float:
        """The gap as they come, in `unit`."""
        return self.first[self.quantity].worst

    @property
    def settings_same(self) -> float:
        """The gap where all settings are the same and nothing is left out."""
        rungs = [trial for trial in self.ladder if trial.way == "parity"]
        known = [trial.worst for trial in rungs if trial.worst is not None]
        return known[-1] if known else self.gap

    @property
    def unexplained(self) -> float:
        """The part of it that nothing took away."""
        return self.left / self.gap if self.gap else 0.0


ORDER = (
    "First what is set differently: {two} is brought to what {one} has, and {one} moves as "
    "before. Gravity and the clock come first, then the robot: its damping before the servo "
    "law, its armature after it.",
    "Then what is set alike and is each engine's own doing: it is left out on both, what acts "
    "now and then first. That makes another motion, so it counts only where it takes away more "
    "than half of what was left.",
)


def attribute(
    one: Model,
    two: Model,
    scenario: Scenario,
    *,
    seconds: float | None = None,
    seed: int = 0,
    quantity: str | None = None,
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
        progress: Told the fraction that is done.

    Raises:
        BadInputError: The models have other joints, or one of them cannot do the experiment.
        UnknownNameError: There is no such quantity.
    """
    sides = [side_of(model, scenario.options) for model in (one, two)]
    if sides[0].fresh and not sides[1].fresh:
        sides.reverse()
    runs = _Runs(sides, scenario, scenario.seconds if seconds is None else seconds, seed, progress)
    names = runs.ruler.units
    if quantity is not None and quantity not in names:
        raise unknown_name("quantity", quantity, names)
    runs.quantity = quantity or runs.natural
    first = runs.gaps({}, {})
    if not first:
        raise BadInputError(f"as they come, a side does not reach the end: {runs.ended}")
    nothing = first[runs.quantity].worst <= _ROUNDING[names[runs.quantity]]
    ladder, parity = ((), ({}, {})) if nothing else _ladder(runs)
    alone = () if nothing else _alone(runs, *parity)
    steps = [trial.worst for trial in ladder if trial.explains is not None]
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
        negligible=_ROUNDING[names[runs.quantity]],
        extent=runs.extent({}),
        touch=runs.touch,
        moments=len(runs.ruler.time),
        between=runs.ruler.between,
        order=(ORDER[0].format(one=runs.names[0], two=runs.names[1]), ORDER[1]),
        runs=runs.count,
        provenance=runs.provenance,
    )


def _names(one: str, two: str) -> tuple[str, str]:
    """The engines, or which is which where they are the same."""
    short = one.split(" ", maxsplit=1)[0], two.split(" ", maxsplit=1)[0]
    return short if short[0] != short[1] else ("the first", "the second")


@dataclass(frozen=True)
class _Move:
    """What can be done with one factor: the changes of both sides, or why there are none."""

    way: Way
    one: Change | None = None
    two: Change | None = None
    did: str = ""
    note: str = ""


class _Runs:
    """Runs of both sides with changes, each made once."""

    def __init__(
        self,
        sides: list[Side],
        scenario: Scenario,
        seconds: float,
        seed: int,
        progress: Progress,
    ) -> None:
        self.one, self.two = sides
        self.names = _names(self.one.label, self.two.label)
        self.seconds, self.count, self.ended = seconds, 0, ""
        self._scenario, self._seed, self._progress = scenario, seed, progress
        self._expected = 4 * len(FACTORS)
        self._curves: dict[Any, Curves | None] = {}
        self.listed = [
            factor
            for factor in FACTORS.values()
            if factor.name != "inertia" or any(side.fresh for side in sides)
        ]
        models = [side.build({}) for side in sides]
        watches = [_Watch(model) for model in models]
        traces = [self._record(*pair) for pair in zip(models, watches, strict=True)]
        self.provenance = provenance(models[0]), provenance(models[1])
        self.ruler = Ruler(models[0], *traces)
        for place, trace in enumerate(traces):
            self._curves[place, ()] = self.ruler.curves(trace)
            self.ended = self.ended or trace.header.ended
        self.natural = self.ruler.held(traces[0], watches[0].at_start)
        self.quantity = self.natural
        self._watches = watches

    def _record(self, model: Model, watch: _Watch | None = None) -> Trace:
        self.count += 1
        self._progress(min(0.99, self.count / self._expected))
        scenario = self._scenario
        controller = scenario.controller(model, self._seed)
        if watch is not None:
            controller = watch.around(controller)
        return record(model, controller, self.seconds, keyframe=scenario.keyframe, derive=False)

    def done(self) -> None:
        """Say that all is done."""
        self._progress(1.0)

    def curves(self, place: int, changes: Changes) -> Curves | None:
        """A run of one side, 0 or 1; None, with a reason in `ended`, if it did not end well."""
        key = place, tuple(sorted((name, change.how) for name, change in changes.items()))
        if key not in self._curves:
            side = (self.one, self.two)[place]
            try:
                trace = self._record(side.build(changes))
                self._curves[key] = self.ruler.curves(trace)
                self._why = trace.header.ended or "it left every bound"
            except (DivergedError, EngineError, UnsupportedError) as error:
                self._curves[key], self._why = None, str(error)
            if self._curves[key] is None:
                self.ended = f"{self.names[place]} does not stand: {_first(self._why)}"
        return self._curves[key]

    def gaps(self, one: Changes, two: Changes) -> dict[str, Gap]:
        """The gap with changes on both sides; nothing if one of them did not end well."""
        first, second = self.curves(0, one), self.curves(1, two)
        return self.ruler.gaps(first, second) if first and second else {}

    def moved(self, changes: Changes) -> float:
        """How far one's own motion is from what it is as it comes."""
        before, after = self._curves[0, ()], self.curves(0, changes)
        assert before is not None and after is not None  # noqa: PT018  (they have gaps)
        return self.ruler.gap(self.quantity, before, after).worst

    def extent(self, changes: Changes) -> float:
        """How far one moves from where it starts."""
        run = self.curves(0, changes)
        assert run  # it has gaps
        start = Curves({name: curve[:1] for name, curve in run.of.items()})
        return float(self.ruler.distances(self.quantity, run, start).max())

    @property
    def first(self) -> float:
        """The gap as they come."""
        return self.gaps({}, {})[self.quantity].worst

    @property
    def touch(self) -> Touch | None:
        """The first contact, where there was none from the start."""
        found = [watch for watch in self._watches if watch.time is not None]
        one, two = self._curves[0, ()], self._curves[1, ()]
        if not found or any(watch.time == 0 for watch in found) or not (one and two):
            return None
        soonest = min(found, key=lambda watch: watch.time or 0.0)
        assert soonest.time is not None
        # A contact found at a moment acts from that moment on: the moment itself is before it.
        before = self.ruler.time <= soonest.time + 1e-9
        far = self.ruler.distances(self.quantity, one, two)[before]
        return Touch(soonest.time, soonest.what, float(far.max()), int(before.sum()))


class _Watch:
    """When the robot first touches something, seen from the controller of a run."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self.time: float | None = None
        self.what = ""
        self.at_start: frozenset[str] = frozenset()

    def around(self, controller: Any) -> Any:
        """The controller, which looks at the contacts before each step."""
        robot = moved_by_actuators(self._model)
        began: list[float] = []
        last = [0.0]

        def watching(time: float, data: Data) -> Any:
            if not began:
                began.append(time)
            elif self.time is None:
                found = touching(self._model, data.contacts, robot)
                if found:  # of the state that the last step began with
                    self.time, self.what = last[0] - began[0], "; ".join(found)
                    if self.time == 0:
                        self.at_start = self._touched(data)
            last[0] = time
            return controller(time, data)

        return watching

    def _touched(self, data: Data) -> frozenset[str]:
        bodies = self._model.geom_bodyid[data.contacts.geom.ravel()]
        return frozenset(self._model.body_names[body] for body in bodies)


def _first(text: str) -> str:
    """The first sentence of a text."""
    return text.split(". ", maxsplit=1)[0]


def _move(runs: _Runs, factor: Factor, one: Changes, two: Changes) -> _Move:
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
    runs: _Runs,
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


def _leave_out(runs: _Runs, factor: Factor, two_has_none: bool) -> _Move:
    off = Change("off", {})
    refusal = runs.one.refuses(factor, "off", {}, {})
    if not refusal and not two_has_none:
        refusal = runs.two.refuses(factor, "off", {}, {})
    if refusal:
        return _Move("none", note=refusal)
    did = f"{factor.off}, {'as ' + runs.names[1] if two_has_none else 'both'}"
    return _Move("off", one=off, two=None if two_has_none else off, did=did)


def _alone(runs: _Runs, one: Changes, two: Changes) -> tuple[Trial, ...]:
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
        found.append(replace(trial, put_back=_put_back(runs, factor, one, two)))
    return tuple(found)


def _put_back(runs: _Runs, factor: Factor, one: Changes, two: Changes) -> float | None:
    """The gap with one factor as it came, all other settings the same."""
    if factor.name not in one and factor.name not in two:
        return None
    without = [runs.one.without(factor, one), runs.two.without(factor, two)]
    gaps = runs.gaps(*without)
    return gaps[runs.quantity].worst if gaps else None


def _one_sided(runs: _Runs, factor: Factor) -> _Move | None:
    """Another integrator on the side that has several."""
    known = runs.one.build({}).capabilities.integrators
    if "euler" not in known:
        return None
    change = Change("parity", {"integrator": "euler"})
    return _Move("one side", one=change, did=f"Euler, {runs.names[0]} only")


def _with(changes: Changes, factor: Factor, change: Change | None) -> dict[str, Change]:
    return {**changes, factor.name: change} if change else dict(changes)


def _trial(
    runs: _Runs,
    factor: Factor,
    move: _Move,
    gaps: dict[str, Gap],
    before: float,
    changes: Changes,
    note: str = "",
) -> Trial:
    worst = gaps[runs.quantity].worst if gaps else None
    explains = None if worst is None else (before - worst) / runs.first if runs.first else 0.0
    if move.way == "alike":
        worst, explains = before, 0.0
    return Trial(
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


def _ladder(runs: _Runs) -> tuple[tuple[Trial, ...], tuple[Changes, Changes]]:
    """One factor on top of the other, and the changes with which all settings are the same."""
    found: list[Trial] = []
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
