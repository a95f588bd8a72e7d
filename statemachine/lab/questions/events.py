"""What happens when, in two runs: first touches, partings, largest differences, early ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ...measures.text import capital, grouped, short_time
from ...show.blocks import Table, TableCell
from ..compare import Comparison
from .compared_names import long_labels, name_of, traces_of


@dataclass(frozen=True)
class Event:
    """Something that happens in one of two runs, or between them.

    Attributes:
        time: Since the start [s].
        kind: A first touch, a quantity that leaves its tolerance, a largest difference, or the
            early end of a run.
        text: What happens, in a few words.
        side: 0 for the left, 1 for the right; None for what is between them.
        what: What touches what; "" of other kinds.
    """

    time: float
    kind: Literal["touch", "part", "largest", "end"]
    text: str
    side: int | None = None
    what: str = ""


def events_of(comparison: Comparison) -> list[Event]:
    """Return first touches, where each quantity parts, largest differences, and early ends."""
    events: list[Event] = []
    for touch in comparison.touches:
        for side, contacts in enumerate((touch.left, touch.right)):
            if contacts.first is not None:
                text = f"first touch: {touch.pair}"
                events.append(Event(contacts.first, "touch", text, side, touch.pair))
    parted = [
        agreement
        for agreement in comparison.agreements
        if agreement.kind != "contact" and agreement.since is not None
    ]
    by_since = grouped((agreement.since, name_of(agreement.name)) for agreement in parted)
    for since, names in by_since.items():
        if since is not None:
            text = f"beyond tolerance from here: {'; '.join(names)}"
            events.append(Event(since, "part", text))
    by_largest = grouped((agreement.at, name_of(agreement.name)) for agreement in parted)
    for at, names in by_largest.items():
        events.append(Event(at, "largest", f"largest difference: {'; '.join(names)}"))
    for side, trace in enumerate(traces_of(comparison)):
        if trace.header.ended:
            end = (len(trace) - 1) * trace.timestep
            events.append(Event(end, "end", f"ends early: {trace.header.ended}", side))
    return sorted(events, key=lambda event: event.time)


def events_table(comparison: Comparison) -> Table:
    """Return what happens when; the same on both sides at the same time is one row."""
    both = grouped(((event.time, event.text), event.side) for event in events_of(comparison))
    rows = []
    for (time, text), sides in both.items():
        where = "both" if {0, 1} <= set(sides) else _where(sides[0], comparison)
        rows.append((TableCell(short_time(time), at=time), capital(text), where))
    return Table(
        ("time", "what", "on"),
        rows,
        words=frozenset({0, 1, 2}),
    )


def _where(side: int | None, comparison: Comparison) -> str:
    """Return what a side is called; None is between the two."""
    return "between them" if side is None else long_labels(comparison)[side]
