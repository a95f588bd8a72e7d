"""Numbers as the text of an attribute, in full: they read back exactly."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

_DEGREE = math.pi / 180.0
_DIGITS = 12
_ROUNDINGS = 32 * 2.0**-52  # relative: as many as may have come together in a figure
_NEIGHBOURS = 4  # floats on each side of an angle that are tried


def number_text(value: float) -> str:
    """Return the shortest text of a number that reads back exactly: "0.1", "45"."""
    if value == 0:
        return "0"  # without the sign that it may have
    return repr(float(value)).removesuffix(".0")


def numbers_text(values: Iterable[float]) -> str:
    """Return numbers in a row, each as `number_text`."""
    return " ".join(number_text(value) for value in values)


def tidied(values: Iterable[float]) -> list[float]:
    """Return numbers that were computed, without the last digits that rounding has left."""
    exact = [float(value) for value in values]
    slack = _ROUNDINGS * max(map(abs, exact), default=0.0)
    rounded = [float(f"{value:.{_DIGITS}g}") if abs(value) > slack else 0.0 for value in exact]
    return [
        short if abs(short - value) <= slack else value
        for short, value in zip(rounded, exact, strict=True)
    ]


def degrees_of(radians: float) -> float:
    """Return the angle in degrees that becomes this one where a reader multiplies by π/180.

    Where no number does, the nearest is returned; of several, the one with the shortest text.
    """
    near = radians / _DEGREE
    candidates = [round(near, digits) for digits in (6, 9, 12)] + [near]
    up = down = near
    for _ in range(_NEIGHBOURS):
        up, down = math.nextafter(up, math.inf), math.nextafter(down, -math.inf)
        candidates += [up, down]
    exact = [degrees for degrees in candidates if degrees * _DEGREE == radians]
    return min(exact, key=lambda degrees: len(repr(degrees)), default=near)


def beginning_text(values: Sequence[float], before: Sequence[float], text: str) -> str:
    """Return an array of which a file may write the first numbers alone.

    As many are written as the file has, and at least up to the last that is changed.

    Args:
        values: The numbers as they are to be.
        before: As they are.
        text: What the file has; "" for nothing.
    """
    changed = np.flatnonzero(np.asarray(values) != np.asarray(before))
    last = int(changed[-1]) + 1 if len(changed) else 1
    count = max(last, len(text.split()))
    return numbers_text(values[:count])
