"""The page of a ranking: what each difference takes away alone, and last, while shares follow."""

from __future__ import annotations

from dataclasses import dataclass

from ...measures.text import capital, percent
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from .explanation import Explanation

_ROWS = 8  # differences that are shown; the others are a count
_HEADS = ("what", "alone", "last")


@dataclass(frozen=True)
class RankingPage(PageContent):
    """What the page of a ranking shows.

    Attributes:
        gap: The gap that is divided, in `unit`.
        unit: Of the quantity.
        quantity: What the gap is measured in.
        effects: Table of the parts of the gap that differences take away, the largest first.
        more: How many differences the table has not.
    """

    template = "ranking.md.j2"
    gap: float
    unit: str
    quantity: str
    effects: Table
    more: int


def ranking_page(result: Explanation) -> Page:
    """Return the page of what is known before the shares are.

    Args:
        result: The explanation so far.
    """
    ranking = result.ranking
    rows = [(capital(row.name), percent(row.alone), percent(row.last)) for row in ranking]
    return render(
        RankingPage(
            gap=result.gap,
            unit=result.unit,
            quantity=result.quantity,
            effects=Table(_HEADS, rows[:_ROWS], words=frozenset({0})),
            more=max(0, len(rows) - _ROWS),
        )
    )
