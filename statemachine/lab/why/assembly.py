"""The answer to why two sides differ, from what a search has found so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...engines import raw_engine_of
from ...engines.records import DifferingQuantity, ModelDifference
from ...interface import JointType, Model
from ...measures import Deviation, rotation_angles
from ...measures.text import milliseconds
from ...release_names import engine_of
from ..compare.instead import instead_of
from ..compare.matching import Matched, missing_parts
from ..compare.motion import SEEN, MotionExtent, motion_of
from ..recordings import Trace
from ..runs.provenance import provenance
from .causes import Cause, readable_of
from .explained_gap import ExplainedGap
from .explanation import Explanation, FailedSet, Share
from .gap import BALLS, size_of
from .locate import Localisation
from .request import WhyRequest, is_one_engine
from .run_differences import orders_of
from .search import Search
from .shapley import Division
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
_NOT_WITH_OTHERS = "it could not be equalized together with the others"


def explanation_of(search: Search) -> Explanation:
    """Return what is known; no run is made for it.

    Args:
        search: At least the gap of which is known.
    """
    request, trials, gap = search.request, search.trials, search.gap
    assert gap is not None
    assert search.attribution is not None
    left, right, matched = request.left, request.right, trials.setup.matched
    division, equalized_gap, localisations = (
        search.attribution.division(),
        search.equalized_gap,
        search.located,
    )
    motion = _motion(trials, matched)
    joint, joint_gap = _farthest_joint(trials, gap)
    shares, impossible = _shares(search, division)
    explained, located, unexplained = _parts(gap, equalized_gap, localisations)
    return Explanation(
        experiment=request.scenario.name,
        description=request.scenario.description,
        seconds=request.duration,
        labels=request.side_labels,
        quantity=gap.quantity,
        unit=trials.ruler.units[gap.quantity],
        measure=gap.measure,
        first=gap.first,
        gap=gap.size,
        shares=shares,
        ended_by=search.ended_by,
        method=division.method,
        orders=division.orders,
        equalized_gap=equalized_gap,
        found_in=tuple(part for part in localisations if not part.side),
        explained=explained,
        located=located,
        unexplained=unexplained,
        negligible=gap.negligible,
        tolerance=gap.tolerance,
        floor=gap.floor,
        draws=trials.draws,
        one_engine=is_one_engine(left, right),
        redundant=_redundant(shares) if explained > UNEXPLAINED else (),
        impossible=impossible,
        unmatched=matched.only,
        missing=_missing(request),
        notes=_notes(matched, left, right, asks_function=request.scenario.is_user_function),
        unread=_unread(matched, request, gap),
        still=_still(search.causes, left, trials.traces[0]),
        motion=motion,
        instead=None if motion.moved else instead_of(left, request.scenario.name, request.seed),
        touch=trials.touch(gap.quantity) if gap.is_divided else None,
        moments=len(trials.ruler.time),
        between=trials.ruler.between,
        runs=trials.count,
        took=search.deadline.elapsed,
        provenance=(provenance(left), provenance(right)),
        right_file=right.path.name,
        renamed=matched.renamed,
        call_periods=request.periods,
        split=search.split,
        joint=joint,
        joint_gap=joint_gap,
        changes=trials.known_changes if gap.size > gap.negligible else (),
    )


_KINDS = {"joints": JointType.HINGE, "slides": JointType.SLIDE, BALLS: JointType.BALL}


def _farthest_joint(trials: Trials, gap: ExplainedGap) -> tuple[str, Deviation | None]:
    """Return the joint that is farthest apart as the sides come, and how far that is.

    Of a quantity that is not of several joints it is "" and None.

    Args:
        trials: What was run.
        gap: What is explained: by its measure the joint is the farthest.
    """
    quantity = gap.quantity
    left, right = (trials.curves_as_they_come(side) for side in (0, 1))
    if quantity not in _KINDS or left is None or right is None:
        return "", None
    matched, labels = trials.setup.matched, trials.traces[0].header.joint_labels
    names = [
        labels[joint]
        for joint, _ in matched.joints
        if matched.left.jnt_type[joint] == _KINDS[quantity]
    ]
    one, other = left[quantity], right[quantity]
    sizes = rotation_angles(one, other) if quantity == BALLS else np.abs(one - other)
    time, unit = trials.ruler.time, trials.ruler.units[quantity]
    gaps = [Deviation.of(column, time, unit) for column in sizes.T]
    figures = [size_of(each, gap.measure) for each in gaps]
    farthest = int(np.argmax(figures))
    return names[farthest], gaps[farthest]


def _motion(trials: Trials, matched: Matched) -> MotionExtent:
    """Return how far the joints move that both sides have, as they come."""
    sides: list[tuple[Trace, list[str]]] = []
    for side, trace in enumerate(trials.traces):
        labels = trace.header.joint_labels
        sides.append((trace, [labels[pair[side]] for pair in matched.joints]))
    return motion_of(sides, SEEN, float(trials.ruler.time[-1]))


def _missing(request: WhyRequest) -> tuple[tuple[str, str], ...]:
    """Return what one side has nothing of and the other has, as far as it acts in what is run."""
    return missing_parts(request.left, request.right, request.scenario.options)


def _shares(search: Search, division: Division) -> tuple[tuple[Share, ...], tuple[FailedSet, ...]]:
    """Return the causes, the largest share first, and the sets of them that could not be run.

    What was found by a setting of one side is a cause, too.

    Args:
        search: What is known.
        division: The parts of the gap of the causes of files, options, commands and settings.
    """
    request, causes = search.request, search.causes
    written = tuple(as_written(request.left.path, request.right.path, causes))
    names = {cause.name: text.name for cause, text in zip(causes, written, strict=True)}
    impossible: list[FailedSet] = []
    for equalized in division.failures:
        failure = search.trials.failure(equalized)
        if failure is not None:
            impossible.append(FailedSet(tuple(sorted(names[c] for c in equalized)), failure))
    rows = [
        _share_of_cause(cause, text, division, impossible)
        for cause, text in zip(causes, written, strict=True)
    ]
    for part in search.located:
        if part.side:
            rows.append(_share_of_integrator(part))
    return tuple(sorted(rows, key=lambda row: -row.weight())), tuple(impossible)


def _share_of_cause(
    cause: Cause, written: WrittenCause, division: Division, impossible: Sequence[FailedSet]
) -> Share:
    """Return what is known of the part of a cause.

    Args:
        cause: The cause.
        written: The same, as the right's file has it.
        division: The parts of all causes.
        impossible: The sets that could not be run, the smaller ones first.
    """
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
    row = replace(
        row,
        share=division.share[name],
        error=division.error[name],
        range=division.range[name],
        alone=division.alone[name],
        last=division.last[name],
    )
    if not (division.is_over(name) and row.share is None):
        return row
    failures = [failed for failed in impossible if written.name in failed.equalized]
    return replace(
        row,
        note=_NOT_RUN if row.alone is None else _NOT_WITH_OTHERS,
        failure=failures[0] if failures else None,
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
    gap: ExplainedGap, equalized_gap: float | None, localisations: Sequence[Localisation]
) -> tuple[float, float, float]:
    """Return what is explained, located and unexplained, as parts of the gap."""
    if not gap.is_divided:
        return 0.0, 0.0, 0.0
    if equalized_gap is None:
        return 0.0, 0.0, 1.0
    by_settings = sum(part.share for part in localisations if part.side)
    explained = (gap.size - equalized_gap) / gap.size + by_settings
    located = sum(part.share for part in localisations if not part.side)
    stays = localisations[-1].gap if localisations else equalized_gap
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


def _notes(matched: Matched, left: Model, right: Model, asks_function: bool) -> tuple[str, ...]:
    """Return what a reader should know, in sentences.

    Args:
        matched: What of the left is what of the right.
        left: The left side.
        right: The right side.
        asks_function: Whether a function commands, whose periods stand on the first screen.
    """
    notes = list(matched.other_notes)
    for model in (left, right):
        for what in raw_engine_of(engine_of(model.backend)).ignored(model):
            if "integrator" not in what:  # which is a cause
                notes.append(f"{model.backend}: {what}")
    left_period, right_period = milliseconds(left.timestep, 3), milliseconds(right.timestep, 3)
    if not asks_function and left_period != right_period:
        notes.append(_PERIODS.format(left=left_period, right=right_period))
    return tuple(dict.fromkeys(notes))


def _unread(matched: Matched, request: WhyRequest, gap: ExplainedGap) -> tuple[str, ...]:
    """Return names of differences that only a function would read, where none does."""
    if not request.are_compiled:
        return ()
    is_read = request.scenario.is_user_function
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
