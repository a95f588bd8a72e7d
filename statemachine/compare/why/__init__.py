"""Why two simulations differ: see `attribute`."""

from __future__ import annotations

from .attribute import attribute
from .factors import FACTORS, Factor
from .gap import Deviation
from .results import Attribution, FactorTrial, FirstTouch

__all__ = [
    "FACTORS",
    "Attribution",
    "Deviation",
    "Factor",
    "FactorTrial",
    "FirstTouch",
    "attribute",
]
