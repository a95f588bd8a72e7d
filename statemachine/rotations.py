"""Rotations as NumPy arrays: quaternions in both orders, matrices, angles; and poses.

Everywhere in this library a quaternion is (w, x, y, z), as in MuJoCo. Backends
whose engine stores (x, y, z, w) convert at their own edge, with these functions.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

INVERSE: Array = np.array([1.0, -1.0, -1.0, -1.0])  # times a unit quaternion, its inverse


def wxyz_from_xyzw(quat: ArrayLike) -> Array:
    """Reorder quaternions (..., 4) from (x, y, z, w) to (w, x, y, z)."""
    return np.asarray(quat, dtype=np.float64)[..., [3, 0, 1, 2]]


def xyzw_from_wxyz(quat: ArrayLike) -> Array:
    """Reorder quaternions (..., 4) from (w, x, y, z) to (x, y, z, w)."""
    return np.asarray(quat, dtype=np.float64)[..., [1, 2, 3, 0]]


def times(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the products (..., 4) of quaternions (..., 4), wxyz: first `b`, then `a`."""
    (aw, ax, ay, az), (bw, bx, by, bz) = _parts(a), _parts(b)
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    return _together(w, x, y, z)


def matrix_from_quat(quat: ArrayLike) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4), wxyz."""
    w, x, y, z = _parts(quat)
    matrix = np.empty((*np.shape(quat)[:-1], 3, 3))
    matrix[..., 0, 0] = w * w + x * x - y * y - z * z
    matrix[..., 0, 1] = 2 * (x * y - w * z)
    matrix[..., 0, 2] = 2 * (x * z + w * y)
    matrix[..., 1, 0] = 2 * (x * y + w * z)
    matrix[..., 1, 1] = w * w - x * x + y * y - z * z
    matrix[..., 1, 2] = 2 * (y * z - w * x)
    matrix[..., 2, 0] = 2 * (x * z - w * y)
    matrix[..., 2, 1] = 2 * (y * z + w * x)
    matrix[..., 2, 2] = w * w - x * x - y * y + z * z
    return matrix


def cross(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the cross product (3,) of vectors (3,), in a twentieth of the time of `np.cross`."""
    ax, ay, az = np.asarray(a, dtype=np.float64).tolist()
    bx, by, bz = np.asarray(b, dtype=np.float64).tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _parts(quat: ArrayLike) -> Any:
    """Return w, x, y and z: floats of one quaternion, which are faster; arrays (...) of many."""
    array = np.asarray(quat, dtype=np.float64)
    if array.ndim == 1:
        return array.tolist()
    return array[..., 0], array[..., 1], array[..., 2], array[..., 3]


def _together(*parts: Any) -> Array:
    """Stack arrays (...) of one shape into one (..., n); faster than `np.stack`."""
    if isinstance(parts[0], float):
        return np.array(parts)
    array = np.empty((*parts[0].shape, len(parts)))
    for k, part in enumerate(parts):
        array[..., k] = part
    return array


def angle_between(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the angle [rad] of the rotation that takes matrices `a` (..., 3, 3) to `b`.

    By atan2 of sine and cosine, so that tiny angles keep their digits; the
    arccosine of the trace alone loses everything below 1e-8.
    """
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    turn = np.swapaxes(a, -1, -2) @ b
    x = turn[..., 2, 1] - turn[..., 1, 2]
    y = turn[..., 0, 2] - turn[..., 2, 0]
    z = turn[..., 1, 0] - turn[..., 0, 1]
    skew = np.stack([x, y, z], axis=-1)
    sine = np.linalg.norm(skew, axis=-1) / 2
    cosine = (np.trace(turn, axis1=-2, axis2=-1) - 1) / 2
    return np.arctan2(sine, cosine)


def rotation(axis: Array, angle: float) -> Array:
    """Return the rotation matrix about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


class Placement(NamedTuple):
    """A pose: `pos` (3,) [m], `mat` (3, 3); or many of them, (N, 3) and (N, 3, 3)."""

    pos: Array
    mat: Array

    def __matmul__(self, inner: Placement) -> Placement:
        """Return the pose `inner`, given in this frame, in the frame that this one is given in."""
        return Placement(self.pos + self.mat @ inner.pos, self.mat @ inner.mat)

    @property
    def inverse(self) -> Placement:
        """Return the inverse pose."""
        return Placement(-self.mat.T @ self.pos, self.mat.T)

    def of(self, point: Array) -> Array:
        """Return a point (3,) of this frame in the frame that this one is given in."""
        return self.pos + self.mat @ point

    def distance(self, other: Placement) -> float:
        """Return the distance between the origins [m]."""
        return float(np.linalg.norm(self.pos - other.pos))

    def angle(self, other: Placement) -> float:
        """Return the angle between the axes [rad]."""
        return float(angle_between(self.mat, other.mat))


HERE = Placement(np.zeros(3), np.eye(3))
