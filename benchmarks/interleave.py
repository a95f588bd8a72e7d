"""Ratios of two ways to do one thing, measured so that a noisy machine cannot fool us.

The contestants run in turns, in one process, in an order that is shuffled each
round; a ratio is the median of the round-by-round ratios. The null is the baseline
against itself: how far from 1 a ratio of two equal things comes out here.
"""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Ratio:
    """Cost of a contestant over the baseline's, with the middle half of the rounds."""

    name: str
    median: float
    low: float
    high: float


def interleaved(
    baseline: Callable[[], object],
    contestants: dict[str, Callable[[], object]],
    rounds: int,
    seed: int = 0,
) -> list[Ratio]:
    """Time everything in turns.

    Args:
        baseline: What the others are measured against; a few milliseconds a call.
        contestants: By name.
        rounds: How often each is called.
        seed: Of the order within each round.

    Returns:
        The null ("baseline again") first, then each contestant.
    """
    everyone = {"": baseline, "the baseline again (null)": baseline, **contestants}
    times: dict[str, list[float]] = {name: [] for name in everyone}
    order = random.Random(seed)
    for call in everyone.values():
        call()
    for _ in range(rounds):
        for name in order.sample(list(everyone), len(everyone)):
            start = time.perf_counter()
            everyone[name]()
            times[name].append(time.perf_counter() - start)
    results = []
    for name, spent in times.items():
        if not name:
            continue
        ratios = [a / b for a, b in zip(spent, times[""], strict=True)]
        low, median, high = statistics.quantiles(ratios, n=4)
        results.append(Ratio(name, median, low, high))
    return results
