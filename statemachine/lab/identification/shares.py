"""What each cause explains of the gap between a model and a recording: Shapley values.

A cause is fitted, together with those before it, and the gap is that on what was not fitted: delay
and gains stand in for each other, and neither order of the two says what is whose.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from ...interface import Array
from ..runs.drive import Progress, no_progress
from ..why.shapley import shapley
from .fit import fit
from .residuals import root_mean_square
from .results import CAUSES, Cause, CauseShare
from .simulation import ArmSimulation
from .starts import Fits

_RUNS = 12  # simulations of each fit
_TOLERANCE = 1e-2  # of a fit, which begins at the best one of all parameters


def cause_shares(
    fits: Fits, held_out: ArmSimulation, progress: Progress = no_progress
) -> tuple[CauseShare, ...]:
    """Return the share of each cause, by what it takes from the gap on what was not fitted.

    Args:
        fits: Of all parameters.
        held_out: Plays what was not fitted.
        progress: Told the fraction that is done.
    """
    objective = fits.best.objective
    nothing = np.zeros(len(objective.parameters))
    known: dict[frozenset[str], float | None] = {}

    def gap(causes: Collection[str]) -> float | None:
        key = frozenset(causes)
        if key not in known:
            known[key] = _gap_held_out(fits, held_out, key)
            progress(min(1.0, len(known) / 2 ** len(CAUSES)))
        return known[key]

    whole = gap_of(held_out, nothing)
    if not math.isfinite(whole) or whole <= 0.0:
        return ()
    division = shapley(CAUSES, gap, whole)
    shares: list[CauseShare] = []
    for cause in CAUSES:
        share, alone, last = division.share[cause], division.alone[cause], division.last[cause]
        if share is None or alone is None or last is None:
            return ()
        shares.append(CauseShare(cause, share, alone, last))
    return tuple(shares)


def _gap_held_out(fits: Fits, held_out: ArmSimulation, causes: frozenset[str]) -> float | None:
    """Return the gap where these causes are fitted; None where the simulation diverges."""
    best = fits.best
    nothing = np.zeros(len(best.vector))
    chosen: list[Cause] = [cause for cause in CAUSES if cause in causes]
    if not chosen:
        return gap_of(held_out, nothing)
    if len(chosen) == len(CAUSES):
        return gap_of(held_out, best.vector)
    free = best.objective.parameters.of_causes(chosen)
    objective = replace(best.objective, free=free, fixed=nothing)
    fitted = fit(objective, best.vector, _RUNS, _TOLERANCE, "rough")
    gap = gap_of(held_out, fitted.vector)
    return gap if math.isfinite(gap) else None


def gap_of(simulation: ArmSimulation, vector: Array) -> float:
    """Return the root mean square over joints and frames of a vector's angles [rad]."""
    angles = simulation.angles(vector)
    errors = (angles - simulation.state)[simulation.first_frame :]
    return root_mean_square(errors)
