"""Pictures of a page, drawn by matplotlib from the figures of a run."""

from __future__ import annotations

import importlib
import io
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import BadInputError
from ..installed import require_extra
from ..page import Bars, Block, HeatMap, Pipeline, Slots, Traces
from ..runs.whole import replace_bytes
from .log_axis import LogAxis

_COLOURS = ("#1f5fa8", "#c2571a", "#2f8f4e", "#8a4fa0", "#b03a48", "#6b6b6b", "#3aa6a6")
_INK, _PAPER, _BELOW = "#222222", "#ffffff", "#f0f0f0"  # the last: behind the level of zero
_WIDE = 30.0  # times the least value: beyond, colours are logarithmic
_WRITTEN, _LONG = 150, 60  # cells whose figures are written; letters that fit under a map
_UP = 24  # letters that fit beside a map
_POWERS = 8  # that a log axis names, at most
_TITLE = 80  # letters of a line of it


Drawn = Traces | Slots | Pipeline | HeatMap | Bars
_DOTS = 150  # a PNG has to an inch
SUFFIXES = (".svg", ".png", ".pdf")
# The same figures give the same bytes: no settings of the user's, no random names, no date, no
# version.
SETTINGS: dict[str, Any] = {
    "svg.fonttype": "none",  # text stays text: small, and found by a search
    "svg.hashsalt": "statemachine",
    "pdf.fonttype": 42,
    "text.parse_math": False,  # a name may have a $ in it
}
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
}


def check_suffix(path: Path) -> str:
    """The form of a figure's file, "svg", "png" or "pdf".

    Raises:
        BadInputError: It is no figure.
        MissingEngineError: matplotlib is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        kinds = f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
        raise BadInputError(f"a figure is a file {kinds}; got {path.name!r}")
    require_matplotlib()
    return suffix.lstrip(".")


def require_matplotlib() -> Any:
    """The package matplotlib.

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    require_extra("matplotlib.figure", "a figure", "matplotlib", "plot")
    return importlib.import_module("matplotlib")


def saved(draw: Callable[[], Any], form: str, settings: dict[str, Any], **how: Any) -> bytes:
    """What is drawn, as svg, png or pdf; the same gives the same bytes.

    Args:
        draw: Makes a figure of matplotlib's.
        form: "svg", "png" or "pdf".
        settings: Of matplotlib.
        how: What `savefig` takes.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    matplotlib = require_matplotlib()
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(settings)
        out = io.BytesIO()
        draw().savefig(out, format=form, metadata=_METADATA[form], **how)
    return out.getvalue()


def svg(picture: Drawn) -> str:
    """A picture as SVG; the same figures give the same text.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    return drawn([picture], "svg").decode()


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
    """Pictures one above the other, as svg, png or pdf.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    sizes = [_SIZES[type(picture)](picture) for picture in pictures]
    heights = [height for _, height in sizes]

    def draw() -> Any:
        from matplotlib.figure import Figure

        size = max(width for width, _ in sizes), sum(heights)
        figure = Figure(
            figsize=size, facecolor=_PAPER, layout="constrained" if heights[1:] else None
        )
        rows = figure.subplots(len(pictures), height_ratios=heights, squeeze=False)[:, 0]
        for axes, picture in zip(rows, pictures, strict=True):
            cast("Callable[[Any, Any], None]", _DRAW[type(picture)])(axes, picture)
            if heights[1:]:
                title = textwrap.fill(picture.title, _TITLE)
                axes.set_title(title, fontsize="medium", loc="left")
        return figure

    return saved(draw, form, SETTINGS, dpi=_DOTS, bbox_inches="tight")


def _traces(axes: Any, picture: Traces) -> None:
    # "engine: what": one colour for what, one kind of line for an engine.
    parts = {name: name.rpartition(": ")[::2] for name in picture.curves}
    engines = list(dict.fromkeys(engine for engine, _ in parts.values()))
    things = list(dict.fromkeys(thing for _, thing in parts.values()))
    log = None
    if picture.log:
        log = LogAxis.around(np.concatenate([np.asarray(y) for _, y in picture.curves.values()]))
    for name, (x, y) in picture.curves.items():
        engine, thing = parts[name]
        style = ("-", "--", ":", "-.")[engines.index(engine) % 4]
        colour = _COLOURS[things.index(thing) % len(_COLOURS)]
        along, up = log.line(np.asarray(x), np.asarray(y)) if log else (x, y)
        axes.plot(along, up, style, color=colour, label=name)
    if log is not None:
        log_scale(axes, log, _POWERS)
    axes.set_xlabel(picture.across)
    axes.set_ylabel(picture.up)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    if len(picture.curves) > 1:
        beside = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)}
        axes.legend(fontsize="small", frameon=False, **beside)


def log_scale(axes: Any, log: LogAxis, most: int) -> None:
    """Give the vertical axis of matplotlib's axes the places of a log axis.

    Args:
        axes: On which places are drawn.
        log: What gives the places.
        most: How many powers of ten are named.
    """
    axes.set_ylim(log.bottom, log.high)
    axes.set_yticks(*zip(*log.ticks(most), strict=True))
    if log.edge is not None:
        axes.axhspan(log.bottom, log.edge, color=_BELOW, linewidth=0, zorder=0)


def _slots(axes: Any, picture: Slots) -> None:
    """Rows of numbered boxes, one above the other, coloured by owner."""
    owners = list(dict.fromkeys(owner for row in picture.rows.values() for owner, _, _ in row))
    widest = max(stop for row in picture.rows.values() for _, _, stop in row)
    for level, (name, row) in enumerate(picture.rows.items()):
        y = -2.0 * level
        axes.text(-0.3, y + 0.5, name, ha="right", va="center", family="monospace", color=_INK)
        for owner, start, stop in row:
            colour = _COLOURS[owners.index(owner) % len(_COLOURS)]
            for slot in range(start, stop):
                axes.add_patch(_box(slot, y, 1, 1, colour))
                axes.text(slot + 0.5, y + 0.5, str(slot), ha="center", va="center", color=_INK)
            if level == 0:
                alone = stop == start + 1  # a name does not fit over one slot
                axes.text(
                    (start + stop) / 2,
                    y + 1.15,
                    owner,
                    ha="left" if alone else "center",
                    va="bottom",
                    rotation=35 if alone else 0,
                    fontsize="small",
                    color=_INK,
                )
    axes.set_xlim(-1.5, widest + 0.5)
    axes.set_ylim(-2.0 * len(picture.rows) + 1.7, 3.2)
    axes.set_aspect("equal")
    axes.axis("off")


def _pipeline(axes: Any, picture: Pipeline) -> None:
    """Boxes from left to right; under them, what each call covers."""
    deepest = max(len(content) for _, content in picture.stages)
    top = deepest * 0.32 + 0.9
    for k, (heading, content) in enumerate(picture.stages):
        x = 3.2 * k
        axes.add_patch(_box(x, 0, 2.6, top, _COLOURS[k % len(_COLOURS)]))
        axes.text(x + 1.3, top - 0.35, heading, ha="center", va="center", weight="bold", color=_INK)
        for line, text in enumerate(content):
            y = top - 0.85 - 0.32 * line
            axes.text(x + 0.2, y, text, va="center", family="monospace", fontsize=8, color=_INK)
        if k:
            axes.annotate(
                "", (x - 0.05, top / 2), (x - 0.55, top / 2),
                arrowprops={"arrowstyle": "->", "color": _INK},
            )  # fmt: skip
    for k, (name, first, last) in enumerate(picture.spans):
        y, left, right = -0.5 - 0.6 * k, 3.2 * first, 3.2 * last + 2.6
        axes.annotate(
            "", (right, y), (left, y), arrowprops={"arrowstyle": "|-|, widthA=.3, widthB=.3"}
        )
        axes.text(
            (left + right) / 2, y, name, ha="center", va="center", family="monospace",
            bbox={"facecolor": _PAPER, "edgecolor": "none", "pad": 2}, color=_INK,
        )  # fmt: skip
    axes.set_xlim(-0.2, 3.2 * len(picture.stages) - 0.4)
    axes.set_ylim(-0.6 * len(picture.spans) - 0.5, top + 0.1)
    axes.axis("off")


def _heat_map(axes: Any, picture: HeatMap) -> None:
    """Cells with their figures; hatched where they are not to be read."""
    import matplotlib
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.patches import Rectangle

    values = np.array([[np.nan if v is None else v for v in row] for row in picture.values])
    known = values[np.isfinite(values) & ~np.array(picture.hatched, dtype=bool)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    wide = low > 0 and high > _WIDE * low
    norm = (LogNorm if wide else Normalize)(low if wide else 0.0, high or 1.0)
    colours = matplotlib.colormaps["YlOrBr"]
    axes.set_facecolor(_BELOW)
    small = values.size <= _WRITTEN
    for r, c in np.ndindex(*values.shape):
        value = values[r, c]
        if not np.isfinite(value):
            axes.text(c, r, "no run", ha="center", va="center", fontsize=6, color=_INK)
            continue
        hatched = picture.hatched[r][c]
        face = _PAPER if hatched else colours(0.85 * float(norm(np.clip(value, low, high))))
        axes.add_patch(
            Rectangle((c - 0.5, r - 0.5), 1, 1, facecolor=face, edgecolor="#999999",
                      linewidth=0.3, hatch="////" if hatched else None)
        )  # fmt: skip
        if picture.framed[r][c]:
            axes.add_patch(
                Rectangle((c - 0.46, r - 0.46), 0.92, 0.92, fill=False, edgecolor=_COLOURS[2],
                          linewidth=1.6)
            )  # fmt: skip
        if small:
            dark = not hatched and float(norm(np.clip(value, low, high))) > 0.7
            axes.text(c, r, f"{value:.3g}", ha="center", va="center", fontsize=7,
                      color=_PAPER if dark else _INK)  # fmt: skip
    axes.set_xlim(-0.5, values.shape[1] - 0.5)
    axes.set_ylim(-0.5, values.shape[0] - 0.5)
    axes.set_xticks(range(len(picture.columns)), picture.columns, fontsize=8,
                    rotation=45 if len("".join(picture.columns)) > _LONG else 0)  # fmt: skip
    axes.set_yticks(range(len(picture.rows)), picture.rows, fontsize=8)
    axes.set_xlabel(picture.across)
    axes.set_ylabel(textwrap.fill(picture.up, _UP))
    scale = ScalarMappable(norm, colours.resampled(256))
    # Beside its map, whatever room the legends of other panels take.
    bar = axes.figure.colorbar(scale, cax=axes.inset_axes((1.02, 0.0, 0.02, 1.0)))
    if wide:
        every = 1 + int(np.log10(high / low)) // _POWERS
        mantissas = (1, 2, 5) if high < 1e4 * low else (1,)
        steps = [m * 10.0**e for e in range(-15, 16, every) for m in mantissas]
        bar.set_ticks([step for step in steps if low <= step <= high], minor=False)
        bar.ax.minorticks_off()
    bar.ax.yaxis.set_major_formatter(lambda tick, _place: f"{tick:g}")
    bar.set_label(picture.unit)


def _bars(axes: Any, picture: Bars) -> None:
    """Bars from left to right, those of a name one below the other."""
    high = 0.8 / len(picture.bars)
    for k, (what, bars) in enumerate(picture.bars.items()):
        places = [n + (k + 0.5) * high - 0.4 for n in range(len(bars))]
        axes.barh(places, [max(0.0, length) for length, _ in bars], high * 0.9,
                  color=_COLOURS[k], alpha=0.75, label=what)  # fmt: skip
        for place, (_, interval) in zip(places, bars, strict=True):
            if interval is not None:
                axes.plot(interval, [place, place], color=_INK, linewidth=1.2)
    axes.set_yticks(range(len(picture.names)), picture.names)
    axes.invert_yaxis()
    axes.set_xlabel(picture.across)
    axes.grid(alpha=0.3, axis="x")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize="small", frameon=False, loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _box(x: float, y: float, width: float, height: float, colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), width, height, facecolor=colour + "30", edgecolor=colour)


_DRAW = {
    Traces: _traces,
    Slots: _slots,
    Pipeline: _pipeline,
    HeatMap: _heat_map,
    Bars: _bars,
}
_SIZES: dict[type, Callable[[Any], tuple[float, float]]] = {
    Traces: lambda _: (7.0, 3.4),
    Slots: lambda _: (7.5, 2.6),
    HeatMap: lambda p: (7.0, 1.3 + 0.33 * min(14, max(2, len(p.rows)))),
    Bars: lambda p: (7.0, 0.9 + 0.42 * len(p.names)),
    Pipeline: lambda p: (7.5, 0.26 * max(len(content) for _, content in p.stages) + 1.6),
}
