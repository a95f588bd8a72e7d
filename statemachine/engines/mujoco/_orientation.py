"""Orientations as an MJCF writes them, and the settings of its compiler that they depend on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ...interface import Array
from ...rotations import matrix_from_quat
from ..description.file_numbers import degrees_of, numbers_text, tidied
from ..description.xml_source import XmlElement

# The attributes that say how an element is turned, of which it has one at most.
ORIENTATIONS = ("quat", "euler", "axisangle", "xyaxes", "zaxis")
_ALWAYS = 1  # of mjtInertiaFromGeom
_LOCKED = 1e-6  # cosine of the second angle: nearer to zero the other two are not known apart


@dataclass(frozen=True)
class CompilerSettings:
    """What numbers of an MJCF mean, by its `<compiler>`.

    Attributes:
        degrees: Whether angles are in degrees.
        euler: The axes about which Euler angles turn, one after the other.
        inertia_from_geoms: Whether an `<inertial>` is not read.
        total_mass: The mass to which all masses are scaled [kg]; 0 for none.
    """

    degrees: bool = True
    euler: str = "xyz"
    inertia_from_geoms: bool = False
    total_mass: float = 0.0

    @classmethod
    def of(cls, spec: Any) -> CompilerSettings:
        """Return those of an MjSpec."""
        compiler = spec.compiler
        return cls(
            degrees=bool(compiler.degree),
            euler=_euler_sequence(compiler.eulerseq),
            inertia_from_geoms=int(compiler.inertiafromgeom) == _ALWAYS,
            total_mass=max(float(compiler.settotalmass), 0.0),
        )


def _euler_sequence(letters: Any) -> str:
    """Return the axes of Euler angles as text."""
    if isinstance(letters, str):
        return letters
    return "".join(letter if isinstance(letter, str) else chr(int(letter)) for letter in letters)


def orientation_texts(
    element: XmlElement, quaternion: Array, settings: CompilerSettings
) -> dict[str, str | None]:
    """Return the attributes that turn an element: in Euler angles where it has these.

    Args:
        element: The element.
        quaternion: (4,) wxyz, as it is to be turned.
        settings: Of the compiler.

    Returns:
        The text of each attribute; None of one that is taken away.
    """
    texts: dict[str, str | None] = dict.fromkeys(ORIENTATIONS)
    angles = _euler_angles(quaternion, settings) if "euler" in element.attributes else []
    if angles:
        texts["euler"] = numbers_text(angles)
    else:
        texts["quat"] = numbers_text(quaternion)
    return texts


def _euler_angles(quaternion: Array, settings: CompilerSettings) -> list[float]:
    """Return Euler angles in the unit of the file; none where these are not unique.

    Small letters turn about axes that turn along, capitals about axes that stay.
    """
    sequence = settings.euler
    if sequence.isupper():
        sequence = sequence[::-1]
    i, j, k = ("xyz".index(letter) for letter in sequence.lower())
    if len({i, j, k}) < 3 or not (sequence.islower() or sequence.isupper()):
        return []
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    matrix = matrix_from_quat(quaternion)
    if math.hypot(matrix[j, k], matrix[k, k]) < _LOCKED:
        return []
    first = math.atan2(-sign * matrix[j, k], matrix[k, k])
    second = math.asin(min(max(sign * float(matrix[i, k]), -1.0), 1.0))
    third = math.atan2(-sign * matrix[i, j], matrix[i, i])
    angles = [first, second, third]
    if settings.euler.isupper():
        angles.reverse()
    if settings.degrees:
        return tidied(degrees_of(angle) for angle in angles)
    return tidied(angles)
