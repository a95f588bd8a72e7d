"""Where two runs part, and by how much: traces of any two engines, quantity by quantity.

    (one, two), said = sides_of("hold")
    comparison = compare(one, two)
    comparison.agrees, comparison.agreements

Two engines that agree prove nothing; neither side is the truth.
"""

from __future__ import annotations

from .agreement import Agreement, Comparison, Side, compare
from .convergence import QuantityLimit, TimestepConvergence, convergence
from .floor import ChaosFloor, FloorBand, chaos_floor
from .one_step import StepComparison, one_step
from .perturbed import Rerun, Uncertainty, perturbed_runs, rerun_of
from .series import Series, default_tip, series
from .sides import Request, sides_of
from .touches import Contact, Touch, touches
from .witness import Witness, witness

__all__ = [
    "Agreement",
    "ChaosFloor",
    "Comparison",
    "Contact",
    "FloorBand",
    "QuantityLimit",
    "Request",
    "Rerun",
    "Series",
    "Side",
    "StepComparison",
    "TimestepConvergence",
    "Touch",
    "Uncertainty",
    "Witness",
    "chaos_floor",
    "compare",
    "convergence",
    "default_tip",
    "one_step",
    "perturbed_runs",
    "rerun_of",
    "series",
    "sides_of",
    "touches",
    "witness",
]
