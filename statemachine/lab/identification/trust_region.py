"""Least squares within bounds that asks for few Jacobians.

Each of them costs as many simulations as there are parameters. SciPy's trust region makes the steps
(T. Coleman and Y. Li, 1996). Between two Jacobians one is carried on by the change of the residuals
along the last step (C. Broyden, 1965).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...installed import require_extra
from ...interface import Array
from .blas_threads import EXTRA, one_blas_thread

_LEAST_STEP = 1e-5  # by the length of the vector


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
        tolerance: Part of the sum of squares that a last step takes away at most.
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
    optimize: Any = require_extra("scipy.optimize", "a fit to a recording", "SciPy", EXTRA)
    evaluated = _Evaluated(problem, effort.steps)
    bounds = (problem.low, problem.high)
    inside = np.clip(start, *bounds)
    with one_blas_thread():
        found = optimize.least_squares(
            evaluated.residuals,
            inside,
            jac=evaluated.jacobian,
            bounds=bounds,
            x_scale=problem.scale,
            max_nfev=effort.runs,
            xtol=_LEAST_STEP,
            ftol=effort.tolerance,
        )
    values, residuals = np.asarray(found.x), np.asarray(found.fun)
    return Minimum(values, residuals, np.asarray(found.jac), evaluated.runs, evaluated.jacobians)


@dataclass(frozen=True, eq=False)
class _Place:
    """Parameters, and what was evaluated there.

    Attributes:
        values: (P,) the parameters.
        residuals: (rows,) there.
    """

    values: Array
    residuals: Array


class _Evaluated:
    """Residuals and Jacobians that SciPy asks for, and how often they were computed.

    Args:
        problem: What is made small.
        steps: After how many steps the Jacobian is computed anew.
    """

    def __init__(self, problem: BoundedLeastSquares, steps: int) -> None:
        self.runs = self.jacobians = 0
        self._problem, self._steps = problem, steps
        self._age = 0  # steps since the Jacobian was computed
        self._last: _Place | None = None
        self._known: tuple[_Place, Array] | None = None  # where a Jacobian is known

    def residuals(self, values: Array) -> Array:
        """Return the residuals (rows,)."""
        return self._evaluate(values).residuals

    def jacobian(self, values: Array) -> Array:
        """Return the Jacobian (rows, P), which SciPy asks for where a step ended."""
        place = self._last
        if place is None or not np.array_equal(place.values, values):
            place = self._evaluate(values)
        if self._known is None or self._age >= self._steps:
            jacobian = self._problem.jacobian(values)
            self.jacobians, self._age = self.jacobians + 1, 0
        else:
            jacobian = self._carried_on(*self._known, place)
        self._age += 1
        self._known = place, jacobian
        return jacobian

    def _evaluate(self, values: Array) -> _Place:
        """Return a place after its residuals were computed."""
        self.runs += 1
        self._last = _Place(values.copy(), self._problem.residuals(values))
        return self._last

    def _carried_on(self, before: _Place, jacobian: Array, place: _Place) -> Array:
        """Return a Jacobian after a step along which the residuals changed as they did."""
        step = place.values - before.values
        by_scale = step / np.square(self._problem.scale)
        surprise = place.residuals - before.residuals - jacobian @ step
        return jacobian + np.outer(surprise, by_scale / (step @ by_scale))
