"""What happens when: first touches, partings, largest differences, early ends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ..compare import Comparison, Touch
from ..measures.text import capital, grouped, short_time
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
            Event(since, "part", f"beyond tolerance from here: {'; '.join(names)}", None)
            for since, names in grouped((since, name) for since, _, name in parted).items()
        ),
        *(
            Event(at, "largest", f"largest difference: {'; '.join(names)}", None)
            for at, names in grouped((at, name) for _, at, name in parted).items()
        ),
        *(
            Event((side.rows - 1) * side.timestep, "end", f"ends early: {side.ended}", number)
            for number, side in enumerate((comparison.one, comparison.two))
            if side.ended
        ),
    ]
    return sorted(found, key=lambda event: event.time)


def events_table(events: Sequence[Event], labels: tuple[str, str]) -> Table:
    """What happens when; the same on both sides at the same time is one row."""
    sides = grouped(((event.time, event.text), event.side) for event in events)
    where = {None: "between them", 0: labels[0], 1: labels[1]}
    return Table.of(
        sides,
        {
            "time": lambda event: TableCell(short_time(event[0]), at=event[0]),
            "what": lambda event: capital(event[1]),
            "on": lambda event: "both" if {0, 1} <= {*sides[event]} else where[sides[event][0]],
        },
        "First touches, partings, largest differences; press a time to go there",
        words={"what", "on"},
    )
