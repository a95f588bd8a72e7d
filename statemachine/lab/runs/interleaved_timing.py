"""Wall times of several ways to do one thing, taken in turns so that noise hits all alike.

A ratio is the median of the ratios round by round. One way is in it twice: the null, which
shows how far from 1 the ratio of two equal things comes out on this machine, now.
"""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from .drive import Progress, no_progress

MIN_ROUNDS = 5  # rounds; the middle half of fewer says nothing


@dataclass(frozen=True)
class Ratio:
    """Cost of one way over another's, round by round.

    Attributes:
        name: Of the way.
        median: Of the ratios of the rounds.
        low: Where their middle half begins.
        high: Where it ends.
        rounds: Number of rounds.
    """

    name: str
    median: float
    low: float
    high: float
    rounds: int

    @classmethod
    def of(cls, name: str, times: Sequence[float], baseline: Sequence[float]) -> Ratio:
        """Return the ratio of the times of each round to those of a baseline [both s]."""
        ratios = [a / b for a, b in zip(times, baseline, strict=True)]
        rounds = len(ratios)
        if rounds == 1:  # which has no quartiles, unless it is taken twice
            ratios *= 2
        low, median, high = statistics.quantiles(ratios, n=4)
        return cls(name, median, low, high, rounds)

    def spread(self, sign: str = "", decimals: int = 2) -> str:
        """Write the median, and the middle half."""
        middle, low, high = (f"{x:.{decimals}f}" for x in (self.median, self.low, self.high))
        return f"{middle}{sign}  ({low} to {high})"

    def differs_from(self, null: Ratio) -> bool:
        """Tell whether the middle halves of the rounds lie apart."""
        if min(self.rounds, null.rounds) < MIN_ROUNDS:
            return False
        return self.low > null.high or self.high < null.low


def time_interleaved(
    ways: Mapping[str, Callable[[], object]],
    rounds: int,
    progress: Progress = no_progress,
    seed: int = 0,
) -> dict[str, list[float]]:
    """Call every way once a round, in an order that is shuffled each round.

    Args:
        ways: What is called, by name.
        rounds: How often.
        progress: Told the fraction that is done.
        seed: Of the order.

    Returns:
        Wall time of each call [s], by name.
    """
    times: dict[str, list[float]] = {name: [] for name in ways}
    order = random.Random(seed)
    for k in range(rounds):
        for done, name in enumerate(order.sample(list(ways), len(ways))):
            start = time.perf_counter()
            ways[name]()
            times[name].append(time.perf_counter() - start)
            progress((k + (done + 1) / len(ways)) / rounds)
    return times
