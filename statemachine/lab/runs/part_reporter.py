"""A Reporter of a part of an answer."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from .drive import Progress
from .reporter import Reporter

if TYPE_CHECKING:
    from ...show.blocks import Page


class PartReporter:
    """A Reporter of a part of an answer: another one is told all but pages of what is known."""

    def __init__(self, whole: Reporter) -> None:
        """Take who is told of the whole answer."""
        self._whole = whole

    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> AbstractContextManager[Progress]:
        """Begin a stage, as of the whole."""
        return self._whole.stage(what, runs_at_once, expected_seconds)

    def note(self, text: str) -> None:
        """Take a line, as of the whole."""
        self._whole.note(text)

    def so_far(self, page: Page) -> None:
        """Show nothing: it is about the part alone."""
