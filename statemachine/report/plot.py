"""Figures of traces, for a paper or a slide: one column wide, readable without colour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..compare import ChaosFloor, Comparison
from ..runs import Trace
from ..runs.whole import replace_bytes
from . import plot_panels
from .figures import SETTINGS, check_suffix, saved
from .plot_panels import Plot

_SETTINGS = {
    **SETTINGS,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 6.5,
    "axes.linewidth": 0.5,
    "axes.unicode_minus": True,
    "path.simplify": True,
}
_DOTS = 300  # a PNG has to an inch


def plot(
    one: Trace,
    two: Trace,
    comparison: Comparison,
    tip: str | None = None,
    floor: ChaosFloor | None = None,
) -> Plot:
    """The figure of two traces and their comparison.

    Args:
        one: Drawn as a broad, pale line.
        two: Drawn dashed and dark over it.
        comparison: Of the two.
        tip: The site whose way is shown; by default gripperframe, else the last one.
        floor: The chaos floor of the comparison, if that is known.
    """
    return plot_panels.of_comparison(one, two, comparison, tip, floor)


def plot_trace(trace: Trace) -> Plot:
    """The figure of one trace: its joints and what they were told, energy and touches."""
    return plot_panels.of_trace(trace)


def drawn(figure: Plot, form: str) -> bytes:
    """A figure as svg, png or pdf; the same figure gives the same bytes.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """

    def draw() -> Any:
        from .plot_draw import draw

        return draw(figure)

    return saved(draw, form, _SETTINGS, dpi=_DOTS)


def write_plot(figure: Plot, path: Path) -> int:
    """Write a figure to a file .svg, .png or .pdf, whole or not at all; its bytes.

    Raises:
        BadInputError: Another suffix.
        MissingEngineError: matplotlib is not installed.
    """
    return replace_bytes(path, drawn(figure, check_suffix(path)))
