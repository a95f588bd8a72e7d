"""Quantities: what two elements of compiled models have in one array, where the two differ.

Equal is what is equal but for rounding; words stand for the entries of enumerations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...installed import require
from ..records import DifferingQuantity
from . import compared_fields as fields

_ROUNDING = 1e-9  # relative: as a file with ten digits, or other units, leaves it


def same(left: Any, right: Any) -> bool:
    """Tell whether two values are equal, but for rounding."""
    a, b = np.asarray(left), np.asarray(right)
    if a.shape != b.shape or "f" not in (a.dtype.kind, b.dtype.kind):
        return bool(np.array_equal(a, b))
    # A range without an end is told by its flag.
    return bool((np.isclose(a, b, _ROUNDING, 1e-15) | np.isinf(a) | np.isinf(b)).all())


def plain(value: Any) -> Any:
    """Return a value as a number or a tuple, for a result."""
    return tuple(np.asarray(value).tolist()) if np.ndim(value) else np.asarray(value).item()


def word_in(enumeration: str, number: int) -> str:
    """Return the word for an entry of one of the engine's enumerations in an MJCF: "affine"."""
    return getattr(require("mujoco"), enumeration)(number).name.partition("_")[2].lower()


def quantity_of(
    array: str, left: Any, right: Any, unit: str = "", called: str = ""
) -> DifferingQuantity:
    """Return what two elements have in one array, as a quantity.

    Args:
        array: Its name in an mjModel; of an option as "opt.o_solref".
        left: The entry of the first model's element: a number, or some.
        right: That of the second's.
        unit: SI unit of each number.
        called: What the quantity is called; "" for the array's name without its kind.
    """
    name = called or fields.word_of(array)
    if array in fields.CHOICES:
        words = (word_in(fields.CHOICES[array], int(entry)) for entry in (left, right))
        return DifferingQuantity(name, *words)
    if array in fields.FLAGS_OF_ELEMENTS:
        return DifferingQuantity(name, bool(left), bool(right))
    if fields.is_beginning(array) and np.size(left) == np.size(right) > 1:
        end = 1 + max(k for k in range(len(left)) if not same(left[k], right[k]))
        left, right = left[:end], right[:end]
        if end == 1:
            left, right = left[0], right[0]
    return DifferingQuantity(name, plain(left), plain(right), unit)


def differing(
    row: fields.FieldRow, left: Sequence[Any], right: Sequence[Any]
) -> tuple[DifferingQuantity, ...]:
    """Return the quantities of a row that differ.

    Args:
        row: Of `fields.ROWS`.
        left: For each of its arrays the entry of the first model's element.
        right: Those of the second's.
    """
    values: list[DifferingQuantity] = []
    for array, ours, theirs in zip(row.fields, left, right, strict=True):
        if array in fields.LIMITS:
            continue  # a range that is not there says so
        one, other = _is_unlimited(array, ours), _is_unlimited(array, theirs)
        if one or other:
            if one != other:
                ends = None if one else plain(ours), None if other else plain(theirs)
                values.append(DifferingQuantity(fields.word_of(array), *ends, row.unit_of(array)))
        elif not same(ours, theirs):
            values.append(quantity_of(array, ours, theirs, row.unit_of(array)))
    return tuple(values)


def _is_unlimited(array: str, entry: Any) -> bool:
    """Tell whether an entry is a range without its flag, which says nothing."""
    return array in fields.LIMITED and bool(np.isinf(entry).all())
