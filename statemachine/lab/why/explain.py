"""Why two sides differ, whatever they are: files, engines, settings."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...engines import room
from ...engines.records import DifferingQuantity, ModelDifference
from ...errors import BadInputError, EndedEarlyError
from ...interface import JointType, Model
from ...measures.text import milliseconds
from ...release_names import engine_of
from ..compare import perturbed
from ..compare.instead import instead_of
from ..compare.labels import files_apart
from ..compare.matching import Matched, match_alike, match_models, missing_parts
from ..compare.motion import SEEN, MotionExtent, motion_of
from ..recordings import Trace
from ..runs.drive import Progress, silent
from ..runs.provenance import provenance
from .causes import Cause, readable_of
from .explained_gap import ExplainedGap, explained_gap, named_quantity
from .explanation import Explanation, Share
from .gap import size_of
from .locate import Localisation, Remainder, locate
from .request import WhyRequest
from .run_differences import orders_of
from .shapley import Division, shapley
from .trials import Trials
from .verdict import UNEXPLAINED
from .written import WrittenCause, as_written

_REDUNDANT = 0.1  # of the gap: so much a cause may leave that makes others needless
_STILL = 1e-3  # [rad or m] over a whole run
_PERIODS = (
    "commands come by the step, which is {left} on the left and {right} on the right: what comes "
    "of that counts as timestep"
)
_NOT_RUN = "no set of causes with it could be run"


class _RunCounter:
    """Counts runs, and tells what part of the expected ones was made."""

    def __init__(self, progress: Progress, budget: int, expected: int) -> None:
        self._progress, self._budget = progress, budget
        self.runs, self.expected = 0, expected

    def ran(self) -> None:
        """Count one more run."""
        self.runs += 1
        if self.runs >= self.expected:  # orders are drawn
            self.expected = self.runs + self._budget // 4
        self._progress(0.99 * self.runs / self.expected)


def explain(request: WhyRequest, progress: Progress = silent) -> Explanation:
    """Equalize what two sides differ in, one by one, and run both again.

    What stays is looked for by leaving out, on both sides, what no setting holds.

    Args:
        request: The two sides, and what is run on them.
        progress: Told the fraction that is done.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        BadInputError: Nothing can be measured, or the commands do not repeat.
        UnknownNameError: There is no such quantity, or name.
    """
    began = time.perf_counter()
    if not request.recordings:
        request = replace(request, scenario=request.scenario.on(request.left))
    left, right, scenario = request.left, request.right, request.scenario
    labels = request.labels or _labels(left, right)
    matched = _match(request)
    draws = 0 if request.uncertain is None else perturbed.RUNS
    counter = _RunCounter(progress, request.budget, expected=10 + 2 * draws)
    trials = Trials(request, matched, counter.ran)
    quantity = named_quantity(trials, request.quantity)
    causes = trials.setup.causes(request.finer)
    able = [cause.name for cause in causes if not cause.refused]
    first = trials.gaps(frozenset())
    if not first:
        raise _ended(trials, able)
    if scenario.own and not trials.repeats():
        raise BadInputError(
            f"two runs of {labels[0]} from the same start differ: "
            f"{scenario.name} does not command the same twice, and so no gap has a cause; give "
            "what it draws a seed, and let it keep nothing from one run to the next"
        )
    gap = explained_gap(trials, request, quantity, first)
    if not gap.is_divided:
        causes = tuple(cause for cause in causes if not cause.only_read)
    counter.expected = counter.runs + 3 * len(able) + 10
    division, brought = _divide(trials, request, gap, able)
    found = _locate(trials, gap, able, brought)
    motion = _motion(trials, matched)
    shares = _shares(causes, division, found, left, right)
    explained, located, unexplained = _parts(gap, brought, found)
    progress(1.0)
    return Explanation(
        experiment=scenario.name,
        says=scenario.says,
        seconds=request.duration,
        labels=labels,
        quantity=gap.quantity,
        unit=trials.ruler.units[gap.quantity],
        measure=gap.measure,
        first=first,
        gap=gap.size,
        shares=shares,
        method=division.method,
        orders=division.orders,
        brought=brought,
        found_in=tuple(part for part in found if not part.side),
        explained=explained,
        located=located,
        unexplained=unexplained,
        negligible=gap.negligible,
        tolerance=gap.tolerance,
        floor=gap.floor,
        draws=draws,
        one_engine=_is_one_engine(left, right),
        redundant=_redundant(shares) if explained > UNEXPLAINED else (),
        impossible=division.impossible,
        unmatched=matched.only,
        missing=_missing(request),
        notes=_notes(matched, left, right),
        renamed=matched.renamed,
        unread=_unread(matched, request, gap),
        still=_still(causes, left, trials.traces[0]),
        motion=motion,
        instead=None if motion.moved else instead_of(left, scenario.name, request.seed),
        touch=trials.touch(gap.quantity) if gap.is_divided else None,
        moments=len(trials.ruler.time),
        between=trials.ruler.between,
        runs=trials.count,
        took=time.perf_counter() - began,
        provenance=(provenance(left), provenance(right)),
        right_file=right.path.name,
    )


def _motion(trials: Trials, matched: Matched) -> MotionExtent:
    """Return how far the joints move that both sides have, as they come."""
    sides: list[tuple[Trace, list[str]]] = []
    for side, trace in enumerate(trials.traces):
        labels = trace.header.joint_labels
        sides.append((trace, [labels[pair[side]] for pair in matched.joints]))
    return motion_of(sides, SEEN, float(trials.ruler.time[-1]))


def _missing(request: WhyRequest) -> tuple[tuple[str, str], ...]:
    """Return what one side has nothing of and the other has, as far as it acts in what is run."""
    parts = missing_parts(request.left, request.right)
    if request.scenario.options.get("actuation", True):
        return parts
    return tuple((side, part) for side, part in parts if part != "actuators")


def _match(request: WhyRequest) -> Matched:
    """Find what of the left is what of the right."""
    if request.are_compiled:
        return match_models(request.left, request.right, request.names)
    return match_alike(request.left, request.right)


def _ended(trials: Trials, able: list[str]) -> EndedEarlyError:
    """Return the error that a side does not reach the end, and by which causes alone it would."""
    reason = trials.ended
    cures = [name for name in able if trials.gaps(frozenset({name}))]
    text = f"as they come, a side does not reach the end: {reason}"
    if cures:
        text += f"; both reach it if one of these is brought to the same: {', '.join(cures)}"
    return EndedEarlyError(text, ended=reason)


def _divide(
    trials: Trials, request: WhyRequest, gap: ExplainedGap, able: Sequence[str]
) -> tuple[Division, float | None]:
    """Divide a gap among its causes.

    Args:
        trials: The runs.
        request: The question.
        gap: The gap.
        able: Names of the causes that can be equalized.

    Returns:
        The parts of the causes, and the gap with all of them equalized, in the unit of the
        quantity; None if that could not be run.
    """

    def value(equalized: frozenset[str]) -> float | None:
        gaps = trials.gaps(equalized)
        return size_of(gaps[gap.quantity], gap.measure) if gaps else None

    division = shapley(
        able if gap.is_divided else [],
        value,
        gap.size or 1.0,
        budget=request.budget,
        seed=request.seed,
        ahead=trials.ahead,
        needs=trials.setup.needs,
    )
    return division, value(frozenset(able)) if gap.is_divided else gap.size


def _locate(
    trials: Trials, gap: ExplainedGap, able: Sequence[str], brought: float | None
) -> tuple[Localisation, ...]:
    """Look where what no cause explains comes from.

    Args:
        trials: The runs.
        gap: The gap.
        able: Names of the causes that can be equalized.
        brought: The gap with all of them equalized; None if that could not be run.
    """
    if brought is None or not gap.is_divided:
        return ()
    remainder = Remainder(
        trials=trials,
        equalized=frozenset(able),
        quantity=gap.quantity,
        measure=gap.measure,
        gap=gap.size,
        left=brought,
        bound=max(gap.negligible, gap.floor),
    )
    return locate(remainder)


def _shares(
    causes: Sequence[Cause],
    division: Division,
    found: Sequence[Localisation],
    left: Model,
    right: Model,
) -> tuple[Share, ...]:
    """Return the causes, the largest share first; of what was found by a setting of one side, too.

    Args:
        causes: Those of files, options, commands and settings of an engine.
        division: Their parts of the gap.
        found: Where the rest was found.
        left: The left side.
        right: The right side.
    """
    written = as_written(left.path, right.path, causes)
    rows = [
        _share_of_cause(cause, text, division) for cause, text in zip(causes, written, strict=True)
    ]
    for part in found:
        if part.side:
            rows.append(_share_of_integrator(part))
    return tuple(sorted(rows, key=lambda row: -abs(row.share or 0.0)))


def _share_of_cause(cause: Cause, written: WrittenCause, division: Division) -> Share:
    row = Share(
        name=written.name,
        values=written.values,
        place=written.place,
        kind=cause.kind,
        note=cause.refused,
    )
    name = cause.name
    if name not in division.share:
        return row
    share = division.share[name]
    return replace(
        row,
        share=share,
        error=division.error[name],
        alone=division.alone[name],
        last=division.last[name],
        note=_NOT_RUN if share is None else "",
    )


def _share_of_integrator(part: Localisation) -> Share:
    """Return the part of an integrator that one side alone can choose, as that of a cause."""
    assert part.side
    values: tuple[DifferingQuantity, ...] = ()
    if part.values:
        values = (DifferingQuantity(part.name, *part.values),)
    return Share(
        name=part.name,
        values=values,
        place=None,
        kind="option",
        share=part.share,
        alone=part.alone,
        last=part.share,
        chosen=(part.side, part.without),
    )


def _parts(
    gap: ExplainedGap, brought: float | None, found: Sequence[Localisation]
) -> tuple[float, float, float]:
    """Return what is explained, located and unexplained, as parts of the gap."""
    if not gap.is_divided:
        return 0.0, 0.0, 0.0
    if brought is None:
        return 0.0, 0.0, 1.0
    by_settings = sum(part.share for part in found if part.side)
    explained = (gap.size - brought) / gap.size + by_settings
    located = sum(part.share for part in found if not part.side)
    stays = found[-1].gap if found else brought
    return explained, located, stays / gap.size


def _redundant(shares: Sequence[Share]) -> tuple[str, ...]:
    """Return causes of which each explains nearly all alone, and next to nothing after the others.

    There are none where that is so of one only.
    """
    names = [
        row.name
        for row in shares
        if row.last is not None
        and row.alone is not None
        and row.alone > 1.0 - _REDUNDANT
        and abs(row.last) < _REDUNDANT
    ]
    return tuple(names) if len(names) > 1 else ()


def _notes(matched: Matched, left: Model, right: Model) -> tuple[str, ...]:
    """Return what a reader should know, in sentences."""
    notes = list(matched.other_notes)
    for model in (left, right):
        for what in room(engine_of(model.backend)).ignored(model):
            if "integrator" not in what:  # which is a cause
                notes.append(f"{model.backend}: {what}")
    left_period, right_period = milliseconds(left.timestep, 3), milliseconds(right.timestep, 3)
    if left_period != right_period:
        notes.append(_PERIODS.format(left=left_period, right=right_period))
    return tuple(dict.fromkeys(notes))


def _unread(matched: Matched, request: WhyRequest, gap: ExplainedGap) -> tuple[str, ...]:
    """Return names of differences that only a function would read, where none does."""
    if not request.are_compiled:
        return ()
    is_read = request.scenario.own
    rows: list[ModelDifference] = []
    if not (is_read and gap.is_divided):
        rows += readable_of(matched)
    if not is_read:
        rows += orders_of(matched)
    return tuple(row.title for row in rows)


def _still(causes: Sequence[Cause], model: Model, trace: Trace) -> tuple[str, ...]:
    """Return joints of some causes, hinges and slides, that hardly move in a run."""
    names = {row.where for cause in causes if cause.kind == "joint" for row in cause.differences}
    still: list[str] = []
    joints = zip(model.joint_names, model.jnt_type, model.jnt_qposadr, strict=True)
    for name, kind, place in joints:
        is_scalar = kind in (JointType.HINGE, JointType.SLIDE)
        if name in names and is_scalar and np.ptp(trace.qpos[:, place]) < _STILL:
            still.append(name)
    return tuple(still)


def _is_one_engine(left: Model, right: Model) -> bool:
    """Tell whether two sides are computed by one engine and release, with settings of one kind."""
    sides = [(model.backend, model.engine_version, _defaults(model)) for model in (left, right)]
    return sides[0] == sides[1]


def _defaults(model: Model) -> str:
    """Return whose settings a Model has: "model", or "engine" for an engine as it comes."""
    return getattr(model, "defaults", "model")


def _labels(left: Model, right: Model) -> tuple[str, str]:
    """Return file and engine of both, with the folders by which two files of one name differ."""
    left_file, right_file = files_apart(left.path.parts, right.path.parts)
    return _label(left_file, left), _label(right_file, right)


def _label(file: str, model: Model) -> str:
    label = f"{file} on {engine_of(model.backend)} {model.engine_version}"
    return f"{label}, engine defaults" if _defaults(model) == "engine" else label
