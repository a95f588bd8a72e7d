"""Fits from several starts, and what they have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...interface import Array
from ..runs.drive import Progress, no_progress
from .fit import Fit, Objective, fit, starting_points
from .residuals import Residuals

_AS_GOOD = 1.92  # half the sum of squares: the 95 % quantile of one parameter
_FIRST_NOISE = 0.6  # counts: taken for the noise before any residual is known


@dataclass(frozen=True, eq=False)
class Fits:
    """Fits from several starts, the best first.

    Attributes:
        each: At least one; `cost` of each is by the noise that the best one leaves.
        residuals: Of the best one.
    """

    each: tuple[Fit, ...]
    residuals: Residuals

    @property
    def best(self) -> Fit:
        """Return the one with the least sum of squares."""
        return self.each[0]

    @property
    def as_good(self) -> tuple[Fit, ...]:
        """Return those that fit as well as the best one, which is among them."""
        return tuple(each for each in self.each if each.cost - self.best.cost < _AS_GOOD)

    @property
    def covariance(self) -> Array:
        """Return the covariance (free, free) of what was fitted, with the prior.

        By the noise of each joint; where more than noise is left, by so much more.
        """
        left = self.residuals.rms / np.minimum(self.residuals.noise, self.residuals.most)
        more = max(1.0, float(np.sqrt(np.square(left).mean())))
        precision = 1.0 / np.square(self.best.objective.prior_deviations)
        information = self.best.information / more**2 + np.diag(precision)
        return np.asarray(np.linalg.inv(information), np.float64)


def first_objective(objective: Objective) -> Objective:
    """Return an objective that takes every angle to be about a count uncertain."""
    resolution = objective.simulation.recording.resolution
    return replace(objective, deviation=_FIRST_NOISE * resolution)


def fits_from_starts(
    objective: Objective, starts: int, seed: int, progress: Progress = no_progress
) -> Fits:
    """Fit from several starts.

    Args:
        objective: What is made small; its deviation is taken anew from the residuals.
        starts: How many.
        seed: Of their draws.
        progress: Told the fraction that is done.
    """
    objective = first_objective(objective)
    fits: list[Fit] = []
    points = starting_points(objective, starts, seed)
    for number, start in enumerate(points):
        fits.append(fit(objective, start))
        progress((number + 1) / (starts + 1))
    place = min(range(len(fits)), key=lambda number: fits[number].cost)
    best = fits.pop(place)
    recording = objective.simulation.recording
    residuals = Residuals.of(best.errors, recording)
    weighted = replace(objective, deviation=np.minimum(residuals.noise, residuals.most))
    # With the noise of each joint known, the best one goes on; the others are weighed alike.
    best = fit(weighted, best.vector)
    residuals = Residuals.of(best.errors, recording)
    others = [each.weighed(weighted) for each in fits]
    progress(1.0)
    return Fits(_in_order([best, *others]), residuals)


def _cost(fit: Fit) -> float:
    return fit.cost


def _in_order(fits: Sequence[Fit]) -> tuple[Fit, ...]:
    return tuple(sorted(fits, key=_cost))
