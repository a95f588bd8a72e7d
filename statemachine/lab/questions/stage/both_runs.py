"""Two runs in one picture: the block of a page that is looked at by moving a slider."""

from __future__ import annotations

from dataclasses import dataclass

from ....show.blocks import Interactive
from ...compare import Comparison
from ..events import Event
from .quantity_chart import QuantityChart


@dataclass(frozen=True, eq=False)
class BothRuns(Interactive):
    """Two runs in one picture, moment by moment.

    Attributes:
        comparison: Of the two: the left one is drawn solid, the right one as a ghost over it.
        start: The moment to begin at [s].
        events: First touches among them are marked.
        charts: What is followed.
        lead: Of these, the ones that are spoken, by number.
    """

    comparison: Comparison
    start: float
    events: tuple[Event, ...]
    charts: tuple[QuantityChart, ...]
    lead: tuple[int, ...]
