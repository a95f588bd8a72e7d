"""The largest of some sizes, and distances between rows of numbers."""

from __future__ import annotations

import numpy as np

from ..interface import Array


def largest(sizes: Array) -> tuple[float, int]:
    """Return the largest of some sizes (n,), and its index; NaN counts as larger than all."""
    place = int(np.argmax(sizes))  # the first NaN, if there is one
    return float(sizes[place]), place


def largest_or_inf(sizes: Array) -> float:
    """Return the largest of some sizes; infinite if one is NaN, as of a run that diverged."""
    return float(np.where(np.isnan(sizes), np.inf, sizes).max(initial=0.0))


def distances(left: Array, right: Array) -> Array:
    """Return the lengths (…) of the differences between vectors (…, k)."""
    return np.linalg.norm(left - right, axis=-1)


def largest_difference(left: Array, right: Array) -> Array:
    """Return the largest absolute difference (…) of k numbers (…, k)."""
    return np.abs(left - right).max(axis=-1, initial=0.0)


def rotation_angles(left: Array, right: Array) -> Array:
    """Return the angles (…) [rad] between unit quaternions (…, 4), in any order of components.

    By the chord, so that tiny angles keep their digits. q and -q are one rotation.
    """
    chord = np.minimum(distances(left, right), distances(left, -right))
    return 4 * np.arcsin(np.minimum(chord / 2, 1.0))
