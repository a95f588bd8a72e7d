"""Closed loop and open loop, apart: what feedback makes of a difference, and the machine's own."""

from __future__ import annotations

from dataclasses import replace

from ..compare import Agreement, Comparison, SidesRun
from ..measures.text import NONE, quantity, sentence
from ..page import Block, Headline, Items, Section, Table, TableCell
from . import template
from .finding import name_of, short_labels
from .template import if_true
from .why import missing


def unmatched(run: SidesRun | None) -> list[Block]:
    """What one side has nothing of, what could not be matched, and what was not by name."""
    lines = [*missing(run.missing), *run.unmatched] if run else []
    return [Items([sentence(line) for line in lines])] if lines else []


def told(run: SidesRun | None) -> list[Block]:
    """Whether the two sides were told the same, where that takes one sentence."""
    if run is None:
        return []
    lacking = run.matched.only[0].get("actuator", ()) if run.matched else ()
    commands = run.commands
    return template.blocks(
        "loops_told",
        same=if_true(commands == "the same"),
        recorded=if_true(commands == "recorded"),
        more=if_true(commands == "more than ctrl"),
        lacking=if_true(lacking and commands != "its own"),
    )


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
    return [Section("loops", "Closed loop and open loop", template.blocks("loops", table=[table]))]


def also_open(headline: Headline, played: Comparison | None) -> Headline:
    """The headline, and what the open loop says where it says something else."""
    if played is None or played.agrees == headline.holds:
        return headline
    verdict = "agree" if played.agrees else "do not agree"
    lead = f"{headline.lead}; in open loop, with the left's commands on both, they {verdict}"
    return replace(headline, lead=lead, holds=headline.holds and played.agrees)


def _cells(agreement: Agreement | None) -> tuple[str, str]:
    if agreement is None:
        return NONE, NONE
    note = agreement.note if agreement.kind == "contact" else ""
    verdict = TableCell(agreement.verdict, verdict=agreement.verdict)
    return verdict, note or quantity(agreement.max, agreement.unit)
