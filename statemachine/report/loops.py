"""Closed loop and open loop, apart: what feedback makes of a difference, and the machine's own."""

from __future__ import annotations

from dataclasses import replace

from ..compare import Agreement, Comparison, SidesRun
from ..measures.text import NONE, quantity, sentence
from ..page import Block, Headline, Items, Section, Table, TableCell, Text
from .finding import name_of, short_labels
from .why import missing

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
_LACKING = "Actuators of the left that the right lacks are not commanded there."
_OPEN = "{lead}; in open loop, with the left's commands on both, they {verdict}"


def unmatched(run: SidesRun | None) -> list[Block]:
    """What one side has nothing of, what could not be matched, and what was not by name."""
    lines = [*missing(run.missing), *run.unmatched] if run else []
    return [Items([sentence(line) for line in lines])] if lines else []


def told(run: SidesRun | None) -> list[Block]:
    """Whether the two sides were told the same, where that takes one sentence."""
    if run is None or run.commands not in _SAID:
        return []
    lacking = run.matched.only[0].get("actuator", ()) if run.matched else ()
    return [Text(_SAID[run.commands]), *([Text(_LACKING)] if lacking else [])]


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
    verdict = "agree" if played.agrees else "do not agree"
    lead = _OPEN.format(lead=headline.lead, verdict=verdict)
    return replace(headline, lead=lead, holds=headline.holds and played.agrees)


def _cells(agreement: Agreement | None) -> tuple[str, str]:
    if agreement is None:
        return NONE, NONE
    note = agreement.note if agreement.kind == "contact" else ""
    verdict = TableCell(agreement.verdict, verdict=agreement.verdict)
    return verdict, note or quantity(agreement.max, agreement.unit)
