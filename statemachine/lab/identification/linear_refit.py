"""Where a fit would end if its angles were a little otherwise, by its Jacobian alone.

One Gauss-Newton step from the best fit: no simulation is needed, and a hundred small changes of
the angles are tried in the time of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array
from .blas_threads import one_blas_thread
from .fit import Fit
from .residuals import root_mean_square
from .simulation import ArmSimulation


@dataclass(frozen=True, eq=False)
class RefitEnd:
    """Where such a fit ends.

    Attributes:
        cost: Half the sum of squares, with the prior.
        residual: Root mean square of what is left [rad].
        shift: (free,) by how much the parameters move.
    """

    cost: float
    residual: float
    shift: Array


@dataclass(frozen=True, eq=False)
class LinearRefit:
    """A fit, as a linear problem about where it ended.

    Attributes:
        fit: Where it ended.
        residuals: (rows * n + free,) of it, with the prior.
        basis: (rows * n + free, free) orthonormal columns: what the parameters can change.
        triangle: (free, free) the Jacobian in terms of these.
    """

    fit: Fit
    residuals: Array
    basis: Array
    triangle: Array

    @classmethod
    def of(cls, fit: Fit) -> LinearRefit:
        """Return the linear problem of a fit."""
        values = fit.vector[fit.objective.free]
        jacobian = fit.jacobian
        with one_blas_thread():
            basis, triangle = np.linalg.qr(jacobian)
        return cls(fit, fit.objective.residuals_of_errors(values, fit.errors), basis, triangle)

    @property
    def cost(self) -> float:
        """Return half the sum of squares where the angles stay as they are."""
        left = self.left(self.residuals)
        return 0.5 * float(left @ left)

    def change_with(self, other: ArmSimulation) -> Array:
        """Return by how much the angles (rows, n) change with another simulation [rad]."""
        fit = self.fit
        return fit.objective.errors(other.angles(fit.vector)) - fit.errors

    def end(self, change: Array) -> RefitEnd:
        """Return where the fit ends if the angles change.

        Args:
            change: (rows, n) of the angles [rad].
        """
        added = self.by_noise(change)
        left = self.left(self.residuals + added)
        errors = left[: change.size].reshape(change.shape) * self.fit.objective.deviation
        shift = -np.asarray(np.linalg.solve(self.triangle, self.basis.T @ added), np.float64)
        return RefitEnd(0.5 * float(left @ left), root_mean_square(errors), shift)

    def by_noise(self, change: Array) -> Array:
        """Return a change of the angles (rows, n) [rad] as one of all residuals."""
        by_noise = np.zeros_like(self.residuals)
        by_noise[: change.size] = (change / self.fit.objective.deviation).ravel()
        return by_noise

    def left(self, residuals: Array) -> Array:
        """Return what is left of residuals once the parameters are fitted anew."""
        return residuals - self.basis @ (self.basis.T @ residuals)
