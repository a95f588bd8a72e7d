"""A page: what a lesson has to say, free of how it is shown.

Lessons, probes and gradings make pages; `report` turns them into text for a terminal and into
other media.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Code:
    """Lines as the reader would type them."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Table:
    """Rows of cells, already formatted.

    Attributes:
        headers: One for each column.
        rows: Cells as text.
        title: What the table shows.
        words: Columns of words, by number; they are aligned to the left, others right.
        emphasis: Rows to set off, by number.
    """

    headers: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    words: frozenset[int] = frozenset({0})
    emphasis: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Verdict:
    """A statement that was checked, and whether it held."""

    text: str
    holds: bool


Block = Text | Code | Table | Verdict


@dataclass(frozen=True)
class Page:
    """A lesson's page.

    Attributes:
        title: Its heading.
        origin: What it was computed with, in one line.
        blocks: Its content, from top to bottom.
    """

    title: str
    origin: str
    blocks: Sequence[Block] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether every verdict on it held."""
        return all(block.holds for block in self.blocks if isinstance(block, Verdict))
