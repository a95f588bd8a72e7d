"""Who is told how an answer gets on: its stages, how much of each is done, and notes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Protocol

from .drive import Progress, no_progress

if TYPE_CHECKING:
    from ...show.blocks import Page


class Reporter(Protocol):
    """Somebody who is told how an answer gets on; what computes it prints nothing itself."""

    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> AbstractContextManager[Progress]:
        """Begin a stage of the work, and give what is told the fraction of it that is done.

        Args:
            what: What is done.
            runs_at_once: How many runs are made side by side, at most, where each fraction is told
                as runs end: only then can be measured how long the rest takes. 0 where it is told
                of something else.
            expected_seconds: How long it takes by what was measured before [s]; None if unknown.
        """
        ...

    def note(self, text: str) -> None:
        """Take a line that a reader should know beside the result."""
        ...

    def so_far(self, page: Page) -> None:
        """Take a page of what is known while the work goes on; the result comes later."""
        ...


class QuietReporter:
    """A Reporter that shows no progress; a note becomes a warning of Python."""

    @contextmanager
    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> Iterator[Progress]:
        """Begin a stage of which nothing is shown."""
        yield no_progress

    def note(self, text: str) -> None:
        """Warn of it."""
        warnings.warn(text, UserWarning, stacklevel=3)

    def so_far(self, page: Page) -> None:
        """Show nothing."""


QUIET = QuietReporter()
