"""The page of one step at a time: what each stage of it gives on both sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import NO_NUMBER, percent, quantity, sentence
from ...show.blocks import Page, Table
from ...show.first_screen import first_screen, with_answer
from ...show.templates import PageContent, render
from ..compare.one_step import OneStep, Spike, StageGap
from ..compare.stages import FORCES
from ..compare.typed_command import typed_command
from .compared_names import moment
from .requests.one_step import OneStepResult


@dataclass(frozen=True)
class OneStepPage(PageContent):
    """What the page of one step shows.

    Attributes:
        experiment: What was run.
        left, right: What the sides are called.
        steps: The gap of each stage.
        worst: Table of the first stages that differ.
        more: How many stages differ that it does not show.
        next_command: What to type next; "" for nothing.
        details: Whether everything is shown.
    """

    template = "one_step.md.j2"
    experiment: str
    left: str
    right: str
    steps: OneStep
    worst: Table
    more: int
    next_command: str
    details: bool

    @property
    def first(self) -> StageGap | None:
        """Return the first stage that differs; None where none does."""
        return self.steps.first

    @property
    def of_usual(self) -> float | None:
        """Return the gap of the first stage as a part of its usual size; None where it has none."""
        return None if self.steps.first is None else self.steps.first.of_usual

    @property
    def has_all_before(self) -> bool:
        """Tell whether every stage before the first that differs was compared, or has nothing."""
        if self.steps.first is None:
            return True
        place = self.steps.stages.index(self.steps.first)
        return all(gap.is_available for gap in self.steps.stages[:place])

    @property
    def agreeing(self) -> int:
        """Return the number of stages that are compared and do not differ."""
        return sum(
            gap.is_available and not gap.reason and not gap.beyond for gap in self.steps.stages
        )

    @property
    def not_compared(self) -> list[str]:
        """Return the stages of which there are no figures, each with the reason."""
        stages: list[str] = []
        for gap in self.steps.stages:
            if not gap.is_available or gap.reason:
                stages.append(f"{gap.stage} ({gap.reason})")
        return stages

    @property
    def primed(self) -> str:
        """Return what the right side has of the step before; "nothing" where it has nothing."""
        return self.steps.primed if self.steps.primed else "nothing"

    @property
    def null(self) -> StageGap | None:
        """Return the stage in which the left differs most from its own run.

        The left is put back to its own states, too, as a check of the method. None where no stage
        is compared.
        """
        compared = [gap for gap in self.steps.stages if gap.is_available and gap.unit]
        return max(compared, key=_null_tolerances, default=None)

    @property
    def causes_of_their_own(self) -> list[str]:
        """Return further stages that are the first to differ at some moments, with how many."""
        stages: list[str] = []
        for gap in self.steps.differing:
            if gap.first_count and gap != self.steps.first:
                stages.append(f"{gap.stage} ({gap.first_count})")
        return stages

    @property
    def stages(self) -> Table:
        """Return a table with a row for each stage."""
        return _stages_table(self.steps)

    @property
    def forces(self) -> Table:
        """Return a table of the largest difference of a force in each unit."""
        return _forces_table(self.steps.differing)

    @property
    def spikes(self) -> Table:
        """Return a table with a row for each moment that stands out."""
        return _spikes_table(self.steps.spikes)

    @property
    def notes(self) -> list[str]:
        """Return what a reader must know, in sentences."""
        return [sentence(note) for note in self.steps.notes]


def page(result: OneStepResult, details: bool = False) -> Page:
    """Return the page of what each stage of a step gives on both sides: what differs first.

    Args:
        result: What one step gives on each side.
        details: Whether every stage, its tolerance and the moments that stand out are shown.
    """
    differing = result.differing

    if details:
        return _page(result, (), details=True)
    return first_screen(lambda rows: _page(result, differing[:rows]), len(differing))


def _page(result: OneStepResult, worst: Sequence[StageGap], details: bool = False) -> Page:
    """Return the page with some of the stages that differ; with details a table has all of them."""
    run = result.request.run
    left, right = run.labels
    # Not --why, which leads here.
    next_command = "" if details else typed_command(run).lines("--one-step", "--details")
    more = 0 if details else len(result.differing) - len(worst)
    content = OneStepPage(
        experiment=run.experiment,
        left=left,
        right=right,
        steps=result,
        worst=_worst_table(worst),
        more=more,
        next_command=next_command,
        details=details,
    )
    return with_answer(render(content))


def _null_tolerances(gap: StageGap) -> float:
    """Return how many tolerances the null of a stage is; a tolerance of zero is next to nothing."""
    return gap.null / (gap.tolerance if gap.tolerance else 1e-300)


def _worst_table(gaps: Sequence[StageGap]) -> Table:
    """Return a row for each of some stages that differ: at how many moments, how far, and where."""
    rows: list[tuple[str, ...]] = []
    for gap in gaps:
        largest = quantity(gap.worst, gap.unit)
        of_usual = percent(gap.of_usual)
        rows.append((gap.stage, str(gap.beyond), largest, of_usual, gap.where, moment(gap.first)))
    return Table(
        ("stage", "moments", "largest", "of usual", "where", "from, s"),
        rows,
        words=frozenset({0, 4}),
    )


def _stages_table(steps: OneStep) -> Table:
    """Return a row for each stage, in the order of a step."""
    columns = (
        *("stage", "differs", "first", "largest", "at, s", "where", "from, s"),
        *("null", "tolerance"),
    )
    rows = [(gap.stage, *_stage_cells(gap)) for gap in steps.stages]
    first = frozenset(k for k, gap in enumerate(steps.stages) if gap is steps.first)
    return Table(
        columns,
        rows,
        "The stages of a step, in their order",
        words=frozenset({0, 5}),
        emphasis=first,
        wide=frozenset({4, 7, 8}),
    )


def _stage_cells(gap: StageGap) -> tuple[str, ...]:
    """Return the cells of a stage behind its name."""
    if not gap.is_available or not gap.unit:
        reason = gap.reason if gap.reason else NO_NUMBER
        return NO_NUMBER, NO_NUMBER, NO_NUMBER, NO_NUMBER, reason, NO_NUMBER, NO_NUMBER, NO_NUMBER
    largest, at, where = "0", NO_NUMBER, NO_NUMBER
    if gap.beyond:
        largest, where = quantity(gap.worst, gap.unit), gap.where
        if gap.at is not None:
            at = moment(gap.at)
    elif gap.worst:
        largest = "≈ 0"
    null = quantity(gap.null, gap.unit)
    tolerance = quantity(gap.limit, gap.unit)
    first = moment(gap.first)
    return str(gap.beyond), str(gap.first_count), largest, at, where, first, null, tolerance


def _forces_table(differing: Sequence[StageGap]) -> Table:
    """Return the largest difference of a force in each unit."""
    largest: dict[str, StageGap] = {}
    for gap in sorted(differing, key=lambda gap: gap.worst):
        if gap.stage in FORCES:
            largest[gap.unit] = gap
    rows: list[tuple[str, ...]] = []
    for gap in largest.values():
        rows.append((gap.stage, quantity(gap.worst, gap.unit), moment(gap.at), gap.where))
    return Table(
        ("stage", "largest", "at, s", "where"),
        rows,
        "The largest difference of a force",
        words=frozenset({0, 3}),
    )


def _spikes_table(spikes: Sequence[Spike]) -> Table:
    """Return a row for each moment that stands out."""
    rows: list[tuple[str, ...]] = []
    for spike in spikes:
        size = quantity(spike.size, spike.unit)
        rows.append((moment(spike.at), size, spike.joint, spike.stage, spike.where))
    return Table(
        ("at, s", "velocity update apart", "joint", "first stage", "where"),
        rows,
        "The moments that stand out",
        words=frozenset({0, 2, 3, 4}),
    )
