"""Other readings of a recording, fitted anew: signs of joints, where viscous friction acts."""

from __future__ import annotations

import math
from dataclasses import replace

from ..runs.drive import Progress, no_progress
from .fit import Objective, fit
from .residuals import root_mean_square
from .results import Hypothesis, HypothesisVerdict
from .simulation import ArmSimulation
from .starts import Fits

_RUNS = 12  # simulations of each fit
EVIDENCE = 5.0  # half the sum of squares: odds of 150 to 1
_SATURATED = 0.01  # part of the frames at the force limit, below which it does not matter


def tried_hypotheses(
    fits: Fits, saturated: float, progress: Progress = no_progress
) -> tuple[Hypothesis, ...]:
    """Return how well other readings fit.

    Signs are tried where the fit leaves more than noise: with the wrong sign gravity pulls a joint
    the wrong way. Where only noise is left, nothing speaks for another sign.

    Args:
        fits: With the reading as it is.
        saturated: Part of the frames in which a servo is at its force limit.
        progress: Told the fraction that is done.
    """
    objective = fits.objective_by_residuals
    simulation = objective.simulation
    readings: list[tuple[str, ArmSimulation]] = []
    if saturated > _SATURATED:
        name = "viscous friction outside of the force limit"
        readings.append((name, replace(simulation, viscous_outside=True)))
    if not fits.residuals.at_floor:
        for place, joint in enumerate(objective.parameters.joints):
            signs = simulation.signs.copy()
            signs[place] = -1.0
            readings.append((f"the other sign of {joint}", replace(simulation, signs=signs)))
    if not readings:
        return ()
    as_it_is = fit(objective, fits.best.vector, runs=_RUNS)
    tried: list[Hypothesis] = []
    for number, (name, other) in enumerate(readings):
        tried.append(tried_reading(name, replace(objective, simulation=other), fits, as_it_is.cost))
        progress((number + 1) / len(readings))
    return tuple(tried)


def tried_reading(name: str, objective: Objective, fits: Fits, cost: float) -> Hypothesis:
    """Return how well another reading fits, from the two best fits.

    It fits better where its angles are nearer, too: where no reading fits, sums of squares differ
    by where a fit ends.

    Args:
        name: Of the reading.
        objective: With that reading.
        fits: With the reading as it is.
        cost: Half the sum of squares of the reading as it is.
    """
    ends = [fit(objective, each.vector, _RUNS, derivatives="rough") for each in fits.each[:2]]
    nearest = min(ends, key=lambda each: each.cost)
    end = fit(objective, nearest.vector, runs=_RUNS)
    evidence = cost - end.cost
    residual = root_mean_square(end.errors)
    if not math.isfinite(residual):
        return Hypothesis(name, residual, evidence, "fits worse")
    is_nearer = residual < fits.residuals.overall
    return Hypothesis(name, residual, evidence, verdict_of(evidence, is_nearer))


def verdict_of(evidence: float, is_nearer: bool) -> HypothesisVerdict:
    """Return what is said of a reading.

    Args:
        evidence: As of `Hypothesis`.
        is_nearer: Whether its angles are nearer to the measured ones, too.
    """
    if evidence < -EVIDENCE:
        return "fits worse"
    return "fits better" if evidence > EVIDENCE and is_nearer else "cannot tell"
