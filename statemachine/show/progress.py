"""A bar of progress on a terminal, for who waits; a line about a long wait elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_PATIENCE = 0.5  # seconds without a bar
_TRIED, _LONG = 5.0, 20.0  # seconds after which an estimate is made, and one that is said
_PACE = 0.1  # seconds between two pictures of it


@contextmanager
def progress(what: str) -> Iterator[Callable[[float], None]]:
    """A function to call with the fraction done; a bar appears if it takes long.

    Nothing of it stays behind. Where standard error is not a terminal, a line tells a long wait.
    """
    if not sys.stderr.isatty():
        yield _estimate(what)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        Remaining(),
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,  # which would take a thread, beside which no process is forked
        redirect_stdout=False,  # while it starts, a lesson may take what its code prints
    )
    task = bar.add_task(what, total=1.0)
    began = time.monotonic()
    started, drawn = False, 0.0

    def report(fraction: float) -> None:
        nonlocal started, drawn
        now = time.monotonic()
        if not started and now - began > _PATIENCE:
            bar.start()
            started = True
        bar.update(task, completed=fraction)
        if started and now - drawn > _PACE:
            bar.refresh()
            drawn = now

    try:
        yield report
    finally:
        if started:
            bar.stop()


def _estimate(what: str) -> Callable[[float], None]:
    """A function to call with the fraction done, which says once how long it may take in all."""
    began, takes = time.monotonic(), 0.0

    def report(fraction: float) -> None:
        nonlocal takes
        now = time.monotonic() - began
        if not takes and now > _TRIED and fraction:
            takes = now / fraction
            if takes > _LONG:
                print(f"{what}: may take {takes:.0f} s", file=sys.stderr)

    return report
