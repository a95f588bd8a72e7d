"""What of a gap is import, joint dynamics and contact, in a few lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ...measures.text import quantity
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from .explanation import Explanation
from .settings import CONTACT
from .split import GapSplit, SplitPart

_CLOSE = 0.1  # of a gap: parts that are less far apart are no contradiction
SplitWording = Literal["short", "read alike", "read otherwise"]


@dataclass(frozen=True)
class SplitParagraphs(PageContent):
    """What is said of a gap that was divided by where it arises.

    Attributes:
        split: The parts.
        gap: The gap, with its unit.
        wording: How the three words are explained.
        located: The part of the gap that the table of causes gives contact; None where it has none.
    """

    template = "why_split.md.j2"
    split: GapSplit
    gap: str
    wording: SplitWording
    located: float | None = None

    @property
    def separated(self) -> tuple[SplitPart, ...]:
        """Return the parts that are known."""
        return tuple(part for part in self.split.parts if part.share is not None)

    @property
    def inseparable(self) -> tuple[str, ...]:
        """Return the names of the parts that cannot be separated."""
        return tuple(part.name for part in self.split.parts if part.share is None)

    @property
    def is_without_contact(self) -> bool:
        """Tell whether nothing touches, and a part of the gap is left beside the other two."""
        return not self.split.touches and bool(self.split.parts[-1].share)

    @property
    def is_located_otherwise(self) -> bool:
        """Tell whether the table of causes gives contact quite another part."""
        contact = self.split.parts[-1].share
        if contact is None or self.located is None:
            return False
        return abs(contact - self.located) > _CLOSE

    @property
    def readers(self) -> tuple[str, ...]:
        """Return what read the files, each once."""
        return tuple(dict.fromkeys(self.split.readers))


def split_blocks(result: Explanation, details: bool = False) -> Sequence[Block]:
    """Return what is said of the three parts of a gap; nothing where it was not divided so.

    Where one engine runs both sides, all is import or none: that is a detail.

    Args:
        result: What the gap comes from.
        details: Whether the three words are explained at length.
    """
    split = result.split
    if split is None or (result.one_engine and not details):
        return []
    wording: SplitWording = "short"
    if details:
        wording = "read alike" if split.reads_alike else "read otherwise"
    gap = quantity(result.gap, result.unit)
    located = next((part.share for part in result.found_in if part.name == CONTACT.name), None)
    return render_blocks(SplitParagraphs(split, gap, wording, located))
