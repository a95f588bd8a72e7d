"""Whether two figures of compiled models are equal, and as what they are told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

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
    """The figures of these that differ, by name."""
    return tuple(
        (name.partition("_")[2] or name, plain(a), plain(b))
        for name, a, b in zip(names, one, two, strict=True)
        if not same(a, b)
    )
