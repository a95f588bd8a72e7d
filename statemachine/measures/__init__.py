"""What all comparisons share: contacts, moments, gaps, tolerances, numbers as text (`text`)."""

from __future__ import annotations

from .contacts import ContactNames, overlaps, same_pairs, together
from .gap import (
    SAME,
    Common,
    Deviation,
    Gap,
    JointPlaces,
    at_moments,
    common_moments,
    distances,
    farthest,
    joint_gap,
    largest,
    largest_or_inf,
    nearest,
    turns,
)
from .quantities import (
    COUNT,
    QUANTITIES,
    Quantity,
    Tolerance,
    amount,
    parse_tolerances,
    tolerance_of,
)

__all__ = [
    "COUNT",
    "QUANTITIES",
    "SAME",
    "Common",
    "ContactNames",
    "Deviation",
    "Gap",
    "JointPlaces",
    "Quantity",
    "Tolerance",
    "amount",
    "at_moments",
    "common_moments",
    "distances",
    "farthest",
    "joint_gap",
    "largest",
    "largest_or_inf",
    "nearest",
    "overlaps",
    "parse_tolerances",
    "same_pairs",
    "together",
    "tolerance_of",
    "turns",
]
