"""Which shape is which, and how two lie to each other."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from ...interface import Array
from ...rotations import Placement, rotation
from .records import CollisionShape

_OTHER_KIND = 100.0  # [m] worse than any distance


def bounds_of(shape: CollisionShape) -> Array:
    """Least and greatest coordinates (6,) of a mesh; of another shape twice its place.

    A mesh has other frames in other files, but the same extent; of one that was not read (0,).
    """
    if shape.kind != "mesh":
        return np.tile(shape.place.pos, 2)
    if shape.points is None:
        return np.empty(0)
    return np.concatenate((shape.corners.min(axis=0), shape.corners.max(axis=0)))


def likest(ours: Sequence[CollisionShape], theirs: Sequence[CollisionShape]) -> dict[int, int]:
    """Which shape of a part is which of another, both in one frame: by name, then by likeness."""
    costs = sorted((_misfit(a, b), k, i) for k, a in enumerate(ours) for i, b in enumerate(theirs))
    return one_to_one((k, i) for _, k, i in costs)


def one_to_one(
    candidates: Iterable[tuple[int, int]], known: Iterable[tuple[int, int]] = ()
) -> dict[int, int]:
    """Known pairs, and of the candidates, in turn, those whose ends are both left."""
    pairs = dict(known)
    for left, right in candidates:
        if left not in pairs and right not in pairs.values():
            pairs[left] = right
    return pairs


def _misfit(left: CollisionShape, right: CollisionShape) -> float:
    """How unlike two shapes are: of one name least, of other kinds most."""
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


def laid_on(shape: CollisionShape, other: CollisionShape) -> CollisionShape:
    """The other box with its axes called as this one's: one solid has six such names."""
    if shape.kind != other.kind or shape.kind not in ("box", "ellipsoid"):
        return other
    most = float(np.linalg.norm(shape.size)) or 1.0

    def turned(order: tuple[int, ...]) -> CollisionShape:
        mat = other.place.mat[:, order].copy()
        mat[:, 2] = np.cross(mat[:, 0], mat[:, 1])  # right-handed; a box has no inside out
        size = tuple(other.size[k] for k in order)
        return replace(other, place=Placement(other.place.pos, mat), size=size)

    def unlike(box: CollisionShape) -> float:
        sizes = np.subtract(shape.size, box.size)
        return float(np.linalg.norm(sizes)) / most + angle_between(shape, box)

    return min(map(turned, permutations(range(3))), key=unlike)


def angle_between(shape: CollisionShape, other: CollisionShape) -> float:
    """Angle [rad] between two shapes of a kind, what their symmetry hides apart."""
    a, b = shape.place.mat, other.place.mat
    if shape.kind == "sphere":
        return 0.0
    if shape.kind in ("cylinder", "capsule", "plane"):
        along = float(a[:, 2] @ b[:, 2])
        across = float(np.linalg.norm(np.cross(a[:, 2], b[:, 2])))
        return math.atan2(across, along if shape.kind == "plane" else abs(along))
    halves = (0.0, math.pi) if shape.kind in ("box", "ellipsoid") else (0.0,)
    sines = [
        float(np.linalg.norm(a @ rotation(axis, half) - b)) / math.sqrt(8)
        for axis in np.eye(3)
        for half in halves
    ]
    return 2 * math.asin(min(1.0, *sines))
