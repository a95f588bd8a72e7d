"""A bar of progress that is drawn on a terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .waiting import Wait

PATIENCE = 0.5  # seconds without a bar
_PACE = 0.1  # seconds between two pictures of it


@contextmanager
def shown_bar(what: str, wait: Wait) -> Iterator[Callable[[float], None]]:
    """Show a bar on the terminal, with the time that remains where that is known and long.

    Args:
        what: What is done.
        wait: What is known of how long it still takes.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[left]}"),
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,  # which would take a thread, beside which no process is forked
        redirect_stdout=False,  # while it starts, a lesson may take what its code prints
    )
    task = bar.add_task(what, total=1.0, left="")
    began = time.monotonic()
    started, drawn = False, 0.0

    def report(fraction: float) -> None:
        nonlocal started, drawn
        wait.ended(fraction)
        now = time.monotonic()
        if not started and now - began > PATIENCE:
            bar.start()
            started = True
        bar.update(task, completed=fraction, left=wait.words())
        if started and now - drawn > _PACE:
            bar.refresh()
            drawn = now

    try:
        yield report
    finally:
        if started:
            bar.stop()
