"""Fit of parameters to a recording: least squares with priors, from several starts.

The sum of squares is that of the residuals by their standard deviation, and of the distance from
the prior by its own (maximum a posteriori, A. Tarantola, Inverse Problem Theory, 2005). Each
Jacobian is one run of as many worlds as there are parameters; on the way to a fit a rough one does,
of as many worlds as there are kinds of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ...interface import Array, Ints
from .parameters import ArmParameters
from .results import UNITS
from .simulation import ArmSimulation
from .trust_region import BoundedLeastSquares, Effort, Minimum, minimum

Derivatives = Literal["rough", "coarse", "exact"]
_RUNS = 40  # simulations of a fit, at most
_TOLERANCE = 1e-4  # of the sum of squares, where a fit ends
_LAST_RUNS = 4  # simulations without the error of a step, after those with it
_STEPS = 3  # of a fit, before its Jacobian is computed anew
_SPREAD = 0.7  # of draws, by the standard deviations of the prior
_DRAWS_FOR_EACH = 12  # draws for each start, of which the best are taken
_STIFFNESS = (-5.5, 0.5)  # logarithm of the factor of all gains, drawn from between
_AMONG_SERVOS = 0.3  # spread of the gains of one arm, by that of the prior
_AT_ONCE = 48  # vectors that are simulated together, for their memory
_RESIDUAL_OF_NAN = 1e4  # of an angle of a simulation that diverged: no such point is kept


@dataclass(frozen=True, eq=False)
class Objective:
    """What a fit makes small.

    Attributes:
        simulation: Plays the commands of the recording.
        deviation: (n,) standard deviation of a measured angle [rad].
        free: Places of the parameters that are fitted; the others stay as in `fixed`.
        fixed: (P,) vector, that of the model as it is.
    """

    simulation: ArmSimulation
    deviation: Array
    free: Ints
    fixed: Array

    @property
    def parameters(self) -> ArmParameters:
        """Return the parameters of the arm."""
        return self.simulation.parameters

    @property
    def prior_deviations(self) -> Array:
        """Return the standard deviations of what is fitted before the fit."""
        return self.parameters.deviations[self.free]

    @property
    def prior_precision(self) -> Array:
        """Return the inverse (free, free) of the covariance of what is fitted before the fit."""
        return np.diag(1.0 / np.square(self.prior_deviations))

    def vector(self, values: Array) -> Array:
        """Return the whole vector (P,) for the values of what is fitted."""
        vector = self.fixed.copy()
        vector[self.free] = values
        return vector

    def errors(self, angles: Array) -> Array:
        """Return how far simulated angles (K, n) are from the measured ones, where they count."""
        first = self.simulation.first_frame
        return (angles - self.simulation.state)[first:]

    def residuals(self, values: Array, angles: Array) -> Array:
        """Return the residuals (rows * n + free,) of angles (K, n) [rad], and of the prior."""
        return self.residuals_of_errors(values, self.errors(angles))

    def residuals_of_errors(self, values: Array, errors: Array) -> Array:
        """Return the residuals (rows * n + free,) of errors (rows, n) [rad], and of the prior."""
        of_data = errors / self.deviation
        of_data = np.where(np.isfinite(of_data), of_data, _RESIDUAL_OF_NAN)
        return np.concatenate([of_data.ravel(), values / self.prior_deviations])

    def without_prior(self, rows: Array) -> Array:
        """Return the rows of residuals, or of their Jacobian, that are of the data."""
        return rows[: -len(self.free)]

    def costs(self, vectors: Array, with_error: bool = False) -> list[float]:
        """Return half the sum of squares of each of some vectors (W, P).

        Args:
            vectors: Of the parameters.
            with_error: As of `ArmSimulation.angles_of_each`.
        """
        costs: list[float] = []
        for first in range(0, len(vectors), _AT_ONCE):
            few = vectors[first : first + _AT_ONCE]
            angles = self.simulation.angles_of_each(few, with_error)
            for world, vector in enumerate(few):
                residuals = self.residuals(vector[self.free], angles[world])
                costs.append(0.5 * float(residuals @ residuals))
        return costs

    def jacobian(self, values: Array, with_error: bool = False) -> Array:
        """Return the Jacobian (rows * n + free, free) of the residuals, by one run of worlds.

        Args:
            values: Of what is fitted.
            with_error: As of `ArmSimulation.angles_of_each`.
        """
        steps = self.parameters.steps[self.free]
        vectors = np.tile(self.vector(values), (len(self.free) + 1, 1))
        vectors[np.arange(1, len(vectors)), self.free] += steps
        change = self._changes(vectors, with_error)
        return self._with_prior(change / steps[:, None, None])

    def information(self, values: Array, with_error: bool = False) -> Array:
        """Return what the data tell (free, free): the Fisher information, without the prior.

        Args:
            values: Of what is fitted.
            with_error: As of `ArmSimulation.angles_of_each`.
        """
        of_data = self.without_prior(self.jacobian(values, with_error))
        return of_data.T @ of_data

    def rough_jacobian(self, values: Array) -> Array:
        """Return the Jacobian as if each joint were moved by its own parameters alone.

        One world for each kind of parameter tells it: all joints have theirs changed at once. It
        has the error of a step.

        Args:
            values: Of what is fitted.
        """
        parameters = self.parameters
        is_free = np.isin(np.arange(len(parameters)), self.free)
        groups: list[Ints] = []
        for kind in UNITS:
            members = parameters.of_kind(kind)
            groups.append(members[is_free[members]])
        vectors = np.tile(self.vector(values), (len(groups) + 1, 1))
        for world, members in enumerate(groups):
            vectors[world + 1, members] += parameters.steps[members]
        changes = self._changes(vectors, with_error=True)
        slopes = np.zeros((len(parameters), *changes.shape[1:]))
        for change, members in zip(changes, groups, strict=True):
            for number in members.tolist():
                mine = parameters.joints_of(number)
                slopes[number, :, mine] = change[:, mine].T / parameters.steps[number]
        return self._with_prior(slopes[self.free])

    def _changes(self, vectors: Array, with_error: bool) -> Array:
        """Return how far residuals (W - 1, rows, n) of vectors (W, P) are from those of the first.

        Args:
            vectors: Of the parameters.
            with_error: As of `ArmSimulation.angles_of_each`.
        """
        angles = self.simulation.angles_of_each(vectors, with_error)
        first = self.simulation.first_frame
        return (angles[1:, first:] - angles[0, first:]) / self.deviation

    def _with_prior(self, slopes: Array) -> Array:
        """Return the Jacobian (rows, free) of slopes (free, frames, n), and of the prior."""
        of_data = slopes.reshape(len(slopes), -1).T
        of_data = np.where(np.isfinite(of_data), of_data, 0.0)
        return np.vstack([of_data, np.diag(1.0 / self.prior_deviations)])


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Attributes:
        objective: What was made small.
        vector: (P,) the parameters.
        cost: Half the sum of squares, with the prior.
        errors: (rows, n) how far the fitted angles are from the measured ones [rad].
        evaluations: How often worlds were run.
        near_jacobian: The Jacobian of a fit that ended near, if this one went on from there.
    """

    objective: Objective
    vector: Array
    cost: float
    errors: Array
    evaluations: int
    near_jacobian: Array | None = None

    @cached_property
    def jacobian(self) -> Array:
        """Return the Jacobian (rows, free) of the residuals, the last rows those of the prior."""
        if self.near_jacobian is not None:
            return self.near_jacobian
        return self.objective.jacobian(self.vector[self.objective.free])

    @property
    def information(self) -> Array:
        """Return what the data tell (free, free): the Fisher information, without the prior."""
        of_data = self.objective.without_prior(self.jacobian)
        return of_data.T @ of_data

    def weighed(self, objective: Objective) -> Fit:
        """Return the same fit as another objective with the same free parameters weighs it."""
        values = self.vector[objective.free]
        residuals = objective.residuals_of_errors(values, self.errors)
        jacobian = self.near_jacobian
        if jacobian is not None:
            of_data = objective.without_prior(jacobian)
            change = (self.objective.deviation / objective.deviation)[None, :, None]
            rows = of_data.reshape(*self.errors.shape, -1) * change
            jacobian = np.vstack([rows.reshape(of_data.shape), jacobian[len(of_data) :]])
        return replace(
            self,
            objective=objective,
            cost=0.5 * float(residuals @ residuals),
            near_jacobian=jacobian,
        )


def fit(
    objective: Objective,
    start: Array,
    runs: int = _RUNS,
    tolerance: float = _TOLERANCE,
    derivatives: Derivatives = "coarse",
) -> Fit:
    """Fit the free parameters from a start.

    Args:
        objective: What is made small.
        start: (P,) vector.
        runs: Simulations at most, without those for derivatives.
        tolerance: Part by which a last step may make the sum of squares smaller.
        derivatives: How the Jacobian is computed: "rough", as if joints did not act on each other,
            and on the way angles have the error of a step, too; "coarse", with that error in the
            Jacobian alone; "exact", without it where the fit ends.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
    """

    def coarse_jacobian(values: Array) -> Array:
        return objective.jacobian(values, with_error=True)

    effort = Effort(runs, tolerance, _STEPS)
    if derivatives == "rough":
        way = _minimum(objective, start, effort, objective.rough_jacobian, with_error=True)
        last_effort = Effort(_LAST_RUNS, tolerance, _LAST_RUNS)
        end = _minimum(
            objective, objective.vector(way.values), last_effort, lambda _values: way.jacobian
        )
        return _fit_of(objective, end, way.runs + way.jacobians + end.runs)
    end = _minimum(objective, start, effort, coarse_jacobian)
    evaluations = end.runs + end.jacobians
    if derivatives == "coarse":
        return _fit_of(objective, end, evaluations)
    jacobian = objective.jacobian(end.values)
    further = fit_near(objective, objective.vector(end.values), jacobian, runs, tolerance)
    return replace(further, evaluations=evaluations + further.evaluations)


def fit_near(
    objective: Objective,
    start: Array,
    jacobian: Array,
    runs: int = _RUNS,
    tolerance: float = _TOLERANCE,
) -> Fit:
    """Fit the free parameters from a start, with the Jacobian of a fit that ended near.

    Args:
        objective: What is made small.
        start: (P,) vector.
        jacobian: (rows * n + free, free) of the fit that ended near.
        runs: As of `fit`.
        tolerance: As of `fit`.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
    """
    effort = Effort(runs, tolerance, runs)
    end = _minimum(objective, start, effort, lambda _values: jacobian)
    return replace(_fit_of(objective, end, end.runs), near_jacobian=jacobian)


def _minimum(
    objective: Objective,
    start: Array,
    effort: Effort,
    jacobian: Callable[[Array], Array],
    with_error: bool = False,
) -> Minimum:
    """Return where a fit ends.

    Args:
        objective: What is made small.
        start: (P,) vector.
        effort: When it ends.
        jacobian: Of the values (free,) of what is fitted.
        with_error: Of the residuals, as of `ArmSimulation.angles_of_each`.
    """
    parameters, free = objective.parameters, objective.free

    def residuals(values: Array) -> Array:
        vectors = objective.vector(values)[None]
        (angles,) = objective.simulation.angles_of_each(vectors, with_error)
        return objective.residuals(values, angles)

    problem = BoundedLeastSquares(
        residuals=residuals,
        jacobian=jacobian,
        low=parameters.low[free],
        high=parameters.high[free],
        scale=objective.prior_deviations,
    )
    return minimum(problem, start[free], effort)


def _fit_of(objective: Objective, end: Minimum, evaluations: int) -> Fit:
    """Return the fit that ended there."""
    of_data = objective.without_prior(end.residuals)
    errors = of_data.reshape(-1, len(objective.deviation)) * objective.deviation
    return Fit(
        objective=objective,
        vector=objective.vector(end.values),
        cost=0.5 * float(end.residuals @ end.residuals),
        errors=errors,
        evaluations=evaluations,
    )


def starting_points(objective: Objective, starts: int, seed: int) -> list[Array]:
    """Return the vectors from which fits start: of many draws those that fit least badly.

    Args:
        objective: What is made small.
        starts: How many.
        seed: Of the draws.
    """
    parameters = objective.parameters
    random = np.random.default_rng(seed)
    count = _DRAWS_FOR_EACH * starts
    drawn = random.normal(0.0, _SPREAD, (count, len(parameters))) * parameters.deviations
    # Servos of an arm have the same settings: how stiff they are is drawn for all of them.
    low, high = _STIFFNESS
    drawn[:, parameters.of_kind("kp")] *= _AMONG_SERVOS
    drawn[:, parameters.of_kind("kp")] += random.uniform(low, high, (count, 1))
    drawn[0] = 0.0
    drawn = np.clip(drawn, parameters.low, parameters.high)
    fixed = np.setdiff1d(np.arange(len(parameters)), objective.free)
    drawn[:, fixed] = objective.fixed[fixed]
    costs = objective.costs(drawn, with_error=True)
    return [drawn[place] for place in np.argsort(costs, kind="stable")[:starts]]
