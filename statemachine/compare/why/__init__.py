"""Why two simulations differ: of two files `explain`, of two engines `attribute`."""

from __future__ import annotations

from .attribute import attribute
from .explain import CauseShare, Explanation, explain
from .factors import FACTORS, Factor
from .results import UNEXPLAINED, Attribution, FactorTrial, FirstTouch
from .shapley import ADDS_UP

__all__ = [
    "ADDS_UP",
    "FACTORS",
    "UNEXPLAINED",
    "Attribution",
    "CauseShare",
    "Explanation",
    "Factor",
    "FactorTrial",
    "FirstTouch",
    "attribute",
    "explain",
]
