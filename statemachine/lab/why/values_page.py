"""The two values of a cause, as a reader has them: with the name of each quantity.

A quantity is named unless the name of its cause says what it is: "mass of lower" needs no "mass".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from ...engines.records import TURNED, DifferingQuantity, QuantityValue
from ...measures.text import NO_NUMBER, display_unit, listed, quantity, significant

if TYPE_CHECKING:
    from . import Share

_OFF = ("place", "anchor", "com", "axis")  # quantities of which only the distance is said
_SHOWN = 3  # quantities that a sentence has
_DIGITS = range(4, 18)  # of a number: as many as it takes to tell two apart
# Which sentence tells a cause.
CauseWording = Literal["values", "bare", "turned axes", "filter on the right", "filter on the left"]
# Causes whose one quantity needs no name, beside those whose name says it.
_SAID = {
    *("moments", "com", "place", "anchor", "drives", "farthest corner", "farthest point"),
    *("time", "order", "count", "joints", "ref", "springref"),
}


def needs_name(row: Share, value: DifferingQuantity) -> bool:
    """Tell whether a quantity of a cause has to be named beside it."""
    name = value.quantity
    if row.kind == "engine" or not name:
        return False
    if len(distinct(row.values)) > 1:
        return True
    words = row.name.replace("(", " ").replace(")", " ").split(" ")
    return not (name in _SAID or name in row.name or set(name.split()) <= {*words})


def title_of(row: Share, value: DifferingQuantity) -> str:
    """Return the name of a cause, and of one of its quantities where it has to be named."""
    return f"{row.name} ({value.quantity})" if needs_name(row, value) else row.name


def heading_of(row: Share) -> str:
    """Return the name of a cause; with that of its quantity, where it has one that needs it."""
    return title_of(row, row.values[0]) if len(distinct(row.values)) == 1 else row.name


def sides_of(row: Share, most: int = _SHOWN) -> tuple[str, str]:
    """Return what each side has of a cause, in words: "solref 0.02 and solmix 1".

    Both are `NO_NUMBER` where a side has nothing that a value could tell.

    Args:
        row: The cause.
        most: How many of its quantities are told.
    """
    if not row.values:
        return NO_NUMBER, NO_NUMBER
    values = _largest_first(distinct(row.values), most)
    pairs = [_named_texts(value, is_only=len(values) == 1) for value in values[:most]]
    left, right = zip(*pairs, strict=True)
    more = len(values) - most
    sides: list[str] = []
    for texts in (left, right):
        named = [text for text in texts if text]
        if more > 0:
            named.append(f"{more} more")
        sides.append(listed(named))
    return sides[0], sides[1]


def distinct(values: Sequence[DifferingQuantity]) -> list[DifferingQuantity]:
    """Return the quantities of a cause without those that several elements have alike."""
    return list(dict.fromkeys(values))


def _largest_first(values: Sequence[DifferingQuantity], most: int) -> list[DifferingQuantity]:
    """Return quantities; of more than so many, those that differ most come first."""
    if len(values) <= most:
        return list(values)
    return sorted(values, key=relative_difference, reverse=True)


def _named_texts(value: DifferingQuantity, is_only: bool) -> tuple[str, str]:
    """Return the texts of a quantity with its name, which one that is alone does not need.

    A side without it among others has "".
    """
    left, right = texts_of(value)
    if is_only:
        return left, right
    texts = ["" if text == NO_NUMBER else f"{value.quantity} {text}" for text in (left, right)]
    return texts[0], texts[1]


def wording_of(row: Share) -> CauseWording:
    """Return which sentence tells a cause: with its values, unless these say too little."""
    names = {value.quantity: value for value in row.values}
    if row.kind == "body" and row.name.startswith("inertia") and names.keys() == {TURNED}:
        return "turned axes"
    times = names.get("timeconst")
    if row.name.startswith("filter of ") and times is not None:
        if times.left is None:
            return "filter on the right"
        if times.right is None:
            return "filter on the left"
    return "bare" if NO_NUMBER in sides_of(row) else "values"


def texts_of(value: DifferingQuantity) -> tuple[str, str]:
    """Return the left's and the right's value of a quantity, with as many digits as it takes.

    Of a place, or a direction, how far the right one is off.
    """
    left, right, unit = value.left, value.right, value.unit
    if isinstance(left, tuple) and isinstance(right, tuple) and value.quantity in _OFF:
        return _how_far_off(left, right, unit)
    texts = _text(left, unit), _text(right, unit)
    if texts[0] != texts[1] or left == right:
        return texts
    for digits in _DIGITS:
        texts = _text(left, unit, digits), _text(right, unit, digits)
        if texts[0] != texts[1]:
            break
    return texts


def _how_far_off(left: tuple[float, ...], right: tuple[float, ...], unit: str) -> tuple[str, str]:
    """Return how far the right place, or direction, is off the left one."""
    a, b = np.array(left, dtype=float), np.array(right, dtype=float)
    if unit:
        return "here", f"{quantity(float(np.linalg.norm(a - b)), unit)} off"
    angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
    return "this way", f"{quantity(angle, 'rad')} off"


def relative_difference(value: DifferingQuantity) -> float:
    """Return how far two values are apart, as a part of the larger; 1 where one is no number."""
    try:
        left, right = np.array(value.left, dtype=float), np.array(value.right, dtype=float)
        size = max(float(np.linalg.norm(left)), float(np.linalg.norm(right)))
        share = float(np.linalg.norm(left - right)) / size if size else 0.0
    except (TypeError, ValueError):
        return 1.0
    return 1.0 if np.isnan(share) else share


def _text(value: QuantityValue, unit: str, digits: int = 0) -> str:
    """Return a value with its unit.

    Args:
        value: The value.
        unit: Its SI unit.
        digits: Significant ones; 0 for as many as are usual.
    """
    match value:
        case None:
            return NO_NUMBER
        case tuple():
            factor, shown = display_unit(unit)
            numbers = (significant(entry * factor, digits or 4) for entry in value)
            return " ".join(numbers) + shown
        case bool():
            return "on" if value else "off"
        case str():
            return value
    if digits or not unit:
        factor, shown = display_unit(unit)
        return f"{significant(float(value) * factor, digits or 4)}{shown}"
    return quantity(float(value), unit)
