"""Page of a recording of an arm: what is nearer to it, its commands or the model as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import degrees
from ...show.blocks import Block, Page, Table
from ...show.first_screen import with_answer
from ...show.templates import PageContent, render
from .page_of_recording import PageOfRecording
from .results import RecordingGap, RecordingResult
from .typed_question import typed_question
from .units_page import units_blocks

ALL_JOINTS = "all joints"


@dataclass(frozen=True)
class RecordingPage(PageOfRecording, PageContent):
    """What the page of a recording shows.

    Attributes:
        result: What was computed.
        units: What the numbers were taken to mean.
    """

    template = "recording.md.j2"
    result: RecordingResult
    units: Sequence[Block]

    @property
    def is_nearer(self) -> bool:
        """Tell whether the model is nearer to the arm than its commands are."""
        return self.gap.model < self.gap.commanded

    @property
    def difference(self) -> float:
        """Return how much nearer to the arm the model is than its commands are [rad]."""
        return self.gap.commanded - self.gap.model

    @property
    def joints(self) -> Table:
        """Return a table with a row for each joint, and one for all."""
        return gap_table(self.gap)

    @property
    def next_command(self) -> str:
        """Return what to type next."""
        return typed_question(self.result.request, "--why")


def gap_table(gap: RecordingGap) -> Table:
    """Return how far each joint is from where it was measured, and all of them together.

    With a column of the fitted model where something was fitted.
    """
    headers = ["joint", "its command", "model as it is", "fitted"]
    rows: list[list[str]] = []
    for joint in gap.joints:
        rows.append(_cells(joint.joint, joint.commanded, joint.model, joint.fitted))
    rows.append(_cells(ALL_JOINTS, gap.commanded, gap.model, gap.fitted))
    return Table(headers[: len(rows[0])], rows)


def _cells(name: str, commanded: float, model: float, fitted: float | None) -> list[str]:
    """Return the cells of a row of angles [rad]."""
    cells = [name, degrees(commanded), degrees(model)]
    return cells if fitted is None else [*cells, degrees(fitted)]


def page(result: RecordingResult, details: bool = False) -> Page:
    """Return the result as a page.

    Args:
        result: What was computed.
        details: Whether what the numbers were taken to mean is shown joint by joint.
    """
    return with_answer(render(RecordingPage(result, units_blocks(result.units, details))))
