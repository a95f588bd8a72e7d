"""Whether a case notices a wrong parameter, on an engine and with an integrator."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from statemachine.lab.validate.battery import CaseResult, run_case
from statemachine.lab.validate.case import Case
from statemachine.lab.validate.variants import Variant

from .table import FAULTS, Fault, Outcome


@dataclass(frozen=True)
class Cell:
    """What a case does with a wrong parameter on an engine.

    Attributes:
        fault: Name of the wrong parameter.
        case: Name of the case.
        variant: The engine and the integrator.
        outcome: Whether the case noticed it.
    """

    fault: str
    case: str
    variant: str
    outcome: Outcome


def outcome_of(fault: Fault, case: Case, variant: Variant, sound: CaseResult) -> Outcome:
    """Run a case with a wrong parameter, and tell whether its verdict shows it.

    Args:
        fault: What is wrong.
        case: The case without it.
        variant: On what it is run.
        sound: What the case gives there without it.

    Raises:
        ValueError: The case does not hold without it, so that nothing is told by it.
    """
    wrong = fault.change(case)
    if wrong is case:
        return "has none"
    if sound.verdict == "refused":
        return "refused"
    if not sound.holds:
        raise ValueError(f"{case.name} does not hold on {variant}: {sound.status}")
    result = run_case(wrong, variant)
    if not result.holds:
        return "noticed"
    same = [each.measured for each in result.measurements]
    if same == [each.measured for each in sound.measurements]:
        return "not read"
    if sound.verdict in ("wrong", "diverges"):
        return "wrong anyway"
    return "missed"


def cells_of(case: Case, variants: Iterable[Variant], until_noticed: bool) -> Iterator[Cell]:
    """Yield what a case does with each wrong parameter that it has.

    Args:
        case: It.
        variants: On which it is run.
        until_noticed: Whether one that is noticed ends the search on a variant.
    """
    for variant in variants:
        sound = run_case(case, variant)
        for fault in FAULTS:
            outcome = outcome_of(fault, case, variant, sound)
            if outcome == "has none":
                continue
            yield Cell(fault.name, case.name, str(variant), outcome)
            if until_noticed and outcome == "noticed":
                break
