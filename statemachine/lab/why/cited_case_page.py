"""The sentence that says which side is nearer to the truth, and in which case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import milliseconds
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..validate.page import error_text
from .cited_case import CitedCase, SideInCase
from .explanation import Explanation


@dataclass(frozen=True)
class CitedCasePage(PageContent):
    """What is said of the case that decides a cause.

    Attributes:
        cited: The case, and what both sides gave in it.
        details: Whether the case is described, too.
    """

    template = "why_cited_case.md.j2"
    cited: CitedCase
    details: bool

    @property
    def is_nearer_left(self) -> bool:
        """Tell whether the left is nearer to the truth."""
        return self.cited.nearer == "left"

    @property
    def nearer(self) -> SideInCase:
        """Return the side that is nearer to the truth."""
        return self.cited.left if self.is_nearer_left else self.cited.right

    @property
    def farther(self) -> SideInCase:
        """Return the other side."""
        return self.cited.right if self.is_nearer_left else self.cited.left

    @property
    def nearer_error(self) -> str:
        """Return the size of the error of the nearer side, with its unit."""
        return error_text(self.nearer.size, self.nearer.error_unit)

    @property
    def farther_error(self) -> str:
        """Return the size of the error of the other side, with its unit."""
        return error_text(self.farther.size, self.farther.error_unit)

    @property
    def has_diverged(self) -> bool:
        """Tell whether the run of the other side diverged."""
        return self.farther.error is None

    @property
    def timesteps(self) -> str:
        """Return the timestep of both sides, or of the left and then of the right."""
        steps = dict.fromkeys((self.cited.left.timestep, self.cited.right.timestep))
        return " and ".join(milliseconds(step) for step in steps)


def cited_case_blocks(result: Explanation, details: bool = False) -> Sequence[Block]:
    """Return what is said of the case that decides a cause; nothing where none does.

    Args:
        result: What the gap comes from.
        details: Whether the case is described, too.
    """
    if result.cited_case is None:
        return []
    return render_blocks(CitedCasePage(result.cited_case, details))
