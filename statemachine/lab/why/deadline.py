"""When a search for causes is to end."""

from __future__ import annotations

import math
import time
from collections.abc import Callable


class TimeIsUp(Exception):  # noqa: N818  (it is no error: what is known by then is the answer)
    """The time that a search was given is over."""


class Deadline:
    """The time that a search is given, and what is left of it.

    Attributes:
        seconds: How long it may take by the clock [s]; None for as long as it takes.
        began: When it began, by the clock [s].
    """

    def __init__(
        self,
        seconds: float | None,
        began: float | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin.

        Args:
            seconds: How long it may take [s]; None for as long as it takes.
            began: When it began, by the clock; None for now.
            clock: Tells the time [s].
        """
        self._clock = clock
        self.seconds = seconds
        self.began = clock() if began is None else began

    @property
    def elapsed(self) -> float:
        """Return the time since the beginning [s]."""
        return self._clock() - self.began

    @property
    def left(self) -> float:
        """Return the time that is left [s]; infinite where there is no end."""
        return math.inf if self.seconds is None else self.seconds - self.elapsed

    def check(self, _fraction: float = 1.0) -> None:
        """Raise TimeIsUp if no time is left; a `Progress`, so that it is called during a run."""
        if self.left <= 0.0:
            raise TimeIsUp
