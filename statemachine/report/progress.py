"""A progress bar on standard error, for what takes longer than a moment."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_PATIENCE = 0.5  # seconds without a bar
_PACE = 0.1  # seconds between two pictures of it


@contextmanager
def progress(what: str) -> Iterator[Callable[[float], None]]:
    """A function to call with the fraction done; a bar appears if it takes long.

    Nothing is shown where standard error is no terminal, and nothing stays behind.
    """
    if not sys.stderr.isatty():
        yield lambda _fraction: None
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
