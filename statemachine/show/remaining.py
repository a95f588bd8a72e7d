"""How long work still takes, as far as that can be told from the runs that were measured."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

LONG = 20.0  # [s] that remain: of less nothing is said
_FEWEST = 2  # measured runs, without the first, before anything is said
_FEW = 6  # paces whose standard error says little
_ALIKE = 1.35  # times: where few differ by more, they say nothing of the next
_STEADY = 0.2  # relative standard error of the mean pace, above which nothing is said
_MINUTE, _IN_MINUTES = 60.0, 100.0  # [s]; from so many on a time is said in minutes


class RemainingTime:
    """The time that the rest of some runs takes, estimated from those that have ended.

    The first is not counted: something may be loaded in it. Nothing is said before two more were
    measured, nor while they vary so much that the estimate could be off by more than a factor of
    two. Of runs that are made side by side several end at nearly one time: they are measured by so
    many together.
    """

    def __init__(self, at_once: int, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin to measure.

        Args:
            at_once: How many runs are made side by side, at most.
            clock: Tells the time [s].
        """
        self._at_once, self._clock = at_once, clock
        self._began = clock()
        self._ended = 0  # runs, since the last of `_measured`
        self._fraction = 0.0
        self._measured: list[tuple[float, float]] = []  # (time [s], fraction) after each group

    def ended(self, fraction: float) -> None:
        """Note that one or more runs ended.

        Args:
            fraction: Of all work, which is done by now.
        """
        if fraction <= self._fraction:
            return
        self._fraction = fraction
        self._ended += 1
        if self._ended == self._at_once:
            self._ended = 0
            self._measured.append((self._clock() - self._began, fraction))

    @property
    def seconds(self) -> float | None:
        """Return the time that the rest takes from now on [s]; None while that cannot be told."""
        pace = self._pace()
        if pace is None:
            return None
        last, fraction = self._measured[-1]
        since = self._clock() - self._began - last
        return max(0.0, pace * (1.0 - fraction) - since)

    def _pace(self) -> float | None:
        """Return what all work takes at the pace of what was measured [s]; None if it varies."""
        if len(self._measured) <= _FEWEST:
            return None
        paces: list[float] = []
        before = (0.0, 0.0)
        for moment in self._measured:
            paces.append((moment[0] - before[0]) / (moment[1] - before[1]))
            before = moment
        if not _is_steady(paces[1:]):
            return None
        first, last = self._measured[0], self._measured[-1]
        return (last[0] - first[0]) / (last[1] - first[1])


def _is_steady(paces: list[float]) -> bool:
    """Tell whether measured paces, at least two, say something of those to come."""
    if len(paces) < _FEW:
        return max(paces) <= _ALIKE * min(paces)
    mean = sum(paces) / len(paces)
    variance = sum((pace - mean) ** 2 for pace in paces) / (len(paces) - 1)
    return math.sqrt(variance / len(paces)) <= _STEADY * mean


def in_words(seconds: float) -> str:
    """Return a time that remains in words, to two digits: "about 45 s more"."""
    if seconds < _IN_MINUTES:
        return f"about {seconds:.0f} s more"
    return f"about {seconds / _MINUTE:.2g} min more"
