"""Curves over time as SVG, with their axes as text: readable without a script, and in print."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...compare import Agreement, Series
from ...interface import Array, Ints
from ...measures import largest
from ...measures.text import figure, on, reading
from ...page import Table
from ..finding import name_of
from ..log_axis import LogAxis
from ..over_time import QuantityChart
from .blocks import badge, table
from .markup import Html, joined, tag

_ROWS = 21  # of the table under a chart
_HIGH = 50.0  # times the tolerance: a difference that reaches more has a log axis
_DECADES = 1e-2  # of the tolerance: where a log axis begins
_APART = 13.0  # percent of a chart's height between two names at its end
_ROUNDING = 1e-6  # of a tolerance
_POWERS = 5  # that a log axis names, at most


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve: `y` (n,) in what is shown; `look` is its class; label at its end; own times."""

    y: Array
    look: str
    label: str = ""
    time: Array | None = None


def quantity_row(chart: QuantityChart, own: tuple[Series, Series] | None, points: int) -> Html:
    """A row of a quantity: how far apart over time, both sides, and the figures on demand.

    Args:
        chart: The quantity.
        own: Each side's curve at its own rows; None where there is none.
        points: At most, of a curve.
    """
    values = None if own is None else values_chart(*own, chart.labels, points)
    axis = "log axis; " if logarithmic(chart.found) else ""
    said = f"how far apart, {chart.unit}; {axis}shaded: within tolerance"
    if _floor_shows(chart):
        said += "; grey: the chaos floor"
    return tag(
        "section",
        tag("h3", tag("span", chart.title, class_="quantity"), badge(chart.found.verdict)),
        tag(
            "div",
            tag("figure", tag("figcaption", said), difference_chart(chart, points)),
            tag("figure", tag("figcaption", _sides(chart)), values) if values else None,
            class_="charts",
        ),
        tag("p", chart.foot, class_="foot") if chart.foot else None,
        tag("details", tag("summary", f"The figures of {chart.title}"), data_table(chart),
            class_="data"),
        class_="quantity-row",
    )  # fmt: skip


def _sides(chart: QuantityChart) -> Html:
    """What the lines of both sides are."""
    one, two = chart.labels
    keys = (tag("i", class_="key one"), f"{one} ", tag("i", class_="key two"), two)
    return joined((f"both sides, {chart.unit}: ", *keys))


def _top(chart: QuantityChart) -> float:
    """The upper end of the axis of differences, in what is shown."""
    most = max(float(chart.curve.difference.max()), chart.found.tolerance)
    return 1.08 * most * reading(chart.curve.unit)[0]


def _floor_shows(chart: QuantityChart) -> bool:
    """Whether the chaos floor is high enough to be seen."""
    if chart.floor is None:
        return False
    least = _DECADES * chart.found.tolerance if logarithmic(chart.found) else 0.01 * _top(chart)
    return bool((chart.floor * reading(chart.curve.unit)[0] > least).any())


def difference_chart(chart: QuantityChart, points: int = 600) -> Html:
    """How far apart over time, with the tolerance and the chaos floor as bands."""
    curve, found, said = chart.curve, chart.found, chart.said
    scale = reading(curve.unit)[0]
    top = _top(chart)
    band = found.tolerance * scale
    values = curve.difference * scale
    floor, axis, span = None, None, (0.0, top)
    if chart.floor is not None and _floor_shows(chart):
        floor = np.minimum(chart.floor * scale, top)
    if logarithmic(found):
        axis = LogAxis(
            math.log10(_DECADES * band), math.log10(top) + 0.1, bool((values == 0).any())
        )
        values, band, span = axis.places(values), math.log10(band), (axis.bottom, axis.high)
        floor = None if floor is None else axis.area(floor)
    return _plot(
        curve.time, [Curve(values, "apart")], span, said, band=band, points=points, log=axis,
        floor=floor,
    )  # fmt: skip


def logarithmic(found: Agreement) -> bool:
    """Whether the tolerance could not be seen on an axis that is as high as the difference."""
    return found.max > _HIGH * found.tolerance


def values_chart(
    one: Series, two: Series, labels: tuple[str, str], points: int = 600
) -> Html | None:
    """Each side over time, at its own rows; None for a quantity that has no values of its own.

    Args:
        one: A curve of the first side with itself.
        two: The same of the second.
        labels: What the sides are called.
        points: At most, of a curve.
    """
    if not one.one.size or not two.one.size:
        return None
    until = min(float(one.time[-1]), float(two.time[-1]))
    scale, unit = reading(one.unit)
    curves, ends = [], []
    for side, look in ((one, "one"), (two, "two")):
        inside = side.time <= until + 1e-9
        values = side.one[inside] * scale
        ends.append(", ".join(f"{float(v):.4g}" for v in np.atleast_1d(values[-1])))
        columns = values.reshape(len(values), -1).T
        names = "xyz" if len(columns) == 3 else [""] * len(columns)
        curves += [
            Curve(y, look, name if look == "one" else "", side.time[inside])
            for y, name in zip(columns, names, strict=True)
        ]
    every = np.concatenate([each.y for each in curves])
    low, high = float(every.min()), float(every.max())
    pad = 0.06 * (high - low) or max(abs(high) * 0.05, 1e-9)
    said = (
        f"{name_of(one.name)} over time on both sides: at the end {ends[0]}{unit} {on(labels[0])} "
        f"and {ends[1]}{unit} {on(labels[1])}."
    )
    floor = low if one.kind == "force" else low - pad
    return _plot(np.array([0.0, until]), curves, (floor, high + pad), said, points=points)


def data_table(chart: QuantityChart) -> Html:
    """The figures of a chart: moments evenly spaced, and that of the largest difference."""
    curve, tolerance = chart.curve, chart.found.tolerance
    scale = reading(curve.unit)[0]
    rows = np.linspace(0, len(curve.time) - 1, min(_ROWS, len(curve.time))).round().astype(int)
    _, worst = largest(curve.difference)
    rows = np.unique([*rows, worst])
    columns = []
    parts = "xyz" if curve.one.ndim == 2 and curve.one.shape[1] == 3 else ("",)
    if curve.one.size:
        for side, label in zip((curve.one, curve.two), chart.labels, strict=True):
            for k, part in enumerate(parts):
                columns.append((f"{label} {part}".strip(), side.reshape(len(side), -1)[:, k]))
    columns.append(("apart", curve.difference))
    cells = [
        (
            f"{curve.time[row]:.3f}",
            *(_number(float(values[row]) * scale, tolerance * scale) for _, values in columns),
        )
        for row in rows.tolist()
    ]
    return table(
        Table(
            ("time, s", *(f"{name}, {chart.unit}" for name, _ in columns)),
            cells,
            f"{chart.title}: {len(rows)} of {len(curve.time)} moments, the largest difference bold",
            emphasis=frozenset(np.flatnonzero(rows == worst).tolist()),
        )
    )


def _number(value: float, tolerance: float) -> str:
    if 0 < abs(value) < _ROUNDING * tolerance:
        return "≈ 0"
    return f"{value:.4f}" if abs(value) >= 1e-3 or value == 0 else figure(value)


def _plot(
    time: Array,
    curves: Sequence[Curve],
    span: tuple[float, float],
    said: str,
    band: float | None = None,
    points: int = 600,
    log: LogAxis | None = None,
    floor: Array | None = None,
) -> Html:
    """Curves in a box of 1000 × 100 that is stretched to its place; ticks are text beside it."""
    until = float(time[-1]) or 1.0
    low, high = span
    marks = []
    if band is not None:
        y = _up(band, low, high)
        marks.append(tag("rect", x=0, y=f"{y:.2f}", width=1000, height=f"{100 - y:.2f}",
                         class_="band"))  # fmt: skip
        marks.append(tag("line", x1=0, x2=1000, y1=f"{y:.2f}", y2=f"{y:.2f}", class_="edge"))
    if floor is not None:
        area = _path(time / until, floor, low, high, points)
        marks.append(tag("path", d=f"{area}V100H0Z", class_="floor"))
    if log is None:
        levels = ticks_of(low, high)
        if len(levels) < 2:
            levels = ticks_of(low, high, 8)
        digits = _digits(levels)
        ticks = [(tick, f"{tick:.{digits}f}") for tick in levels]
    else:
        ticks = log.ticks(_POWERS)
        if log.edge is not None:
            y = _up(log.edge, low, high)
            marks.append(tag("path", d=f"M0 {y:.2f}H1000V100H0Z", class_="zero"))
    marks += [
        tag("line", x1=0, x2=1000, y1=f"{_up(t, low, high):.2f}", y2=f"{_up(t, low, high):.2f}",
            class_="grid")
        for t, _ in ticks
    ]  # fmt: skip
    marks += [
        tag(
            "path",
            d=_path((time if each.time is None else each.time) / until, each.y, low, high, points),
            class_=f"curve {each.look}",
        )
        for each in sorted(curves, key=lambda each: each.look)
    ]
    svg = tag("svg", *marks, viewBox="0 0 1000 100", preserveAspectRatio="none", focusable="false")
    labels = [
        tag("span", text, class_="ytick", style=f"top:{_up(tick, low, high):.2f}%")
        for tick, text in ticks
    ]
    ending = [curve for curve in curves if curve.label]
    places = spread([_up(float(curve.y[-1]), low, high) for curve in ending])
    ends = [
        tag("span", curve.label, class_="name", style=f"top:{place:.2f}%")
        for curve, place in zip(ending, places, strict=True)
    ]
    return tag(
        "div",
        tag("div", svg, *labels, *ends, tag("i", class_="cursor"), class_="area"),
        time_axis(until),
        class_="plot",
        role="img",
        aria_label=said,
    )


def spread(places: Sequence[float], apart: float = _APART) -> list[float]:
    """Places from 0 to 100 as they are, but pushed apart until none covers another."""
    order = sorted(range(len(places)), key=lambda k: places[k])
    found = list(places)
    for before, k in itertools.pairwise(order):
        found[k] = max(found[k], found[before] + apart)
    limit = 100.0
    for k in reversed(order):
        found[k] = min(found[k], limit)
        limit = found[k] - apart
    return found


def time_axis(until: float) -> Html:
    """Ticks of time under a box that is as wide as the run is long."""
    ticks = [tick for tick in ticks_of(0.0, until, 5) if tick <= until * 1.0001]
    digits = _digits(ticks)
    labels = []
    for k, tick in enumerate(ticks):
        unit = tag("small", "s") if k == len(ticks) - 1 else None
        labels.append(
            tag("span", f"{tick:.{digits}f}", unit, style=f"left:{100 * tick / until:.2f}%")
        )
    return tag("div", joined(labels), class_="times", aria_hidden="true")


def ticks_of(low: float, high: float, most: int = 4) -> list[float]:
    """Round numbers within a range: steps of 1, 2 or 5 times a power of ten."""
    width = high - low
    if not (math.isfinite(width) and width > 0):
        return [low]
    raw = width / most
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(f * power for f in (1, 2, 5, 10) if f * power >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [k * step + 0.0 for k in range(first, math.floor(high / step + 1e-9) + 1)]


def _digits(ticks: Sequence[float]) -> int:
    if len(ticks) < 2:
        return 2
    return max(0, -math.floor(math.log10(abs(ticks[1] - ticks[0])) + 1e-9))


def _up(value: float, low: float, high: float) -> float:
    return 100.0 * (1.0 - (value - low) / (high - low)) if high > low else 50.0


def _path(x: Array, y: Array, low: float, high: float, most: int) -> str:
    rows = _thinned(y, most)
    points = [f"{1000 * float(x[k]):.1f} {_up(float(y[k]), low, high):.2f}" for k in rows.tolist()]
    if len(points) == 1:  # a run of one row is a dash
        points.append("1000 " + points[0].split()[1])
    return "M" + "L".join(points)


def _thinned(y: Array, most: int) -> Ints:
    """Rows that show the same curve: of each stretch its lowest and its highest."""
    n = len(y)
    if n <= most:
        return np.arange(n)
    edges = np.linspace(0, n, most // 2 + 1).astype(int)
    rows = {0, n - 1}
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part = y[start:stop]
        rows |= {start + int(np.argmin(part)), start + int(np.argmax(part))}
    return np.array(sorted(rows))
