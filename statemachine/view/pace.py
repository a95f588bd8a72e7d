"""How many steps the clock asks for, and how fast it really went."""

from __future__ import annotations

import math
from collections import deque

from ..errors import BadInputError

SLOWEST, FASTEST = 0.001, 1000.0
_WINDOW = 1.0  # seconds over which the speed is measured


class Pacer:
    """Simulated time that follows a clock.

    It has no clock of its own: each method is told what the clock says [s].
    """

    def __init__(self, timestep: float, speed: float = 1.0, now: float = 0.0) -> None:
        """Begin at `now`.

        Args:
            timestep: Of one step [s].
            speed: Simulated seconds in a second of the clock.
            now: What the clock says.
        """
        self._timestep = timestep
        self._speed = checked_speed(speed)
        self._marks: deque[tuple[float, int]] = deque()
        self._total = 0  # steps taken since the beginning
        self.restart(now)

    @property
    def speed(self) -> float:
        """Simulated seconds that are wanted in a second of the clock."""
        return self._speed

    def set_speed(self, speed: float, now: float) -> None:
        """Another speed from now on.

        Raises:
            BadInputError: It is not between `SLOWEST` and `FASTEST`.
        """
        self._speed = checked_speed(speed)
        self.restart(now)

    def restart(self, now: float) -> None:
        """From `now` on; nothing is due of the time before."""
        self._start, self._taken = now, 0
        self._marks.clear()
        self._marks.append((now, self._total))

    def due(self, now: float) -> int:
        """Steps that should have been taken by now and are not."""
        # A hair more than a whole number of steps may come out a hair less.
        wanted = math.floor((now - self._start) * self._speed / self._timestep + 1e-6)
        return max(0, wanted - self._taken)

    def lag(self, now: float) -> float:
        """How long ago the next step was due [s of the clock]; 0 if it is not due."""
        return self.due(now) * self._timestep / self._speed

    def took(self, steps: int, now: float) -> None:
        """So many steps were taken, and the clock says `now`."""
        self._taken += steps
        self._total += steps
        self._marks.append((now, self._total))
        while len(self._marks) > 2 and self._marks[1][0] <= now - _WINDOW:
            self._marks.popleft()

    def give_up(self, now: float) -> None:
        """Let go of the steps that are due, so that the lag does not grow."""
        self._taken += self.due(now)

    def factor(self, now: float) -> float | None:
        """Simulated seconds in a second of the clock, of late; None before it can be told."""
        began, total = self._marks[0]
        if now - began < _WINDOW / 4:
            return None
        return (self._total - total) * self._timestep / (now - began)


def checked_speed(speed: float) -> float:
    if not SLOWEST <= speed <= FASTEST:  # not a number fails this too
        raise BadInputError(f"speed must be from {SLOWEST:g} to {FASTEST:g}; got {speed:g}")
    return float(speed)
