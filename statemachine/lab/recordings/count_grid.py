"""The grid that measured values lie on, as a servo measures in whole counts.

The values v of a joint are v = start + quantum * n with whole numbers n. The largest such quantum
is looked for: the values agree about their place on a grid where the mean of exp(2 pi i v /
quantum) has nearly the length 1, as in a periodogram; a line through (n, v) then gives quantum
and start to the rounding of float32. Values that were smoothed lie on none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array

FEWEST_LEVELS = 8  # different values from which a quantum is told
_ROUNDED = 0.002  # of a quantum: what float32 may have rounded
_MISFIT = 0.02  # of a quantum: float32 rounds to 0.0001 of one
_WITHIN = 0.95  # of the values are that near to the grid
_COHERENT = 0.9  # length of the mean above which a quantum is looked at
_STEPS_PER_TURN = 10  # between two quanta that are tried, over the span of the values
WIDEST = 1000.0  # units that no joint turns: 2.7 turns in degrees
_AT_ONCE = 2048  # quanta that are tried together, for their memory
_MOST_LEVELS = 60  # that all quanta are compared with


@dataclass(frozen=True)
class CountGrid:
    """Places start + quantum * n that the values of a joint lie on.

    Attributes:
        quantum: Width of the grid, in the unit of the values.
        start: One of its places.
    """

    quantum: float
    start: float

    def floor(self, values: Array) -> Array:
        """Return the place at or below each value; one just below a place is at it."""
        return self.start + self.quantum * np.floor(self._places(values) + _ROUNDED)

    def ceil(self, values: Array) -> Array:
        """Return the place at or above each value; one just above a place is at it."""
        return self.start + self.quantum * np.ceil(self._places(values) - _ROUNDED)

    def _places(self, values: Array) -> Array:
        return (values - self.start) / self.quantum


def grid_of(levels: Array, finest: float) -> CountGrid | None:
    """Return the coarsest grid that values lie on; None if they are on none.

    Args:
        levels: (m,) different values, ascending.
        finest: Least quantum that is looked for.
    """
    if len(levels) < FEWEST_LEVELS:
        return None
    with np.errstate(over="ignore"):
        span = float(levels[-1] - levels[0])
    if not finest < span <= WIDEST:
        return None
    few = _some_of(levels) - levels[0]
    # Per unit: on the widest grid all values are within a few places.
    frequencies = np.arange(2.0 / span, 1.0 / finest, 1.0 / (_STEPS_PER_TURN * span))
    for first in range(0, len(frequencies), _AT_ONCE):
        block = frequencies[first : first + _AT_ONCE]
        coherence = np.abs(np.exp(2j * np.pi * np.multiply.outer(block, few)).mean(axis=1))
        for frequency in block[coherence >= _COHERENT]:
            grid = _refined(levels, 1.0 / float(frequency))
            if grid is not None:
                return grid
    return None


def _refined(levels: Array, quantum: float) -> CountGrid | None:
    """Return the grid near a quantum that the values fit best, if most lie on it."""
    turns = np.exp(2j * np.pi * (levels - levels[0]) / quantum)
    start = float(levels[0] + quantum * np.angle(turns.mean()) / (2.0 * np.pi))
    places = np.round((levels - start) / quantum)
    near = np.abs(levels - start - quantum * places) <= 0.25 * quantum
    if np.ptp(places[near]) < 1.0:
        return None
    quantum, start = (float(each) for each in np.polyfit(places[near], levels[near], 1))
    places = (levels - start) / quantum
    misfit = np.quantile(np.abs(places - np.round(places)), _WITHIN)
    return CountGrid(quantum, start) if misfit <= _MISFIT else None


def _some_of(levels: Array) -> Array:
    """Return some of the values, drawn, so that they are no grid of their own."""
    if len(levels) <= _MOST_LEVELS:
        return levels
    return np.random.default_rng(0).choice(levels, _MOST_LEVELS, replace=False)
