"""A quantity over time on a page: its charts, whose place in time follows the slider."""

from __future__ import annotations

import re

import numpy as np

from ...errors import MissingEngineError
from ...measures import largest
from ...measures.text import figure, reading
from ...page import Table, Traces
from ..figures import INK, SIDES, chart
from ..over_time import QuantityChart
from .blocks import badge, table
from .markup import Html, joined, tag

_ROWS = 21  # of the table under a chart
_ROUNDING = 1e-6  # of a tolerance
_SIZE = (4.0, 1.3)  # inches
_BOX = (0.12, 0.18, 0.85, 0.75)  # of its axes: left, bottom, width, height
# So that the theme of the page changes the colours.
_COLOURS = {
    INK: "var(--ink)",
    SIDES[0]["color"]: "var(--one)",
    SIDES[1]["color"]: "var(--two)",
    "#f0f0f0": "var(--shade)",
}


def quantity_row(quantity: QuantityChart) -> Html:
    """A row of a quantity: how far apart over time, both sides, and the figures on demand."""
    values, agreement = quantity.values(), quantity.agreement
    one, two = quantity.labels
    keys = tag("i", class_="key one"), f"{one} ", tag("i", class_="key two"), two
    gap = f"how far apart, {quantity.unit}; log axis; dotted: the tolerance"
    if quantity.floor is not None:
        gap += "; grey: the chaos floor"
    return tag(
        "section",
        tag("h3", tag("span", quantity.title, class_="quantity"), badge(agreement.verdict)),
        tag(
            "div",
            _figure(quantity.gap(), gap, quantity.said),
            _figure(values, joined((f"{values.title}: ", *keys)), values.title) if values else None,
            class_="charts",
        ),
        tag("p", quantity.foot, class_="foot") if quantity.foot else None,
        tag("details", tag("summary", f"The figures of {quantity.title}"), data_table(quantity),
            class_="data"),
        class_="quantity-row",
    )  # fmt: skip


def _figure(picture: Traces, caption: str, said: str) -> Html:
    """A chart with the cursor of time over its axes; a line where matplotlib is not installed."""
    try:
        text = chart(picture, "svg", _SIZE, _BOX).decode()
    except MissingEngineError as error:
        return tag("p", f"No chart: {error}.", class_="foot")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' id="[a-z]+[\d_]+"', "", text)
    text = re.sub(r"(\d\.\d)\d{3,}", r"\1", text)  # tenths of a point are seen, no more
    for colour, name in _COLOURS.items():
        text = text.replace(colour, name)
    left, bottom, width, height = (100 * share for share in _BOX)
    place = f"left:{left:g}%;width:{width:g}%;bottom:{bottom:g}%;height:{height:g}%"
    area = tag("div", tag("i", class_="cursor"), class_="area", style=place)
    return tag(
        "figure",
        tag("figcaption", caption),
        tag("div", Html(text), area, class_="plot", role="img", aria_label=said),
    )


def data_table(quantity: QuantityChart) -> Html:
    """The figures of its charts: moments evenly spaced, and that of the largest difference."""
    time, tolerance = quantity.curve.time, quantity.agreement.tolerance
    rows = np.linspace(0, len(time) - 1, min(_ROWS, len(time))).round().astype(int)
    worst = largest(quantity.curve.difference)[1]
    rows = np.unique([*rows, worst])
    values = quantity.values()
    columns = {**(values.curves if values else {}), **quantity.gap().curves}
    scale = reading(quantity.curve.unit)[0]
    cells = [
        (
            f"{time[row]:.3f}",
            *(_number(float(y[row]), tolerance * scale) for _, y in columns.values()),
        )
        for row in rows.tolist()
    ]
    return table(
        Table(
            ("time, s", *(f"{name}, {quantity.unit}" for name in columns)),
            cells,
            f"{quantity.title}: {len(rows)} of {len(time)} moments, the largest difference bold",
            emphasis=frozenset(np.flatnonzero(rows == worst).tolist()),
        )
    )


def _number(value: float, tolerance: float) -> str:
    if 0 < abs(value) < _ROUNDING * tolerance:
        return "≈ 0"
    return f"{value:.4f}" if abs(value) >= 1e-3 or value == 0 else figure(value)
