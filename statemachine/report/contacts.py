"""Who presses on what in the end, and how hard, in words."""

from __future__ import annotations

from collections.abc import Sequence

from ..compare import Comparison, Contact, Touch
from ..measures.text import capital, figure, on, quantity, short_time
from ..page import Block, Section, Text
from .finding import short_labels, window

_MOST = 3  # pairs of bodies that are named on a side


def contact_words(comparison: Comparison, touches: Sequence[Touch]) -> list[Block]:
    """What never touches; then what presses in the end, and the deepest overlap."""
    if not touches:
        return []
    labels = short_labels(comparison)
    sides = [
        {touch.pair: contact for touch in touches if (contact := pick(touch)).first is not None}
        for pick in (lambda touch: touch.one, lambda touch: touch.two)
    ]
    found: list[Block] = []
    for side, other, label in zip(sides, reversed(sides), labels, strict=True):
        if not side:
            body, _, ground = _deepest(other).partition(" on ")
            found.append(Text(f"{capital(on(label))} {body} never touches {ground} in this run."))
    ends = [_end(side, label) for side, label in zip(sides, labels, strict=True)]
    found.append(Text(f"Over {window(comparison)}, on average: {'; '.join(ends)}."))
    deep = [
        f"{quantity(side[pair].deepest, 'm')} {on(label)} ({pair}, at "
        f"{short_time(side[pair].deepest_at)})"
        for side, label in zip(sides, labels, strict=True)
        if side and side[pair := _deepest(side)].deepest > 0
    ]
    if deep:
        text = f"The deepest that one shape is in another: {', '.join(deep)}."
        found.append(Section("", "", [Text(text)], detail=True))
    return found


def _deepest(side: dict[str, Contact]) -> str:
    """The pair of bodies that overlap most."""
    return max(side, key=lambda pair: side[pair].deepest)


def _end(side: dict[str, Contact], label: str) -> str:
    if not side:
        return f"{on(label)} nothing touches at all"
    pressing = sorted(
        (pair for pair, contact in side.items() if contact.force > 0),
        key=lambda pair: -side[pair].force,
    )
    if not pressing and not any(contact.ends for contact in side.values()):
        last = max(contact.last or 0.0 for contact in side.values())
        return f"{on(label)} nothing touches after {short_time(last)}"
    if not pressing:
        return f"{on(label)} what touches presses with no force"
    listed = [
        f"{'and ' if k else ''}{pair.replace(' on ', ' presses on ', 1)} with "
        f"{figure(side[pair].force)} N (with friction {figure(side[pair].total)} N)"
        for k, pair in enumerate(pressing[:_MOST])
    ]
    return f"{on(label)} {' '.join(listed)}"
