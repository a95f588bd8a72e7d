"""Charts: what matplotlib is given for the figures of a run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.errors import BadInputError
from statemachine.show.blocks import Text
from statemachine.show.charts import (
    GAP,
    SIDES,
    chart,
    check_suffix,
    data_url,
    draw_picture,
    drawn,
    write_pictures,
)
from statemachine.show.pictures import Bars, Traces

pytestmark = pytest.mark.usefixtures("matplotlib")

TIME = np.linspace(0.0, 2.0, 5)


@pytest.fixture
def axes() -> Any:
    from matplotlib.figure import Figure

    return Figure((7.0, 3.4)).subplots()


def traces(curves: dict[str, Any], **named: Any) -> Traces:
    """Return curves over the time of this file."""
    return Traces("a title", "t [s]", "q", {k: (TIME, y) for k, y in curves.items()}, **named)


def test_a_curve_has_its_points_and_its_name(axes: Any) -> None:
    draw_picture(axes, traces({"one": TIME**2}))
    [line] = axes.lines
    assert line.get_label() == "one"
    assert line.get_xydata().tolist() == np.column_stack([TIME, TIME**2]).tolist()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("t [s]", "q")
    assert axes.get_legend() is None


def test_several_curves_have_a_legend(axes: Any) -> None:
    draw_picture(axes, traces({"one": TIME, "two": -TIME}))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["one", "two"]


def test_what_has_one_colour_and_an_engine_one_kind_of_line(axes: Any) -> None:
    names = ("mujoco: hip", "mujoco: knee", "pybullet: hip", "pybullet: knee")
    draw_picture(axes, traces(dict.fromkeys(names, TIME)))
    colours = [line.get_color() for line in axes.lines]
    kinds = [line.get_linestyle() for line in axes.lines]
    assert colours[0] == colours[2] != colours[1] == colours[3]
    assert kinds[0] == kinds[1] != kinds[2] == kinds[3]


def test_sides_are_drawn_as_sides_over_the_whole_time(axes: Any) -> None:
    draw_picture(axes, traces({"one": TIME, "two": -TIME}, sides=True))
    assert [line.get_color() for line in axes.lines] == [side["color"] for side in SIDES]
    assert axes.get_xlim() == (0.0, 2.0)


def test_how_far_apart_the_sides_are_is_a_line_of_its_own(axes: Any) -> None:
    draw_picture(axes, traces({"gap": TIME + 1}, sides=True, log=True))
    assert axes.lines[0].get_color() == GAP["color"]


def test_an_axis_goes_over_what_matters_at_least(axes: Any) -> None:
    draw_picture(axes, traces({"one": 3.0 + TIME / 20}, least=1.0))
    assert axes.get_ylim() == pytest.approx((3.05 - 0.58, 3.05 + 0.58))


def test_an_axis_that_goes_over_more_stays(axes: Any) -> None:
    draw_picture(axes, traces({"one": 3.0 * TIME}, least=1.0))
    low, high = axes.get_ylim()
    assert low < 0
    assert 6 < high < 7


def test_the_tolerance_is_a_level_line(axes: Any) -> None:
    draw_picture(axes, traces({"one": TIME}, tolerance=0.5))
    assert axes.lines[-1].get_ydata() == [0.5, 0.5]


@pytest.mark.parametrize(
    ("values", "tolerance", "low", "high"),
    [
        ([0.02, 0.5], None, 1e-2, 1.0),
        ([0.02, 0.95], None, 1e-2, 10.0),  # a twentieth of a decade is left above
        ([0.5, 0.5], None, 1e-2, 1.0),  # two decades at least
        ([1e-9, 0.5], 0.1, 1e-4, 1.0),  # below a thousandth of the tolerance nothing matters
        ([1e-3, 0.5], 30.0, 1e-2, 100.0),
        ([0.0, 0.5], None, -0.25e-2, 1.0),  # with a level for zero
    ],
)
def test_a_logarithmic_axis_goes_over_whole_powers_of_ten(
    axes: Any, values: list[float], tolerance: float | None, low: float, high: float
) -> None:
    picture = Traces("", "", "", {"one": ([0, 1], values)}, log=True, tolerance=tolerance)
    draw_picture(axes, picture)
    assert axes.get_ylim() == pytest.approx((low, high))


def test_powers_of_ten_are_written_out_where_they_are_few(axes: Any) -> None:
    draw_picture(axes, Traces("", "", "", {"one": ([0, 1], [2e-5, 5e-3])}, log=True))
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["1e−5", "1e−4", "0.001", "0.01"]
    assert axes.get_yticks().tolist() == pytest.approx([1e-5, 1e-4, 1e-3, 1e-2])


def test_many_powers_of_ten_are_not_all_named(axes: Any) -> None:
    draw_picture(axes, Traces("", "", "", {"one": ([0, 1], [1e-15, 1e15])}, log=True))
    exponents = np.log10(axes.get_yticks())
    assert 4 <= len(exponents) <= 9
    assert set(np.diff(exponents).round(9)) == {np.diff(exponents)[0].round(9)}


def test_zero_is_named_where_it_is(axes: Any) -> None:
    draw_picture(axes, Traces("", "", "", {"one": ([0, 1, 2], [0.0, 0.0, 0.5])}, log=True))
    assert axes.get_yticks()[0] == 0.0
    assert axes.get_yticklabels()[0].get_text() == "0"


def test_bars_of_a_name_stand_below_each_other(axes: Any) -> None:
    draw_picture(axes, Bars("", "[N]", ("hip", "knee"), {"one": [1.0, 2.0], "two": [3.0, 4.0]}))
    found = [(bar.get_y() + bar.get_height() / 2, bar.get_width()) for bar in axes.patches]
    assert np.array(found) == pytest.approx(np.array([(-0.2, 1), (0.8, 2), (0.2, 3), (1.2, 4)]))
    assert {round(bar.get_height(), 9) for bar in axes.patches} == {0.36}
    assert [label.get_text() for label in axes.get_yticklabels()] == ["hip", "knee"]
    low, high = axes.get_ylim()
    assert low > high  # the first is on top


def _size(content: bytes) -> tuple[float, float]:
    """Return width and height of an SVG [pt]."""
    words = content.decode().split("<svg", 1)[1].split(">", 1)[0]
    width, height = (
        float(words.split(f'{name}="')[1].split("pt")[0]) for name in ("width", "height")
    )
    return width, height


def test_pictures_stand_above_each_other_each_in_its_height() -> None:
    bars = Bars("", "[N]", ("hip", "knee"), {"one": [1.0, 2.0]})
    curve = traces({"one": TIME})
    assert _size(drawn([curve], "svg")) == pytest.approx((7.0 * 72, 3.4 * 72))
    assert _size(drawn([bars], "svg")) == pytest.approx((7.0 * 72, (0.9 + 2 * 0.42) * 72))
    assert _size(drawn([curve, bars], "svg"))[1] == pytest.approx((3.4 + 0.9 + 2 * 0.42) * 72)


def test_only_several_pictures_have_titles() -> None:
    curve = traces({"one": TIME})
    assert b"a title" not in drawn([curve], "svg")
    assert drawn([curve, curve], "svg").count(b">a title<") == 2


def test_a_chart_of_a_page_has_the_size_and_the_box_that_are_asked_for() -> None:
    text = chart(traces({"one": TIME, "two": TIME}), (4.0, 2.0), (0.1, 0.2, 0.8, 0.7))
    assert _size(text.encode()) == pytest.approx((4.0 * 72, 2.0 * 72))


def test_the_same_picture_has_the_same_bytes() -> None:
    curve = traces({"one": TIME})
    assert drawn([curve], "svg") == drawn([curve], "svg")


def test_the_pictures_of_a_page_are_written_whole(tmp_path: Path) -> None:
    file = tmp_path / "a.SVG"
    size = write_pictures([Text("words"), traces({"one": TIME})], file)
    assert size == file.stat().st_size > 1000


def test_a_page_without_a_picture_has_nothing_to_write(tmp_path: Path) -> None:
    with pytest.raises(BadInputError):
        write_pictures([Text("words")], tmp_path / "a.svg")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["a.gif", "a", "a.svg.txt"])
def test_another_suffix_is_no_figure(name: str) -> None:
    with pytest.raises(BadInputError):
        check_suffix(Path(name))


def test_a_suffix_names_the_form() -> None:
    assert [check_suffix(Path(name)) for name in ("a.svg", "b.PNG", "c.pdf")] == [
        "svg",
        "png",
        "pdf",
    ]


def test_a_picture_is_a_url_of_its_bytes() -> None:
    assert data_url(b"\x00\xff", "webp") == "data:image/webp;base64,AP8="


def test_what_is_not_a_number_has_no_place_on_a_logarithmic_axis(axes: Any) -> None:
    draw_picture(axes, Traces("", "", "", {"one": ([0, 1, 2], [math.nan, 0.2, 0.5])}, log=True))
    assert axes.get_ylim() == pytest.approx((1e-2, 1.0))
