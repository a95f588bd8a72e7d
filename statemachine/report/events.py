"""What happens when: first touches, partings, largest differences, early ends."""

from __future__ import annotations

from collections.abc import Sequence
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
    found: list[Event] = []
    for touch in touches:
        for side, contact in enumerate((touch.one, touch.two)):
            if contact.first is not None:
                text = f"first touch: {touch.pair}"
                found.append(Event(contact.first, "touch", text, side, touch.pair))
    since: dict[float, list[str]] = {}
    largest: dict[float, list[str]] = {}
    for agreement in comparison.agreements:
        if agreement.kind == "contact":
            continue
        if agreement.since is not None:
            since.setdefault(agreement.since, []).append(agreement.name.replace(", ", " "))
            largest.setdefault(agreement.at, []).append(agreement.name.replace(", ", " "))
    for time, names in since.items():
        found.append(Event(time, "part", f"beyond tolerance from here: {'; '.join(names)}", None))
    for time, names in largest.items():
        found.append(Event(time, "largest", f"largest difference: {'; '.join(names)}", None))
    for number, side in enumerate((comparison.one, comparison.two)):
        if side.ended:
            last = (side.rows - 1) * side.timestep
            found.append(Event(last, "end", f"ends early: {side.ended}", number))
    return sorted(found, key=lambda event: event.time)


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
