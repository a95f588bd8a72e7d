"""A run of a case: a Model, a Data of it, and how many steps were made."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...errors import BadInputError
from ...interface import Data, Model, forward, step
from ...interface.records import Array
from ...release_names import is_release

MAX_STEPS = 10_000_000  # of a run
_SAME_TIME = 1e-14  # relative: what is closer is apart by rounding


class TimestepError(BadInputError):
    """A case cannot be run at a timestep."""


class Samples(NamedTuple):
    """What was read of a Data, before the first step and after each.

    Attributes:
        times: (n,) [s].
        values: (n, ...) What was read.
    """

    times: Array
    values: Array


class Run:
    """A Model and a Data of it, which a case drives; it counts steps and the time they take.

    Attributes:
        model: The case's, as an engine has it.
        data: A fresh one, which the case changes.
        steps: Number of steps made.
        time: Simulated time of these steps [s]: that of the closed form which they are held
            against.
        seconds: CPU time of these steps [s], so that what else is computed on the machine counts
            little; of a release, which has a process of its own, the time by the clock.
    """

    def __init__(self, model: Model, data: Data) -> None:
        self.model = model
        self.data = data
        self.steps = 0
        self.time = 0.0
        self.seconds = 0.0
        self._clock = time.perf_counter if is_release(model.backend) else time.process_time

    @property
    def timestep(self) -> float:
        """Return the length of a step [s]."""
        return self.model.timestep

    def advance(self, duration: float) -> float:
        """Step as long as `duration` [s], rounded to whole steps; at least one.

        Returns:
            The simulated time [s], which is another where the timestep does not divide it.
        """
        count = self._count(duration)
        began = self._clock()
        step(self.model, self.data, count)
        self.seconds += self._clock() - began
        return self._add(count, duration)

    def sample(self, duration: float, read: Callable[[Data], float | Array]) -> Samples:
        """Step as long as `duration` [s], and read before the first step and after each.

        Args:
            duration: Simulated time [s], rounded to whole steps.
            read: Returns a number or an array; inputs are copied.
        """
        model, data = self.model, self.data
        times = [data.time]
        values = [np.array(read(data))]
        count = self._count(duration)
        began = self._clock()
        for _ in range(count):
            step(model, data)
            times.append(data.time)
            values.append(np.array(read(data)))
        self.seconds += self._clock() - began
        self._add(count, duration)
        return Samples(np.array(times), np.array(values))

    def forward(self) -> None:
        """Recompute what is derived; no time passes."""
        forward(self.model, self.data)

    def _add(self, count: int, duration: float) -> float:
        """Add steps that were made, and return their simulated time [s]."""
        simulated = simulated_time(duration, self.timestep)
        self.steps += count
        self.time += simulated
        return simulated

    def _count(self, duration: float) -> int:
        """Return the whole number of steps that a duration [s] takes.

        Raises:
            TimestepError: That is none, or the run would have too many.
        """
        timestep = self.timestep
        if duration > (MAX_STEPS - self.steps) * timestep * (1.0 + _SAME_TIME):
            raise TimestepError(
                f"a timestep of {timestep!r} s is too short: the run would take more than "
                f"{MAX_STEPS:,} steps"
            )
        count = round(duration / timestep)
        if count < 1:
            raise TimestepError(
                f"a timestep of {timestep!r} s is too long for a run of {duration:g} s"
            )
        return count


def simulated_time(duration: float, timestep: float) -> float:
    """Return the time [s] of the whole number of steps that is nearest to a duration.

    Args:
        duration: What is asked for [s]; returned as it is where the timestep divides it.
        timestep: Length of a step [s].
    """
    time = round(duration / timestep) * timestep
    return duration if math.isclose(time, duration, rel_tol=_SAME_TIME) else time


def zero_crossings(samples: Samples, rising: bool) -> Array:
    """Return the times (n,) [s] at which a sampled number crosses zero, by a cubic.

    Args:
        samples: Of one number, (n,).
        rising: Whether it crosses upwards.
    """
    values = samples.values
    if not rising:
        values = -values
    crossed = np.flatnonzero((values[1:-2] < 0) & (values[2:-1] >= 0)) + 1
    times: list[float] = []
    for k in crossed.tolist():
        times.append(_root(samples.times[k - 1 : k + 3], values[k - 1 : k + 3]))
    return np.array(times)


def _root(times: Array, values: Array) -> float:
    """Return where the cubic through four points is zero, between the second and the third."""
    start, length = times[1], times[2] - times[1]
    cubic = np.polynomial.Polynomial.fit(times - start, values, 3, domain=[-length, 2 * length])
    slope = cubic.deriv()
    # From the straight line between the two; Newton's method doubles the digits each time.
    at = -values[1] * length / (values[2] - values[1])
    for _ in range(6):
        at -= float(cubic(at) / slope(at))
    return float(start + at)


def zero() -> float:
    """Return 0: the truth of what must not be."""
    return 0.0


def largest_deviation(values: Array, start: float) -> float:
    """Return the relative deviation of values (n,) from a start that is largest in size."""
    relative = values / start - 1.0
    return float(relative[np.abs(relative).argmax()])
