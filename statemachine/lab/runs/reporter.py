"""Who is told how an answer gets on: its stages, how much of each is done, and notes."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

from .drive import Progress, silent


class Reporter(Protocol):
    """Somebody who is told how an answer gets on; what computes it prints nothing itself."""

    def stage(self, what: str) -> AbstractContextManager[Progress]:
        """Begin a stage of the work, and give what is told the fraction of it that is done."""
        ...

    def note(self, text: str) -> None:
        """Take a line that a reader should know beside the result."""
        ...


class QuietReporter:
    """A Reporter that shows no progress; a note becomes a warning of Python."""

    @contextmanager
    def stage(self, what: str) -> Iterator[Progress]:
        """Begin a stage of which nothing is shown."""
        yield silent

    def note(self, text: str) -> None:
        """Warn of it."""
        warnings.warn(text, UserWarning, stacklevel=3)


QUIET = QuietReporter()
