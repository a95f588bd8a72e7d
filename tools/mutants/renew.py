"""Bring a list of mutants up to date with today's source."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from difflib import SequenceMatcher

from .draw import Mutant, Site, by_code, find

NOT_TRIED = "not tried"
# What a fault of these kinds becomes says little ("2", "pass"), so its statement must be like.
_SHORT = ("number", "dropped call")
# Ratios of difflib, above which a fault is taken for the same one: of the statements of short
# faults; of statements, and of what becomes of them, where a name in the fault is another.
_ALIKE_SHORT, _ALIKE_STATEMENT, _ALIKE_FAULT = 0.6, 0.7, 0.7


@dataclass(frozen=True)
class Row:
    """A mutant of the list, with what became of it.

    Attributes:
        mutant: The fault.
        result: "killed", "survived", "timed out", "not covered", "gone" or "not tried".
        test: The test that noticed it; "" where none did.
        note: What a reader of the survivors found; "" where nobody looked.
    """

    mutant: Mutant
    result: str
    test: str
    note: str = ""

    def to_dict(self) -> dict[str, object]:
        """Return the entry of results.json."""
        outcome = {"result": self.result, "test": self.test, "note": self.note}
        return {**asdict(self.mutant), **outcome}


def unique(sites: Iterable[Site]) -> set[Mutant]:
    """Return the faults that stand in one place alone: others are two faults of one name."""
    counts = Counter(site.mutant for site in sites)
    return {mutant for mutant, count in counts.items() if count == 1}


def successor(mutant: Mutant, others: Iterable[Mutant]) -> Mutant | None:
    """Return the same fault in what its statement has become, in its function or its file.

    Args:
        mutant: A fault whose statement is gone.
        others: Every fault that today's source allows.
    """
    best, most = None, 0.0
    for other in others:
        likeness = _likeness(mutant, other)
        if likeness > most:
            best, most = other, likeness
    return best


def _likeness(mutant: Mutant, other: Mutant) -> float:
    """Return how like a fault is to one that is gone; 0 where it is not the same, 2 at most."""
    same_function = mutant.function == other.function
    if other.kind != mutant.kind or not (same_function or other.file == mutant.file):
        return 0.0
    statements = SequenceMatcher(None, mutant.statement, other.statement)
    if other.becomes == mutant.becomes:
        if mutant.kind in _SHORT:
            is_same = same_function and statements.ratio() > _ALIKE_SHORT
        else:
            is_same = other.file == mutant.file or bool(mutant.function)
        return 1.0 + statements.ratio() if is_same else 0.0
    if mutant.kind in _SHORT or not same_function or not mutant.function:
        return 0.0
    faults = SequenceMatcher(None, mutant.becomes, other.becomes)
    if min(statements.quick_ratio(), faults.quick_ratio()) < min(_ALIKE_STATEMENT, _ALIKE_FAULT):
        return 0.0
    if statements.ratio() < _ALIKE_STATEMENT or faults.ratio() < _ALIKE_FAULT:
        return 0.0
    return (statements.ratio() + faults.ratio()) / 2


def renewed(rows: Sequence[Row], sites: Sequence[Site], seed: int) -> list[Row]:
    """Return as many mutants as before, each of which stands in one place of today's source.

    One whose code has moved is named by its place. One whose statement was written otherwise is the
    same fault in what it has become. Where there is none, another is drawn. A fault that has
    another function or another statement than before is not tried yet.

    Args:
        rows: The list before.
        sites: Every fault that today's source allows.
        seed: Of what is drawn.
    """
    standing, single = by_code(sites), unique(sites)
    ordered = sorted(single, key=str)
    kept: dict[Mutant, Row] = {}
    for row in rows:
        site = find(row.mutant, standing)
        if site is not None and site.mutant in single:
            now = Row(site.mutant, row.result, row.test, row.note)
            if site.mutant.function != row.mutant.function:
                now = Row(site.mutant, NOT_TRIED, "")
        else:
            other = successor(row.mutant, ordered)
            now = None if other is None else Row(other, NOT_TRIED, "")
        if now is not None:
            kept.setdefault(now.mutant, now)
    free = [mutant for mutant in ordered if mutant not in kept]
    for mutant in random.Random(seed).sample(free, len(rows) - len(kept)):
        kept[mutant] = Row(mutant, NOT_TRIED, "")
    return sorted(kept.values(), key=lambda row: str(row.mutant))
