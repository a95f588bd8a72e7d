"""For how long holds what a function of the user's returned: a number of steps, or a time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from ...errors import BadInputError, shown
from ...interface.checks import as_count
from ...measures import parse_amount
from ...measures.text import milliseconds
from ...typed_numbers import is_count

# How often a function is called: at the first of so many steps, or once in a time such as "5ms".
Every = int | str
_WHOLE = 1e-6  # of a step: a number of steps that is nearer to a whole one is that one
_LARGEST_DENOMINATOR = 10**7  # of a timestep [s] as a fraction


def checked_every(every: Every) -> Every:
    """Return how often a function is called.

    Raises:
        BadInputError: It is no whole number of steps from 1 on, and no time above 0 with its unit.
    """
    if not isinstance(every, str):
        return as_count(every, "every")
    seconds_of(every)
    return every


def every_of_word(word: str) -> Every:
    """Return how often a function is called, as somebody typed it: "5" steps, or "5ms".

    Raises:
        BadInputError: It is neither.
    """
    if is_count(word) and int(word) >= 1:
        return int(word)
    seconds_of(word)
    return word


def seconds_of(every: str) -> float:
    """Return a time such as "5ms" or "0.005s" [s].

    Raises:
        BadInputError: It is none, or not above 0.
    """
    seconds, unit = parse_amount(every)
    if unit != "s" or math.isnan(seconds):
        raise BadInputError(
            "every is a number of steps, at least 1, or a time with its unit such as 5ms or 0.005s;"
            f" got {shown(every)}"
        )
    return seconds


def steps_of(every: Every, timestep: float) -> int:
    """Return for how many steps holds what the function returned.

    Args:
        every: How often it is called.
        timestep: The time from one step to the next [s].

    Raises:
        BadInputError: The time is not a whole number of steps.
    """
    if not isinstance(every, str):
        return every
    exact = seconds_of(every) / timestep
    steps = round(exact)
    if steps < 1 or abs(exact - steps) > _WHOLE * max(1, steps):
        raise BadInputError(
            f"a function is called at the beginning of a step, and {every} is {exact:.6g} steps of "
            f"{milliseconds(timestep)}: name a whole multiple of each side's timestep"
        )
    return steps


@dataclass(frozen=True)
class CallPeriods:
    """How often a function of the user's is called on two sides.

    Attributes:
        left: The time from one call to the next on the left [s].
        right: The same on the right [s].
        common: A time that is a whole number of steps on both sides [s]: the shorter of both
            periods, or else the longer one, where it is such a time; else the shortest.
    """

    left: float
    right: float
    common: float

    @property
    def differ(self) -> bool:
        """Tell whether the function is called more often on one side."""
        return not math.isclose(self.left, self.right, rel_tol=_WHOLE)

    @property
    def common_word(self) -> str:
        """Return the common time, as one types it."""
        return f"{1000 * self.common:.10g}ms"


def call_periods(every: Every, timesteps: tuple[float, float]) -> CallPeriods:
    """Return how often a function is called on two sides.

    Args:
        every: As it was asked for.
        timesteps: Of the left and of the right [s].

    Raises:
        BadInputError: The time is not a whole number of steps of a side.
    """
    left, right = (steps_of(every, timestep) * timestep for timestep in timesteps)
    for period in sorted((left, right)):
        if all(_is_whole(period / timestep) for timestep in timesteps):
            return CallPeriods(left, right, period)
    return CallPeriods(left, right, _least_common_multiple(*timesteps))


def _is_whole(steps: float) -> bool:
    return round(steps) >= 1 and abs(steps - round(steps)) <= _WHOLE * steps


def _least_common_multiple(left: float, right: float) -> float:
    """Return the shortest time that is a whole number of both times [s]."""
    first = Fraction(left).limit_denominator(_LARGEST_DENOMINATOR)
    second = Fraction(right).limit_denominator(_LARGEST_DENOMINATOR)
    numerator = math.lcm(first.numerator, second.numerator)
    return numerator / math.gcd(first.denominator, second.denominator)
