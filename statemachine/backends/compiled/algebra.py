"""Small dense algebra by MuJoCo's functions: the same bits on every processor of a kind.

They were compiled once, for all, where a BLAS chooses its kernels by the processor.
"""

from __future__ import annotations

import mujoco
import numpy as np

from ...interface import Array

_TINY = 1e-15  # smallest pivot


def times(matrix: Array, vector: Array) -> Array:
    """Return the product (n,) of a matrix (n, m) and a vector (m,)."""
    product = np.empty(len(matrix))
    mujoco.mju_mulMatVec(product, matrix, vector)
    return product


def product(left: Array, right: Array) -> Array:
    """Return the product (n, k) of matrices (n, m) and (m, k)."""
    result = np.empty((len(left), right.shape[1]))
    mujoco.mju_mulMatMat(result, left, right)
    return result


def dot(left: Array, right: Array) -> float:
    """Return the product of two vectors (n,)."""
    return mujoco.mju_dot(left, right)


def factored(matrix: Array) -> Array:
    """Return Cholesky's factor of a positive definite matrix (n, n), whose place it takes."""
    mujoco.mju_cholFactor(matrix, _TINY)
    return matrix


def solved(factor: Array, right: Array) -> Array:
    """Return the solution (n,) for a right-hand side (n,), whose place it takes."""
    mujoco.mju_cholSolve(right, factor, right)
    return right


def quat_of_matrix(matrix: Array) -> Array:
    """Return the quaternion (4,), wxyz, of a rotation matrix (9,)."""
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, matrix)
    return quat


def principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Return the moments (3,) [kg m²] of an inertia (3, 3), and the quaternion (4,) of its axes.

    The largest moment is the first, as in MuJoCo's compiler.
    """
    moments, axes, quat = np.empty(3), np.empty(9), np.empty(4)
    mujoco.mju_eig3(moments, axes, quat, np.ravel(inertia))
    return moments, quat
