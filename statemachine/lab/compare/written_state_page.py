"""That a function of the user's writes the state: said on the first screen of a comparison."""

from __future__ import annotations

from dataclasses import dataclass

from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..recordings import Trace


@dataclass(frozen=True)
class WrittenState(PageContent):
    """How often a function wrote the state.

    Attributes:
        left, right: In how many rows it did.
        rows_left, rows_right: Of how many.
    """

    template = "written_state.md.j2"
    left: int
    right: int
    rows_left: int
    rows_right: int


def written_state_blocks(left: Trace, right: Trace) -> list[Block]:
    """Say that a function wrote the state of a side; nothing where it wrote ctrl alone."""
    written = left.header.rewritten, right.header.rewritten
    if not any(written):
        return []
    return render_blocks(WrittenState(*written, len(left), len(right)))
