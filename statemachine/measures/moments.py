"""The moments that two runs share, and values at them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import TraceError
from ..interface import Array, Ints

SAME_MOMENT = 1e-6  # of a timestep: two moments nearer than this are one
_MIN_COMMON_MOMENTS = 5  # common moments below which a comparison says nothing


@dataclass(frozen=True, eq=False)
class CommonMoments:
    """The moments that two runs share, counted from the start of each.

    Attributes:
        time: (n,) since the start [s].
        left: (n,) rows of the one run.
        right: (n,) rows of the other.
    """

    time: Array
    left: Ints
    right: Ints


def common_moments(left: Array, right: Array, steps: tuple[float, float]) -> CommonMoments:
    """Return the rows of the same moments in two runs: nothing is interpolated.

    Timesteps of 1/200 and 1/240 s meet every 25 ms, those of 1/500 and 1/240 s every 50 ms; what
    happens between is left out, and who compares says so.

    Args:
        left: (n,) ascending, when the rows of a run are [s].
        right: (m,) those of the other.
        steps: The timesteps of both [s].

    Raises:
        TraceError: They share too few moments.
    """
    times = [time - time[0] for time in (left, right)]
    near = nearest(times[1], times[0])
    # A time is a sum of timesteps: its rounding grows with their number.
    slack = SAME_MOMENT * min(steps) + 1e-12 * np.arange(len(times[0]))
    rows = np.flatnonzero(np.abs(times[1][near] - times[0]) <= slack)
    if len(rows) < min(_MIN_COMMON_MOMENTS, len(left), len(right)):
        raise TraceError(
            f"timesteps of {steps[0]:g} and {steps[1]:g} s have only {len(rows)} moments "
            "in common: record one of them with the other's timestep"
        )
    return CommonMoments(times[0][rows], rows, near[rows])


def nearest(time: Array, wanted: Array) -> Ints:
    """Return the row of the ascending times (n,) that is nearest to each wanted one (k,)."""
    near = np.clip(np.searchsorted(time, wanted), 0, len(time) - 1)
    near -= (near > 0) & (np.abs(time[near - 1] - wanted) < np.abs(time[near] - wanted))
    return near


def at_moments(time: Array, values: Array, wanted: Array, slack: float) -> Array:
    """Return the values (n, k) of ascending moments (n,) at other moments (m,).

    Those of the run itself where it has the moment, to within `slack` [s]; else on the line
    between two of them.
    """
    near = nearest(time, wanted)
    rows = values[near].copy()
    off = np.flatnonzero(np.abs(time[near] - wanted) > slack)
    if len(off):
        rows[off] = np.column_stack([np.interp(wanted[off], time, column) for column in values.T])
    return rows
