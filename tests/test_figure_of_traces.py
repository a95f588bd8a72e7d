"""The figure of traces as matplotlib has it: sizes, bars of touches, axes, by what it is given."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from statemachine.lab.questions.plot import COMMAND, TracePlot, draw, of_comparison, of_trace
from statemachine.lab.recordings import Trace
from statemachine.measures import ENCODER_COUNT
from statemachine.show.charts import SIDES
from statemachine.show.pictures import Traces

from .support.traces import traced

pytestmark = pytest.mark.usefixtures("matplotlib")

CURVE = Traces("a", "", "", {"one": ([0.0, 1.0], [0.0, 2.0]), "two": ([0.0, 1.0], [1.0, 1.0])})
TOUCHES = {"ball on floor": [[[0.2, 0.5]], [[0.3, 0.9], [1.0, 1.001]]], "a on b": [[], [[0, 2]]]}
PLOT = TracePlot(
    title="hold",
    lines=["file", "step"],
    labels=["one", "two"],
    rows=[[CURVE, replace(CURVE, title="b")], [replace(CURVE, title="c DIFFERS")]],
    touches=TOUCHES,
    seconds=3.0,
    part=0.4,
    notes=["a note"],
)
MM = 1 / 25.4


def _bars(axes: Any) -> list[tuple[float, float, float, float]]:
    """Return begin, end, lower and upper edge of each bar, in the order in which it was drawn."""
    bars: list[tuple[float, float, float, float]] = []
    for group in axes.collections:
        for path in group.get_paths():
            (x0, y0), (x1, y1) = path.vertices.min(axis=0), path.vertices.max(axis=0)
            bars.append((x0, x1, y0, y1))
    return bars


def test_a_figure_is_eighty_millimetres_wide() -> None:
    assert draw(PLOT).get_size_inches()[0] == pytest.approx(80 * MM)


@pytest.mark.parametrize(
    ("changes", "height"),
    [
        # Two rows, two touches with a title, and 3 mm for each of the lines of text.
        ({}, 2 * 17 + 3 * 5 + 3 * (0 + 2 + 2 + 5)),
        ({"touches": {}}, 2 * 17 + 3 * (0 + 2 + 2 + 5)),
        ({"rows": [], "touches": {}}, 3 * (0 + 2 + 2 + 5)),
        ({"notes": ["a", "b"]}, 2 * 17 + 3 * 5 + 3 * (1 + 2 + 2 + 5)),
        ({"notes": ["word " * 20]}, 2 * 17 + 3 * 5 + 3 * (1 + 2 + 2 + 5)),  # 100 letters: two lines
        ({"lines": ["x"], "labels": ["one"]}, 2 * 17 + 3 * 5 + 3 * (0 + 1 + 1 + 5)),
    ],
)
def test_a_figure_is_as_high_as_its_rows_touches_and_words(
    changes: dict[str, Any], height: float
) -> None:
    assert draw(replace(PLOT, **changes)).get_size_inches()[1] == pytest.approx(height * MM)


def test_a_chart_that_is_alone_in_its_row_is_as_wide_as_two() -> None:
    first, second, alone, _ = (axes.get_subplotspec() for axes in draw(PLOT).axes)
    columns = [
        (place.colspan.start, place.colspan.stop, place.rowspan.start)
        for place in (first, second, alone)
    ]
    assert columns == [(0, 1, 0), (1, 2, 0), (0, 2, 1)]


def test_only_what_differs_is_bold() -> None:
    figure = draw(PLOT)
    titles = [axes.title.get_fontweight() for axes in figure.axes[:3]]
    assert titles == ["normal", "normal", "bold"]


@pytest.mark.parametrize(("beside", "letters"), [(1, 60), (2, 30)])
def test_a_title_is_folded_at_the_width_of_its_chart(beside: int, letters: int) -> None:
    long = replace(CURVE, title="ab " * 40)
    figure = draw(replace(PLOT, rows=[[long] * beside], touches={}))
    lines = figure.axes[0].get_title(loc="left") or figure.axes[0].get_title()
    assert max(map(len, lines.splitlines())) == letters - 1  # words of two, and a space


def test_all_axes_are_of_the_whole_time() -> None:
    assert [axes.get_xlim() for axes in draw(PLOT).axes] == [(0.0, 3.0)] * 4


def test_a_figure_of_no_time_has_an_axis_all_the_same() -> None:
    low, high = draw(replace(PLOT, seconds=0.0, touches={})).axes[0].get_xlim()
    assert 0 == low < high < 1e-6


def test_a_line_stands_where_the_sides_part() -> None:
    for axes in draw(PLOT).axes:
        upright = [line for line in axes.lines if list(line.get_xdata()) == [0.4, 0.4]]
        assert len(upright) == 1


def test_there_is_no_line_where_they_do_not_part() -> None:
    with_line, without = (draw(replace(PLOT, part=part)).axes for part in (0.4, None))
    counts = [len(a.lines) - len(b.lines) for a, b in zip(with_line, without, strict=True)]
    assert counts == [1] * 4


def test_the_time_is_named_below_the_last_axes_alone() -> None:
    names = [axes.get_xlabel() for axes in draw(PLOT).axes]
    assert [bool(name) for name in names] == [False, False, False, True]


def test_a_bar_lasts_as_long_as_two_bodies_touch() -> None:
    bars = [bar[:2] for bar in _bars(draw(PLOT).axes[-1])]
    least = 3.0 / 300  # what touches for a step is seen
    expected = [(0.2, 0.5), (0.3, 0.9), (1.0, 1.0 + least), (0.0, 2.0)]
    np.testing.assert_allclose(bars, expected, atol=1e-9)


def test_the_second_side_is_below_the_first_and_each_pair_below_the_last() -> None:
    bars = [bar[2:] for bar in _bars(draw(PLOT).axes[-1])]
    expected = [(0.42, 0.68), (0.7, 0.96), (0.7, 0.96), (1.7, 1.96)]
    np.testing.assert_allclose(bars, expected, atol=1e-9)


def test_the_panel_of_touches_goes_down_from_zero_to_the_number_of_pairs() -> None:
    axes = draw(PLOT).axes[-1]
    assert axes.get_ylim() == (2.0, 0.0)
    assert list(axes.get_yticks()) == []


def test_the_names_of_what_touches_stand_above_its_bars() -> None:
    axes = draw(PLOT).axes[-1]
    places = {text.get_text(): text.get_position() for text in axes.texts}
    assert places == {"ball on floor": (0.0, 0.38), "a on b": (0.0, 1.38)}


def test_only_the_bars_of_the_second_side_are_hatched() -> None:
    groups = draw(PLOT).axes[-1].collections
    assert [bool(group.get_hatch()) for group in groups if group.get_paths()] == [
        False,
        True,
        True,
    ]


def test_the_bars_of_a_side_have_its_colour() -> None:
    from matplotlib.colors import to_rgb

    groups = [group for group in draw(PLOT).axes[-1].collections if group.get_paths()]
    edges = [tuple(group.get_edgecolor()[0][:3]) for group in groups]
    expected = [to_rgb(SIDES[side]["color"]) for side in (0, 1, 1)]
    np.testing.assert_allclose(edges, expected)
    np.testing.assert_allclose(groups[0].get_facecolor()[0][:3], expected[0])
    np.testing.assert_allclose(groups[1].get_facecolor()[0][:3], (1, 1, 1))


def test_the_legend_names_the_sides_that_there_are() -> None:
    for labels in (["one", "two"], ["one"]):
        (legend,) = draw(replace(PLOT, labels=labels)).legends
        assert [text.get_text() for text in legend.texts] == labels
        assert legend.get_title().get_text().splitlines() == ["hold", "file", "step"]


# The figure of one run.


@pytest.fixture(scope="module")
def hold() -> Trace:
    """A short run of the arm, above a floor."""
    return traced("hold", seconds=0.1)


def test_a_chart_of_a_joint_is_in_degrees_with_its_command(hold: Trace) -> None:
    charts = [chart for row in of_trace(hold).rows for chart in row]
    name, place = hold.header.joints[1], hold.header.jnt_qposadr[1]
    (chart,) = [chart for chart in charts if chart.title.startswith(name)]
    np.testing.assert_allclose(
        chart.curves[hold.header.label][1], np.degrees(hold.qpos[:, place]), atol=1e-12
    )
    np.testing.assert_allclose(chart.curves[COMMAND][1], np.degrees(hold.ctrl[:, 1]), atol=1e-12)
    assert chart.least == pytest.approx(np.degrees(20 * ENCODER_COUNT))


def test_the_time_of_a_figure_starts_at_zero(hold: Trace) -> None:
    later = Trace(hold.header, {**hold.columns, "time": hold.time + 5})
    figure = of_trace(later)
    assert figure.seconds == pytest.approx(0.1)
    assert figure.part is None
    time = next(iter(figure.rows[0][0].curves.values()))[0]
    np.testing.assert_allclose(time, hold.time - hold.time[0], atol=1e-12)


def test_the_figure_of_a_run_against_itself_has_no_line_and_nothing_apart(hold: Trace) -> None:
    from statemachine.lab.compare import compare

    figure = of_comparison(compare(hold, hold))
    assert (figure.part, figure.seconds) == (None, pytest.approx(0.1))
    gaps = [row[-1] for row in figure.rows]
    assert all(np.abs(curve[1]).max() == 0 for gap in gaps for curve in gap.curves.values())
