"""A quantity over time as a row of a page: how far apart, both sides, and the figures on demand."""

from __future__ import annotations

import numpy as np

from ....measures import largest
from ....measures.text import display_unit, figure
from ....show.blocks import Table
from ....show.html.blocks import badge, table
from ....show.html.chart import chart_figure
from ....show.html.markup import Html, joined, tag
from .quantity_chart import QuantityChart

_ROWS = 21  # of the table under a chart
_ROUNDING = 1e-6  # of a tolerance


def quantity_row(quantity: QuantityChart) -> Html:
    """Return a row of a quantity: how far apart, both sides, and the figures on demand."""
    verdict = badge(quantity.agreement.verdict)
    parts = [tag("h3", tag("span", quantity.title, class_="quantity"), verdict), _charts(quantity)]
    if quantity.foot:
        parts.append(tag("p", quantity.foot, class_="foot"))
    summary = tag("summary", f"The figures of {quantity.title}")
    parts.append(tag("details", summary, data_table(quantity), class_="data"))
    return tag("section", *parts, class_="quantity-row")


def _charts(quantity: QuantityChart) -> Html:
    """Return how far apart a quantity is over time, and, where it has values, both sides."""
    caption = f"how far apart, {quantity.unit}; log axis; dotted: the tolerance"
    if quantity.floor is not None:
        caption += "; grey: the chaos floor"
    charts = [chart_figure(quantity.gap(), caption, quantity.said)]
    values = quantity.values()
    if values is not None:
        left, right = quantity.labels
        keys = tag("i", class_="key one"), f"{left} ", tag("i", class_="key two"), right
        charts.append(chart_figure(values, joined((f"{values.title}: ", *keys)), values.title))
    return tag("div", *charts, class_="charts")


def data_table(quantity: QuantityChart) -> Html:
    """Return the figures of its charts: at even spaces, and at the largest difference."""
    time, tolerance = quantity.curve.time, quantity.agreement.tolerance
    rows = np.linspace(0, len(time) - 1, min(_ROWS, len(time))).round().astype(int)
    worst = largest(quantity.curve.difference)[1]
    rows = np.unique([*rows, worst])
    values = quantity.values()
    columns = {} if values is None else dict(values.curves)
    columns |= quantity.gap().curves
    scale = display_unit(quantity.curve.unit)[0]
    cells = []
    for row in rows.tolist():
        figures = [_number(float(y[row]), tolerance * scale) for _, y in columns.values()]
        cells.append((f"{time[row]:.3f}", *figures))
    title = f"{quantity.title}: {len(rows)} of {len(time)} moments, the largest difference bold"
    heads = ("time, s", *(f"{name}, {quantity.unit}" for name in columns))
    largest_row = frozenset(np.flatnonzero(rows == worst).tolist())
    return table(Table(heads, cells, title, emphasis=largest_row))


def _number(value: float, tolerance: float) -> str:
    if 0 < abs(value) < _ROUNDING * tolerance:
        return "≈ 0"
    return f"{value:.4f}" if abs(value) >= 1e-3 or value == 0 else figure(value)
