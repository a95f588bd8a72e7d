"""Bring two traces to common moments."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import TraceError
from ..interface import Array, Ints
from ..traces import Trace

SAME = 1e-6  # of a timestep: two moments nearer than this are one
_FEW = 20  # common moments below which a comparison says nothing


@dataclass(frozen=True, eq=False)
class Common:
    """The moments that two traces share, counted from the start of each.

    Attributes:
        time: (n,) since the start [s].
        one, two: (n,) rows of the traces.
    """

    time: Array
    one: Ints
    two: Ints


def common_moments(one: Trace, two: Trace) -> Common:
    """Rows of the same moment: nothing is interpolated.

    Timesteps of 1/200 and 1/240 s meet every 25 ms; what happens between is left out.

    Raises:
        TraceError: They share too few moments.
    """
    times = [trace.time - trace.time[0] for trace in (one, two)]
    steps = [trace.header.timestep for trace in (one, two)]
    near = np.clip(np.searchsorted(times[1], times[0]), 1, len(times[1]) - 1)
    if len(times[1]) == 1:
        near = np.zeros(len(times[0]), dtype=np.int64)
    else:
        left = np.abs(times[1][near - 1] - times[0]) < np.abs(times[1][near] - times[0])
        near = near - left
    # A time is a sum of timesteps: its rounding grows with their number.
    slack = SAME * min(steps) + 1e-12 * np.arange(len(times[0]))
    rows = np.flatnonzero(np.abs(times[1][near] - times[0]) <= slack)
    least = min(_FEW, len(one), len(two))
    if len(rows) < least:
        raise TraceError(
            f"timesteps of {steps[0]:g} and {steps[1]:g} s have only {len(rows)} moments in "
            "common: record one of them with the other's timestep"
        )
    return Common(times[0][rows], rows, near[rows].astype(np.int64))
