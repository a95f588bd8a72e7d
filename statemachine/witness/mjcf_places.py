"""How MJCF writes a place: pos, and one of several ways to give an orientation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from .. import models
from ..errors import ModelError
from ..rotations import HERE, Array, Placement, matrix_from_quat, rotation


class Compiler(NamedTuple):
    """What <compiler> says of angles, and whether free bodies are aligned with their inertia."""

    degrees: bool
    eulerseq: str
    aligned: bool

    def radians(self, angle: float) -> float:
        """An angle of the file [rad]."""
        return float(np.deg2rad(angle)) if self.degrees else angle


def numbers(text: str, count: int) -> Array:
    """The numbers of an attribute."""
    return np.array(models.numbers(text, count, "an attribute of the file"))


def own_place(given: Mapping[str, str], compiler: Compiler) -> Placement:
    """The place that an element's attributes give it.

    Args:
        given: pos; one of quat, axisangle, euler, xyaxes and zaxis; or fromto, whose place
            is in the middle with z from the second point to the first.
        compiler: Of the file.
    """
    if "fromto" in given:
        ends = numbers(given["fromto"], 6)
        return Placement((ends[:3] + ends[3:]) / 2, _z_along(ends[:3] - ends[3:]))
    mat = HERE.mat
    if "quat" in given:
        mat = matrix_from_quat(_unit(numbers(given["quat"], 4)))
    elif "axisangle" in given:
        axis, angle = np.split(numbers(given["axisangle"], 4), [3])
        mat = rotation(_unit(axis), compiler.radians(float(angle[0])))
    elif "euler" in given:
        # A small letter turns about the axes as they are by now, a capital about the parent's.
        for letter, angle in zip(compiler.eulerseq, numbers(given["euler"], 3), strict=True):
            turn = rotation(HERE.mat["xyz".index(letter.lower())], compiler.radians(angle))
            mat = mat @ turn if letter.islower() else turn @ mat
    elif "xyaxes" in given:
        x, y = np.split(numbers(given["xyaxes"], 6), 2)
        x = _unit(x)
        y = _unit(y - x * (x @ y))
        mat = np.array([x, y, np.cross(x, y)]).T
    elif "zaxis" in given:
        mat = _z_along(numbers(given["zaxis"], 3))
    return Placement(numbers(given.get("pos", "0 0 0"), 3), mat)


def _z_along(direction: Array) -> Array:
    """The shortest turn that takes z to a direction; the opposite of z, about x."""
    x, y, z = _unit(direction)
    sine = float(np.hypot(x, y))
    axis = np.array([-y / sine, x / sine, 0.0]) if sine > 1e-10 else HERE.mat[0]
    return rotation(axis, float(np.arctan2(sine, z)))


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    if not length:
        raise ModelError("the file gives a direction or a quaternion that is zero")
    return vector / length
