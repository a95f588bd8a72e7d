"""Shapes as triangles: the primitives of MuJoCo, height fields, and welding.

Every face is wound so that its normal, by the right hand, points outward. Sizes are
MuJoCo's: half of a box's edges, half of a cylinder's length (XML reference, `geom/size`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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

    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float32), ("faces", np.int32)):
            array = np.array(getattr(self, name), dtype=kind).reshape(-1, 3)
            array.setflags(write=False)
            vars(self)[name] = array


def box(size: Sequence[float]) -> Surface:
    """A box; `size` are half of its edges."""
    faces = [triangle for a, b, c, d in _BOX for triangle in ((a, b, c), (a, c, d))]
    return _shape(_CORNERS * np.asarray(size)[:3], faces)


def rectangle(half_x: float, half_y: float) -> Surface:
    """A rectangle in the plane z = 0, seen from above."""
    corners = [(-half_x, -half_y, 0), (half_x, -half_y, 0), (half_x, half_y, 0)]
    return _shape([*corners, (-half_x, half_y, 0)], [(0, 1, 2), (0, 2, 3)])


def ellipsoid(size: Sequence[float], around: int = AROUND) -> Surface:
    """An ellipsoid; `size` are its semi-axes. A sphere has three equal ones."""
    turn = np.linspace(0, np.pi, around // 2 + 1)
    unit = lathe(np.sin(turn), -np.cos(turn), around)
    return _shape(unit.vertices * np.asarray(size)[:3], unit.faces)


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
    radius, height = np.asarray(radii)[1:-1], np.asarray(heights)
    angle = 2 * np.pi * np.arange(around) / around
    rings = np.empty((len(radius), around, 3))
    rings[..., 0] = radius[:, None] * np.cos(angle)
    rings[..., 1] = radius[:, None] * np.sin(angle)
    rings[..., 2] = height[1:-1, None]
    here = np.arange(around)
    after = (here + 1) % around
    faces = [np.stack([np.zeros_like(here), after + 1, here + 1], axis=1)]
    for low in range(1, 1 + (len(radius) - 1) * around, around):
        high = low + around
        faces.append(np.stack([low + here, low + after, high + after], axis=1))
        faces.append(np.stack([low + here, high + after, high + here], axis=1))
    last = 1 + (len(radius) - 1) * around
    top = np.full_like(here, last + around)
    faces.append(np.stack([last + here, last + after, top], axis=1))
    poles = np.array([(0, 0, height[0])]), np.array([(0, 0, height[-1])])
    return _shape(np.concatenate([poles[0], rings.reshape(-1, 3), poles[1]]), np.concatenate(faces))


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
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:],
                                      number[1:, :-1]))  # fmt: skip
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return _shape(np.stack([x, y, z], axis=-1).reshape(-1, 3), faces)


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


def _shape(vertices: ArrayLike, faces: ArrayLike) -> Surface:
    return Surface(np.asarray(vertices, np.float32), np.asarray(faces, np.int32))
