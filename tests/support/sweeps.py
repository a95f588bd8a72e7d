"""Sweeps that are run in the process of a test."""

from __future__ import annotations

from typing import Any

from statemachine.lab.sweep import Sweep, prepare_sweep
from statemachine.lab.sweep.worker import run_batch


def rows_of(sweep: Sweep) -> list[dict[str, Any]]:
    """Return the rows of a sweep, run here one after the other."""
    ready = prepare_sweep(sweep)
    cells = [cell for name in ready.backends for cell in ready.cells(name)]
    return run_batch(ready, cells, False)
