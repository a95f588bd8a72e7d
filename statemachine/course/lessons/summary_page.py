"""The page of the last lesson: what a student can do now."""

from __future__ import annotations

from dataclasses import dataclass

from ...show.engine_tables import Results
from ...show.templates import PageContent
from .frame import LessonFrame
from .summary import SummaryResult

_LAST = "time"  # the line that measures the clock on the wall


@dataclass(frozen=True)
class SummaryPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
    """

    template = "summary.md.j2"
    lesson: LessonFrame
    result: SummaryResult

    @property
    def repeats(self) -> bool:
        """Tell whether a second run printed the same, but for the line that reads the clock."""
        return set(self.result.changed_lines) <= {_LAST}

    @property
    def right(self) -> int | None:
        """Return the number of the right choice; None if none of them is right."""
        return 1 if self.repeats else None

    @property
    def sag(self) -> float:
        """Return how far the joint sagged [rad; of a slide, m]."""
        return abs(self.result.sagged)


def contents(results: Results[SummaryResult], frame: LessonFrame) -> dict[str, SummaryPage]:
    """Return what the page shows of each engine."""
    return {name: SummaryPage(frame, result) for name, result in results.items()}
