"""The page of one step at a time: what each stage of it gives on both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import (
    NONE,
    figure,
    listed,
    quantity,
    sentence,
)
from ...show import report_template as template
from ...show.blocks import Items, Page, Table
from ...show.report_template import if_true, slots_of
from ..compare.one_step import OneStep, Spike, StageGap
from ..compare.stages import FORCES
from .compared_names import moment
from .requests.one_step import OneStepResult


def page(result: OneStepResult, details: bool = False) -> Page:
    """Return the page of what each stage of a step gives on both sides: what differs first.

    Args:
        result: What was found.
        details: Whether all of it is shown, and not the first screen alone.
    """
    left, right = result.request.run.labels
    return template.page(
        "lab/questions/one_step",
        experiment=result.request.run.experiment,
        left=left,
        right=right,
        **slots_of(
            _moments_of(result),
            _null_of(result),
            _step_tables_of(result),
            _verdict_of(result),
            _first_stage_of(result),
            _others_of(result),
        ),
    )


@dataclass(frozen=True)
class _Moments:
    """From which moments a step was taken.

    Attributes:
        moments: How many.
        every: Steps from one to the next.
        until: The last of them [s].
        primed: What of the step before the right side was given.
        relative: The tolerance, relative to the scale of a stage.
        weight: Of the robot, whose share is no difference either.
        size: Of the robot.
    """

    moments: int
    every: int
    until: float
    primed: str
    relative: str
    weight: str
    size: str


def _moments_of(result: OneStep) -> _Moments:
    return _Moments(
        moments=result.moments,
        every=result.every,
        until=result.until,
        primed=result.primed if result.primed else "nothing",
        relative=figure(result.relative),
        weight=quantity(result.robot.weight, "N"),
        size=quantity(result.robot.size, "m"),
    )


@dataclass(frozen=True)
class _Null:
    """How far the left side, put back to its own states, gets from its own run.

    Attributes:
        null: At most.
        stage: In which stage.
    """

    null: str
    stage: str


def _null_of(result: OneStep) -> _Null:
    compared = [gap for gap in result.stages if gap.told and gap.unit]
    most = max(compared, key=_null_tolerances)
    return _Null(quantity(most.null, most.unit), most.stage)


def _null_tolerances(gap: StageGap) -> float:
    """Return how many tolerances the null of a stage is; a tolerance of zero is next to nothing."""
    return gap.null / (gap.tolerance if gap.tolerance else 1e-300)


@dataclass(frozen=True)
class _StepTables:
    """What stands alone on the page.

    Attributes:
        stages: A row for each stage.
        spikes: A row for each moment that stands out.
        notes: What a reader must know.
    """

    stages: Table
    spikes: Table
    notes: Items


def _step_tables_of(result: OneStep) -> _StepTables:
    notes = [f"{gap.stage} is not compared: {gap.reason}." for gap in result.stages if not gap.told]
    notes += [sentence(line) for line in result.notes]
    return _StepTables(_stages_table(result), _spikes_table(result.spikes), Items(notes))


_STAGE_HEADS = (
    "stage",
    "differs",
    "first",
    "largest",
    "at, s",
    "where",
    "from, s",
    "null",
    "tolerance",
)


def _stages_table(result: OneStep) -> Table:
    rows = [(gap.stage, *_stage_cells(gap)) for gap in result.stages]
    first = frozenset(k for k, gap in enumerate(result.stages) if gap is result.first)
    return Table(
        _STAGE_HEADS,
        rows,
        "The stages of a step, in their order",
        words=frozenset({0, 5}),
        emphasis=first,
        wide=frozenset({4, 7, 8}),
    )


def _stage_cells(gap: StageGap) -> tuple[str, ...]:
    """Return the cells of a stage behind its name."""
    if not gap.told or not gap.unit:
        reason = gap.reason if gap.reason else NONE
        return NONE, NONE, NONE, NONE, reason, NONE, NONE, NONE
    largest, at, where = "0", NONE, NONE
    if gap.beyond:
        largest, where = quantity(gap.worst, gap.unit), gap.where
        if gap.at is not None:
            at = moment(gap.at)
    elif gap.worst:
        largest = "≈ 0"
    null = quantity(gap.null, gap.unit)
    tolerance = quantity(max(gap.tolerance, gap.floor), gap.unit)
    return (
        str(gap.beyond),
        str(gap.leads),
        largest,
        at,
        where,
        moment(gap.first),
        null,
        tolerance,
    )


def _spikes_table(spikes: Sequence[Spike]) -> Table:
    rows = []
    for spike in spikes:
        size = quantity(spike.size, spike.unit)
        rows.append((moment(spike.at), size, spike.joint, spike.stage, spike.where))
    return Table(
        ("at, s", "velocity update apart", "joint", "first stage", "where"),
        rows,
        "The moments that stand out",
        words=frozenset({0, 2, 3, 4}),
    )


@dataclass(frozen=True)
class _StepVerdict:
    """Whether both sides take the same step.

    Attributes:
        same: True where they do; else None.
        exact: "" where every figure is the same to the last bit.
        differs: False where they do not; else None.
    """

    same: bool | None
    exact: str | None
    differs: bool | None


def _verdict_of(result: OneStep) -> _StepVerdict:
    if result.first is not None:
        return _StepVerdict(same=None, exact=None, differs=False)
    exact = all(gap.worst == 0 for gap in result.stages)
    return _StepVerdict(same=True, exact=if_true(exact), differs=None)


@dataclass(frozen=True)
class _FirstStage:
    """The first stage that differs; None of all where none does.

    Attributes:
        first: Its name.
        since: The first moment at which it differs [s].
        beyond: At how many moments it differs.
        where: The joint, body or pair to look at.
    """

    first: str | None = None
    since: str | None = None
    beyond: int | None = None
    where: str | None = None


def _first_stage_of(result: OneStep) -> _FirstStage:
    gap = result.first
    if gap is None:
        return _FirstStage()
    return _FirstStage(gap.stage, moment(gap.first), gap.beyond, gap.where)


@dataclass(frozen=True)
class _OtherStages:
    """What else differs; None for nothing.

    Attributes:
        others: Stages that have a cause of their own at some moments, with the number of these.
        forces: The largest difference of a force in each unit.
    """

    others: str | None
    forces: str | None


def _others_of(result: OneStep) -> _OtherStages:
    differing = [gap for gap in result.stages if gap.beyond]
    others = [
        f"{gap.stage} ({gap.leads})" for gap in differing if gap.leads and gap != result.first
    ]
    forces: dict[str, str] = {}  # the largest of each unit
    for gap in sorted(differing, key=lambda gap: gap.worst):
        if gap.stage in FORCES:
            size, at = quantity(gap.worst, gap.unit), moment(gap.at)
            forces[gap.unit] = f"{gap.stage}, {size} at {at} s, {gap.where}"
    return _OtherStages(
        others=listed(others) if others else None,
        forces="; ".join(forces.values()) if forces else None,
    )
