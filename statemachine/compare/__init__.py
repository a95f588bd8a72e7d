"""Where two runs part, and by how much: traces of any two engines, quantity by quantity.

    (one, two), said = sides_of("hold")
    comparison = compare(one, two)
    comparison.agrees, comparison.agreements

A side is a file, an engine and options, typed or from Python:

    run = run_sides(Request(("hold",), sides=(Side("a.xml"), Side("b.urdf", "pybullet"))))
    compare(run.left, run.right)

Two engines that agree prove nothing; neither side is the truth.
"""

from __future__ import annotations

from .agreement import Agreement, Comparison, SideRun, compare
from .floor import ChaosFloor, FloorBand, chaos_floor
from .labels import Labels, labels_of
from .perturbed import Rerun, Uncertainty, perturbed_runs, rerun_of
from .request import Request, split_words
from .series import Series, default_tip, series
from .side import Side, parse_sides
from .sides import sides_of
from .touches import Contact, Touch, touches
from .two_sides import SidesRun, run_sides
from .witness import Witness, witness

__all__ = [
    "Agreement",
    "ChaosFloor",
    "Comparison",
    "Contact",
    "FloorBand",
    "Labels",
    "Request",
    "Rerun",
    "Series",
    "Side",
    "SideRun",
    "SidesRun",
    "Touch",
    "Uncertainty",
    "Witness",
    "chaos_floor",
    "compare",
    "default_tip",
    "labels_of",
    "parse_sides",
    "perturbed_runs",
    "rerun_of",
    "run_sides",
    "series",
    "sides_of",
    "split_words",
    "touches",
    "witness",
]
