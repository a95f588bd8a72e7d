"""What a sweep gave, and what moves a quantity of it, as Results that show themselves."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from ..runs.reporter import QUIET, Reporter
from ..shown_result import Column, ShownResult, columns_of
from . import questions
from .analysis import SweepEffects
from .questions import SweepReportRequest, SweepRequest
from .rows import read_cells
from .summary import SweepSummary


@dataclass(frozen=True, repr=False)
class SweepResult(ShownResult):
    """The dataset of a sweep.

    Attributes:
        request: What was asked.
        summary: How many cells it has, and what became of them.
    """

    page_function: ClassVar[str] = "sweep.page:result_page"

    request: SweepRequest = field(metadata={"json": False})
    summary: SweepSummary

    def figures(self) -> object:
        """Return what JSON shows of it: the summary."""
        return self.summary

    def to_dict(self) -> dict[str, Column]:
        """Return the dataset: a row for each cell, and the columns of `COLUMNS` and of factors."""
        return read_cells(Path(self.summary.folder)).to_pydict()


@dataclass(frozen=True, repr=False)
class SweepReportResult(ShownResult):
    """How much each parameter of a sweep moves a quantity.

    Attributes:
        request: What was asked.
        effects: Of all parameters.
    """

    page_function: ClassVar[str] = "sweep.page:report_page"

    request: SweepReportRequest = field(metadata={"json": False})
    effects: SweepEffects

    def figures(self) -> object:
        """Return what JSON shows of it: the effects."""
        return self.effects

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each parameter: its share of the variance, and the standard error."""
        return columns_of(self.effects.effects, ("parameter", "share", "error"))


def answer(request: SweepRequest, reporter: Reporter = QUIET) -> SweepResult:
    """Run what is missing of a sweep; raises as `questions.answer` does."""
    return SweepResult(request, questions.answer(request, reporter))


def answer_report(request: SweepReportRequest) -> SweepReportResult:
    """Return what moves the quantity; raises as `questions.answer_report` does."""
    return SweepReportResult(request, questions.answer_report(request))
