"""Poses of a run at the moments that are shown: at its rows, or between two of them."""

from __future__ import annotations

import numpy as np

from ....interface import Array, Ints
from ...recordings import Trace


def rows_at(trace: Trace, times: Array) -> tuple[Ints, Array]:
    """Return the row (n,) at or before each moment, and the share (n,) of the way to the next."""
    elapsed = trace.time - trace.time[0]
    row = np.searchsorted(elapsed, times + 1e-9, side="right") - 1
    following = np.minimum(row + 1, len(elapsed) - 1)
    width = np.where(following > row, elapsed[following] - elapsed[row], np.inf)
    share = np.clip((times - elapsed[row]) / width, 0.0, 1.0)
    return row, np.where(share < 1e-6, 0.0, share)


def last_finite(pos: Array) -> Array:
    """Return positions (n, nbody, 3) of which those that are not finite are the last that were."""
    row, good = np.arange(len(pos))[:, None], np.isfinite(pos).all(axis=2)
    last = np.maximum.accumulate(np.where(good, row, 0))
    held = pos[last, np.arange(pos.shape[1])]
    return np.where(np.isfinite(held), held, 0.0)


def positions_between(values: Array, rows: Ints, share: Array) -> Array:
    """Return rows of values, each gone a share of the way to the next."""
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    after = values[np.minimum(rows + 1, len(values) - 1)]
    return np.where(share > 0, (1 - share) * values[rows] + share * after, values[rows])


def orientations_between(quat: Array, rows: Ints, share: Array) -> Array:
    """Return the same of orientations, the shorter way, of unit length."""
    after = quat[np.minimum(rows + 1, len(quat) - 1)]
    same = (quat[rows] * after).sum(axis=-1, keepdims=True) >= 0
    weight = share[:, None, None]
    return unit_quat((1 - weight) * quat[rows] + weight * np.where(same, after, -after))


def unit_quat(quat: Array) -> Array:
    """Return quaternions (..., 4) of unit length; the identity for what is not a rotation."""
    quat = np.nan_to_num(quat)
    length = np.linalg.norm(quat, axis=-1, keepdims=True)
    return np.where(length > 0, quat / np.where(length > 0, length, 1.0), [1.0, 0.0, 0.0, 0.0])
