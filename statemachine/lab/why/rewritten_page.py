"""What was written of the right's file, and what was not, as blocks of a page."""

from __future__ import annotations

from dataclasses import dataclass

from ...engines.description.file_changes import AttributeChange, UnwrittenChange
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from .rewriting import RewrittenFile


@dataclass(frozen=True)
class RewrittenPart(PageContent):
    """What was written of the right's file.

    Attributes:
        rewritten: The file.
        has_changes: Whether each attribute that was changed has a row.
        most: How many rows there are of what was not written.
    """

    template = "why_rewritten.md.j2"
    rewritten: RewrittenFile
    has_changes: bool
    most: int

    @property
    def is_written(self) -> bool:
        """Tell whether a file was written."""
        return bool(self.rewritten.written)

    @property
    def is_run(self) -> bool:
        """Tell whether the file was run."""
        return bool(self.rewritten.quantity)

    @property
    def is_measured(self) -> bool:
        """Tell whether the run of the file reached its end."""
        return self.rewritten.gap is not None

    @property
    def all_written(self) -> bool:
        """Tell whether no difference is left in the file that was written."""
        return self.is_written and not self.rewritten.not_written

    @property
    def unwritten_count(self) -> int:
        """Return how many differences are not written."""
        return len(self.rewritten.not_written)

    @property
    def changes(self) -> tuple[AttributeChange, ...]:
        """Return the attributes that have a row in the table."""
        return self.rewritten.written if self.has_changes else ()

    @property
    def refusals(self) -> tuple[UnwrittenChange, ...]:
        """Return the changes that were not written, as far as they have a row in the table."""
        return self.rewritten.not_written[: self.most]

    @property
    def more_refusals(self) -> int:
        """Return the number of unwritten changes without a row; 0 where the table has no limit."""
        if not self.most:
            return 0
        return len(self.rewritten.not_written) - len(self.refusals)


def rewritten_blocks(rewritten: RewrittenFile, most: int | None = None) -> list[Block]:
    """Return what was written, and what was not.

    Args:
        rewritten: The file.
        most: How many rows there are of what was not written, and none of what was; None for all
            of both.
    """
    if most is None:
        return render_blocks(RewrittenPart(rewritten, True, len(rewritten.not_written)))
    return render_blocks(RewrittenPart(rewritten, False, most))
