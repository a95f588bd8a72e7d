"""Sweeps: one experiment at many settings, from many starts, on every engine, as a dataset.

    from statemachine.sweep import Sweep, read_cells, run_sweep

    sweep = Sweep("hold", vary=("timestep=0.001,0.005", "damping=0.5x:2x:5"), seeds=10)
    summary = run_sweep(sweep, "damping")
    table = read_cells("damping")  # a pyarrow Table, a row a cell

A cell is one point of the design, one seed and one backend. A cell that fails is a row with its
error. Called again, `run_sweep` runs what is missing.
"""

from __future__ import annotations

from .design import Design, DesignPoint, Vary
from .drive import SweepSummary, run_sweep
from .folder import design_of, read_manifest
from .prepare import prepared
from .request import PreparedSweep, Sweep
from .rows import COLUMNS, read_cells

__all__ = [
    "COLUMNS",
    "Design",
    "DesignPoint",
    "PreparedSweep",
    "Sweep",
    "SweepSummary",
    "Vary",
    "design_of",
    "prepared",
    "read_cells",
    "read_manifest",
    "run_sweep",
]
