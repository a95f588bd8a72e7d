"""A figure of traces for a paper or a slide, one column wide and readable without colour.

It is drawn with matplotlib: panels at places in millimetres, one above the other.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..runs.whole import replace_bytes
from .figures import SETTINGS, check_suffix, log_scale, saved
from .log_axis import LogAxis
from .plot_panels import Panel, Plot

FIGURE_SETTINGS = {
    **SETTINGS,
    "font.family": ["DejaVu Sans", "sans-serif"],
    "font.size": 6.5,
    "axes.linewidth": 0.5,
    "axes.unicode_minus": True,
    "path.simplify": True,
}
_DOTS = 300  # a PNG has to an inch
# A colour-blind-safe pair, pale and broad under dark and dashed: told apart in grey too.
STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#f0a830", "linewidth": 2.0, "linestyle": "-", "solid_capstyle": "butt"},
    {"color": "#4b1f78", "linewidth": 0.8, "linestyle": (0, (4, 1.6))},
)
_INK, _GREY, _APART = "#222222", "#8a8a8a", "#4b1f78"
_MM = 1 / 25.4
_WIDTH, _LEFT, _RIGHT, _BETWEEN = 80.0, 9.5, 2.0, 9.5
_VALUES, _LOWER, _TITLE, _GAP = 11.0, 7.5, 3.6, 1.2
_ROW = 3.4  # of the touches
_SMALL, _TINY = 5.6, 5.2
_SAMPLE, _LETTER = 9.5, 1.25  # of a label: the line before it, and one letter
_DECADES = 6  # at most, of a difference
_POWERS = 2  # that its axis names, at most
_FLOOR = "#bdbdbd"


def drawn(figure: Plot, form: str) -> bytes:
    """A figure as svg, png or pdf; the same figure gives the same bytes.

    Raises:
        MissingEngineError: matplotlib is not installed.
    """
    return saved(lambda: draw(figure), form, FIGURE_SETTINGS, dpi=_DOTS)


def write_plot(figure: Plot, path: Path) -> int:
    """Write a figure to a file .svg, .png or .pdf, whole or not at all; its bytes.

    Raises:
        BadInputError: Another suffix.
        MissingEngineError: matplotlib is not installed.
    """
    return replace_bytes(path, drawn(figure, check_suffix(path)))


def draw(figure: Plot) -> Any:
    """The figure as matplotlib's, 80 mm wide."""
    from matplotlib.figure import Figure as Canvas

    rows = _rows(figure.panels)
    notes = [line for note in figure.notes for line in textwrap.wrap(note, 78)]
    head = 4.6 + 3.0 * len(figure.lines) + 4.2 * len(_legend_rows(figure)) + 1.0
    touches = _ROW * len(figure.touches) + _TITLE + 1.5 if figure.touches else 0.0
    foot = 5.2 + 2.6 * len(notes)
    lasts = {id(column) for column in _lasts(rows)}
    talls = [_tall(row, any(id(panel) in lasts for panel in row)) for row in rows]
    height = head + sum(talls) + touches + foot
    canvas = Canvas(figsize=(_WIDTH * _MM, height * _MM), facecolor="white")
    place = _Places(canvas, height)
    _head(place, figure)
    y = head
    for k, row in enumerate(rows):
        named = k == len(rows) - 1 and not figure.touches
        for column, panel in enumerate(row):
            _panel(place, figure, panel, column, y, id(panel) in lasts, named)
        y += talls[k]
    if figure.touches:
        _touches(place, figure, y)
    for k, line in enumerate(notes):
        place.text(_RIGHT, height - 2.6 * (len(notes) - k) + 0.6, line, size=_TINY, color=_INK)
    return canvas


class _Places:
    """Axes and text at millimetres from the upper left corner."""

    def __init__(self, canvas: Any, height: float) -> None:
        self.canvas, self.height = canvas, height

    def axes(self, x: float, y: float, width: float, height: float) -> Any:
        box = (x / _WIDTH, 1 - (y + height) / self.height, width / _WIDTH, height / self.height)
        axes = self.canvas.add_axes(box)
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=_SMALL, length=1.8, width=0.5, pad=1.2)
        return axes

    def text(self, x: float, y: float, text: str, **how: Any) -> None:
        self.canvas.text(x / _WIDTH, 1 - y / self.height, text, va="top", **how)


def _rows(panels: Sequence[Panel]) -> list[list[Panel]]:
    rows: list[list[Panel]] = []
    for panel in panels:
        if panel.wide or not rows or len(rows[-1]) == 2 or rows[-1][0].wide:
            rows.append([panel])
        else:
            rows[-1].append(panel)
    if rows and len(rows[-1]) == 1:  # nothing beside it
        rows[-1] = [replace(rows[-1][0], wide=True)]
    return rows


def _lasts(rows: Sequence[Sequence[Panel]]) -> list[Panel]:
    """Panels below which the axis of time is of others: their times are written out."""
    return [
        panel
        for k, row in enumerate(rows)
        for panel in row
        if k == len(rows) - 1 or rows[k + 1][0].wide != panel.wide
    ]


def _tall(row: Sequence[Panel], times: bool) -> float:
    lower = _LOWER + _GAP if any(panel.apart is not None for panel in row) else 0.0
    return _TITLE + _VALUES + lower + (4.6 if times else 2.2)


def _legend_rows(figure: Plot) -> list[list[str]]:
    """Labels in one row if there is room, else each in its own."""
    if sum(_SAMPLE + _LETTER * len(label) + 5 for label in figure.labels) <= _WIDTH:
        return [list(figure.labels)]
    return [[label] for label in figure.labels]


def _head(place: _Places, figure: Plot) -> None:
    from matplotlib.lines import Line2D

    place.text(_RIGHT, 1.2, figure.title, size=8, weight="bold", color=_INK)
    y = 4.9
    for line in figure.lines:
        place.text(_RIGHT, y, line, size=_SMALL, color=_INK)
        y += 3.0
    number = 0
    for row in _legend_rows(figure):
        x = _RIGHT
        for label in row:
            level = 1 - (y + 1.6) / place.height
            ends = [x / _WIDTH, (x + 8) / _WIDTH]
            place.canvas.add_artist(Line2D(ends, [level, level], **STYLES[number]))
            place.text(x + _SAMPLE, y + 0.3, label, size=6.5, color=_INK)
            x += _SAMPLE + _LETTER * len(label) + 5
            number += 1
        y += 4.2


def _panel(
    place: _Places, figure: Plot, panel: Panel, column: int, y: float, times: bool, named: bool
) -> None:
    half = (_WIDTH - _LEFT - _RIGHT - _BETWEEN) / 2
    width = _WIDTH - _LEFT - _RIGHT if panel.wide else half
    x = _LEFT + column * (half + _BETWEEN)
    unit = f" [{panel.unit}]" if panel.unit else ""
    place.text(x - 6.5, y, panel.title + unit, size=6.2, color=_INK)
    if panel.verdict:
        weight = "bold" if panel.verdict.startswith("DIFFERS") else "normal"
        how = {"size": _TINY, "ha": "right", "color": _INK, "weight": weight}
        below = not panel.wide and len(panel.title + unit) + len(panel.verdict) > 32
        place.text(x + width, y + (2.4 if below else 0.2), panel.verdict, **how)
    top, bottom = y + _TITLE, y + _TITLE
    lowest = None
    if panel.curves:
        tall = _VALUES
        axes = lowest = place.axes(x, top, width, tall)
        for side, (time, values) in panel.curves:
            axes.plot(time, values, **STYLES[side])
        _value_axis(axes, panel)
        bottom += tall + _GAP
    if panel.apart is not None:
        tall = _LOWER if panel.curves else _LOWER + _VALUES + _GAP
        if lowest is not None:
            lowest.tick_params(labelbottom=False)
            _time_axis(lowest, figure)
        lowest = place.axes(x, bottom, width, tall)
        _apart(lowest, panel)
    if lowest is not None:
        _time_axis(lowest, figure)
        lowest.tick_params(labelbottom=times)
        if named:
            lowest.set_xlabel("time [s]", fontsize=_SMALL, labelpad=0.8)


def _value_axis(axes: Any, panel: Panel) -> None:
    from matplotlib.ticker import MaxNLocator

    values = np.concatenate([curve[1] for _, curve in panel.curves])
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    # What does not matter is not blown up to the height of the panel.
    least = 20 * panel.tolerance if panel.tolerance else 1e-3 * max(abs(high), abs(low), 1e-3)
    if high - low < least:
        middle = (low + high) / 2
        low, high = middle - least / 2, middle + least / 2
    margin = 0.08 * (high - low)
    axes.set_ylim(low - margin, high + margin)
    axes.yaxis.set_major_locator(MaxNLocator(3, min_n_ticks=2))


def _apart(axes: Any, panel: Panel) -> None:
    """Differences on a log axis, the tolerance, and filled what is beyond it."""
    assert panel.apart is not None
    time, values = panel.apart
    log = LogAxis.around(values, [panel.tolerance] if panel.tolerance else [], _DECADES)
    places = log.places(values)
    if panel.floor is not None:
        width = np.minimum(panel.floor[1], 10.0**log.high)
        axes.fill_between(
            panel.floor[0], log.bottom, log.area(width), color=_FLOOR, linewidth=0, zorder=0.5,
        )  # fmt: skip
    axes.plot(time, places, color=_APART, linewidth=0.7)
    if panel.tolerance:
        limit = float(np.log10(panel.tolerance))
        axes.axhline(limit, color=_INK, linewidth=0.6, linestyle=(0, (1, 1.5)))
        axes.fill_between(
            time, limit, places, where=places > limit, color=_APART, alpha=0.35, linewidth=0,
        )  # fmt: skip
    log_scale(axes, log, _POWERS)
    axes.get_yticklabels()[-1].set_verticalalignment("top")  # above it is another panel's label


def _time_axis(axes: Any, figure: Plot) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.set_xlim(0, max(figure.seconds, 1e-9))
    axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    if figure.part is not None:
        axes.axvline(figure.part, color=_GREY, linewidth=0.6, zorder=0)


def _touches(place: _Places, figure: Plot, y: float) -> None:
    """Bars while two bodies touch: above of the first side, below, hatched, of the second."""
    place.text(_LEFT - 6.5, y, "who touches when", size=6.2, color=_INK)
    count, names = len(figure.touches), max(len(touch.name) for touch in figure.touches)
    left = min(_LEFT + max(0.0, 1.05 * names - 5.0), 32.0)
    axes = place.axes(left, y + _TITLE, _WIDTH - left - _RIGHT, _ROW * count)
    for row, touch in enumerate(figure.touches):
        for side, spans in enumerate(touch.spans):
            # A touch of one step is seen too.
            least = figure.seconds / 300
            bars = [(begin, max(length, least)) for begin, length in spans]
            style = STYLES[side]["color"]
            how: dict[str, Any] = {"facecolor": style, "edgecolor": style, "linewidth": 0.4}
            if side:
                how = {"facecolor": "white", "edgecolor": style, "hatch": "////////"}
            base = row + (0.12 if side == 0 else 0.52)
            axes.broken_barh(bars, (base, 0.36), **{"linewidth": 0.4, **how})
            if spans and len(touch.spans) > 1:
                axes.plot(
                    spans[0][0], base + 0.18, marker=">", markersize=2.6, color=_INK,
                    clip_on=False, markeredgewidth=0, zorder=3,
                )  # fmt: skip
    axes.set_ylim(count, 0)
    axes.set_yticks([row + 0.5 for row in range(count)], [touch.name for touch in figure.touches])
    axes.tick_params(axis="y", length=0, pad=3)
    _time_axis(axes, figure)
    axes.set_xlabel("time [s]", fontsize=_SMALL, labelpad=0.8)
