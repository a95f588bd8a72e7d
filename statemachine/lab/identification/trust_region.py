"""Least squares within bounds that asks for few Jacobians, each of which costs as many simulations
as there are parameters.

Each step minimises the quadratic model of the sum of squares within a trust region and the bounds
(J. Nocedal and S. Wright, Numerical Optimization, 2006, chapters 4 and 10). Between two Jacobians
one is carried on by the change of the residuals along the last step (C. Broyden, 1965). A step
decomposes a matrix of the size of the parameters, and never the Jacobian with all its rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...installed import require_extra
from ...interface import Array

EXTRA = "recordings"
_LEAST_STEP = 1e-4  # of the scale: a shorter one is none
_POOR, _GOOD = 0.25, 0.75  # of what was predicted: the region shrinks, and grows
_TOO_LONG = 1.05  # of the radius: a step of this length is short enough
_NEWTON_STEPS = 20  # for the damping of a step


@dataclass(frozen=True, eq=False)
class BoundedLeastSquares:
    """A sum of squares that is made small.

    Attributes:
        residuals: Of parameters (P,), (rows,).
        jacobian: Of parameters (P,), (rows, P).
        low, high: (P,) the bounds.
        scale: (P,) how far the parameters are expected to change.
    """

    residuals: Callable[[Array], Array]
    jacobian: Callable[[Array], Array]
    low: Array
    high: Array
    scale: Array


@dataclass(frozen=True)
class Effort:
    """How long a minimum is looked for.

    Attributes:
        runs: Evaluations of the residuals at most.
        tolerance: Part of the sum of squares that a last step promises at most.
        steps: After how many steps the Jacobian is computed anew.
    """

    runs: int
    tolerance: float
    steps: int


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where a search ended.

    Attributes:
        values: (P,) the parameters.
        residuals: (rows,) there.
        jacobian: (rows, P), carried on to there.
        runs: How often residuals were evaluated.
        jacobians: How often Jacobians were.
    """

    values: Array
    residuals: Array
    jacobian: Array
    runs: int
    jacobians: int


def minimum(problem: BoundedLeastSquares, start: Array, effort: Effort) -> Minimum:
    """Return a minimum of the sum of squares.

    Args:
        problem: What is made small.
        start: (P,) parameters; the nearest within the bounds are taken.
        effort: When the search ends.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
    """
    scale = problem.scale
    low, high = problem.low / scale, problem.high / scale
    place = np.clip(start / scale, low, high)
    residuals, jacobian = problem.residuals(place * scale), problem.jacobian(place * scale) * scale
    runs, jacobians, age = 1, 1, 0
    radius = max(1.0, float(np.linalg.norm(place)))
    while runs < effort.runs:
        model = _QuadraticModel(jacobian.T @ jacobian, jacobian.T @ residuals)
        step = model.step(low - place, high - place)
        is_last = model.decrease(step) < effort.tolerance * _cost(residuals)
        if np.linalg.norm(step) > radius:
            step = model.step(low - place, high - place, model.damping(radius))
        length = float(np.linalg.norm(step))
        if length < _LEAST_STEP:
            break
        promised = model.decrease(step)
        next_place = np.clip(place + step, low, high)
        next_residuals = problem.residuals(next_place * scale)
        runs += 1
        decrease = _cost(residuals) - _cost(next_residuals)
        if decrease < _POOR * promised:
            radius = _POOR * length
        elif decrease > _GOOD * promised and length > 0.9 * radius:
            radius *= 2.0
        if decrease > 0.0:
            surprise = next_residuals - residuals - jacobian @ step
            jacobian = jacobian + np.outer(surprise, step / length**2)
            place, residuals, age = next_place, next_residuals, age + 1
        if is_last and (decrease > 0.0 or age == 0):
            break
        if age >= effort.steps or (age > 0 and decrease <= 0.0):
            jacobian = problem.jacobian(place * scale) * scale
            jacobians, age = jacobians + 1, 0
    return Minimum(place * scale, residuals, jacobian / scale, runs, jacobians)


def _cost(residuals: Array) -> float:
    """Return half the sum of squares."""
    return 0.5 * float(residuals @ residuals)


@dataclass(frozen=True, eq=False)
class _QuadraticModel:
    """What half the sum of squares is taken to be near a place.

    Attributes:
        curvature: (P, P).
        gradient: (P,).
    """

    curvature: Array
    gradient: Array

    def decrease(self, step: Array) -> float:
        """Return by how much a step (P,) makes it smaller."""
        return -float(self.gradient @ step + 0.5 * step @ self.curvature @ step)

    def step(self, low: Array, high: Array, damping: float = 0.0) -> Array:
        """Return the step (P,) that makes it smallest within bounds."""
        optimize: Any = require_extra("scipy.optimize", "a fit to a recording", "SciPy", EXTRA)
        damped = self.curvature + damping * np.eye(len(self.gradient))
        lower = np.linalg.cholesky(damped)
        target = -np.linalg.solve(lower, self.gradient)
        found = optimize.lsq_linear(lower.T, target, bounds=(low, high), method="bvls")
        return np.asarray(found.x)

    def damping(self, radius: float) -> float:
        """Return what is added to the curvature, so that a step without bounds has this length.

        By Newton's method from no damping (J. Moré and D. Sorensen, 1983), which gives steps that
        are too long until it ends.
        """
        damping = 0.0
        for _ in range(_NEWTON_STEPS):
            lower = np.linalg.cholesky(self.curvature + damping * np.eye(len(self.gradient)))
            step = np.linalg.solve(lower.T, np.linalg.solve(lower, self.gradient))
            length = float(np.linalg.norm(step))
            if length <= _TOO_LONG * radius:
                break
            slope = float(np.linalg.norm(np.linalg.solve(lower, step)))
            damping += (length / slope) ** 2 * (length / radius - 1.0)
        return damping
