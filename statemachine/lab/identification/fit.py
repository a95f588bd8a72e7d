"""Fit of parameters to a recording: least squares with priors, from several starts.

The sum of squares is that of the residuals by their standard deviation, and of the distance from
the prior by its own (maximum a posteriori, A. Tarantola, Inverse Problem Theory, 2005). It is
minimised by SciPy's trust region (T. Coleman and Y. Li, 1996); each Jacobian is one run of as many
worlds as there are parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...installed import require_extra
from ...interface import Array, Ints
from .parameters import ArmParameters
from .simulation import ArmSimulation

EXTRA = "recordings"
_COARSE_RUNS = 12  # simulations of all worlds of a start, before angles without the step's error
_FINE_RUNS = 12
_COARSE_TOLERANCE = 2e-2  # of the sum of squares, where a fit goes on without the step's error
_TOLERANCE = 1e-5
_NEAR = 0.05  # of the prior's standard deviations: the Jacobian is taken to be the same there
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

    def coarse(self, values: Array) -> tuple[Array, Array]:
        """Return residuals and their Jacobian, with coarse steps."""
        steps = self.parameters.steps[self.free]
        vectors = np.tile(self.vector(values), (len(self.free) + 1, 1))
        vectors[np.arange(1, len(vectors)), self.free] += steps
        angles = self.simulation.angles_of_each(vectors)
        first = self.simulation.first_frame
        change = (angles[1:, first:] - angles[0, first:]) / self.deviation
        of_data = (change / steps[:, None, None]).reshape(len(self.free), -1).T
        of_data = np.where(np.isfinite(of_data), of_data, 0.0)
        of_prior = np.diag(1.0 / self.prior_deviations)
        return self.residuals(values, angles[0]), np.vstack([of_data, of_prior])


class _Memory:
    """Residuals and Jacobian of the last point, which SciPy asks for one after the other."""

    def __init__(self, objective: Objective, fine: bool) -> None:
        """Remember nothing yet.

        Args:
            objective: What is made small.
            fine: Whether residuals are those without the error of a step.
        """
        self.objective, self.fine = objective, fine
        self.evaluations = 0
        self._values: Array | None = None
        self._known: tuple[Array, Array] | None = None

    def residuals(self, values: Array) -> Array:
        if self.fine:
            self.evaluations += 1
            vector = self.objective.vector(values)
            return self.objective.residuals(values, self.objective.simulation.angles(vector))
        return self._of(values)[0]

    def jacobian(self, values: Array) -> Array:
        if self.fine and self._known is not None and self._values is not None:
            moved = np.abs(values - self._values) / self.objective.prior_deviations
            if moved.max() < _NEAR:
                return self._known[1]
        return self._of(values)[1]

    def _of(self, values: Array) -> tuple[Array, Array]:
        known = self._values
        if self._known is None or known is None or not np.array_equal(values, known):
            self.evaluations += 1
            self._values, self._known = values.copy(), self.objective.coarse(values)
        return self._known


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


def fit(objective: Objective, start: Array, fine: bool = True, runs: int = _COARSE_RUNS) -> Fit:
    """Fit the free parameters from a start.

    Args:
        objective: What is made small.
        start: (P,) vector.
        fine: Whether it ends with angles that have no error of a step.
        runs: Simulations of all worlds with coarse steps, at most.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
    """
    values = start[objective.free]
    coarse = _Memory(objective, fine=False)
    values, jacobian = _minimised(coarse, values, runs, _COARSE_TOLERANCE)
    evaluations = coarse.evaluations
    if fine:
        memory = _Memory(objective, fine=True)
        values, jacobian = _minimised(memory, values, _FINE_RUNS, _TOLERANCE)
        evaluations += memory.evaluations
    vector = objective.vector(values)
    angles = (
        objective.simulation.angles(vector)
        if fine
        else objective.simulation.angles_of_each(vector[None])[0]
    )
    residuals = objective.residuals(values, angles)
    return Fit(
        objective=objective,
        vector=vector,
        cost=0.5 * float(residuals @ residuals),
        jacobian=jacobian,
        errors=objective.errors(angles),
        evaluations=evaluations,
    )


def _minimised(memory: _Memory, values: Array, runs: int, tolerance: float) -> tuple[Array, Array]:
    """Return the values at the end of a fit, and the Jacobian there."""
    optimize: Any = require_extra("scipy.optimize", "a fit to a recording", "SciPy", EXTRA)
    parameters, free = memory.objective.parameters, memory.objective.free
    low, high = parameters.low[free], parameters.high[free]
    margin = 1e-6 * (high - low)
    result = optimize.least_squares(
        memory.residuals,
        np.clip(values, low + margin, high - margin),
        jac=memory.jacobian,
        bounds=(low, high),
        x_scale=parameters.deviations[free],
        max_nfev=runs,
        xtol=_TOLERANCE,
        ftol=tolerance,
    )
    return np.asarray(result.x), np.asarray(result.jac)


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
    angles = objective.simulation.angles_of_each(drawn)
    costs = [
        float(np.square(objective.residuals(vector[objective.free], angles[i])).sum())
        for i, vector in enumerate(drawn)
    ]
    return [drawn[place] for place in np.argsort(costs, kind="stable")[:starts]]
