"""The words of every comparison: contacts, moments, gaps, and numbers as text (`text`)."""

from __future__ import annotations

from .contacts import ContactNames, same_pairs, together
from .gap import Gap, largest
from .moments import SAME, Common, common_moments, nearest
from .quantities import QUANTITIES, Quantity, Tolerance, parse_tolerances

__all__ = [
    "QUANTITIES",
    "SAME",
    "Common",
    "ContactNames",
    "Gap",
    "Quantity",
    "Tolerance",
    "common_moments",
    "largest",
    "nearest",
    "parse_tolerances",
    "same_pairs",
    "together",
]
