"""A progress bar on standard error, for what takes longer than a moment."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

_PATIENCE = 0.5  # seconds without a bar


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
        redirect_stdout=False,  # while it starts, a lesson may take what its code prints
    )
    task = bar.add_task(what, total=1.0)
    began = time.monotonic()
    started = False

    def report(fraction: float) -> None:
        nonlocal started
        if not started and time.monotonic() - began > _PATIENCE:
            bar.start()
            started = True
        bar.update(task, completed=fraction)

    try:
        yield report
    finally:
        if started:
            bar.stop()
