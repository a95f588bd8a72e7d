"""How MJCF writes a place: pos, and one of several ways to give an orientation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import numpy as np

from ..errors import ModelError
from ..rotations import Array, matrix_from_quat, times

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Compiler(NamedTuple):
    """What <compiler> says of angles, and whether free bodies are aligned with their inertia."""

    degrees: bool
    eulerseq: str
    aligned: bool


class Place:
    """A frame in another: `pos` (3,) [m] and `quat` (4,), wxyz, of length one."""

    __slots__ = ("pos", "quat")
    IDENTITY: ClassVar[Place]

    def __init__(self, pos: Array, quat: Array) -> None:
        self.pos = pos
        self.quat = quat

    @property
    def turn(self) -> Array:
        """The rotation matrix (3, 3)."""
        return matrix_from_quat(self.quat)

    @property
    def is_identity(self) -> bool:
        """Whether it changes nothing."""
        return not self.pos.any() and not self.quat[1:].any()

    def carry(self, point: Array) -> Array:
        """A point (3,) of this frame, in the other."""
        return self.pos + self.turn @ point

    def __matmul__(self, inner: Place) -> Place:
        """Where a place in this frame is, in the other."""
        quat = times(self.quat, inner.quat)
        return Place(self.carry(inner.pos), quat / np.linalg.norm(quat))


Place.IDENTITY = Place(np.zeros(3), np.array([1.0, 0, 0, 0]))


def numbers(text: str, count: int) -> Array:
    """The numbers of an attribute.

    Raises:
        ModelError: They are not `count`, or no finite numbers.
    """
    try:
        found = np.array([float(word) for word in text.split()])
    except ValueError:
        found = np.empty(0)
    if found.shape != (count,) or not np.isfinite(found).all():
        raise ModelError(f"{text!r} in the file should be {count} numbers")
    return found


def own_place(given: Mapping[str, str], compiler: Compiler) -> Place:
    """The place that an element's attributes give it.

    Args:
        given: pos; one of quat, axisangle, euler, xyaxes and zaxis; or fromto, whose place
            is in the middle with z from the second point to the first.
        compiler: Of the file.
    """
    if "fromto" in given:
        ends = numbers(given["fromto"], 6)
        return Place((ends[:3] + ends[3:]) / 2, _z_along(ends[:3] - ends[3:]))
    pos = numbers(given.get("pos", "0 0 0"), 3)
    if "quat" in given:
        return Place(pos, _unit(numbers(given["quat"], 4)))
    if "axisangle" in given:
        axis, angle = np.split(numbers(given["axisangle"], 4), [3])
        return Place(pos, _about(_unit(axis), float(angle[0]), compiler.degrees))
    if "euler" in given:
        return Place(pos, _euler(numbers(given["euler"], 3), compiler))
    if "xyaxes" in given:
        x, y = np.split(numbers(given["xyaxes"], 6), 2)
        x = _unit(x)
        y = _unit(y - x * (x @ y))
        return Place(pos, _quat_from_columns(x, y, np.cross(x, y)))
    if "zaxis" in given:
        return Place(pos, _z_along(numbers(given["zaxis"], 3)))
    return Place(pos, Place.IDENTITY.quat)


def _euler(angles: Array, compiler: Compiler) -> Array:
    """A small letter turns about the axes as they are by now, a capital about the parent's."""
    quat = Place.IDENTITY.quat
    for letter, angle in zip(compiler.eulerseq, angles, strict=True):
        turn = _about(np.array(_AXES[letter.lower()]), float(angle), compiler.degrees)
        quat = times(quat, turn) if letter.islower() else times(turn, quat)
    return quat


def _about(axis: Array, angle: float, degrees: bool) -> Array:
    half = np.deg2rad(angle) / 2 if degrees else angle / 2
    return np.array([np.cos(half), *(np.sin(half) * axis)])


def _z_along(direction: Array) -> Array:
    """The shortest turn that takes z to a direction; the opposite of z, about x."""
    x, y, z = _unit(direction)
    sine = float(np.hypot(x, y))
    axis = np.array([-y / sine, x / sine, 0.0]) if sine > 1e-10 else np.array([1.0, 0, 0])
    return _about(axis, float(np.arctan2(sine, z)), degrees=False)


def _quat_from_columns(x: Array, y: Array, z: Array) -> Array:
    """Of the four ways to find it, that which divides by the largest number."""
    squares = np.array(
        [
            1 + x[0] + y[1] + z[2],
            1 + x[0] - y[1] - z[2],
            1 - x[0] + y[1] - z[2],
            1 - x[0] - y[1] + z[2],
        ]
    )
    a, b, c = y[2] - z[1], z[0] - x[2], x[1] - y[0]
    d, e, f = x[1] + y[0], z[0] + x[2], y[2] + z[1]
    s = squares
    rows = ([s[0], a, b, c], [a, s[1], d, e], [b, d, s[2], f], [c, e, f, s[3]])
    return _unit(np.array(rows[int(squares.argmax())]))


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    if not length:
        raise ModelError("the file gives a direction or a quaternion that is zero")
    return vector / length
