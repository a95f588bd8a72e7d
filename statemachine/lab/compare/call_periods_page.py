"""That a function is called more often on one side: said on the first screen of every question."""

from __future__ import annotations

from dataclasses import dataclass

from ...measures.text import milliseconds
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..runs.call_period import CallPeriods


@dataclass(frozen=True)
class CallPeriodsSentence(PageContent):
    """How often a function is called on both sides.

    Attributes:
        left, right: The time from one call to the next.
        common: A time that both sides can have, as one types it.
    """

    template = "call_periods.md.j2"
    left: str
    right: str
    common: str


def call_periods_blocks(periods: CallPeriods | None) -> list[Block]:
    """Say how often a function is called on both sides, where that is not the same."""
    if periods is None or not periods.differ:
        return []
    left, right = milliseconds(periods.left, 3), milliseconds(periods.right, 3)
    return render_blocks(CallPeriodsSentence(left, right, periods.common_word))
