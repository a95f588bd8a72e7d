"""Which shape is which, and how two lie to each other."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from ...interface import Array
from ...rotations import Placement, rotation
from .records import CollisionShape

_OTHER_KIND = 100.0  # [m] worse than any distance
_ROUNDING = 1e-6  # of the largest size of an ellipsoid: two that are nearer are equal
_CORNERED = ("box", "ellipsoid")  # with three axes, each of a size of its own
_ROUND = ("cylinder", "capsule", "plane")  # about the z axis
_WITH_TWO_ENDS = ("cylinder", "capsule")  # which are alike


def _rotations_of_a_cube() -> tuple[Array, ...]:
    """Return the 24 rotations (3, 3) that lay a cube on itself, none at all first."""
    turns: list[Array] = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        axes = np.eye(3)[:, order] * signs
        if np.linalg.det(axes) > 0:
            turns.append(axes)
    return tuple(turns)


_CUBE = _rotations_of_a_cube()


def bounds_of(shape: CollisionShape) -> Array:
    """Return the least and greatest coordinates (6,) of a mesh; of another shape twice its place.

    A mesh has other frames in other files, but the same extent; of one that was not read (0,).
    """
    if shape.kind != "mesh":
        return np.tile(shape.place.pos, 2)
    if shape.points is None:
        return np.empty(0)
    return np.concatenate((shape.corners.min(axis=0), shape.corners.max(axis=0)))


def most_alike(ours: Sequence[CollisionShape], theirs: Sequence[CollisionShape]) -> dict[int, int]:
    """Return which shape of a part is which of another, both in one frame: by name, then by
    likeness.
    """
    costs = sorted((_misfit(a, b), k, i) for k, a in enumerate(ours) for i, b in enumerate(theirs))
    return one_to_one((k, i) for _, k, i in costs)


def one_to_one(
    candidates: Iterable[tuple[int, int]], known: Iterable[tuple[int, int]] = ()
) -> dict[int, int]:
    """Return the known pairs, and of the candidates, in turn, those whose ends are both left."""
    pairs = dict(known)
    for left, right in candidates:
        if left not in pairs and right not in pairs.values():
            pairs[left] = right
    return pairs


def _misfit(left: CollisionShape, right: CollisionShape) -> float:
    """Return how unlike two shapes are: of one name least, of other kinds most."""
    if left.name and left.name == right.name:
        return -1.0
    ends = bounds_of(left), bounds_of(right)
    far = float(np.linalg.norm(ends[0] - ends[1])) if len(ends[0]) == len(ends[1]) else 0.0
    if left.kind != right.kind:
        return far + _OTHER_KIND
    return far + float(np.abs(np.subtract(sorted(left.size), sorted(right.size))).sum())


def capsules_of(
    shapes: Sequence[CollisionShape],
) -> Iterator[tuple[CollisionShape, tuple[CollisionShape, CollisionShape]]]:
    """Yield each cylinder with the spheres on its ends: the capsule that a URDF has no word for."""
    for cylinder in shapes:
        ends = tuple(_ends(cylinder, shapes)) if cylinder.kind == "cylinder" else ()
        if len(ends) == 2:
            yield cylinder, ends


def _ends(cylinder: CollisionShape, shapes: Sequence[CollisionShape]) -> Iterator[CollisionShape]:
    """Yield the first sphere of the cylinder's radius at each of its ends."""
    radius, half = cylinder.size
    for sign in (-1, 1):
        end = cylinder.place.of(np.array([0.0, 0.0, sign * half]))
        for shape in shapes:
            if shape.kind != "sphere":
                continue
            is_as_wide = abs(shape.size[0] - radius) <= 1e-6 * radius
            if is_as_wide and np.linalg.norm(shape.place.pos - end) <= 1e-3 * radius:
                yield shape
                break


@dataclass(frozen=True, eq=False)
class LaidShape:
    """A shape, its axes called as those of another one that it is nearly.

    Attributes:
        place: Its frame, by these axes.
        size: Its sizes [m], by these axes.
        order: (3,) of each of these axes the one of its file that lies along it.
        axes: (3, 3) these axes in those of its file.
    """

    place: Placement
    size: tuple[float, ...]
    order: tuple[int, ...]
    axes: Array

    @property
    def is_reordered(self) -> bool:
        """Tell whether the sizes of a shape stand in another order than in its file."""
        return self.order != (0, 1, 2)

    def in_own_order(self, values: Array) -> Array:
        """Return numbers (3,) of these axes in the order of the axes of its file."""
        own = np.empty(3)
        own[list(self.order)] = values
        return own


def laid_on(
    shape: CollisionShape, other: CollisionShape, reordered_below: float = 0.25
) -> LaidShape:
    """Return another shape, its axes called as those of this one that they are nearest to.

    A solid has several frames: a box and an ellipsoid 24, in six orders of the sizes; what is round
    about an axis is the same turned about it; a plane has no middle. A box that was turned by 90
    degrees is a box that was turned, though: the sizes are put in another order where that leaves
    much less of a difference.

    Args:
        shape: A shape.
        other: The other; of another kind it is taken for one of this kind that is where it is.
        reordered_below: The part of the difference that another order of the sizes must leave less
            than.
    """
    kinds = (shape.kind, other.kind)
    axes = np.eye(3)
    if kinds[0] in _CORNERED and kinds[1] in _CORNERED:
        axes = _nearest_axes(shape, other, reordered_below)
    elif kinds[0] in _WITH_TWO_ENDS and shape.place.mat[:, 2] @ other.place.mat[:, 2] < 0:
        axes = np.diag([1.0, -1.0, -1.0])
    order = tuple(np.abs(axes).argmax(axis=0).tolist())
    size = other.size
    if len(size) == 3:
        size = tuple(size[k] for k in order)
    axes = axes @ _unseen_turn(shape, size, other.place.mat @ axes)
    pos = other.place.pos
    if kinds == ("plane", "plane"):
        normal = other.place.mat[:, 2]
        off = shape.place.pos - pos
        pos = pos + off - normal * (normal @ off)
    return LaidShape(Placement(pos, other.place.mat @ axes), size, order, axes)


def _nearest_axes(shape: CollisionShape, other: CollisionShape, reordered_below: float) -> Array:
    """Return the axes (3, 3) of a box or an ellipsoid by which it differs least from another.

    Args:
        shape: The other one.
        other: That which has the axes; they are given in its own.
        reordered_below: As of `laid_on`.
    """
    sizes = np.array(shape.size), np.array(other.size)
    weights = (np.sort(sizes[0]) + np.sort(sizes[1])) / 2
    weights = weights[sizes[0].argsort().argsort()]

    def apart(axes: Array) -> float:
        own = np.abs(axes).T @ sizes[1]
        turned = (shape.place.mat - other.place.mat @ axes) * weights
        return float(np.linalg.norm(sizes[0] - own) + np.linalg.norm(turned))

    def keeps_sizes(axes: Array) -> bool:
        return np.allclose(np.abs(axes).T @ sizes[1], sizes[1], rtol=1e-9, atol=0)

    own = min(filter(keeps_sizes, _CUBE), key=apart)
    nearest = min(_CUBE, key=apart)
    return nearest if apart(nearest) < apart(own) * reordered_below else own


def _unseen_turn(shape: CollisionShape, size: tuple[float, ...], mat: Array) -> Array:
    """Return the turn (3, 3) that brings axes nearest to those of a shape, and is not seen.

    Args:
        shape: The shape.
        size: Sizes of the other one, in the order of its axes.
        mat: (3, 3) the axes of the other one.
    """
    turn = mat.T @ shape.place.mat
    if shape.kind == "sphere":
        return turn
    if shape.kind in _ROUND:
        return _about(2, turn)
    if shape.kind == "ellipsoid" and len(size) == 3:
        x, y, z = (_are_equal(shape, size, k) for k in range(3))
        if x and y and z:
            return turn
        if x or y or z:
            return _about((x, y, z).index(True), turn)
    return np.eye(3)


def _are_equal(shape: CollisionShape, size: tuple[float, ...], axis: int) -> bool:
    """Tell whether one of two ellipsoids is round about an axis, but for rounding."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    return any(abs(sizes[i] - sizes[j]) <= _ROUNDING * max(sizes) for sizes in (shape.size, size))


def _about(axis: int, turn: Array) -> Array:
    """Return the part (3, 3) of a turn (3, 3) that is about an axis: its twist."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    angle = math.atan2(turn[j, i] - turn[i, j], turn[i, i] + turn[j, j])
    return rotation(np.eye(3)[axis], angle)
