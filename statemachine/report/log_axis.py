"""A logarithmic axis that shows what is exactly zero, too: at a level of its own, below."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..interface import Array

_FEWEST = 2  # decades
_HEAD = 0.05  # decades that are free above the largest value, at least
_WRITTEN_OUT = range(-3, 4)  # powers of ten; others as 1e6


class LogAxis:
    """Places of values on an axis of exponents: log10 of a value is its place.

    No power of ten reaches zero. So it has a level below the lowest power, parted from it.

    Attributes:
        low, high: Exponents; a value that is smaller is drawn at `low`.
        bottom: Where the axis ends below.
        zero: The place of zero, and edge: what parts it from the rest; None where nothing
            is zero.
    """

    def __init__(self, low: float, high: float, zero: bool, share: float = 0.2) -> None:
        """An axis from one exponent to another.

        Args:
            low: The smallest exponent.
            high: The largest.
            zero: Whether something is zero.
            share: How far below `low` its level is, as a share of the decades.
        """
        self.low, self.high, self.bottom = low, high, low
        self.zero: float | None = None
        self.edge: float | None = None
        if zero:
            below = share * (high - low)
            self.zero, self.edge, self.bottom = low - below, low - below / 2, low - 1.25 * below

    @classmethod
    def around(
        cls, values: Array, marks: Sequence[float] = (), decades: int | None = None
    ) -> LogAxis:
        """An axis of whole decades that has values (n,) on it, and marks that are above zero.

        Args:
            values: Never negative; what is not finite is left out.
            marks: Of lines that are drawn beside them.
            decades: At most; the largest value counts.
        """
        finite = values[np.isfinite(values)]
        shown = [*finite[finite > 0].tolist(), *marks]
        most, least = (max(shown), min(shown)) if shown else (1.0, 1.0)
        high = math.ceil(math.log10(most) + _HEAD)
        low = min(math.floor(math.log10(least)), high - _FEWEST)
        if decades is not None:
            low = max(low, high - decades)
        return cls(low, high, bool((finite == 0).any()))

    def places(self, values: Array) -> Array:
        """Where values (n,) are on the axis."""
        with np.errstate(divide="ignore"):
            found = np.clip(np.log10(values), self.low, self.high)
        return found if self.zero is None else np.where(values == 0, self.zero, found)

    def area(self, values: Array) -> Array:
        """The upper edge of an area over the axis (n,): what is too small to be on it has none."""
        places = self.places(values)
        return np.where(places > self.low, places, self.bottom)

    def line(self, across: Array, values: Array) -> tuple[Array, Array]:
        """Points of a line through values (n,); no number where it would join zero to another.

        Between those two lie all powers of ten, and the line was at none of them.
        """
        runs = np.split(np.arange(len(values)), np.flatnonzero(np.diff(values == 0)) + 1)
        # A value alone becomes a line of no length, which is drawn as a dot.
        ends = [np.append(run if len(run) > 1 else np.repeat(run, 2), len(values)) for run in runs]
        rows = np.concatenate(ends)
        return np.append(across, np.nan)[rows], np.append(self.places(values), np.nan)[rows]

    def ticks(self, most: int) -> list[tuple[float, str]]:
        """Places and labels upwards: zero, and at most so many powers of ten, evenly spaced."""
        powers = list(range(math.floor(self.high + 1e-9), math.ceil(self.low - 1e-9) - 1, -1))
        found = [(float(k), _label(k)) for k in reversed(powers[:: -(-len(powers) // most)])]
        return found if self.zero is None else [(self.zero, "0"), *found]


def _label(power: int) -> str:
    return f"{10.0**power:g}" if power in _WRITTEN_OUT else f"1e{power}".replace("-", "−")
