"""What was written of the model's file, as blocks of a page."""

from __future__ import annotations

from dataclasses import dataclass

from ...engines.description.file_changes import AttributeChange
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..why.rewriting import RewrittenFile


@dataclass(frozen=True)
class WrittenPart(PageContent):
    """What was written of the model's file.

    Attributes:
        rewritten: The file.
        has_changes: Whether each attribute that was changed has a row.
    """

    template = "written_model.md.j2"
    rewritten: RewrittenFile
    has_changes: bool

    @property
    def has_delay(self) -> bool:
        """Tell whether a delay is among what was written."""
        return any(change.attribute == "delay" for change in self.rewritten.written)

    @property
    def changes(self) -> tuple[AttributeChange, ...]:
        """Return the attributes that have a row."""
        return self.rewritten.written if self.has_changes else ()


def written_blocks(rewritten: RewrittenFile, details: bool) -> list[Block]:
    """Return what was written, and what of the determined figures was not, and why.

    Args:
        rewritten: The file.
        details: Whether each attribute that was changed has a row.
    """
    return render_blocks(WrittenPart(rewritten, details))
