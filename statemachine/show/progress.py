"""A bar of progress on a terminal, for who waits; a line about a long wait elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .waiting import Wait


@contextmanager
def progress(
    what: str, runs_at_once: int = 0, expected_seconds: float | None = None
) -> Iterator[Callable[[float], None]]:
    """Give a function to call with the fraction done; a bar appears if it takes long.

    Nothing of it stays behind. Where standard error is not a terminal, a line tells a long wait.
    How long it takes is said only where that is known from runs that were measured.

    Args:
        what: What is done.
        runs_at_once: How many runs are made side by side, where each call tells that runs have
            ended; 0 where it does not.
        expected_seconds: How long it takes by what was measured before [s]; None if unknown.
    """
    wait = Wait(runs_at_once, expected_seconds)
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
