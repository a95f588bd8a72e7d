"""The page of one run on several releases of an engine: between which of them it changes."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import Comparison
from ..measures.text import NONE, listed, quantity, short_time
from ..page import Headline, Page, Table, TableCell
from . import template
from .finding import leading, name_of

CHANGED = "The motion changes between {pairs}"
SAME = "The motion is the same on all of them, within its tolerances"


def page(comparisons: Sequence[Comparison], experiment: str) -> Page:
    """What each comparison of a release with the next one found."""
    pairs = [(_version(found, "one"), _version(found, "two")) for found in comparisons]
    rows = [
        (*pair, *_row(found), "agrees" if found.agrees else "DIFFERS")
        for pair, found in zip(pairs, comparisons, strict=True)
    ]
    changed = [
        f"MuJoCo {left} and {right}"
        for (left, right), found in zip(pairs, comparisons, strict=True)
        if not found.agrees
    ]
    heads = ("release", "next", "quantity", "largest", "at", "tolerance", "verdict")
    headline = Headline(CHANGED.format(pairs=listed(changed)), holds=False)
    return template.page(
        "versions",
        headline if changed else Headline(SAME),
        experiment=experiment,
        first=pairs[0][0],
        last=pairs[-1][1],
        until=max(found.until for found in comparisons),
        steps=[Table(heads, rows, "From release to release", words=frozenset({0, 1, 2, 6}))],
    )


def _version(comparison: Comparison, side: str) -> str:
    made = getattr(comparison, side)
    return made.provenance.versions[made.backend]


def _row(comparison: Comparison) -> tuple[str | TableCell, ...]:
    worst = leading(comparison)
    if worst is None:
        return (NONE,) * 4
    largest, tolerance = quantity(worst.max, worst.unit), quantity(worst.tolerance, worst.unit)
    return name_of(worst.name), largest, short_time(worst.at), tolerance
