"""Pictures of a page, drawn by matplotlib from the figures of a run."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import BadInputError, MissingEngineError
from ..page import Block, Pipeline, Slots, Traces
from ..traces.whole import replace_file
from .log_axis import LogAxis

_COLOURS = ("#1f5fa8", "#c2571a", "#2f8f4e", "#8a4fa0", "#b03a48", "#6b6b6b", "#3aa6a6")
_INK, _PAPER, _BELOW = "#222222", "#ffffff", "#f0f0f0"  # the last: behind the level of zero
_DOTS = 200  # a PNG has to an inch
_POWERS = 8  # that a log axis names, at most

Figure = Traces | Slots | Pipeline


def svg(picture: Figure) -> str:
    """A picture as SVG; the same figures give the same text.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    return _drawn([picture], "svg").decode()


def write_pictures(blocks: Sequence[Block], path: Path) -> int:
    """Write all pictures among these blocks into one file, one below the other; how many.

    Args:
        blocks: Of a page.
        path: A file .svg, .png or .pdf, written whole or not at all.

    Raises:
        BadInputError: There is no picture among them.
        MissingEngineError: matplotlib is not installed.
    """
    pictures = [block for block in blocks if isinstance(block, Traces | Slots | Pipeline)]
    if not pictures:
        raise BadInputError("this lesson has no picture to write")
    content = _drawn(pictures, path.suffix.lower().lstrip("."))
    replace_file(path, lambda out: out.write(content))
    return len(pictures)


def _drawn(pictures: Sequence[Figure], form: str) -> bytes:
    try:
        import matplotlib
        from matplotlib.figure import Figure as Sheet
    except ImportError as error:
        raise MissingEngineError(
            "pictures need matplotlib: pip install 'statemachine-sim[docs]'", engine="matplotlib"
        ) from error
    sizes = [_SIZES[type(picture)](picture) for picture in pictures]
    # Text as paths would be twice as large; without a salt and a date each run differs.
    with matplotlib.rc_context(
        {"svg.fonttype": "none", "svg.hashsalt": "statemachine", "text.parse_math": False}
    ):
        size = max(width for width, _ in sizes), sum(height for _, height in sizes)
        sheet = Sheet(figsize=size, facecolor=_PAPER, layout=None if len(sizes) == 1 else "tight")
        ratios = {"height_ratios": [height for _, height in sizes]}
        every = sheet.subplots(len(sizes), squeeze=False, gridspec_kw=ratios)
        for axes, picture in zip(every[:, 0], pictures, strict=True):
            cast("Callable[[Any, Any], None]", _DRAW[type(picture)])(axes, picture)
            if len(sizes) > 1:
                axes.set_title(picture.title, loc="left", fontsize="medium")
        out = io.BytesIO()
        date = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form)
        sheet.savefig(out, format=form, dpi=_DOTS, bbox_inches="tight", metadata=date)
    return out.getvalue()


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
        axes.set_ylim(log.bottom, log.high)
        ticks, labels = zip(*log.ticks(_POWERS), strict=True)
        axes.set_yticks(ticks, labels)
        if log.edge is not None:
            axes.axhspan(log.bottom, log.edge, color=_BELOW, linewidth=0, zorder=0)
    axes.set_xlabel(picture.across)
    axes.set_ylabel(picture.up)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    if len(picture.curves) > 1:
        beside = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)}
        axes.legend(fontsize="small", frameon=False, **beside)


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


def _box(x: float, y: float, width: float, height: float, colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((x, y), width, height, facecolor=colour + "30", edgecolor=colour)


_DRAW = {Traces: _traces, Slots: _slots, Pipeline: _pipeline}
_SIZES: dict[type, Callable[[Any], tuple[float, float]]] = {
    Traces: lambda _: (7.0, 3.4),
    Slots: lambda _: (7.5, 2.6),
    Pipeline: lambda p: (7.5, 0.26 * max(len(content) for _, content in p.stages) + 1.6),
}
