"""Closed loop and open loop, apart: what feedback makes of a difference, and the machine's own."""

from __future__ import annotations

from dataclasses import replace

from ..compare import Agreement, Comparison, SidesRun
from ..measures.text import NONE, quantity
from ..page import Block, Headline, Items, Section, Table, TableCell, Text
from .finding import name_of, short_labels

_MEANS = (
    "Closed loop: each side computes its commands from its own state, so this is what feedback "
    "makes of a difference. Open loop: the left's start and its recorded commands are played on "
    "the right, so this says whether the machine itself differs."
)
_SAID = {
    "the same": (
        "Both sides were told the same at every moment, so the open loop, which says whether the "
        "machine itself differs, and the closed loop, which says what feedback makes of it, are "
        "one run."
    ),
    "recorded": (
        "Both sides were told the recorded commands, an open loop: the figures say whether the "
        "machine itself differs, and nothing of what feedback would make of it."
    ),
    "more than ctrl": (
        "There is no open loop: beside ctrl the function wrote into the state or applied forces, "
        "which the recorded commands of the left do not repeat on the right."
    ),
}


def unmatched(run: SidesRun | None) -> list[Block]:
    """What could not be matched, and what was matched by more than its name."""
    lines = run.unmatched if run else ()
    return [Items([line[:1].upper() + line[1:] + "." for line in lines])] if lines else []


def told(run: SidesRun | None) -> list[Block]:
    """Whether the two sides were told the same, where that takes one sentence."""
    if run is None or run.commands not in _SAID:
        return []
    lacking = run.matched.only[0].get("actuator", ()) if run.matched else ()
    deaf = " The right has no counterpart of all actuators, and was told what it can take."
    return [Text(_SAID[run.commands] + deaf * bool(lacking))]


def loops(comparison: Comparison, played: Comparison | None) -> list[Block]:
    """The figures of both loops, quantity by quantity; nothing where they are the same."""
    if played is None:
        return []
    closed = {found.name: found for found in comparison.agreements}
    opened = {found.name: found for found in played.agreements}
    rows = [
        (name_of(name), *_cells(closed.get(name)), *_cells(opened.get(name)))
        for name in dict.fromkeys([*closed, *opened])
    ]
    one, two = short_labels(comparison)
    table = Table(
        ("quantity", "closed loop", "largest", "open loop", "largest"),
        rows,
        f"{one} against {two}: each with its own commands, and both with the left's",
        words=frozenset({0, 1, 3}),
    )
    return [Section("loops", "Closed loop and open loop", [Text(_MEANS), table])]


def also_open(headline: Headline, played: Comparison | None) -> Headline:
    """The headline, and what the open loop says where it says something else."""
    if played is None or played.agrees == headline.holds:
        return headline
    if headline.holds:
        lead = f"{headline.lead}; in open loop, with the left's commands on both, they do not agree"
        return replace(headline, lead=lead, holds=False)
    lead = f"{headline.lead}; in open loop, with the left's commands on both, they agree"
    return replace(headline, lead=lead)


def _cells(found: Agreement | None) -> tuple[str, str]:
    if found is None:
        return NONE, NONE
    largest = found.note if found.kind == "contact" and found.note else ""
    return (
        TableCell(found.verdict, verdict=found.verdict),
        largest or quantity(found.max, found.unit),
    )
