"""Small dense algebra that gives the same bits on every processor of a kind.

NumPy's products and solutions go through a BLAS that chooses its kernels by the
processor, and their last bits differ. MuJoCo's functions were compiled once, for all.
They are also as quick, at these sizes.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from ..interface import Array

_TINY = 1e-15  # smallest pivot


def times(matrix: Array, vector: Array) -> Array:
    """The product (n,) of a matrix (n, m) and a vector (m,)."""
    product = np.empty(len(matrix))
    mujoco.mju_mulMatVec(product, matrix, vector)
    return product


def product(left: Array, right: Array) -> Array:
    """The product (n, k) of matrices (n, m) and (m, k)."""
    found = np.empty((len(left), right.shape[1]))
    mujoco.mju_mulMatMat(found, left, right)
    return found


def dot(left: Array, right: Array) -> float:
    """The product of two vectors (n,)."""
    return mujoco.mju_dot(left, right)


def factored(matrix: Array) -> Array:
    """Cholesky's factor of a positive definite matrix (n, n), which it takes the place of."""
    mujoco.mju_cholFactor(matrix, _TINY)
    return matrix


def solved(factor: Array, right: Array) -> Array:
    """The solution (n,) for a right-hand side (n,), which it takes the place of."""
    mujoco.mju_cholSolve(right, factor, right)
    return right


def inverse_rows(factor: Array, rows: NDArray[np.intp]) -> Array:
    """Rows (k,) of the inverse, (k, n), of the matrix that was factored."""
    found = np.zeros((len(rows), len(factor)))
    found[np.arange(len(rows)), rows] = 1.0
    for row in found:
        solved(factor, row)
    return found
