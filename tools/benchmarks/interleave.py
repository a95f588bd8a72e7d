"""Ratios of two ways to do one thing, measured so that a noisy machine cannot fool us."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from statemachine.lab.runs.interleaved_timing import Ratio, time_interleaved

NULL = "the baseline again (null)"


def interleaved(
    baseline: Callable[[], object],
    contestants: Mapping[str, Callable[[], object]],
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
        The null first, then each contestant.
    """
    everyone = {"": baseline, NULL: baseline, **contestants}
    for call in everyone.values():
        call()
    times = time_interleaved(everyone, rounds, seed=seed)
    return [Ratio.of(name, spent, times[""]) for name, spent in times.items() if name]
