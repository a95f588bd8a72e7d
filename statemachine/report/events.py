"""What happens when: first touches, partings, largest differences, early ends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from ..compare import Comparison, Touch
from ..measures.text import capital, short_time
from ..page import Table, TableCell


@dataclass(frozen=True)
class Event:
    """Something that happens.

    Attributes:
        time: Since the start [s].
        kind: "touch", "part", "largest" or "end".
        text: What, in a few words.
        side: 0 or 1, or None for both.
        what: What touches what; empty otherwise.
    """

    time: float
    kind: Literal["touch", "part", "largest", "end"]
    text: str
    side: int | None
    what: str = ""


def events_of(comparison: Comparison, touches: Sequence[Touch]) -> list[Event]:
    """First touches on each side, where each quantity parts, largest differences, early ends."""
    parted = [
        (found.since, found.at, found.name.replace(", ", " "))
        for found in comparison.agreements
        if found.kind != "contact" and found.since is not None
    ]
    found = [
        *(
            Event(contact.first, "touch", f"first touch: {touch.pair}", side, touch.pair)
            for touch in touches
            for side, contact in enumerate((touch.one, touch.two))
            if contact.first is not None
        ),
        *(
            Event(since, "part", f"beyond tolerance from here: {names}", None)
            for since, names in _together((since, name) for since, _, name in parted)
        ),
        *(
            Event(at, "largest", f"largest difference: {names}", None)
            for at, names in _together((at, name) for _, at, name in parted)
        ),
        *(
            Event((side.rows - 1) * side.timestep, "end", f"ends early: {side.ended}", number)
            for number, side in enumerate((comparison.one, comparison.two))
            if side.ended
        ),
    ]
    return sorted(found, key=lambda event: event.time)


def _together(moments: Iterable[tuple[float, str]]) -> Iterable[tuple[float, str]]:
    """The names of each moment in a row, in the order in which the moments first come."""
    names: dict[float, list[str]] = {}
    for time, name in moments:
        names.setdefault(time, []).append(name)
    return [(time, "; ".join(those)) for time, those in names.items()]


def events_table(events: Sequence[Event], labels: tuple[str, str]) -> Table:
    """What happens when; the same on both sides at the same time is one row."""
    merged: dict[tuple[float, str], set[int | None]] = {}
    for event in events:
        merged.setdefault((event.time, event.text), set()).add(event.side)
    rows = []
    for (time, text), sides in merged.items():
        if sides in ({None}, {0, 1}):
            where = "both" if 0 in sides else "between them"
        else:
            where = labels[next(iter(s for s in sides if s is not None))]
        rows.append((TableCell(short_time(time), at=time), capital(text), where))
    return Table(
        ("time", "what", "on"),
        rows,
        "First touches, partings, largest differences; press a time to go there",
        words=frozenset({1, 2}),
    )
