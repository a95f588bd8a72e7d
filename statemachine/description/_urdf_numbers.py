"""Numbers in the attributes of a URDF, each error in one line with what it concerns."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np

from ..errors import ModelError
from ..interface import Array
from ..rotations import HERE, Placement


def origin(element: Element, where: str) -> Placement:
    origin = element.find("origin")
    if origin is None:
        return HERE
    pos = numbers(origin, "xyz", 3, where, (0.0, 0.0, 0.0))
    roll, pitch, yaw = numbers(origin, "rpy", 3, where, (0.0, 0.0, 0.0))
    return Placement(pos, matrix_from_rpy(roll, pitch, yaw))


def matrix_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rz(yaw)·Ry(pitch)·Rx(roll), as the format defines its rpy."""
    (sr, sp, sy), (cr, cp, cy) = (
        [f(angle) for angle in (roll, pitch, yaw)] for f in (math.sin, math.cos)
    )
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def number(element: Element, attribute: str, where: str) -> float:
    return float(numbers(element, attribute, 1, where)[0])


def numbers(
    element: Element,
    attribute: str,
    count: int,
    where: str,
    default: tuple[float, ...] | None = None,
) -> Array:
    text = element.get(attribute)
    if text is None:
        if default is not None:
            return np.array(default)
        raise ModelError(f"{where}: <{element.tag}> has no {attribute}")
    shown = text if len(text) <= 40 else f"{text[:37]}..."
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        raise ModelError(f"{where}: {attribute}={shown!r} is no number") from None
    if len(values) != count:
        raise ModelError(f"{where}: {attribute}={shown!r} should be {count} numbers")
    if not all(map(math.isfinite, values)):
        raise ModelError(f"{where}: {attribute}={shown!r} is not finite")
    return np.array(values)
