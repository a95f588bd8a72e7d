"""Page of a recording of an arm: what is nearer to it, its commands or the model as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import degrees
from ...show.blocks import Block, Page, Table
from ...show.first_screen import with_answer
from ...show.templates import PageContent, render
from ..runs.provenance import Provenance
from .results import RecordingGap, RecordingResult
from .typed_question import recording_name, typed_question
from .units_page import other_robot, units_blocks

ALL_JOINTS = "all joints"


@dataclass(frozen=True)
class RecordingPage(PageContent):
    """What the page of a recording shows.

    Attributes:
        result: What was computed.
        units: What the numbers were taken to mean.
    """

    template = "recording.md.j2"
    result: RecordingResult
    units: Sequence[Block]

    @property
    def gap(self) -> RecordingGap:
        """Return how far commands and model are from the arm."""
        return self.result.gap

    @property
    def provenance(self) -> Provenance:
        """Return what it was computed with."""
        return self.result.provenance

    @property
    def recording(self) -> str:
        """Return the recording, without its folder."""
        return recording_name(self.result.request.recording)

    @property
    def other_robot(self) -> str:
        """Return the robot that the data set is of; "" for an SO-100 or SO-101, and for no word."""
        return other_robot(self.result.recordings.fitted)

    @property
    def model_file(self) -> str:
        """Return the name of the model's file."""
        return self.provenance.model_file.rpartition("/")[2]

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
