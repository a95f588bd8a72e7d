"""What sides, quantities and moments are called on every page of a comparison."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...show.blocks import TableCell
from ..compare import Agreement, Comparison
from ..compare.series import SETTLED
from ..recordings import Trace

if TYPE_CHECKING:
    pass


def short_labels(comparison: Comparison) -> tuple[str, str]:
    """Return what the sides are called for short: their engines, or what tells two of one apart."""
    return comparison.left.short, comparison.right.short


def long_labels(comparison: Comparison) -> tuple[str, str]:
    """Return what the sides are called: engine and version, or what tells two of one apart."""
    return comparison.left.label, comparison.right.label


def traces_of(comparison: Comparison) -> tuple[Trace, Trace]:
    """Return the runs of both sides."""
    return comparison.left.trace, comparison.right.trace


def window(comparison: Comparison) -> str:
    """Return what the figures of the end are a mean over."""
    return f"the last {SETTLED * comparison.until:.3g} s"


def name_of(name: str) -> str:
    """Return a quantity's name where names stand in a list: without a comma of its own."""
    return name.replace(", ", " ")


def moment(time: float | None) -> TableCell:
    """Return a time of the run [s] in a cell, to which a slider can go."""
    return TableCell("never" if time is None else f"{time:.3f}", at=time)


def named(agreement: Agreement) -> str:
    """Return what a quantity is called within a sentence."""
    if agreement.kind in ("joint", "slide"):
        return f"joint {agreement.name}"
    name, _, part = agreement.name.partition(", ")
    return f"the {part} of {name}" if part else f"the {name}"
