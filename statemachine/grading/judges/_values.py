"""What the judges share: looking at returned values, and comparing without the student's NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...interface import Model
from ...records import Array
from ..calls import FaultError

LIFT, TIP = "shoulder_lift", "gripperframe"


def address(model: Model, joint: str = LIFT) -> int:
    """Where a joint begins in qpos."""
    return int(model.jnt_qposadr[model.joint_id(joint)])


def parts(value: Any, count: int, what: str) -> list[Any]:
    """A returned value as so many parts.

    Raises:
        FaultError: It has another number of them, or none.
    """
    try:
        found = list(value)
    except TypeError:
        raise FaultError(f"it returns {kind(value)}, where {what} is asked for") from None
    if isinstance(value, (str, dict, set)) or len(found) != count:
        raise FaultError(f"it returns {kind(value)}, where {what} is asked for")
    return found


def numbers(value: Any, shape: tuple[int, ...], what: str) -> Array:
    """A returned value as an array of a shape.

    Raises:
        FaultError: It is not one.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise FaultError(f"{what}: numbers are asked for, and it returns {kind(value)}") from None
    if array.shape != shape:
        raise FaultError(
            f"{what}: an array of shape {shape} is asked for, and it returns one of {array.shape}"
        )
    return array


def near(one: Array, two: Array, tolerance: float) -> bool:
    """Whether no number is farther apart; NaN is far from everything."""
    return one.shape == two.shape and bool((abs(one - two) <= tolerance).all())


def same_bits(one: Array, two: Array) -> bool:
    """Whether all numbers are equal."""
    return one.shape == two.shape and bool((one == two).all())


def kind(value: Any) -> str:
    """What a value is, in words."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    if isinstance(value, (tuple, list, dict, set)):
        return f"a {type(value).__name__} of {len(value)}"
    text, name = repr(value), type(value).__name__
    name = f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
    return f"{name}: {text}" if len(text) < 40 else name


def owner(model: Model, place: int) -> str:
    """The joint that a place in qpos belongs to."""
    starts = model.jnt_qposadr.tolist()
    return model.joint_names[max(k for k, start in enumerate(starts) if start <= place)]


def listed(values: Array, digits: int = 4) -> str:
    """Numbers in brackets."""
    return "[" + " ".join(f"{v + 0.0:.{digits}g}" for v in values.tolist()) + "]"
