"""Fit of parameters to a recording: least squares with priors, from several starts.

The sum of squares is that of the residuals by their standard deviation, and of the distance from
the prior by its own (maximum a posteriori, A. Tarantola, Inverse Problem Theory, 2005). It is
minimised by SciPy's trust region (T. Coleman and Y. Li, 1996); each Jacobian is one run of as
many worlds as there are parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ...installed import require_extra
from ...interface import Array, Ints
from .parameters import ArmParameters
from .simulation import ArmSimulation

Derivatives = Literal["coarse", "exact"]
EXTRA = "recordings"
_RUNS = 40  # simulations of a fit, at most
_TOLERANCE = 1e-4  # of the sum of squares, where a fit ends
_LEAST_STEP = 1e-5  # by the length of the vector
_NEAR = 0.1  # of the prior's standard deviations: the Jacobian is taken to be the same there
_SPREAD = 0.7  # of draws, by the standard deviations of the prior
_DRAWS_FOR_EACH = 12  # draws for each start, of which the best are taken
_STIFFNESS = (-5.5, 0.5)  # logarithm of the factor of all gains, drawn from between
_AMONG_SERVOS = 0.3  # spread of the gains of one arm, by that of the prior
_PULLED = 1e4  # residual of an angle that is no number: no such point is kept


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
        """Return the residuals of angles (K, n), and of the prior."""
        return self.scaled(values, self.errors(angles))

    def scaled(self, values: Array, errors: Array) -> Array:
        """Return the residuals of errors (rows, n) [rad], and of the prior."""
        scaled = errors / self.deviation
        scaled = np.where(np.isfinite(scaled), scaled, _PULLED)
        return np.concatenate([scaled.ravel(), values / self.prior_deviations])

    def costs(self, vectors: Array, with_error: bool = False) -> list[float]:
        """Return half the sum of squares of each of some vectors (W, P).

        Args:
            vectors: Of the parameters.
            with_error: As of `ArmSimulation.angles_of_each`.
        """
        angles = self.simulation.angles_of_each(vectors, with_error)
        costs: list[float] = []
        for world, vector in enumerate(vectors):
            residuals = self.residuals(vector[self.free], angles[world])
            costs.append(0.5 * float(residuals @ residuals))
        return costs

    def jacobian(self, values: Array, with_error: bool = False) -> Array:
        """Return the Jacobian of the residuals, by one run of worlds.

        Args:
            values: Of what is fitted.
            with_error: As of `ArmSimulation.angles_of_each`.
        """
        steps = self.parameters.steps[self.free]
        vectors = np.tile(self.vector(values), (len(self.free) + 1, 1))
        vectors[np.arange(1, len(vectors)), self.free] += steps
        angles = self.simulation.angles_of_each(vectors, with_error)
        first = self.simulation.first_frame
        change = (angles[1:, first:] - angles[0, first:]) / self.deviation
        of_data = (change / steps[:, None, None]).reshape(len(self.free), -1).T
        of_data = np.where(np.isfinite(of_data), of_data, 0.0)
        return np.vstack([of_data, np.diag(1.0 / self.prior_deviations)])


class _Memory:
    """Residuals and Jacobians that SciPy asks for, and how often worlds were run for them."""

    def __init__(self, objective: Objective, method: Derivatives | Array) -> None:
        """Begin with nothing known.

        Args:
            objective: What is made small.
            method: As of `fit`.
        """
        self.objective, self.method = objective, method
        self.evaluations = 0
        self._known: tuple[Array, Array] | None = None  # values, and the Jacobian there

    def residuals(self, values: Array) -> Array:
        """Return the residuals, without the error of a step."""
        self.evaluations += 1
        angles = self.objective.simulation.angles(self.objective.vector(values))
        return self.objective.residuals(values, angles)

    def jacobian(self, values: Array) -> Array:
        """Return the Jacobian, that of the last point where it is near."""
        if isinstance(self.method, np.ndarray):
            return self.method
        if self._known is not None:
            moved = np.abs(values - self._known[0]) / self.objective.prior_deviations
            if moved.max() < _NEAR:
                return self._known[1]
        self.evaluations += 1
        with_error = self.method == "coarse"
        self._known = values.copy(), self.objective.jacobian(values, with_error)
        return self._known[1]


@dataclass(frozen=True, eq=False)
class Fit:
    """Where a fit ended.

    Attributes:
        objective: What was made small.
        vector: (P,) the parameters.
        cost: Half the sum of squares, with the prior.
        jacobian: (rows, free) of the residuals, the last rows those of the prior.
        errors: (rows, n) how far the fitted angles are from the measured ones [rad].
        evaluations: How often worlds were run.
    """

    objective: Objective
    vector: Array
    cost: float
    jacobian: Array
    errors: Array
    evaluations: int

    @property
    def information(self) -> Array:
        """Return what the data tell (free, free): the Fisher information, without the prior."""
        of_data = self.jacobian[: -len(self.objective.free)]
        return of_data.T @ of_data

    def weighed(self, objective: Objective) -> Fit:
        """Return the same fit as another objective with the same free parameters weighs it."""
        values = self.vector[objective.free]
        residuals = objective.scaled(values, self.errors)
        of_data = self.jacobian[: -len(objective.free)].reshape(*self.errors.shape, -1)
        change = (self.objective.deviation / objective.deviation)[None, :, None]
        rows = (of_data * change).reshape(-1, of_data.shape[-1])
        return replace(
            self,
            objective=objective,
            cost=0.5 * float(residuals @ residuals),
            jacobian=np.vstack([rows, self.jacobian[-len(objective.free) :]]),
        )


def fit(
    objective: Objective,
    start: Array,
    runs: int = _RUNS,
    tolerance: float = _TOLERANCE,
    derivatives: Derivatives | Array = "coarse",
) -> Fit:
    """Fit the free parameters from a start.

    Args:
        objective: What is made small.
        start: (P,) vector.
        runs: Simulations at most, without those for derivatives.
        tolerance: Part by which the sum of squares falls at least, or the fit ends.
        derivatives: How the Jacobian is computed: with the error of a step, or without; or the
            Jacobian itself, of a fit that ended near.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
    """
    optimize: Any = require_extra("scipy.optimize", "a fit to a recording", "SciPy", EXTRA)
    parameters, free = objective.parameters, objective.free
    low, high = parameters.low[free], parameters.high[free]
    margin = 1e-6 * (high - low)
    memory = _Memory(objective, derivatives)
    inside = np.clip(start[free], low + margin, high - margin)
    result = optimize.least_squares(
        memory.residuals,
        inside,
        jac=memory.jacobian,
        bounds=(low, high),
        x_scale=objective.prior_deviations,
        max_nfev=runs,
        xtol=_LEAST_STEP,
        ftol=tolerance,
    )
    of_data = np.asarray(result.fun)[: -len(free)]
    errors = of_data.reshape(-1, len(objective.deviation)) * objective.deviation
    return Fit(
        objective=objective,
        vector=objective.vector(np.asarray(result.x)),
        cost=float(result.cost),
        jacobian=np.asarray(result.jac),
        errors=errors,
        evaluations=memory.evaluations,
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
