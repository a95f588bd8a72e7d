"""Where two runs part, and by how much: traces of any two engines, quantity by quantity.

    run = run_sides("hold")
    comparison = compare(run.left, run.right)
    comparison.agrees, comparison.agreements

A side is a file, an engine and options, typed or from Python:

    run = run_sides(Request(("hold",), sides=(Side("a.xml"), Side("b.urdf", "pybullet"))))
    compare(run.left, run.right)

Two engines that agree prove nothing; neither side is the truth.
"""

from __future__ import annotations

from ..runs.rerun import Rerun, rerun_of
from .agreement import Agreement, Comparison, SideRun, compare
from .convergence import QuantityLimit, TimestepConvergence, convergence
from .floor import ChaosFloor, FloorBand, chaos_floor
from .labels import Labels, labels_of
from .one_step import StepComparison, one_step
from .perturbed import Uncertainty, perturbed_runs
from .series import Contact, Series, Touch, default_tip, series, touches
from .sides import Request, Side, parse_sides, split_words
from .two_sides import SidesRun, prepare_sides, run_sides
from .witness import Witness, witness

__all__ = [
    "Agreement",
    "ChaosFloor",
    "Comparison",
    "Contact",
    "FloorBand",
    "Labels",
    "QuantityLimit",
    "Request",
    "Rerun",
    "Series",
    "Side",
    "SideRun",
    "SidesRun",
    "StepComparison",
    "TimestepConvergence",
    "Touch",
    "Uncertainty",
    "Witness",
    "chaos_floor",
    "compare",
    "convergence",
    "default_tip",
    "labels_of",
    "one_step",
    "parse_sides",
    "perturbed_runs",
    "prepare_sides",
    "rerun_of",
    "run_sides",
    "series",
    "split_words",
    "touches",
    "witness",
]
