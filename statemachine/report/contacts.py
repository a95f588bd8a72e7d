"""Who presses on what in the end, how hard, and how deep shapes are in one another: a table."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import Comparison, Contact, Touch
from ..measures.text import NONE, figure, quantity, short_time
from ..page import Block, Table, TableCell
from .finding import short_labels, window

_PAIRS_SHOWN = 3  # pairs of bodies that have rows: those that press hardest
_HEADS = ("bodies", "side", "force, N", "with friction, N", "deepest", "at, s", "last touch")


def contact_words(comparison: Comparison, touches: Sequence[Touch]) -> list[Block]:
    """How hard each pair of bodies presses in the end on each side, and how deep it overlaps."""
    ranked = sorted(touches, key=lambda t: (-max(t.one.force, t.two.force), -_deepest(t)))
    labels = short_labels(comparison)
    rows = [
        _row(touch.pair, label, side)
        for touch in ranked[:_PAIRS_SHOWN]
        for label, side in zip(labels, (touch.one, touch.two), strict=True)
    ]
    shown = f"{min(_PAIRS_SHOWN, len(ranked))} of {len(ranked)} pairs"
    title = f"Who presses on what ({shown}; forces are means over {window(comparison)})"
    return (
        [Table(_HEADS, rows, title, words=frozenset({0, 1}), wide=frozenset({5}))] if rows else []
    )


def _deepest(touch: Touch) -> float:
    return max(touch.one.deepest, touch.two.deepest)


def _row(pair: str, label: str, contact: Contact) -> tuple[str, ...]:
    if contact.first is None:
        return pair, label, NONE, NONE, NONE, NONE, "never touches"
    at = TableCell(f"{contact.deepest_at:.3f}", at=contact.deepest_at)
    last = "in the end" if contact.ends else short_time(contact.last or 0.0)
    force, total = figure(contact.force), figure(contact.total)
    return pair, label, force, total, quantity(contact.deepest, "m"), at, last
