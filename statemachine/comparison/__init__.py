"""The words of every comparison: contacts, moments, gaps, and numbers as text (`text`)."""

from __future__ import annotations

from .contacts import ContactNames, same_pairs
from .gap import Gap, largest
from .moments import SAME, Common, common_moments, nearest

__all__ = [
    "SAME",
    "Common",
    "ContactNames",
    "Gap",
    "common_moments",
    "largest",
    "nearest",
    "same_pairs",
]
