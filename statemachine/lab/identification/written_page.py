"""What was written of the model's file, as blocks of a page."""

from __future__ import annotations

from dataclasses import dataclass

from ...engines.description.file_changes import AttributeChange
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..why.rewriting import RewrittenFile
from .results import IdentificationResult

_FARTHER = 1.5  # times as far from the arm as the fit: that needs a reason


@dataclass(frozen=True)
class UnwrittenFigures:
    """Figures that are determined and were not written, all for one reason.

    Attributes:
        names: What they are.
        reason: Why they were not written.
    """

    names: tuple[str, ...]
    reason: str


@dataclass(frozen=True)
class WrittenPart(PageContent):
    """What was written of the model's file.

    Attributes:
        result: What the recording tells.
        rewritten: The file.
        has_changes: Whether each attribute that was changed has a row, and each reason why one was
            not; else what was not written is counted.
    """

    template = "written_model.md.j2"
    result: IdentificationResult
    rewritten: RewrittenFile
    has_changes: bool

    @property
    def is_farther(self) -> bool:
        """Tell whether the file is farther from the arm than what was fitted, and lacks figures."""
        gap, fitted = self.rewritten.gap, self.result.gap.fitted
        if gap is None or fitted is None or not self.unchanged:
            return False
        return gap > _FARTHER * fitted

    @property
    def is_measured(self) -> bool:
        """Tell whether it is known how far the file is from the arm."""
        return self.rewritten.gap is not None

    @property
    def unwritten_count(self) -> int:
        """Return of how many figures it is only counted that they were not written."""
        return 0 if self.has_changes else len(self.rewritten.not_written)

    @property
    def unwritten(self) -> tuple[UnwrittenFigures, ...]:
        """Return what is determined and was not written, by the reasons; empty if it is counted."""
        if not self.has_changes:
            return ()
        names: dict[str, list[str]] = {}
        for row in self.rewritten.not_written:
            names.setdefault(row.reason, []).append(row.cause)
        return tuple(UnwrittenFigures(tuple(each), reason) for reason, each in names.items())

    @property
    def unchanged(self) -> int:
        """Return how many figures are not determined, and stay as they were."""
        return sum(each.verdict != "determined" for each in self.result.parameters)

    @property
    def has_delay(self) -> bool:
        """Tell whether a delay is among what was written."""
        return any(change.attribute == "delay" for change in self.rewritten.written)

    @property
    def changes(self) -> tuple[AttributeChange, ...]:
        """Return the attributes that have a row."""
        return self.rewritten.written if self.has_changes else ()


def written_blocks(result: IdentificationResult, details: bool) -> list[Block]:
    """Return what was written, and what of the determined figures was not, and why.

    Empty where no file was to be written.

    Args:
        result: What the recording tells.
        details: Whether each attribute that was changed has a row.
    """
    if result.rewritten is None:
        return []
    return render_blocks(WrittenPart(result, result.rewritten, details))
