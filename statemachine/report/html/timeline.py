"""The moments that the page can show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array, Ints
from ...measures import common_moments
from ...runs import Trace

_SMOOTH = 1 / 60  # seconds between two pictures that look like motion
_BYTES = 450_000  # of the poses of both sides; each takes 14


@dataclass(frozen=True, eq=False)
class Frames:
    """Moments that can be shown.

    Attributes:
        time: (n,) since the start [s].
        one, two: (n,) rows of the traces, the last at or before that moment.
        share: (n,) how far two has to be taken from its row towards the next, 0 to 1.
        between: Whether any row of two had to be interpolated.
        left_out: How many rows of one are not shown.
    """

    time: Array
    one: Ints
    two: Ints
    share: Array
    between: bool
    left_out: int

    def __len__(self) -> int:
        return len(self.time)


def frames_of(one: Trace, two: Trace, must: tuple[float, ...] = ()) -> Frames:
    """Moments to be shown: those that were compared, unless they are too few to look like motion.

    Args:
        one: A trace.
        two: The other.
        must: Moments that have to be among them [s].
    """
    bodies = len(one.header.bodies) + len(two.header.bodies)
    most = max(60, min(1200, _BYTES // (14 * bodies)))
    common = common_moments(one.time, two.time, (one.timestep, two.timestep))
    n = len(common.time)
    spacing = float(common.time[-1]) / max(1, n - 1)
    steps = one.header.timestep, two.header.timestep
    if spacing <= max(_SMOOTH, 1.5 * max(steps)):
        rows, time = common.one, common.time
    else:
        elapsed = one.time - one.time[0]
        rows = np.flatnonzero(elapsed <= common.time[-1] + 1e-9)
        time = elapsed[rows]
    keep = np.arange(0, len(time), -(-len(time) // most))
    wanted = np.searchsorted(time, np.array(must) - 1e-9) if must else np.empty(0, int)
    keep = np.union1d(keep, np.append(np.clip(wanted, 0, len(time) - 1), len(time) - 1))
    rows, time = rows[keep], time[keep]
    other = two.time - two.time[0]
    after = np.searchsorted(other, time + 1e-9, side="right")
    row = np.clip(after - 1, 0, len(other) - 1)
    following = np.clip(row + 1, 0, len(other) - 1)
    width = np.where(following > row, other[following] - other[row], 1.0)
    share = np.clip((time - other[row]) / width, 0.0, 1.0)
    share[(share < 1e-6) | (following == row)] = 0.0
    return Frames(
        time=time,
        one=rows,
        two=row,
        share=share,
        between=bool((share > 0).any()),
        left_out=n - len(time) if rows is not common.one and len(time) < n else 0,
    )
