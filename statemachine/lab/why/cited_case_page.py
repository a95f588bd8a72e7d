"""The sentence that says which side is nearer to the truth, and in which case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import quantity
from ...show.blocks import Block
from ...show.templates import PageContent, render_blocks
from ..validate.shown_error import error_text
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
    def case(self) -> str:
        """Return the name of the case that the nearer side ran."""
        return self.nearer.case

    @property
    def other_case(self) -> str:
        """Return the name of the case of the other side where it is another one; else ""."""
        return "" if self.farther.case == self.case else self.farther.case

    @property
    def timesteps(self) -> str:
        """Return the timestep of both sides, or of the left and then of the right."""
        steps = dict.fromkeys((self.cited.left.timestep, self.cited.right.timestep))
        return " and ".join(_milliseconds(step) for step in steps)

    @property
    def own_timesteps(self) -> str:
        """Return the timesteps of the sides at which the case was not run; "" where it was."""
        sides = (self.cited.left, self.cited.right)
        steps = dict.fromkeys(
            side.own_timestep for side in sides if side.timestep != side.own_timestep
        )
        return " and ".join(_milliseconds(step) for step in steps)

    @property
    def left_in_run(self) -> str:
        """Return how far the left is from its own finer run, with its unit; "" if not known."""
        in_run = self.cited.in_run
        return "" if in_run is None else quantity(in_run.left, in_run.unit)

    @property
    def right_in_run(self) -> str:
        """Return how far the right is from its own finer run, with its unit; "" if not known."""
        in_run = self.cited.in_run
        return "" if in_run is None else quantity(in_run.right, in_run.unit)

    @property
    def has_gap_of_finer_runs(self) -> bool:
        """Tell whether the finer runs are no nearer to each other, so that no truth is in reach."""
        return self.cited.in_run is not None and not self.cited.in_run.converges

    @property
    def finer_gap(self) -> str:
        """Return the gap between the finer runs, with its unit; "" if not known."""
        in_run = self.cited.in_run
        return "" if in_run is None else quantity(in_run.finer_gap, in_run.unit)


def _milliseconds(timestep: float) -> str:
    """Return a timestep [s] as it is read, with four digits at most."""
    return f"{1e3 * timestep:.4g} ms"


@dataclass(frozen=True)
class ContradictedCasePage(CitedCasePage):
    """What is said of a case with which the run that was asked does not agree."""

    template = "why_contradicted_case.md.j2"


def cited_case_blocks(result: Explanation, details: bool = False) -> Sequence[Block]:
    """Return what is said of the case that decides a cause; nothing where none does.

    A case with which the run that was asked does not agree is a detail.

    Args:
        result: What the gap comes from.
        details: Whether the case is described, too.
    """
    if result.cited_case is not None:
        return render_blocks(CitedCasePage(result.cited_case, details))
    if result.contradicted_case is not None and details:
        return render_blocks(ContradictedCasePage(result.contradicted_case, details))
    return []
