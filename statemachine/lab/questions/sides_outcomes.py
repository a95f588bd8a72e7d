"""What came of a policy on several sides: each outcome with a number for each side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ...show.blocks import Table
from ..compare import Comparison
from .policy_outcomes import outcome_text


@dataclass(frozen=True)
class SidesOutcome:
    """One outcome of several runs of a policy.

    Attributes:
        name: As in `compare.outcomes.OUTCOMES`.
        unit: SI.
        values: One for each side, in their order; None where it did not fall, or has no such
            outcome.
    """

    name: str
    unit: str
    values: tuple[float | None, ...]


def sides_outcomes(
    comparisons: Mapping[tuple[int, int], Comparison], sides: int
) -> tuple[SidesOutcome, ...]:
    """Return what came of a policy on several sides; nothing of anything else that was run.

    Args:
        comparisons: Each two sides, by their numbers.
        sides: How many there are.
    """
    units: dict[str, str] = {}
    values: dict[str, list[float | None]] = {}
    for pair, comparison in comparisons.items():
        if not comparison.is_of_policy():
            return ()
        for outcome in comparison.outcomes:
            units[outcome.name] = outcome.unit
            row = values.setdefault(outcome.name, [None] * sides)
            row[pair[0]], row[pair[1]] = outcome.left, outcome.right
    return tuple(SidesOutcome(name, units[name], tuple(row)) for name, row in values.items())


def sides_outcomes_table(outcomes: Iterable[SidesOutcome], labels: Sequence[str]) -> Table:
    """Return a row for each outcome, with a column for each side."""
    rows: list[list[str]] = []
    for outcome in outcomes:
        texts = [outcome_text(outcome.name, outcome.unit, value) for value in outcome.values]
        rows.append([outcome.name, *texts])
    return Table(("what came of it", *labels), rows)
