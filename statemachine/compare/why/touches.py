"""What touches in the runs that are compared, and how far they were apart until then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...interface import Array
from ...runs import Trace


@dataclass(frozen=True)
class FirstTouch:
    """The first contact of anything, and how far apart the runs were until then.

    Attributes:
        time: Since the start [s]; 0 if something touches from the start.
        what: What touched what.
        before: The gap of the runs as they come, at the moments until then.
        moments: How many these are.
    """

    time: float
    what: str
    before: float
    moments: int


def touched_at_start(trace: Trace, robot: frozenset[str]) -> frozenset[str]:
    """Names of the bodies that some bodies of the robot touch from the start."""
    pairs = [pair.split(" on ") for pair, rows in _touches(trace).items() if rows[0]]
    return frozenset(b for pair in pairs for b in pair if not robot.isdisjoint(pair)) - robot


def first_touch(traces: Sequence[Trace], time: Array, apart: Array) -> FirstTouch | None:
    """The first contact of some runs; None where nothing touches, or no engine tells of it.

    Args:
        traces: The runs.
        time: (n,) moments since the start [s].
        apart: (n,) how far apart the runs are there.
    """
    met = [
        (float(trace.time[rows.argmax()] - trace.time[0]), pair)
        for trace in traces
        for pair, rows in _touches(trace).items()
        if rows.any()
    ]
    if not met:
        return None
    when, what = min(met)
    if not when:  # no moment shows the rest alone
        return FirstTouch(0.0, what, 0.0, 0)
    # A contact found at a moment acts from that moment on: the moment itself is before it.
    before = time <= when + 1e-9
    return FirstTouch(when, what, float(apart[before].max()), int(np.sum(before)))


def _touches(trace: Trace) -> dict[str, NDArray[np.bool_]]:
    """When each pair of bodies touches, as far as the engine tells."""
    return trace.touches() if "contact_row" in trace.columns else {}
