"""How a command of long work tells how it gets on, and is ended by a Ctrl-C wherever it comes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..processes.interrupts import noting_interrupts
from .common import TerminalReporter


class LongWorkReporter(TerminalReporter):
    """A `TerminalReporter` whose stages end by a Ctrl-C that was lost, at the next progress."""

    @contextmanager
    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> Iterator[Callable[[float], None]]:
        """Show a bar for a stage of the work."""
        bar = super().stage(what, runs_at_once, expected_seconds)
        with noting_interrupts() as raise_if_noted, bar as report:

            def tell(fraction: float) -> None:
                raise_if_noted()
                report(fraction)

            yield tell
