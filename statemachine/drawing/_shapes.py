"""Shapes as triangles: the primitives of MuJoCo, height fields, and welding.

Every face is wound so that its normal, by the right hand, points outward. Sizes are
MuJoCo's: half of a box's edges, half of a cylinder's length (XML reference, `geom/size`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

AROUND = 32  # corners of a circle
_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
_BOX = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of triangles; read-only.

    Attributes:
        vertices: (v, 3) float32 [m].
        faces: (f, 3) int32, numbers of vertices.
    """

    vertices: NDArray[Any]
    faces: NDArray[Any]

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float32), ("faces", np.int32)):
            array = np.array(getattr(self, name), dtype=kind).reshape(-1, 3)
            array.setflags(write=False)
            vars(self)[name] = array


def box(size: Sequence[float]) -> Surface:
    """A box; `size` are half of its edges."""
    faces = [triangle for a, b, c, d in _BOX for triangle in ((a, b, c), (a, c, d))]
    return Surface(_CORNERS * np.asarray(size)[:3], np.array(faces))


def rectangle(half_x: float, half_y: float) -> Surface:
    """A rectangle in the plane z = 0, seen from above."""
    return terrain(np.zeros((2, 2)), half_x, half_y)


def ellipsoid(size: Sequence[float], around: int = AROUND) -> Surface:
    """An ellipsoid; `size` are its semi-axes. A sphere has three equal ones."""
    turn = np.linspace(0, np.pi, around // 2 + 1)
    unit = lathe(np.sin(turn), -np.cos(turn), around)
    return Surface(unit.vertices * np.asarray(size)[:3], unit.faces)


def cylinder(radius: float, half: float, around: int = AROUND) -> Surface:
    """A cylinder along z of length 2·`half`."""
    return lathe([0, radius, radius, 0], [-half, -half, half, half], around)


def capsule(radius: float, half: float, around: int = AROUND) -> Surface:
    """A cylinder along z of length 2·`half`, with half a ball at each end."""
    turn = np.linspace(0, np.pi / 2, max(around // 4, 2) + 1)
    out, up = radius * np.sin(turn), radius * np.cos(turn) + half
    return lathe([*out, *out[::-1]], [*-up, *up[::-1]], around)


def lathe(radii: ArrayLike, heights: ArrayLike, around: int = AROUND) -> Surface:
    """A profile turned about z, from its lower end on the axis to its upper one.

    Args:
        radii: (n,) distances from the axis [m]; the first and the last are the poles.
        heights: (n,) heights [m].
        around: Corners of a full turn.
    """
    radius, height = np.array(radii, dtype=float), np.asarray(heights)
    radius[[0, -1]] = 0  # exactly: each pole is one point
    angle = 2 * np.pi * np.arange(around) / around
    rings = np.empty((len(radius), around, 3))
    rings[..., 0] = radius[:, None] * np.cos(angle)
    rings[..., 1] = radius[:, None] * np.sin(angle)
    rings[..., 2] = height[:, None]
    number = np.arange(len(radius) * around).reshape(-1, around)
    return welded(rings, _triangles(np.column_stack([number, number[:, 0]])))


def terrain(heights: ArrayLike, half_x: float, half_y: float) -> Surface:
    """The upper side of a height field.

    Args:
        heights: (rows, columns) [m]; columns go along x, rows along y.
        half_x: Half of its extent in x [m].
        half_y: Half of its extent in y [m].
    """
    z = np.asarray(heights)
    rows, columns = z.shape
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    return Surface(np.stack([x, y, z], axis=-1), _triangles(np.arange(z.size).reshape(z.shape)))


def _triangles(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Two triangles for each square of a grid of numbered points (rows, columns)."""
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def welded(vertices: ArrayLike, faces: ArrayLike) -> Surface:
    """The same surface with every point there once, and without faces of no area.

    Args:
        vertices: (v, 3) [m]; points that are equal as float32 become one.
        faces: (f, 3) numbers of vertices.
    """
    points = np.asarray(vertices, dtype=np.float32).reshape(-1, 3) + np.float32(0)  # no -0
    unique, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[np.asarray(faces).reshape(-1, 3)]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Surface(unique[used], renumbered.reshape(-1, 3).astype(np.int32))
