"""Where two runs part, and by how much: traces of any two engines, quantity by quantity.

    run = run_sides("hold")
    comparison = compare(run.left, run.right, robot=run.robot)
    comparison.agrees, comparison.agreements

A side is a file, an engine and options, typed or from Python:

    run = run_sides(Request(("hold",), sides=(Side("a.xml"), Side("b.urdf", "pybullet"))))
    compare(run.left, run.right)

Two engines that agree prove nothing; neither side is the truth.
"""

from __future__ import annotations

from ..recordings import Rerun, rerun_of
from .agreement import Agreement, Comparison, SideRun, compare
from .chaos import chaos_floor
from .labels import Labels, labels_of
from .perturbed import Uncertainty, perturbed_runs
from .prepared_sides import prepare_sides
from .series import Series, default_tip, series, touches
from .sides import Request, Side
from .two_sides import SidesRun, run_sides
from .typed_sides import parse_sides, split_words
from .witnessed import witness

__all__ = [
    "Agreement",
    "Comparison",
    "Labels",
    "Request",
    "Rerun",
    "Series",
    "Side",
    "SideRun",
    "SidesRun",
    "Uncertainty",
    "chaos_floor",
    "compare",
    "default_tip",
    "labels_of",
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
