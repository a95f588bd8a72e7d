"""What is known of a wait: how long it still takes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .remaining import RemainingTime


class Wait:
    """What is known of how long it still takes."""

    def __init__(self, runs_at_once: int, expected_seconds: float | None) -> None:
        self._measured: RemainingTime | None = None
        if runs_at_once:
            from .remaining import RemainingTime  # here, for most work is too short to measure

            self._measured = RemainingTime(runs_at_once)
        self._expected_seconds, self._began = expected_seconds, time.monotonic()

    def ended(self, fraction: float) -> None:
        """Note what is done by now."""
        if self._measured is not None:
            self._measured.ended(fraction)

    @property
    def seconds(self) -> float | None:
        """Return how long it still takes [s]; None where that is not known."""
        if self._expected_seconds is not None:
            return max(0.0, self._expected_seconds - (time.monotonic() - self._began))
        return None if self._measured is None else self._measured.seconds

    def words(self) -> str:
        """Return how long it still takes in words; "" where that is not known, or is not long."""
        seconds = self.seconds
        if seconds is None:
            return ""
        from .remaining import LONG, in_words

        return in_words(seconds) if seconds > LONG else ""
