"""Fits from several starts, and what they have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...interface import Array
from ..runs.drive import Progress, no_progress
from .considered import considered_shifts
from .fit import Fit, Objective, fit, fit_near, starting_points
from .residuals import Residuals, root_mean_square

_RUNS_TO_BEST = 8  # simulations of a start that goes on with the derivatives of the best
_RUNS_BY_ITSELF = 20  # of one that goes on with its own
AS_GOOD = 1.92  # half the sum of squares: 0.5 * QUANTILE**2, for one parameter
_NEAR_THE_END = 1e-2  # of the sum of squares, where a start waits for the best one
_FIRST_NOISE = 0.6  # counts: taken for the noise before any residual is known
_WEAKER = (0.15, 0.3)  # logarithms of the factors by which joints are taken to be weaker
_LEAST_DEVIATION = 1e-9  # rad
_POSSIBLE = 2.0 * AS_GOOD  # half the sum of squares: a joint that is weaker fits hardly worse


@dataclass(frozen=True, eq=False)
class Fits:
    """Fits from several starts, the best first.

    Attributes:
        each: At least one; `cost` of each is by the noise that the best one leaves.
        residuals: Of the best one.
        beside: Fisher informations (free, free) of arms with joints that are weaker.
        considered: (S, free) by how much parameters move for what is uncertain and no recording
            tells; None for nothing.
    """

    each: tuple[Fit, ...]
    residuals: Residuals
    beside: tuple[Array, ...] = ()
    considered: Array | None = None

    @property
    def best(self) -> Fit:
        """Return the one with the least sum of squares."""
        return self.each[0]

    @property
    def as_good(self) -> tuple[Fit, ...]:
        """Return those that fit as well as the best one, which is among them."""
        return tuple(each for each in self.each if each.cost - self.best.cost < AS_GOOD)

    @property
    def objective_by_residuals(self) -> Objective:
        """Return the objective that weighs angles by what the best fit leaves, not by the noise.

        By it other readings of the recording are compared, which may all be wrong.
        """
        deviation = np.maximum(self.residuals.rms, _LEAST_DEVIATION)
        return replace(self.best.objective, deviation=deviation)

    @property
    def informations(self) -> tuple[Array, ...]:
        """Return the Fisher informations (free, free), without the prior: of the best fit first."""
        return (self.best.information, *self.beside)

    @property
    def deviations(self) -> Array:
        """Return the standard deviations (free,) of what was fitted, with the prior.

        By the noise of each joint; where more than noise is left, by so much more. Of the best fit
        or of an arm beside it, whichever tells less; or by what is left in each frame, where that
        is more. And by what is uncertain and no recording tells.
        """
        prior = self.best.objective.prior_deviations
        more = self._more_than_noise
        by_noise = least_certain([each / more**2 for each in self.informations], prior)
        deviations = np.maximum(by_noise, self._deviations_by_frame)
        if self.considered is None:
            return deviations
        return np.hypot(deviations, np.linalg.norm(self.considered, axis=0))

    @property
    def _deviations_by_frame(self) -> Array:
        """Return the standard deviations (free,) by what is left in each frame.

        What is left may be more where the arm is fast, and of all joints together, as where a frame
        is read late: noise that is the same everywhere would make intervals too narrow (K.-Y. Liang
        and S. Zeger, Longitudinal data analysis using generalized linear models, 1986).
        """
        best, objective = self.best, self.best.objective
        precision = objective.prior_precision
        left = (best.errors / objective.deviation)[:, :, None]
        slopes = objective.without_prior(best.jacobian).reshape(*best.errors.shape, -1)
        of_frames = (left * slopes).sum(axis=1)
        inverse = np.linalg.inv(best.information + precision)
        covariance = inverse @ (of_frames.T @ of_frames + precision) @ inverse
        return np.sqrt(np.diag(covariance))

    @property
    def covariance(self) -> Array:
        """Return the covariance (free, free) of the best fit, with the prior."""
        precision = self.best.objective.prior_precision
        information = self.best.information / self._more_than_noise**2 + precision
        return np.asarray(np.linalg.inv(information), np.float64)

    @property
    def _more_than_noise(self) -> float:
        """Return what is left by its noise, over all joints; at least 1."""
        left = self.residuals.rms / np.minimum(self.residuals.noise, self.residuals.most)
        return max(1.0, root_mean_square(left))


def least_certain(informations: Sequence[Array], prior: Array) -> Array:
    """Return the largest standard deviations (free,) that any of some informations leaves.

    Args:
        informations: (free, free) each, without the prior.
        prior: (free,) standard deviations of the prior.
    """
    precision = np.diag(1.0 / np.square(prior))
    each = [np.sqrt(np.diag(np.linalg.inv(one + precision))) for one in informations]
    return np.max(each, axis=0)


def informations_beside(best: Fit) -> tuple[Array, ...]:
    """Return the Fisher informations (free, free) of arms with joints that are weaker.

    A fit may end where a servo just reaches its force limit: beyond, angles change with the common
    scale of a joint's gains, friction and armature, and below they do not. The information there
    is that of one side, and an interval from it would be too narrow towards the other. Joints that
    the recording shows not to be weaker stay as they are.
    """
    objective = best.objective
    parameters = objective.parameters
    numbers = objective.free.tolist()
    weakened = np.zeros((len(parameters.joints), len(parameters)))
    for world, joint in enumerate(parameters.joints):
        mine = [i for i in numbers if parameters.each[i].joint == joint]
        weakened[world, mine] = [parameters.each[i].is_factor for i in mine]
    informations: list[Array] = []
    for weaker in _WEAKER:
        vectors = np.maximum(best.vector - weaker * weakened, parameters.low)
        possible = np.array(objective.costs(vectors)) - best.cost < _POSSIBLE
        if possible.any():
            vector = vectors[possible].min(axis=0)
            informations.append(objective.information(vector[objective.free]))
    return tuple(informations)


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
    recording = objective.simulation.recording
    fits: list[Fit] = []
    points = starting_points(objective, starts, seed)
    for number, start in enumerate(points):
        fits.append(fit(objective, start, tolerance=_NEAR_THE_END, derivatives="rough"))
        progress((number + 1) / (2 * starts + 2))
    best = min(fits, key=_cost)
    fits.remove(best)
    best = _better(best, fit(objective, best.vector, derivatives="exact"))
    # The noise of each joint is known now, and what it makes of the derivatives.
    residuals = Residuals.of(best.errors, recording)
    weighted = replace(objective, deviation=np.minimum(residuals.noise, residuals.most))
    best = best.weighed(weighted)
    best = _better(best, fit_near(weighted, best.vector, best.jacobian))
    others: list[Fit] = []
    for number, end in enumerate(fits):
        others.append(gone_on(end.weighed(weighted), best))
        progress((starts + number + 2) / (2 * starts + 2))
    in_order = sorted([best, *others], key=_cost)
    residuals = Residuals.of(in_order[0].errors, recording)
    beside = informations_beside(in_order[0])
    considered = considered_shifts(in_order[0])
    progress(1.0)
    return Fits(tuple(in_order), residuals, beside, considered)


def gone_on(end: Fit, best: Fit) -> Fit:
    """Return where a start goes on to: with the derivatives of the best, if these do, or its own.

    They do where it becomes as good.
    """
    objective = best.objective
    further = _better(end, fit_near(objective, end.vector, best.jacobian, _RUNS_TO_BEST))
    if further.cost - best.cost < AS_GOOD:
        return further
    return _better(further, fit(objective, further.vector, _RUNS_BY_ITSELF))


def _better(end: Fit, further: Fit) -> Fit:
    """Return the one with the smaller sum of squares, with the evaluations of both."""
    better = further if further.cost < end.cost else end
    return replace(better, evaluations=end.evaluations + further.evaluations)


def _cost(fit: Fit) -> float:
    return fit.cost
