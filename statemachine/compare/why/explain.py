"""Why two sides differ, whatever they are: files, engines, settings."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence

import numpy as np

from ...engines import room
from ...engines.records import ModelDifference
from ...errors import BadInputError, EndedEarlyError, unknown_name
from ...interface import JointType, Model
from ...measures import Deviation
from ...measures.text import milliseconds
from ...page import Figures
from ...release_names import engine_of
from ...runs import Trace
from ...runs.drive import Progress, silent
from ...runs.header import provenance
from ...runs.robot import moved_by_actuators
from ...runs.scenarios import Scenario
from .. import perturbed
from ..labels import files_apart
from ..matching import Matched, match_alike, match_models, missing_parts
from ..perturbed import EXACT, Uncertainty, against_floor
from .causes import Cause, as_written, orders_of, readable_of
from .gap import touched_at_start
from .shapley import locate, shapley
from .trials import Measure, Trials
from .verdict import UNEXPLAINED, CausePart, Facts, GapVerdict, LocatedPart, gap_state, verdict_of

# What the arithmetic of an engine makes of a run's positions: two arms that are built alike are
# 1e-9° to 5e-10 m apart after some seconds. Less than this is no gap to be explained.
ROUNDING = {"rad": 1e-8, "m": 1e-9}
_REDUNDANT = 0.1  # of the gap: so much a cause may leave that makes others needless
_STILL = 1e-3  # [rad or m] over a whole run
_PERIODS = (
    "commands come by the step, which is {left} on the left and {right} on the right: what comes "
    "of that counts as timestep"
)
_NOT_RUN = "no set of causes with it could be run"


class Explanation(Figures):
    """What the gap between two sides comes from.

    Attributes:
        experiment, says, seconds: What was run.
        labels: What the sides are called; differences are brought from the right to the left.
        quantity: What the gap is measured in; unit: of it.
        measure: Which figure of it: the worst at any moment, that of the end, or the rms.
        first: The gap in each quantity, as they come.
        gap: The one that is explained, in `unit`.
        shares: The causes in files, options, commands and settings of an engine, the largest share
            first; see `_shares`. The shares add up to `explained`.
        method: How the shares were computed; orders: how many orders were drawn for it.
        brought: The gap with all of them brought to the same; None if that could not be run.
        found_in: What the rest is found in by leaving features out on both sides.
        explained: The part of the gap that goes where settings are brought to the same.
        located: The part that goes only where something is left out on both sides: it says
            where the rest comes from, not why.
        unexplained: The part that stays.
        negligible: Gaps below this are taken for rounding, in `unit`.
        tolerance: A gap that does not matter, in `unit`.
        floor: The chaos floor, in `unit`: how far the two sides are at most from themselves,
            started and commanded anew with rounding, and with what is not known of the start.
        draws: How many such runs were made of each side; 0 if the floor was not looked for.
        one_engine: Whether both sides run on one engine and release, both with its own settings or
            both with the model's.
        redundant: Causes of which each one alone takes away nine tenths of the gap or more, and the
            last of them less than a tenth.
        impossible: Sets of causes that could not be run.
        unmatched: What only one side has: joints, actuators, by side.
        missing: What one side has nothing of, and the other has: see `missing_parts`.
        notes: What a reader should know, in sentences.
        unread: What differs, too, and nothing depends on but a function that reads it, where there
            is none, or no gap.
        still: Joints with a difference that the left hardly moves: it cannot show.
        touch: The first contact; None without one.
        moments: How many moments the runs are compared at; between: whether rows had to be
            interpolated there.
        runs: How many runs it took; took: by the clock [s].
    """

    @property
    def verdict(self) -> GapVerdict:
        """What the gap comes from, and whether that answers the question."""
        return verdict_of(
            Facts(
                state=gap_state(self.gap, self.negligible, self.tolerance, self.floor),
                differs=bool(self.shares),
                refused=any(row.note for row in self.shares),
                one_engine=self.one_engine,
                explained=self.explained,
                located=self.located,
                unexplained=self.unexplained,
                cause=self._largest_cause(),
                places=tuple(
                    LocatedPart(place.share, place.is_still, self._is_switch(place.name))
                    for place in self.found_in
                ),
            )
        )

    def _largest_cause(self) -> CausePart | None:
        """The cause with the largest share, which comes first; None if none takes away anything."""
        for row in self.shares:
            if row.share:
                return CausePart(row.share, row.alone, row.last)
        return None

    def _is_switch(self, feature: str) -> bool:
        """Whether a feature that was left out on both sides is on on one side, and off on one."""
        return any(row.name == feature for row in self.shares)


def explain(
    left: Model,
    right: Model,
    scenario: Scenario,
    *,
    recordings: Sequence[Trace] = (),
    seconds: float | None = None,
    seed: int = 0,
    names: Mapping[str, str] | None = None,
    quantity: str | None = None,
    measure: Measure = "worst",
    finer: bool = False,
    budget: int = 200,
    labels: tuple[str, str] | None = None,
    uncertain: Uncertainty | None = EXACT,
    jobs: int | None = None,
    progress: Progress = silent,
) -> Explanation:
    """Bring what two sides differ in to the same, one by one, and run both again.

    What stays is looked for by leaving out, on both sides, what no setting holds.

    Args:
        left: The left side, as loaded; the other is brought to it.
        right: The right side, of any file and engine. Where one side comes with the settings of its
            engine and the other does not, each of them is a cause.
        scenario: What is run.
        recordings: Runs with the start and the commands of the left and of the right instead of the
            scenario's; of one alone both are given those.
        seconds: Simulated time; None for the scenario's own.
        seed: Of what the scenario draws, and of the orders that are drawn.
        names: Joints, bodies, sites and actuators of `left` that go by other names in `right`.
        quantity: What the gap is measured in; None for a free body that is touched at the start,
            relative to the tip, else the joints, or what differs most where these agree.
        measure: Which figure of it.
        finer: Every difference by its single entries, however many there are.
        budget: How many sets of causes may be run: all of them where there are no more, else as
            far as orders are drawn.
        labels: What the sides are called.
        uncertain: What is not known of the start, for the chaos floor; None for no floor.
        jobs: How many processes make the runs; None for one a processor where that pays, and
            for one where a function commands. Without forks the runs are made in this process. The
            figures are the same.
        progress: Told the fraction that is done.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        BadInputError: Nothing can be measured, or `jobs` is less than 1.
        UnknownNameError: There is no such quantity, or name.
    """
    began, (left_label, right_label) = time.perf_counter(), labels or _labels(left, right)
    scenario = scenario if recordings else scenario.on(left)
    compiled = left.compiled is not None and right.compiled is not None
    matched = match_models(left, right, names) if compiled else match_alike(left, right)
    runs, expected = 0, 10 + (2 * perturbed.RUNS if uncertain is not None else 0)

    def ran() -> None:
        nonlocal runs, expected
        runs += 1
        if runs >= expected:  # orders are drawn
            expected = runs + budget // 4
        progress(0.99 * runs / expected)

    length = scenario.seconds if seconds is None else seconds
    trials = Trials((left, right), matched, scenario, recordings, length, seed, ran, jobs, quantity)
    units = trials.ruler.units
    if quantity is not None:
        quantity = trials.ruler.named(quantity)
        if quantity not in units:
            known = (*units, *trials.traces[0].header.joint_labels)
            called = dict.fromkeys(name.replace(",", "") for name in known)
            raise unknown_name("quantity", quantity, called)
    listed = trials.causes(finer)
    able = [cause.name for cause in listed if not cause.refused]
    first = trials.gaps(frozenset())
    if not first:
        raise _ended(trials, able)
    if scenario.own and not trials.repeats():
        raise BadInputError(
            f"two runs of {left_label} from the same start differ: "
            f"{scenario.name} does not command the same twice, and so no gap has a cause; give "
            "what it draws a seed, and let it keep nothing from one run to the next"
        )
    floors = {} if uncertain is None else trials.floor(uncertain, measure)
    if quantity is None:
        quantity = _quantity(trials, first, floors, measure, left)
    gap, floor = getattr(first[quantity], measure), floors.get(quantity, 0.0)
    negligible, tolerance = ROUNDING[units[quantity]], trials.ruler.tolerance(quantity)
    nothing = gap_state(gap, negligible, tolerance, floor) != "beyond"
    if nothing:
        listed = tuple(cause for cause in listed if not cause.only_read)

    def value(brought: frozenset[str]) -> float | None:
        gaps = trials.gaps(brought)
        return getattr(gaps[quantity], measure) if gaps else None

    expected = runs + 3 * len(able) + 10
    divided = shapley(
        [] if nothing else able,
        value,
        gap or 1.0,
        budget=budget,
        seed=seed,
        ahead=trials.ahead,
        needs=trials.needs,
    )
    brought = gap if nothing else value(frozenset(able))
    rest = (
        ()
        if nothing or brought is None
        else locate(
            trials, frozenset(able), quantity, measure, gap, brought, max(negligible, floor)
        )
    )
    shares = _shares(listed, divided, rest, left, right)
    left_out = [
        f"{model.backend}: {what}"
        for model in (left, right)
        for what in room(engine_of(model.backend)).ignored(model)
        if "integrator" not in what  # which is a cause
    ]
    periods = [milliseconds(model.timestep, 3) for model in (left, right)]
    asked = [_PERIODS.format(left=periods[0], right=periods[1])] if len(set(periods)) > 1 else []
    explained, located, unexplained = _parts(gap, brought, rest, nothing)
    # Each of them explains nearly all alone, and next to nothing after the others.
    redundant = [
        row.name
        for row in shares
        if row.last is not None
        and (row.alone or 0.0) > 1.0 - _REDUNDANT
        and abs(row.last) < _REDUNDANT
    ]
    progress(1.0)
    return Explanation(
        experiment=scenario.name,
        says=scenario.says,
        seconds=length,
        labels=(left_label, right_label),
        quantity=quantity,
        unit=units[quantity],
        measure=measure,
        first=first,
        gap=gap,
        shares=shares,
        method=divided.method,
        orders=divided.orders,
        brought=brought,
        found_in=tuple(part for part in rest if not part._side),
        explained=explained,
        located=located,
        unexplained=unexplained,
        negligible=negligible,
        tolerance=tolerance,
        floor=floor,
        draws=0 if uncertain is None else perturbed.RUNS,
        one_engine=_is_one_engine(left, right),
        redundant=tuple(redundant) if len(redundant) > 1 and explained > UNEXPLAINED else (),
        impossible=divided.impossible,
        unmatched=matched.only,
        missing=missing_parts(left, right),
        notes=tuple(dict.fromkeys((*matched.notes, *left_out, *asked))),
        unread=_unread(matched, scenario, nothing) if compiled else (),
        still=_still(listed, left, trials.traces[0]),
        touch=None if nothing else trials.touch(quantity),
        moments=len(trials.ruler.time),
        between=trials.ruler.between,
        runs=trials.count,
        took=time.perf_counter() - began,
        provenance=(provenance(left), provenance(right)),
    )


def _is_one_engine(left: Model, right: Model) -> bool:
    """Whether two sides are computed by one engine and release, with settings of one kind."""
    sides = [
        (model.backend, model.engine_version, getattr(model, "defaults", "model"))
        for model in (left, right)
    ]
    return sides[0] == sides[1]


def _ended(trials: Trials, able: list[str]) -> EndedEarlyError:
    """That a side does not reach the end, and by which causes alone it would."""
    reason = trials.ended
    cures = [name for name in able if trials.gaps(frozenset({name}))]
    text = f"as they come, a side does not reach the end: {reason}"
    if cures:
        text += f"; both reach it if one of these is brought to the same: {', '.join(cures)}"
    return EndedEarlyError(text, ended=reason)


def _quantity(
    trials: Trials,
    first: Mapping[str, Deviation],
    floors: Mapping[str, float],
    measure: Measure,
    model: Model,
) -> str:
    """The quantity that a gap is explained in.

    It is a body that is held, relative to the tip, where that is beyond its tolerance. Else it is
    the one that is farthest beyond, among those that are more than rounding and chaos make of a
    run: a coordinate, as `compare` names it, if one is. Where none is beyond, it is the first.
    """
    ruler = trials.ruler
    robot = frozenset(model.body_names[body] for body in moved_by_actuators(model))
    preferred = ruler.default_quantity(touched_at_start(trials.traces[0], robot))
    above = {
        name: getattr(gap, measure) / ruler.tolerance(name)
        for name, gap in first.items()
        if getattr(gap, measure) > ROUNDING[ruler.units[name]]
    }
    beyond = above
    for chance in ("beyond", "cannot be told"):
        clear = {
            name: off
            for name, off in above.items()
            if against_floor(getattr(first[name], measure), floors.get(name, 0.0)) == chance
        }
        if clear:
            beyond = clear
            break
    if preferred not in ruler.coordinates and beyond.get(preferred, 0.0) > 1:
        return preferred
    own = {name: beyond[name] for name in ruler.coordinates if beyond.get(name, 0.0) > 1}
    most = max(own or beyond, key=beyond.__getitem__, default=preferred)
    return preferred if preferred in beyond and beyond[most] <= 1 else most


def _shares(
    listed: tuple[Cause, ...],
    divided: Figures,
    rest: tuple[Figures, ...],
    left: Model,
    right: Model,
) -> tuple[Figures, ...]:
    """The causes, the largest share first; of what was found by a setting of one side, too.

    Returns:
        name, values, unit, units, place: See `as_written`.
        kind: Of the elements: "body", "joint", "option"; "run" of what is commanded and of the
            start, "engine" of a setting of an engine as it comes.
        share: Its part of the gap (Shapley value); below zero where it hides others; None where it
            cannot be brought to the same, or no set of causes with it could be run.
        error: Standard error of the share; 0 where it is not an estimate.
        alone: The part that it takes away as the only one; last: after all others.
        note: Why there is no share, or what else is to be said.
        chosen: Of an integrator the side that can choose, and the one to choose; else None.
    """
    rows = [
        Figures(
            **vars(said),
            kind=cause.kind,
            share=divided.share.get(cause.name),
            error=divided.error.get(cause.name, 0.0),
            alone=divided.alone.get(cause.name),
            last=divided.last.get(cause.name),
            note=cause.refused or _NOT_RUN * (divided.share.get(cause.name, 0.0) is None),
            chosen=None,
        )
        for cause, said in zip(listed, as_written(left.path, right.path, listed), strict=True)
    ]
    rows += [
        Figures(
            name=part.name,
            kind="option",
            values=((part.name, *part.values),) if part.values else (),
            unit="",
            units=("",) if part.values else (),
            share=part.share,
            error=0.0,
            alone=part.alone,
            last=part.share,
            note="",
            place=None,
            chosen=(part._side, part.without),
        )
        for part in rest
        if part._side
    ]
    return tuple(sorted(rows, key=lambda row: -abs(row.share or 0.0)))


def _parts(
    gap: float, brought: float | None, rest: tuple[Figures, ...], nothing: bool
) -> tuple[float, float, float]:
    """What is explained, located and unexplained, as parts of the gap."""
    if nothing or brought is None:
        return 0.0, 0.0, float(not nothing)
    explained = (gap - brought) / gap + sum(part.share for part in rest if part._side)
    located = sum(part.share for part in rest if not part._side)
    return explained, located, (rest[-1].gap if rest else brought) / gap


def _unread(matched: Matched, scenario: Scenario, nothing: bool) -> tuple[str, ...]:
    """What differs, and only a function would read, where none does: names of differences."""
    rows: list[ModelDifference] = []
    if nothing or not scenario.own:
        rows += readable_of(matched)
    if not scenario.own:
        rows += orders_of(matched)
    return tuple(row.title for row in rows)


def _still(listed: tuple[Cause, ...], model: Model, trace: Trace) -> tuple[str, ...]:
    """Joints of some causes, hinges and slides, that hardly move in a run."""
    names = {row.where for cause in listed if cause.kind == "joint" for row in cause.differences}
    return tuple(
        name
        for name, kind, place in zip(
            model.joint_names, model.jnt_type, model.jnt_qposadr, strict=True
        )
        if name in names
        and kind in (JointType.HINGE, JointType.SLIDE)
        and np.ptp(trace.qpos[:, place]) < _STILL
    )


def _labels(left: Model, right: Model) -> Sequence[str]:
    """File and engine of both, with the folders by which two files of one name differ."""
    return [
        f"{file} on {engine_of(model.backend)} {model.engine_version}"
        + ", engine defaults" * (getattr(model, "defaults", "model") == "engine")
        for file, model in zip(
            files_apart(left.path.parts, right.path.parts), (left, right), strict=True
        )
    ]
