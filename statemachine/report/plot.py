"""Figures of traces, for a paper or a slide: one column wide, readable without colour."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, BinaryIO

from ..compare import ChaosFloor, Comparison
from ..errors import BadInputError, MissingEngineError
from ..traces import Trace
from ..traces.whole import replace_file
from . import plot_panels
from .figures import METADATA
from .plot_panels import Plot

SUFFIXES = (".svg", ".png", ".pdf")
# The same figures give the same bytes: no random names, no settings of the user's.
_SETTINGS = {
    "svg.fonttype": "none",  # text stays text: small, and found by a search
    "svg.hashsalt": "statemachine",
    "pdf.fonttype": 42,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 6.5,
    "axes.linewidth": 0.5,
    "text.parse_math": False,  # a name may have a $ in it
    "axes.unicode_minus": True,
    "path.simplify": True,
}
_DOTS = 300  # a PNG has to an inch


def check_suffix(path: Path) -> None:
    """Raise BadInputError for a file that is no figure, MissingEngineError without the extra."""
    if path.suffix.lower() not in SUFFIXES:
        kinds = f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        raise BadInputError(f"a figure is a file {kinds}; got {path.name!r}")
    _matplotlib()


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
    matplotlib = _matplotlib()
    from .plot_draw import draw

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        out = io.BytesIO()
        draw(figure).savefig(out, format=form, dpi=_DOTS, metadata=METADATA[form])
    return out.getvalue()


def write_plot(figure: Plot, path: Path) -> int:
    """Write a figure to a file .svg, .png or .pdf, whole or not at all; its bytes.

    Raises:
        BadInputError: Another suffix.
        MissingEngineError: matplotlib is not installed.
    """
    check_suffix(path)
    content = drawn(figure, path.suffix.lower().lstrip("."))

    def fill(out: BinaryIO) -> None:
        out.write(content)

    replace_file(path, fill)
    return len(content)


def _matplotlib() -> Any:
    try:
        import matplotlib
        import matplotlib.figure
    except ImportError as error:
        raise MissingEngineError(
            "figures need matplotlib: pip install 'statemachine-sim[plot]'", engine="matplotlib"
        ) from error
    return matplotlib
