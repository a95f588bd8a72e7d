"""What is exactly zero is drawn as zero on every logarithmic axis: at a level of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from statemachine.show.charts import draw_picture
from statemachine.show.pictures import Traces

from .support.claims import assert_has

pytest.importorskip("matplotlib")
from matplotlib.figure import Figure

TIME = np.linspace(0.0, 1.0, 11)
VALUES = np.array([0.0, 1e-14, 1e-14, 0.0, 0.0, 0.0, 0.0, 1e-3, 1.0, 2.0, 1.0])
ZERO = VALUES == 0


def axes_of(values: Any, **more: Any) -> Any:
    axes = Figure((6, 3)).subplots()
    curves = {"a": (np.linspace(0.0, 1.0, len(values)), values)}
    draw_picture(axes, Traces("", "", "", curves, log=True, **more))
    return axes


def heights(axes: Any, values: Any) -> Any:
    """Return where values are from the bottom (0) to the top (1)."""
    points = axes.transData.transform(np.column_stack([np.zeros(len(values)), values]))
    return axes.transAxes.inverted().transform(points)[:, 1]


def ticks(axes: Any) -> dict[str, float]:
    names = [label.get_text() for label in axes.get_yticklabels()]
    return dict(zip(names, axes.get_yticks(), strict=True))


def test_zero_is_below_every_power_of_ten() -> None:
    axes = axes_of(VALUES)
    zero, least, most = heights(axes, [0.0, 1e-14, 2.0])
    assert 0.02 < zero < least - 0.05 < least < most < 1
    named = ticks(axes)
    assert_has(named, **{"0": 0.0, "10": 10.0})
    assert {"1e−14"} < set(named) - {"0", "10"}
    between = heights(axes, 10.0 ** np.arange(-14, 2))
    assert np.ptp(np.diff(between)) < 1e-6  # as far apart as each other


def test_small_is_not_zero() -> None:
    """A thousandth of the tolerance and what is less is at one level, above zero."""
    drawn = axes_of(VALUES, sides=True, tolerance=1.0).lines[0].get_ydata()
    assert set(drawn[drawn < 1e-3 * 0.999]) == {0.0}
    assert (drawn == 0).sum() == ZERO.sum()
    without = axes_of(VALUES[~ZERO])
    assert "0" not in ticks(without)
    assert without.get_ylim()[0] == pytest.approx(1e-14)


@pytest.mark.parametrize("values", [np.zeros(3), np.full(2, np.nan), np.ones(1)])
def test_an_axis_has_a_span(values: Any) -> None:
    axes = axes_of(values)
    low, high = axes.get_ylim()
    assert low < high
    assert len(ticks(axes)) >= 2


def test_no_line_joins_zero_to_what_is_not() -> None:
    x, y = axes_of(VALUES).lines[0].get_data()
    gaps = np.flatnonzero(np.isnan(x))
    assert np.array_equal(np.isnan(x), np.isnan(y))
    assert len(gaps) == 3
    for run in np.split(y, gaps):
        assert len(set((run[np.isfinite(run)] == 0).tolist())) <= 1
    assert set(x[np.isfinite(x)]) == set(TIME)


def test_the_floor_is_an_area_where_it_is_high_enough() -> None:
    axes = axes_of(VALUES + 1e-9, floor=(TIME, np.where(TIME < 0.5, 1e-20, 1e-2)))
    (area,) = axes.collections
    x, y = np.concatenate([path.vertices for path in area.get_paths()]).T
    assert (x.min(), y.max()) == pytest.approx((0.5, 1e-2))
