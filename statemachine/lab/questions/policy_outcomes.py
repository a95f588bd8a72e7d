"""What came of two runs of a policy, side by side: a policy is judged by it before any curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ...measures.text import NO_NUMBER, quantity, short_time
from ...show.blocks import Block, Table, TableCell
from ...show.templates import PageContent, render_blocks
from ..compare import Comparison
from ..compare.outcomes import FELL, RunOutcome
from .compared_names import short_labels

_COLUMN = 20  # characters of what a side is called above a column


@dataclass(frozen=True)
class PolicyOutcomes(PageContent):
    """What came of two runs of a policy.

    Attributes:
        policy: Its file.
        until: The last moment that counts [s].
        description: What was asked of it, in sentences.
        outcomes: A row for each.
    """

    template = "policy_outcomes.md.j2"
    policy: str
    until: float
    description: str
    outcomes: Table


def policy_outcomes_blocks(comparison: Comparison) -> list[Block]:
    """Return what came of two runs of a policy; nothing of runs of anything else."""
    if not comparison.is_of_policy():
        return []
    header, table = comparison.left.trace.header, outcomes_table(comparison)
    content = PolicyOutcomes(header.experiment, comparison.until, header.description, table)
    return render_blocks(content)


def outcomes_table(comparison: Comparison) -> Table:
    """Return a row for each outcome: of both sides, how far apart, and whether that matters."""
    left, right = short_labels(comparison)
    if max(len(left), len(right)) > _COLUMN:
        left, right = "left", "right"
    columns: dict[str, Callable[[RunOutcome], str]] = {
        "what came of it": lambda outcome: outcome.name,
        left: _left_text,
        right: _right_text,
        "apart": _apart,
        "verdict": _verdict,
    }
    return Table.of(comparison.outcomes, columns, words={"verdict"}, emphasis=_differs)


def _verdict(outcome: RunOutcome) -> str:
    return TableCell(outcome.verdict, verdict=outcome.verdict)


def _differs(outcome: RunOutcome) -> bool:
    return outcome.verdict == "differs"


def _apart(outcome: RunOutcome) -> str:
    """Return how far apart an outcome is; a fall that no side has is at no time."""
    if outcome.left is None and outcome.right is None:
        return NO_NUMBER
    return quantity(outcome.difference, outcome.unit)


def outcome_text(name: str, unit: str, value: float | None) -> str:
    """Return an outcome of one side as it stands in a table.

    Args:
        name: As in `compare.outcomes.OUTCOMES`.
        unit: SI.
        value: [unit]; None where it did not fall, or has no such outcome.
    """
    if name == FELL:
        return "no" if value is None else f"at {short_time(value)}"
    return quantity(value, unit)


def _left_text(outcome: RunOutcome) -> str:
    return outcome_text(outcome.name, outcome.unit, outcome.left)


def _right_text(outcome: RunOutcome) -> str:
    return outcome_text(outcome.name, outcome.unit, outcome.right)
