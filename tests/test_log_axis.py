"""What is exactly zero is drawn as zero on every logarithmic axis: at a level of its own."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from statemachine.compare import Agreement, Series
from statemachine.page import Traces
from statemachine.rendering import Timing
from statemachine.report.figures import svg
from statemachine.report.film_overlay import Overlay, Strip
from statemachine.report.html.charts import difference_chart
from statemachine.report.log_axis import LogAxis
from statemachine.report.over_time import chart_of
from statemachine.report.plot_draw import draw
from statemachine.report.plot_panels import Panel, Plot

TIME = np.linspace(0.0, 1.0, 11)
VALUES = np.array([0.0, 1e-14, 1e-14, 0.0, 0.0, 0.0, 0.0, 1e-3, 1.0, 2.0, 1.0])
ZERO = VALUES == 0


def test_zero_is_below_every_power_of_ten() -> None:
    axis = LogAxis.around(VALUES)
    places = axis.places(VALUES)
    assert axis.zero is not None
    assert axis.edge is not None
    assert axis.bottom < axis.zero < axis.edge < axis.low == -14
    assert np.array_equal(places[ZERO], np.full(ZERO.sum(), axis.zero))
    assert np.allclose(places[~ZERO], np.log10(VALUES[~ZERO]))
    assert axis.high == 1
    ticks = axis.ticks(4)
    assert ticks[0] == (axis.zero, "0")
    assert ticks[1:] == [(-11.0, "1e−11"), (-7.0, "1e−7"), (-3.0, "0.001"), (1.0, "10")]


def test_small_is_not_zero() -> None:
    axis = LogAxis.around(VALUES, decades=4)
    assert axis.low == -3
    assert axis.places(np.array([1e-14, 0.0])).tolist() == [-3.0, axis.zero]
    without = LogAxis.around(VALUES[~ZERO])
    assert (without.zero, without.edge, without.bottom) == (None, None, without.low)
    assert [text for _, text in without.ticks(2)] == ["1e−7", "10"]


@pytest.mark.parametrize("values", [np.zeros(3), np.zeros(0), np.full(2, np.nan), np.ones(1)])
def test_an_axis_has_a_span(values: Any) -> None:
    axis = LogAxis.around(values)
    assert axis.high - axis.low >= 2
    assert axis.ticks(3)
    shown = axis.places(values)
    assert ((shown >= axis.bottom) & (shown <= axis.high))[np.isfinite(values)].all()


def _level(ticks: list[tuple[float, str]], values: Any) -> None:
    """Fail unless the zeros, and only they, are at the tick that is called 0."""
    (zero,) = [place for place, text in ticks if text == "0"]
    assert np.allclose(values[ZERO], zero, atol=0.02)
    assert min(abs(values[~ZERO] - zero)) > 0.05 * np.ptp(values)


def test_no_line_joins_zero_to_what_is_not() -> None:
    axis = LogAxis.around(VALUES)
    x, y = axis.line(TIME, np.append(VALUES[:-1], 0.0))  # one alone at both ends
    gaps = np.flatnonzero(np.isnan(x))
    assert gaps.tolist() == np.flatnonzero(np.isnan(y)).tolist()
    for run in np.split(y, gaps):
        assert len(set((run[np.isfinite(run)] == axis.zero).tolist())) <= 1
    assert set(x[np.isfinite(x)]) == set(TIME)
    curves = {"a": (TIME.tolist(), VALUES.tolist())}
    (path,) = re.findall(
        r'<path d="([^"]+)" clip-path[^>]*stroke: #1f5fa8',
        svg(Traces("", "time", "difference", curves, log=True)),
    )
    assert path.count("M") == 4


def test_in_the_pictures_of_the_documentation() -> None:
    curves = {"a": (TIME.tolist(), VALUES.tolist()), "b": (TIME.tolist(), [0.0] * len(TIME))}
    text = svg(Traces("", "time", "difference", curves, log=True))
    paths = re.findall(r'<path d="([^"]+)" clip-path[^>]*stroke: #(?:1f5fa8|c2571a)', text)
    a, b = (np.array(re.findall(r"[ML] (\S+) (\S+)", path), dtype=float)[:, 1] for path in paths)
    # matplotlib leaves points out where a line goes straight on.
    assert np.ptp(b) == 0
    assert np.isclose(a, b[0]).sum() >= 3
    label = re.search(r'<text [^>]*y="([\d.]+)"[^>]*>0</text>', text)
    assert label
    assert float(label[1]) == pytest.approx(b[0], abs=6)


def test_in_a_figure() -> None:
    panel = Panel("a", "°", [], (TIME, VALUES), tolerance=0.1)
    canvas = draw(Plot("t", [], ["one"], [panel], [], 1.0, None, []))
    (axes,) = canvas.axes
    ticks = [
        (float(place), label.get_text())
        for place, label in zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)
    ]
    curve = max(axes.lines, key=lambda line: len(line.get_ydata()))
    _level(ticks, np.asarray(curve.get_ydata(), dtype=float))


def test_in_a_report() -> None:
    found = Agreement(
        name="a", kind="joint", unit="rad", max=2.0, at=0.9, rms=1.0, settled=1.0, since=0.7,
        tolerance=1e-3, reason="", verdict="differs",
    )  # fmt: skip
    curve = Series("a", "joint", TIME, np.zeros(0), np.zeros(0), VALUES)
    chart = difference_chart(chart_of(curve, found, ("a", "b")))
    ticks = [
        (float(top), text)
        for top, text in re.findall(r'ytick" style="top:([\d.]+)%">([^<]+)<', chart)
    ]
    (path,) = re.findall(r'<path d="M([^"]+)" class="curve apart"', chart)
    _level(ticks, np.array([float(point.split()[1]) for point in path.split("L")]))
    assert 'class="zero"' in chart
    never = replace(curve, difference=np.maximum(VALUES, 1e-9))
    chart = difference_chart(chart_of(never, found, ("a", "b")))
    assert 'class="zero"' not in chart
    assert ">0<" not in chart


def test_in_a_film() -> None:
    pytest.importorskip("PIL", reason="Pillow is not installed")
    overlay = Overlay(
        (640, 480), Timing(1.0, 10), "t", ["a", "b"], Strip("a", "°", TIME, VALUES, 0.1)
    )
    places = [place for place, _ in overlay._log.ticks(9)]
    assert places[0] == overlay._log.zero
    _level([(overlay._y(places[0]), "0")], np.array([overlay._y(p) for p in overlay._places]))
    picture = np.asarray(overlay._done).astype(int)
    x, y = round(overlay._x(0.45)), round(overlay._y(places[0]))
    assert picture[y - 1 : y + 2, x].sum(axis=1).min() < picture[y + 4, x].sum() - 100
