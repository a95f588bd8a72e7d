"""A bar of progress on a terminal, for who waits; a line about a long wait elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .remaining import RemainingTime


@contextmanager
def progress(
    what: str, runs_at_once: int = 0, takes: float | None = None
) -> Iterator[Callable[[float], None]]:
    """Give a function to call with the fraction done; a bar appears if it takes long.

    Nothing of it stays behind. Where standard error is not a terminal, a line tells a long wait.
    How long it takes is said only where that is known from runs that were measured.

    Args:
        what: What is done.
        runs_at_once: How many runs are made side by side, where each call tells that runs have
            ended; 0 where it does not.
        takes: How long it takes, from what was measured before [s]; None where that is not known.
    """
    wait = Wait(runs_at_once, takes)
    if sys.stderr.isatty():
        from .progress_bar import shown_bar  # here, for nobody sees one elsewhere

        with shown_bar(what, wait) as report:
            yield report
        return
    is_said = False

    def tell(fraction: float) -> None:
        nonlocal is_said
        wait.ended(fraction)
        words = "" if is_said else wait.words()
        if words:
            is_said = True
            print(f"{what}: {words}", file=sys.stderr, flush=True)

    tell(0.0)
    yield tell


class Wait:
    """What is known of how long it still takes."""

    def __init__(self, runs_at_once: int, takes: float | None) -> None:
        self._measured: RemainingTime | None = None
        if runs_at_once:
            from .remaining import RemainingTime  # here, for most work is too short to measure

            self._measured = RemainingTime(runs_at_once)
        self._takes, self._began = takes, time.monotonic()

    def ended(self, fraction: float) -> None:
        """Note what is done by now."""
        if self._measured is not None:
            self._measured.ended(fraction)

    @property
    def seconds(self) -> float | None:
        """How long it still takes [s]; None where that is not known."""
        if self._takes is not None:
            return max(0.0, self._takes - (time.monotonic() - self._began))
        return None if self._measured is None else self._measured.seconds

    def words(self) -> str:
        """Return how long it still takes in words; "" where that is not known, or is not long."""
        seconds = self.seconds
        if seconds is None:
            return ""
        from .remaining import LONG, in_words

        return in_words(seconds) if seconds > LONG else ""
