"""Whether two figures of compiled models are equal, and as what they are told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

_TOGETHER = 3  # entries: a longer array is told by those that differ
_ROUNDING = 1e-9  # relative: as a file with ten digits, or other units, leaves it


def same(one: Any, two: Any, slack: float = _ROUNDING) -> bool:
    """Whether two values are equal, but for rounding."""
    a, b = np.asarray(one), np.asarray(two)
    if a.shape != b.shape:
        return False
    if a.dtype.kind != "f" and b.dtype.kind != "f":
        return bool(np.array_equal(a, b))
    a, b = a.astype(float), b.astype(float)
    with np.errstate(invalid="ignore"):
        gap = np.where(a == b, 0.0, np.abs(a - b))
    return bool((gap <= slack * np.maximum(np.abs(a), np.abs(b)) + 1e-15).all())


def plain(value: Any) -> Any:
    """A number or a tuple, for a result."""
    return tuple(np.asarray(value).tolist()) if np.ndim(value) else np.asarray(value).item()


def differing(
    names: Sequence[str], one: Sequence[Any], two: Sequence[Any]
) -> tuple[tuple[str, Any, Any], ...]:
    """The figures of these that differ, by name; of a long array each entry that does."""
    found: list[tuple[str, Any, Any]] = []
    for name, a, b in zip(names, one, two, strict=True):
        if same(a, b):
            continue
        word, size = name.partition("_")[2] or name, np.size(a)
        if size <= _TOGETHER or np.shape(a) != np.shape(b):
            found.append((word, plain(a), plain(b)))
            continue
        places = [k for k in range(size) if not same(a[k], b[k])]
        found += [(f"{word}[{k}]", plain(a[k]), plain(b[k])) for k in places]
    return tuple(found)
