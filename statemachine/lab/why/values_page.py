"""The two values of a cause, as a reader has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...engines.records import TURNED, DifferingQuantity
from ...measures.text import NONE, quantity, reading, significant

if TYPE_CHECKING:
    from . import Share

_WIDE = 24  # characters of a value
_OFF = ("place", "anchor", "com", "axis")  # figures of which only the distance is said


def figure_of(row: Share) -> str:
    """Say which figure of a cause it is, where its name does not say so; else ""."""
    figure = row.values[0].quantity if row.values else ""
    if has_several_figures(row):
        return f" ({len(row.values)} figures)"
    is_entry = "[" in figure or figure == TURNED or row.kind == "option"
    return f" ({figure})" if is_entry and figure not in row.name else ""


def has_several_figures(row: Share) -> bool:
    """Tell whether its figures differ; a servo's kp stands in two, once with another sign."""
    sizes = {repr((values.left, values.right)).replace("-", "") for values in row.values}
    return len(sizes) > 1


def values_of(row: Share) -> tuple[str, str]:
    """Return the left's and the right's value of the figure that differs most.

    Of a place, or a direction, how far the right one is off.
    """
    if not row.values:
        return NONE, NONE
    figure = max(row.values, key=_relative)
    left, right, unit = figure.left, figure.right, figure.unit
    if isinstance(left, tuple) and isinstance(right, tuple) and left and right:
        if figure.quantity in _OFF:
            return _how_far_off(left, right, unit)
        texts = _of_arrays(left, right, unit)
    else:
        texts = _value(left, unit), _value(right, unit)
    left_text, right_text = _cut(texts[0]), _cut(texts[1])
    if left_text == right_text and _relative(figure):  # numbers, which read the same: all digits
        return _first_that_differs(figure)
    return left_text, right_text


def _how_far_off(left: tuple[object, ...], right: tuple[object, ...], unit: str) -> tuple[str, str]:
    """Return how far the right place, or direction, is off the left one."""
    a, b = np.array(left, dtype=float), np.array(right, dtype=float)
    if unit:
        return "here", f"{quantity(float(np.linalg.norm(a - b)), unit)} off"
    angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
    return "this way", f"{quantity(angle, 'rad')} off"


def _of_arrays(left: tuple[object, ...], right: tuple[object, ...], unit: str) -> tuple[str, str]:
    """Return two arrays; of long ones the entries that differ, which a cut would hide."""
    texts = _value(left, unit), _value(right, unit)
    if len(left) != len(right) or max(len(text) for text in texts) <= _WIDE:
        return texts
    a, b = np.array(left, object), np.array(right, object)
    differ = a != b
    texts = _value(tuple(a[differ]), unit), _value(tuple(b[differ]), unit)
    if differ.all():
        return texts
    return f"{texts[0]} …", f"{texts[1]} …"


def _cut(text: str) -> str:
    return text if len(text) <= _WIDE else f"{text[: _WIDE - 1]}…"


def _first_that_differs(figure: DifferingQuantity) -> tuple[str, str]:
    """Return the first numbers of two values that differ, with all their digits."""
    a, b = (np.array(value, dtype=float).ravel() for value in (figure.left, figure.right))
    first = np.argmax(a != b)
    return f"{a[first]:.12g}", f"{b[first]:.12g}"


def _relative(figure: DifferingQuantity) -> float:
    """Return how far two values are apart, as a part of the larger.

    It is 0 where that is not a number.
    """
    try:
        left, right = (np.array(value, dtype=float) for value in (figure.left, figure.right))
        size = max(float(np.linalg.norm(left)), float(np.linalg.norm(right)))
        return float(np.linalg.norm(left - right)) / size if size else 0.0
    except (TypeError, ValueError):
        return 0.0


def _value(value: object, unit: str) -> str:
    match value:
        case None:
            return NONE
        case tuple():
            factor, shown = reading(unit)
            return " ".join(_value(_scaled(entry, factor), "") for entry in value) + shown
        case bool():
            return "on" if value else "off"
        case int() | float():
            return quantity(float(value), unit) if unit else significant(float(value))
    return str(value)


def _scaled(value: object, factor: float) -> object:
    """Return a number times a factor, and anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float) or factor == 1:
        return value
    return value * factor
