"""The largest of some sizes, and distances between rows of numbers."""

from __future__ import annotations

import numpy as np

from ..interface import Array


def largest(sizes: Array) -> tuple[float, int]:
    """The largest of some sizes (n,), and its place; what is not a number is larger than all."""
    place = int(np.argmax(sizes))  # the first NaN, if there is one
    return float(sizes[place]), place


def largest_or_inf(sizes: Array) -> float:
    """The largest of some sizes; infinite if one is not a number, as of a run that diverged."""
    return float(np.where(np.isnan(sizes), np.inf, sizes).max(initial=0.0))


def distances(left: Array, right: Array) -> Array:
    """Lengths (…) of the way from one vector (…, k) to another."""
    return np.linalg.norm(left - right, axis=-1)


def farthest(left: Array, right: Array) -> Array:
    """The largest difference (…) of any of k numbers (…, k)."""
    return np.abs(left - right).max(axis=-1, initial=0.0)


def turns(left: Array, right: Array) -> Array:
    """Angles (…) [rad] between unit quaternions (…, 4), in any order of their components.

    By the chord, so that tiny angles keep their digits. q and -q are one rotation.
    """
    chord = np.minimum(distances(left, right), distances(left, -right))
    return 4 * np.arcsin(np.minimum(chord / 2, 1.0))
