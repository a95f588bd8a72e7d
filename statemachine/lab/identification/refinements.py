"""What a model lacks and an arm may have, tried on a fit: play, loaded gears, a tilted base.

Each may pass for friction, gains or offsets, and leave no more than noise. What it would change
is not determined.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...interface import Array
from .fit import Fit, fit
from .hypotheses import EVIDENCE, verdict_of
from .linear_refit import LinearRefit
from .load_friction import load_friction_profile
from .play_profiles import play_profiles
from .residuals import root_mean_square
from .results import Hypothesis, Reason
from .simulation import ArmSimulation
from .starts import Fits
from .tilt import likeliest_tilt, tilted_gravity

_RUNS = 12  # simulations of the fit that confirms what its Jacobian says


@dataclass(frozen=True, eq=False)
class Refinement:
    """Something that the model lacks, and what the fit would be with it.

    Attributes:
        hypothesis: How well it fits.
        reason: Why what it changes is not determined.
        shifts: (S, free) by how much the parameters move, with each size of it that fits as well.
    """

    hypothesis: Hypothesis
    reason: Reason
    shifts: Array

    @property
    def fits_better(self) -> bool:
        """Tell whether the model fits better with it."""
        return self.hypothesis.verdict == "fits better"

    @property
    def least(self) -> Array:
        """Return by how much parameters (free,) move down at most; not above 0."""
        return self.shifts.min(axis=0, initial=0.0)

    @property
    def most(self) -> Array:
        """Return by how much parameters (free,) move up at most; not below 0."""
        return self.shifts.max(axis=0, initial=0.0)


def tried_refinements(fits: Fits) -> tuple[Refinement, ...]:
    """Return how well play of each joint, friction of loaded gears and a tilted base fit.

    All are tried by the Jacobian of the best fit. What then fits better is fitted.

    Args:
        fits: Of the model as it is.
    """
    best = fits.best.weighed(fits.objective_by_residuals)
    if not math.isfinite(best.cost):
        return ()
    refit = LinearRefit.of(best)
    return (*_of_play(refit), _of_load_friction(refit), _of_tilt(refit))


def _of_play(refit: LinearRefit) -> list[Refinement]:
    """Return play of each joint; the joints that are likely to have some are fitted together."""
    best = refit.fit
    profiles = play_profiles(refit)
    widths = np.array([profile.sizes[profile.best] for profile in profiles])
    residuals = [profile.ends[profile.best].residual for profile in profiles]
    shifts = [profile.as_good for profile in profiles]
    likely = np.array([profile.evidence > EVIDENCE for profile in profiles])
    if likely.any():
        playing = np.where(likely, widths, 0.0)
        fitted = _fitted(best, replace(best.objective.simulation, play=playing))
        likely &= fitted.cost < refit.cost - EVIDENCE
        for place in np.flatnonzero(likely).tolist():
            shifts[place] = np.vstack([shifts[place], _moved(best, fitted)])
        # Widths come out larger once friction is less, which had stood in for play.
        again = play_profiles(LinearRefit.of(fitted))
        widths = np.where(likely, [each.sizes[each.best] for each in again], widths)
    refinements: list[Refinement] = []
    for place, joint in enumerate(best.objective.parameters.joints):
        evidence = profiles[place].evidence
        hypothesis = Hypothesis(
            name=f"play of {joint}",
            residual=residuals[place],
            evidence=evidence,
            verdict=verdict_of(evidence, is_nearer=bool(likely[place])),
            size=float(widths[place]),
        )
        refinements.append(Refinement(hypothesis, "play fits as well", shifts[place]))
    return refinements


def _of_load_friction(refit: LinearRefit) -> Refinement:
    """Return friction in the gears of all servos, of one make, that grows with their force."""
    best = refit.fit
    profile = load_friction_profile(refit)
    part, end = float(profile.sizes[profile.best]), profile.ends[profile.best]
    shifts, is_nearer = profile.as_good, False
    if profile.evidence > EVIDENCE:
        loaded = replace(best.objective.simulation, load_friction=part)
        fitted = _fitted(best, loaded)
        is_nearer = fitted.cost < refit.cost - EVIDENCE
        if is_nearer:
            shifts = np.vstack([shifts, _moved(best, fitted)])
    hypothesis = Hypothesis(
        name="friction that grows with the load",
        residual=end.residual,
        evidence=profile.evidence,
        verdict=verdict_of(profile.evidence, is_nearer),
        size=part,
        unit="of the force",
    )
    return Refinement(hypothesis, "friction of the load fits as well", shifts)


def _of_tilt(refit: LinearRefit) -> Refinement:
    """Return a tilted base. One that fits no better moves nothing: a base is to stand level."""
    best = refit.fit
    tilt = likeliest_tilt(refit)
    evidence, residual = refit.cost - tilt.end.cost, tilt.end.residual
    verdict = verdict_of(evidence, is_nearer=False)
    shifts = np.zeros((0, len(best.objective.free)))
    if evidence > EVIDENCE:
        simulation = best.objective.simulation
        gravity = tilted_gravity(np.array(simulation.parameters.model.gravity), tilt.angles)
        fitted = _fitted(best, replace(simulation, gravity=gravity))
        evidence, residual = refit.cost - fitted.cost, root_mean_square(fitted.errors)
        verdict = verdict_of(evidence, residual < root_mean_square(best.errors))
        if verdict == "fits better":
            shifts = _moved(best, fitted)[None]
    hypothesis = Hypothesis(
        name="a tilted base",
        residual=residual,
        evidence=evidence,
        verdict=verdict,
        size=float(np.linalg.norm(tilt.angles)),
    )
    return Refinement(hypothesis, "a tilted base fits as well", shifts)


def _fitted(best: Fit, simulation: ArmSimulation) -> Fit:
    """Return the fit of another simulation, from where the best one ended."""
    return fit(replace(best.objective, simulation=simulation), best.vector, runs=_RUNS)


def _moved(best: Fit, fitted: Fit) -> Array:
    """Return by how much the parameters (free,) are elsewhere in another fit."""
    return (fitted.vector - best.vector)[best.objective.free]
