"""Differences of a pair of rigid parts in what they touch with, and how."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from ...description.match import Pair
from ...description.meshes import extent
from ...description.records import CollisionShape
from ...description.tree import GroupTree
from ...interface import Array
from ...rotations import Placement, rotation
from .ledger import Ledger

_AXES = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
_SIDES = ("+x", "-x", "+y", "-y", "+z", "-z")


def compare(book: Ledger, pair: Pair, one: GroupTree, two: GroupTree, reach: float) -> None:
    """Their share is that of how far they stand out, against the robot's reach."""
    where = pair.one.name
    ours = [replace(s, place=pair.align @ s.place) for s in pair.one.shapes]
    theirs = list(pair.two.shapes)
    if not ours and not theirs:
        return
    counts = _count(ours), _count(theirs)
    if counts[0] != counts[1]:
        book.differ(
            "shapes",
            where,
            "shapes",
            counts[0],
            counts[1],
            "",
            None,
            1.0 if not (ours and theirs) else 0.5,
        )
    solid = [[s for s in each if s.kind != "plane"] for each in (ours, theirs)]
    if all(solid):
        _boxes(book, where, solid[0], solid[1], reach)
        volumes = [_volume(each) for each in solid]
        if None not in volumes:
            a, b = float(volumes[0] or 0), float(volumes[1] or 0)
            size = book.same("shapes", where, a, b, "m³", slack=16)
            if size is not None:
                share = min(0.5, size / max(a, b))
                book.differ("shapes", where, "volume", a, b, "m³", size, share)
    _each(book, where, ours, theirs, reach, one, two)


def _count(shapes: Sequence[CollisionShape]) -> str:
    found = Counter(shape.kind for shape in shapes)
    plural = {"box": "boxes", "mesh": "meshes"}
    words = (f"{n} {k if n == 1 else plural.get(k, k + 's')}" for k, n in sorted(found.items()))
    return ", ".join(words) or "none"


def _volume(shapes: Sequence[CollisionShape]) -> float | None:
    """Sum of the volumes, what they share counted twice; None if one is not known."""
    volumes = [shape.volume for shape in shapes]
    return None if None in volumes else sum(v for v in volumes if v is not None)


def _boxes(
    book: Ledger,
    where: str,
    ours: Sequence[CollisionShape],
    theirs: Sequence[CollisionShape],
    reach: float,
) -> None:
    """How far the shapes reach along the axes of the link."""
    sides = []
    for shapes in (ours, theirs):
        reaches = [[extent(shape, axis) for shape in shapes] for axis in _AXES]
        if any(each is None for row in reaches for each in row):
            return
        sides.append([max(e for e in row if e is not None) for row in reaches])
    apart = np.abs(np.subtract(*sides))
    size = float(apart.max())
    if size > 4 * book.tolerance * reach:
        side = int(apart.argmax())
        a, b = (float(sign * each[side]) for each in sides for sign in ((1, -1)[side % 2],))
        book.differ("shapes", where, f"ends at {_SIDES[side]}", a, b, "m", size, size / reach)
    else:
        book.agree("shapes", where, size, size / reach, "m")


def _each(
    book: Ledger,
    where: str,
    ours: list[CollisionShape],
    theirs: list[CollisionShape],
    reach: float,
    one: GroupTree,
    two: GroupTree,
) -> None:
    """Shapes one by one, each with that of its kind and name, or else of its kind and place."""
    rest = list(theirs)
    frictions: dict[tuple[object, object, str], list[str]] = {}
    for shape in ours:
        alike = [each for each in rest if each.kind == shape.kind]
        if not alike:
            continue
        named = [each for each in alike if each.name and each.name == shape.name]
        other = min(named or alike, key=lambda each: _misfit(shape, each))
        rest.remove(other)
        other = _laid_on(shape, other)
        label = f"{where}: {shape.name or other.name or shape.kind}"
        if shape.size and other.size:
            size = book.same("shapes", label, shape.size, other.size, "m", slack=2)
            if size is not None:
                book.differ(
                    "shapes", label, "size", shape.size, other.size, "m", size, size / reach
                )
        if shape.kind != "mesh" or (shape.points is not None and other.points is not None):
            _place(book, label, shape, other, reach)
        _contact(label, shape, other, one, two, frictions)
    for (a, b, figure), labels in frictions.items():
        label = labels[0] if len(labels) == 1 else f"{where}: {len(labels)} shapes"
        values = (a, b)
        size = share = None
        if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
            size = float(np.linalg.norm(np.subtract(a, b)))
            share = size / max(float(np.linalg.norm(a)), float(np.linalg.norm(b)), 1e-300)
        book.differ("contact", label, figure, *values, "", size, 0.5 if share is None else share)  # pyright: ignore[reportArgumentType]


def _laid_on(shape: CollisionShape, other: CollisionShape) -> CollisionShape:
    """The other box with its axes called as this one's: one solid has six such names."""
    if shape.kind not in ("box", "ellipsoid"):
        return other
    choices = []
    for order in permutations(range(3)):
        mat = other.place.mat[:, order].copy()
        mat[:, 2] = np.cross(mat[:, 0], mat[:, 1])  # right-handed; a box has no inside out
        size = tuple(other.size[k] for k in order)
        turned = replace(other, place=Placement(other.place.pos, mat), size=size)
        most = float(np.linalg.norm(shape.size)) or 1.0
        apart = float(np.linalg.norm(np.subtract(shape.size, size))) / most
        choices.append((apart + _turn(shape, turned), turned))
    return min(choices, key=lambda each: each[0])[1]


def _misfit(one: CollisionShape, two: CollisionShape) -> float:
    far = _centre_apart(one, two)
    if len(one.size) == len(two.size):
        far += float(np.linalg.norm(np.subtract(sorted(one.size), sorted(two.size))))
    return far


def _middle(shape: CollisionShape) -> Array | None:
    """The middle of a mesh's extent, for which every file may have another frame."""
    if shape.kind != "mesh":
        return shape.place.pos
    if shape.points is None:
        return None
    reaches = [extent(shape, axis) or 0.0 for axis in _AXES]
    return np.array([(reaches[k] - reaches[k + 1]) / 2 for k in (0, 2, 4)])


def _centre_apart(one: CollisionShape, two: CollisionShape) -> float:
    a, b = _middle(one), _middle(two)
    return 0.0 if a is None or b is None else float(np.linalg.norm(a - b))


def _place(
    book: Ledger, label: str, shape: CollisionShape, other: CollisionShape, reach: float
) -> None:
    """Where a shape is: its middle, and how it is turned, as far as that shows."""
    far = _centre_apart(shape, other)
    a, b = _middle(shape), _middle(other)
    if far > 4 * book.tolerance * reach and a is not None and b is not None:
        values = tuple(map(float, a)), tuple(map(float, b))
        book.differ("shapes", label, "middle", *values, "m", far, far / reach)
    else:
        book.agree("shapes", label, far, far / reach, "m")
    turn = _turn(shape, other)
    if turn > 8 * book.tolerance * math.pi:
        book.differ("shapes", label, "turned", None, None, "rad", turn, turn / math.pi / 10)


def _turn(shape: CollisionShape, other: CollisionShape) -> float:
    """Angle [rad] between two shapes of a kind, what their symmetry hides apart."""
    a, b = shape.place.mat, other.place.mat
    if shape.kind in ("sphere", "mesh"):
        return 0.0
    if shape.kind in ("cylinder", "capsule"):
        return math.atan2(
            float(np.linalg.norm(np.cross(a[:, 2], b[:, 2]))), abs(float(a[:, 2] @ b[:, 2]))
        )
    if shape.kind == "plane":
        return math.atan2(
            float(np.linalg.norm(np.cross(a[:, 2], b[:, 2]))), float(a[:, 2] @ b[:, 2])
        )
    best = math.pi
    for axis in np.eye(3):
        for half in (0.0, math.pi):
            turned = a @ rotation(axis, half)
            sine = float(np.linalg.norm(turned - b)) / math.sqrt(8)
            best = min(best, 2 * math.asin(min(1.0, sine)))
    return best


def _contact(
    label: str,
    shape: CollisionShape,
    other: CollisionShape,
    one: GroupTree,
    two: GroupTree,
    found: dict[tuple[object, object, str], list[str]],
) -> None:
    """Friction and the other settings; where one does not say, what its engine would take."""
    usual = one.robot.touch or two.robot.touch
    a: dict[str, tuple[float, ...] | None] = {"friction": shape.friction, **shape.contact}
    b: dict[str, tuple[float, ...] | None] = {"friction": other.friction, **other.contact}
    for name in dict.fromkeys((*a, *b)):
        mine, theirs = a.get(name), b.get(name)
        if mine == theirs:
            continue
        if mine is None or theirs is None:
            said = mine if mine is not None else theirs
            if said == usual.get(name):
                continue
        found.setdefault((mine, theirs, name), []).append(label)
