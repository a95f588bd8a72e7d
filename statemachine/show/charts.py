"""Pictures of a page, drawn by matplotlib from the figures of a run."""

from __future__ import annotations

import base64
import importlib
import io
import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic_files import replace_bytes
from ..errors import BadInputError
from ..installed import require_extra
from ..interface import Array
from .blocks import Block
from .diagrams import figure as diagram_figure
from .pictures import Bars, Diagram, Traces

_COLOURS = ("#1f5fa8", "#c2571a", "#2f8f4e", "#8a4fa0", "#b03a48", "#6b6b6b", "#3aa6a6")
INK, _PAPER, _BELOW = "#222222", "#ffffff", "#f0f0f0"  # the last: behind the level of zero
_WRITTEN_OUT = range(-3, 4)  # powers of ten; others as 1e6
_TITLE = 80  # letters of a line of it
_LINES = ("-", "--", ":", "-.")
_FLOOR = "#bdbdbd"
# A colour-blind-safe pair, pale and broad under dark and dashed: told apart in grey too.
SIDES: tuple[dict[str, Any], ...] = (
    {"color": "#f0a830", "linewidth": 2.0, "linestyle": "-", "solid_capstyle": "butt"},
    {"color": "#4b1f78", "linewidth": 0.8, "linestyle": (0, (4, 1.6))},
)
GAP: dict[str, Any] = {"color": INK, "linewidth": 1.0}  # of the sides
Box = tuple[float, float, float, float]

Drawn = Traces | Bars | Diagram
_DOTS = 150  # a PNG has to an inch
SUFFIXES = (".svg", ".png", ".pdf")
# The same figures give the same bytes: no settings of the user's, no random names, no date, no
# version.
SETTINGS: dict[str, Any] = {
    "svg.fonttype": "none",  # text stays text: small, and found by a search
    "svg.hashsalt": "statemachine",
    "pdf.fonttype": 42,
    "text.parse_math": False,  # a name may have a $ in it
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
}
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}


def check_suffix(path: Path) -> str:
    """Return the form of a figure's file, "svg", "png" or "pdf".

    Raises:
        BadInputError: It is not a figure.
        MissingEngineError: matplotlib is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        kinds = f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        raise BadInputError(f"a figure is a file {kinds}; got {path.name!r}")
    require_matplotlib()
    return suffix.lstrip(".")


def require_matplotlib() -> Any:
    """Return the package matplotlib.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    require_extra("matplotlib.figure", "a figure", "matplotlib", "plot")
    return importlib.import_module("matplotlib")


def saved(
    draw: Callable[[], Any], form: str, settings: Mapping[str, Any] = SETTINGS, dpi: int = _DOTS
) -> bytes:
    """Return what is drawn, as svg, png or pdf; the same gives the same bytes.

    Args:
        draw: Makes a figure of matplotlib's.
        form: "svg", "png" or "pdf".
        settings: Of matplotlib.
        dpi: Dots of a png to an inch.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    matplotlib = require_matplotlib()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(settings)
        out = io.BytesIO()
        draw().savefig(out, format=form, metadata=_METADATA[form], dpi=dpi)
    return out.getvalue()


def write_pictures(blocks: Sequence[Block], path: Path) -> int:
    """Write all pictures among some blocks into one file, one above the other; its bytes.

    Args:
        blocks: Of a page.
        path: A file .svg, .png or .pdf, written whole or not at all.

    Raises:
        BadInputError: There is no picture among them, or another suffix.
        MissingEngineError: matplotlib is not installed.
    """
    pictures = [block for block in blocks if isinstance(block, Drawn)]
    if not pictures:
        raise BadInputError("there is no picture to write")
    return replace_bytes(path, drawn(pictures, check_suffix(path)))


def drawn(pictures: Sequence[Drawn], form: str) -> bytes:
    """Draw pictures one above the other, as svg, png or pdf.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    sizes = [_size_of(picture) for picture in pictures]
    heights = [height for _, height in sizes]

    def draw() -> Any:
        from matplotlib.figure import Figure

        size = max(width for width, _ in sizes), sum(heights)
        figure = Figure(size, facecolor=_PAPER, layout="constrained")
        rows = figure.subplots(len(pictures), height_ratios=heights, squeeze=False)[:, 0]
        for axes, picture in zip(rows, pictures, strict=True):
            draw_picture(axes, picture)
            if heights[1:]:
                axes.set_title(textwrap.fill(picture.title, _TITLE), fontsize="medium", loc="left")
        return figure

    return saved(draw, form)


def draw_picture(axes: Any, picture: Drawn) -> None:
    """Draw a picture on axes of matplotlib's."""
    match picture:
        case Traces():
            _traces(axes, picture)
        case Bars():
            _bars(axes, picture)
        case Diagram():
            diagram_figure.draw(axes, picture.shapes)


def chart(picture: Traces, size: tuple[float, float], box: Box) -> str:
    """Draw curves as SVG without a legend, where something goes along the axis of time.

    Args:
        picture: The curves.
        size: Width and height [inches].
        box: Left, bottom, width and height of the axes, as shares of that.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """

    def draw() -> Any:
        from matplotlib.figure import Figure

        figure = Figure(size, facecolor="none")
        draw_picture(figure.add_axes(box), picture)
        return figure

    settings = {"font.size": 8, "axes.linewidth": 0.6, "axes.facecolor": "none"}
    return saved(draw, "svg", {**SETTINGS, **settings}).decode()


def _traces(axes: Any, picture: Traces) -> None:
    """Draw curves over one axis, with the tolerance and the chaos floor where they are known."""
    curves = [(np.asarray(x, float), np.asarray(y, float)) for x, y in picture.curves.values()]
    every = np.concatenate([y for _, y in curves])
    least = _log_axis(axes, every, picture.tolerance) if picture.log else -np.inf
    styles = _styles(picture)
    for name, (x, y), style in zip(picture.curves, curves, styles, strict=True):
        points = x, y
        if picture.log:
            points = _parted(x, np.where(y == 0, 0.0, np.maximum(y, least)))
        axes.plot(*points, label=name, marker="o" if picture.log_across else "", **style)
    if picture.log_across:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(lambda _value, _: "")
    _spanned(axes, every, picture.least)
    if picture.tolerance:
        axes.axhline(picture.tolerance, color=INK, linewidth=0.7, linestyle=(0, (1, 1.5)))
    if picture.floor is not None:
        x, y = (np.asarray(values) for values in picture.floor)
        style = {"color": _FLOOR, "linewidth": 0, "zorder": 0.5}
        axes.fill_between(x, axes.get_ylim()[0], y, where=y > least, **style)
    axes.set_xlabel(picture.across)
    axes.set_ylabel(picture.up)
    axes.spines[["top", "right"]].set_visible(False)
    if picture.sides:
        axes.set_xlim(0, max(curves[0][0][-1], 1e-9))
        return
    axes.grid(alpha=0.3)
    if len(picture.curves) > 1:
        axes.legend(fontsize="small", frameon=False, loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _styles(picture: Traces) -> list[dict[str, Any]]:
    """Return the style of each curve.

    Of curves that are called "engine: what", what has one colour, an engine one kind of line.
    """
    if picture.sides:
        return [GAP if picture.log else SIDES[k] for k in range(len(picture.curves))]
    parts = [name.rpartition(": ") for name in picture.curves]
    engines = list(dict.fromkeys(engine for engine, _, _ in parts))
    things = list(dict.fromkeys(thing for _, _, thing in parts))
    styles = []
    for engine, _, thing in parts:
        colour = _COLOURS[things.index(thing) % len(_COLOURS)]
        line = _LINES[engines.index(engine) % len(_LINES)]
        styles.append({"linestyle": line, "color": colour})
    return styles


def _spanned(axes: Any, values: Array, least: float) -> None:
    """Let the vertical axis go over so much at least: what does not matter is not blown up."""
    values = values[np.isfinite(values)]
    if len(values) and least > np.ptp(values):
        middle = (values.min() + values.max()) / 2
        axes.set_ylim(middle - 0.58 * least, middle + 0.58 * least)


def _log_axis(axes: Any, values: Array, tolerance: float | None) -> float:
    """Make the axis a log one with a level of its own for what is exactly zero.

    Returns:
        The least value that has a place: below a thousandth of the tolerance nothing matters.
    """
    shown = values[np.isfinite(values) & (values > 0)]
    if tolerance:
        shown = np.append(shown, tolerance)
    most, least = (shown.max(), shown.min()) if len(shown) else (1.0, 1.0)
    high = math.ceil(math.log10(most) + 0.05)
    low = min(math.floor(math.log10(least)), high - 2)
    if tolerance:
        low = max(low, math.floor(math.log10(tolerance)) - 3)
    below, has_zero = 10.0**low, bool((values == 0).any())
    axes.set_yscale("symlog", linthresh=below, linscale=0.2 * (high - low))
    axes.set_ylim(-0.25 * below if has_zero else below, 10.0**high)
    if has_zero:
        axes.axhspan(-0.25 * below, 0.5 * below, color=_BELOW, linewidth=0, zorder=0)
    room = max(2, int(axes.bbox.height / axes.figure.dpi / 0.35))
    powers = range(high, low - 1, -(high - low + 1) // room)[::-1]
    names = [f"{10.0**k:g}" if k in _WRITTEN_OUT else f"1e{k}".replace("-", "−") for k in powers]
    ticks = [10.0**k for k in powers]
    if has_zero:
        ticks, names = [0.0, *ticks], ["0", *names]
    axes.set_yticks(ticks, names)
    axes.minorticks_off()
    return below


def _parted(x: Array, y: Array) -> tuple[Array, Array]:
    """Return points of a line that is broken where it comes from zero or goes there.

    Between zero and another value lie all powers of ten, and the line was at none of them.
    """
    breaks = np.flatnonzero(np.diff(y == 0)) + 1
    return np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)


def _bars(axes: Any, picture: Bars) -> None:
    """Draw bars from left to right, those of a name one below the other."""
    high = 0.8 / len(picture.bars)
    for k, (what, bars) in enumerate(picture.bars.items()):
        places = [n + (k + 0.5) * high - 0.4 for n in range(len(bars))]
        axes.barh(places, bars, high * 0.9, color=_COLOURS[k], alpha=0.75, label=what)
    axes.set_yticks(range(len(picture.names)), picture.names)
    axes.invert_yaxis()
    axes.set_xlabel(picture.across)
    axes.grid(alpha=0.3, axis="x")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize="small", frameon=False, loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _size_of(picture: Drawn) -> tuple[float, float]:
    """Return width and height of a picture [inches]."""
    match picture:
        case Traces():
            return 7.0, 3.4
        case Bars(names=names):
            return 7.0, 0.9 + 0.42 * len(names)
        case Diagram(shapes=shapes):
            return diagram_figure.size_in_inches(shapes)


def data_url(content: bytes, kind: str) -> str:
    """Return a picture as a URL that has it within itself.

    Args:
        content: Of its file.
        kind: Of its file, as media types name it: "svg+xml" or "webp".
    """
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"
