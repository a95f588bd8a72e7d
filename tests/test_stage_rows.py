"""What a page of two runs draws, ranks and counts, of runs whose rows are written here."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from statemachine.interface import Model
from statemachine.lab.compare import Agreement, Comparison, compare
from statemachine.lab.compare.chaos import Band, ChaosFloor
from statemachine.lab.compare.perturbed import EXACT, Uncertainty
from statemachine.lab.questions.events import events_of, events_table
from statemachine.lab.questions.finding import VerdictCounts, finding_of, leading
from statemachine.lab.questions.plot import COMMAND, of_comparison, of_trace
from statemachine.lab.questions.stage.both_runs import BothRuns
from statemachine.lab.questions.stage.lanes import lanes_of, round_times
from statemachine.lab.questions.stage.quantity_chart import GAP, charts_of
from statemachine.lab.questions.stage.quantity_row import data_table, quantity_row
from statemachine.lab.questions.stage.scene import moments_of
from statemachine.lab.questions.worst import (
    difference,
    end_cell,
    is_noisy,
    largest_cell,
    worst_of,
)
from statemachine.lab.recordings import Trace
from statemachine.measures import ENCODER_COUNT

from .support.still_runs import (
    ARM,
    BALL,
    FLOOR,
    RAIL,
    ROWS,
    STEP,
    TURN,
    moved,
    robot,
    still_run,
    touching,
)
from .support.traces import changed, cut, named

ONE = (1.0, 0.0, 0.0)  # a force


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return robot(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="module")
def still(model: Model) -> Trace:
    return still_run(model)


def runs_of(comparison: Comparison) -> BothRuns:
    """Return the block of a page for two runs."""
    return BothRuns("", comparison, 0.0, tuple(events_of(comparison)), charts_of(comparison), ())


def of_kind(comparison: Comparison, kind: str) -> Agreement:
    (found,) = [each for each in comparison.agreements if each.kind == kind]
    return found


# Lanes under the slider


def lane_of(markup: str, name: str) -> str:
    """Return the lane of a quantity or of the touches of a side."""
    return markup.partition(f'title="{name}"')[2].partition('class="lane ')[0]


def bars(lane: str) -> list[tuple[float, float]]:
    """Return where the bars of a lane begin and how wide they are [%]."""
    found = re.findall(r"left:([\d.]+)%;width:([\d.]+)%", lane)
    return [(float(left), float(width)) for left, width in found]


def test_a_bar_is_as_long_as_a_quantity_is_beyond_its_tolerance(still: Trace) -> None:
    """Of 0.2 s; a row counts until the next one."""
    other = moved(moved(still, TURN, 1.0, rows=slice(4, 8)), TURN, 1.0, rows=slice(12, 13))
    markup = str(lanes_of(runs_of(compare(still, other))))
    assert bars(lane_of(markup, "turn")) == [(20.0, 20.0), (60.0, 5.0)]


def test_a_quantity_at_its_tolerance_has_no_bar(still: Trace) -> None:
    other = moved(still, TURN, 0.25, rows=slice(4, 8))
    for tolerance, count in ((0.25, 0), (0.2499, 1)):
        markup = str(lanes_of(runs_of(compare(still, other, tolerances={"joint": tolerance}))))
        assert len(bars(lane_of(markup, "turn"))) == count


def test_lanes_come_in_the_order_in_which_quantities_leave_their_tolerance(still: Trace) -> None:
    other = moved(moved(still, TURN, 1.0, rows=slice(9, None)), RAIL, 1.0, rows=slice(5, 7))
    markup = str(lanes_of(runs_of(compare(still, other))))
    assert markup.index('title="rail"') < markup.index('title="turn"')
    assert bars(lane_of(markup, "rail")) == [(25.0, 10.0)]
    assert bars(lane_of(markup, "turn")) == [(45.0, 55.0)]  # it ends with the run
    spoken = markup.partition("Beyond tolerance: ")[2]
    assert spoken.startswith("rail from 0.050 s, 0.02 s in all; turn from 0.090 s, 0.11 s in all")


def test_charts_without_a_bar_are_counted(still: Trace) -> None:
    comparison = compare(still, moved(still, TURN, 1.0, rows=5))
    count = len(charts_of(comparison))
    assert f"{count - 1} of {count}." in str(lanes_of(runs_of(comparison)))


def test_first_touches_are_marked_on_the_lane_of_their_side(still: Trace) -> None:
    left = touching(still, (4, (FLOOR, BALL), ONE, 0.0), (6, (FLOOR, ARM), ONE, 0.0))
    right = touching(still, (8, (FLOOR, BALL), ONE, 0.0))
    markup = str(lanes_of(runs_of(compare(left, right))))
    marks = [
        (look, float(left))
        for look, left in re.findall(r'class="mark (one|two)"[^>]*?left:([\d.]+)%', markup)
    ]
    assert marks == [("one", 20.0), ("one", 30.0), ("two", 40.0)]


def test_the_axis_has_round_times_at_their_places(still: Trace) -> None:
    markup = str(lanes_of(runs_of(compare(still, still))))
    axis = markup.partition('class="times"')[2].partition("</div>")[0]
    assert [float(left) for left in re.findall(r"left:([\d.]+)%", axis)] == [0, 25, 50, 75, 100]
    assert re.findall(r">([\d.]+)<", axis) == ["0", "0.05", "0.1", "0.15", "0.2"]


# Charts


def test_a_chart_has_both_sides_and_their_gap_in_the_unit_that_is_read(still: Trace) -> None:
    comparison = compare(still, moved(still, RAIL, 0.5, rows=7))
    (chart,) = [chart for chart in charts_of(comparison) if chart.title == "rail"]
    assert chart.unit == "mm"
    left, right = (curve for _, curve in chart.values().curves.values())
    assert float(right[7]) - float(left[7]) == pytest.approx(500.0)
    assert chart.values().least == pytest.approx(20 * 1000 * chart.agreement.tolerance)
    gap = chart.gap()
    assert gap.curves[GAP][1][7] == pytest.approx(500.0)
    assert gap.tolerance == pytest.approx(1000 * chart.agreement.tolerance)
    assert gap.floor is None


def test_a_chart_has_the_floor_of_its_quantity(still: Trace) -> None:
    comparison = compare(still, moved(still, RAIL, 0.5, rows=7))
    floor = floor_of(comparison, rail=np.full(ROWS, 0.25))
    charts = {chart.title: chart for chart in charts_of(comparison, floor)}
    time, width = charts["rail"].gap().floor or ((), ())
    assert len(time) == ROWS
    assert np.asarray(width) == pytest.approx(np.full(ROWS, 250.0))
    assert charts["turn"].gap().floor is None


def test_a_quantity_that_is_no_number_has_no_chart(still: Trace) -> None:
    energy = np.array(still["energy"])
    energy[3] = np.nan
    comparison = compare(still, changed(still, energy=energy))
    assert "energy" not in {chart.title for chart in charts_of(comparison)}
    assert len(charts_of(comparison)) == len(comparison.curves) - 1


def floor_of(comparison: Comparison, chance: Any = None, **widths: Any) -> ChaosFloor:
    """Return a floor of these widths by quantity, at all moments."""
    known = named(comparison)
    bands: list[Band] = []
    for name, width in widths.items():
        found = known[name]
        array = np.atleast_1d(np.asarray(width, dtype=float))
        most, end = float(array.max()), float(array[-1])
        bands.append(Band(name, found.kind, found.unit, most, end, 0.0, chance, array))
    return ChaosFloor(3, (0,), 0, 1e-12, EXACT, 0, tuple(bands))


# The table under a chart


def table_of(left: Trace, right: Trace, title: str) -> Any:
    comparison = compare(left, right)
    (chart,) = [chart for chart in charts_of(comparison) if chart.title == title]
    return str(quantity_row(chart)), data_table(chart)


def test_the_figures_of_a_chart_are_at_even_spaces_and_at_the_largest(still: Trace) -> None:
    times = 0.01 * np.arange(201)
    columns = {
        name: array if name.startswith("contact_") else np.repeat(array[:1], 201, axis=0)
        for name, array in still.columns.items()
    }
    long = Trace(still.header, {**columns, "time": times})
    markup, table = table_of(long, moved(long, RAIL, 0.5, rows=67), "rail")
    body = re.findall(r">(\d\.\d{3})<", str(table))
    assert body == sorted({f"{0.1 * k:.3f}" for k in range(21)} | {"0.670"})
    assert "22 of 201 moments" in str(table)
    assert str(table) in markup


def test_small_figures_have_significant_digits_and_rounding_is_none(still: Trace) -> None:
    """Of 1 mm in 0.001, 0.0009 and, a millionth of its tolerance, less than that."""
    gaps = np.zeros(ROWS)
    gaps[[3, 4, 5]] = 1e-6, 9e-7, 1e-12
    comparison = compare(still, moved(still, RAIL, gaps))
    (chart,) = [chart for chart in charts_of(comparison) if chart.title == "rail"]
    table = str(data_table(chart))
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", table, re.S)
    cells = [re.findall(r">([^<>]*)</td>", row) for row in rows]
    last = [row[-1] for row in cells if row]
    assert last[3] == "0.0010"
    assert last[4].replace("\u2212", "-") == "9e-4"
    assert float(last[5].replace("≈", "")) == pytest.approx(0.0, abs=1e-8)
    assert last[6] == "0.0000"


# Events


def test_events_are_touches_partings_largest_differences_and_early_ends(still: Trace) -> None:
    left = touching(still, (4, (FLOOR, BALL), ONE, 0.0))
    right = moved(still, TURN, [0.5, 0.9], rows=[6, 9])
    right = changed(moved(right, RAIL, 0.5, rows=6), {"ended": "it left every bound"})
    found = events_of(compare(left, right))
    kinds = [(event.kind, round(event.time, 3), event.side) for event in found]
    assert ("touch", 0.04, 0) in kinds
    assert ("part", 0.06, None) in kinds
    assert ("largest", 0.09, None) in kinds
    assert ("end", 0.2, 1) in kinds
    assert [event.time for event in found] == sorted(event.time for event in found)
    (part,) = [event for event in found if event.kind == "part" and round(event.time, 3) == 0.06]
    assert "turn" in part.text
    assert "rail" in part.text


def test_what_both_sides_touch_at_one_time_is_one_row(still: Trace) -> None:
    trace = touching(still, (4, (FLOOR, BALL), ONE, 0.0))
    table = events_table(compare(trace, trace))
    assert [(row[0], row[2]) for row in table.rows] == [("0.040 s", "both")]
    alone = events_table(compare(still, trace))
    assert next(row[0] for row in alone.rows if "touch" in row[1].lower()) == "0.040 s"
    assert "both" not in [row[2] for row in alone.rows]


# What differs most


def test_verdicts_are_counted_and_told_in_turn(still: Trace) -> None:
    found = of_kind(compare(still, moved(still, TURN, 1.0)), "joint")
    three = [replace(found, verdict=verdict) for verdict in ("agrees", "differs", "differs")]
    counts = VerdictCounts.of(three)
    assert (counts.differs, counts.settles, counts.agrees, counts.total) == (2, 0, 1, 3)
    assert counts.in_turn == ["differs 2", "agrees 1"]


@pytest.mark.parametrize(
    ("turn", "rail", "lead"), [(0.9, 0.001, "turn"), (0.02, 0.9, "rail"), (0.0, 0.9, "rail")]
)
def test_what_is_farthest_beyond_its_tolerance_leads(
    still: Trace, turn: float, rail: float, lead: str
) -> None:
    other = moved(moved(still, TURN, turn, rows=slice(5, None)), RAIL, rail, rows=slice(5, None))
    assert leading(compare(still, other)).name == lead


def test_what_differs_at_the_end_leads_before_what_settles(still: Trace) -> None:
    other = moved(moved(still, TURN, 0.9, rows=5), RAIL, 0.02, rows=slice(5, None))
    comparison = compare(still, other)
    finding = finding_of(comparison, None)
    assert named(comparison)["turn"].tolerances() > finding.lead.tolerances()
    worst = worst_of(comparison, finding, None).agreements[0]
    assert (worst, worst.name, worst.verdict) == (finding.lead, "rail", "differs")


def test_the_worst_come_by_verdict_then_by_tolerances_with_contacts_last(still: Trace) -> None:
    left = touching(still, (4, (FLOOR, BALL), ONE, 0.0))
    other = moved(moved(still, TURN, 0.5, rows=5), RAIL, 0.5, rows=slice(5, None))
    comparison = compare(left, other)
    finding = finding_of(comparison, None)
    worst = worst_of(comparison, finding, None, most=50)
    ranks = {"differs": 0, "settles": 1, "agrees": 2}
    assert worst.agreements[0] == finding.lead
    assert finding.lead.verdict == "differs"
    rest = worst.agreements[1:]
    assert [ranks[a.verdict] for a in rest] == sorted(ranks[a.verdict] for a in rest)
    for verdict in ranks:
        same = [a for a in rest if a.verdict == verdict]
        is_contact = [a.kind in ("force", "contact") for a in same]
        assert is_contact == sorted(is_contact)
        for contact in (False, True):
            sizes = [a.tolerances() for a in same if (a.kind in ("force", "contact")) is contact]
            assert sizes == sorted(sizes, reverse=True)
    few = worst_of(comparison, finding, None, most=3)
    assert few.agreements == worst.agreements[:3]
    assert few.rest.total == len(comparison.agreements) - 3
    assert few.floors == {}


@pytest.mark.parametrize(("width", "is_so"), [(0.99, False), (1.0, False), (1.01, True)])
def test_a_floor_is_told_that_is_above_a_tolerance(still: Trace, width: float, is_so: bool) -> None:
    comparison = compare(still, moved(still, TURN, 1.0))
    turn = named(comparison)["turn"]
    floor = floor_of(comparison, turn=width * turn.tolerance)
    assert is_noisy(comparison.agreements, floor) is is_so
    touch = replace(turn, kind="contact")
    assert not is_noisy([touch], floor)
    worst = worst_of(comparison, finding_of(comparison, floor), floor)
    assert bool(worst.floors) is is_so
    headers = worst.full_table.headers
    assert ("rounding" in headers) is is_so


def test_the_cells_of_a_quantity_are_its_largest_and_that_of_the_end(still: Trace) -> None:
    found = named(compare(still, moved(still, RAIL, 0.5)))["rail"]
    facts = replace(found, max=0.5, settled=0.25, tolerance=1e-3)
    assert (largest_cell(facts), end_cell(facts)) == ("500 mm", "250 mm")
    assert difference(0.99e-9, facts) == "≈ 0"
    assert difference(1.01e-9, facts) != "≈ 0"
    assert difference(0.0, facts) == "0 mm"
    touch = replace(facts, kind="contact", unit="s", note="never on the left")
    assert (largest_cell(touch), end_cell(touch)) == ("never", "–")
    assert largest_cell(replace(touch, note="")) == "500 ms"


@pytest.mark.parametrize(("settled", "most", "is_changing"), [(0.9, 0.9, False), (0.5, 0.9, False)])
def test_a_difference_that_stays_is_settled(
    still: Trace, settled: float, most: float, is_changing: bool
) -> None:
    gaps = np.full(ROWS, settled)
    gaps[:10] = most
    finding = finding_of(compare(still, moved(still, TURN, gaps)), None)
    assert finding.is_changing is is_changing
    grows = finding_of(compare(still, moved(still, TURN, 0.1 * np.arange(ROWS) ** 2)), None)
    assert grows.is_changing


# A figure for paper


def test_the_figure_of_two_runs_has_a_row_for_each_chart(still: Trace) -> None:
    left = touching(still, (2, (FLOOR, ARM), ONE, 0.0), (4, (FLOOR, BALL), ONE, 0.0))
    comparison = compare(left, moved(still, TURN, 1.0, rows=slice(9, None)))
    plot = of_comparison(comparison)
    assert len(plot.rows) == len(charts_of(comparison))
    assert plot.seconds == pytest.approx(0.2)
    assert plot.part == min(a.since for a in comparison.agreements if a.since is not None)
    assert list(plot.touches.values()) == [
        [[[pytest.approx(0.02), pytest.approx(0.03)]], []],
        [[[pytest.approx(0.04), pytest.approx(0.05)]], []],
    ]
    assert plot.title == still.header.experiment
    agrees = of_comparison(compare(still, still))
    assert (agrees.part, agrees.touches) == (None, {})


def test_the_notes_of_a_figure_name_what_parts_first(still: Trace) -> None:
    plot = of_comparison(compare(still, moved(still, TURN, 1.0, rows=slice(9, None))))
    (note,) = [note for note in plot.notes if "0.09" in note]
    assert "turn" in note
    assert "rail" not in note


def test_the_figure_of_one_run_has_its_joints_with_their_commands(still: Trace) -> None:
    ctrl = np.array(still.ctrl)
    ctrl[:] = 0.5, 0.25
    trace = changed(moved(moved(still, TURN, 0.1), RAIL, 0.2), ctrl=ctrl)
    plot = of_trace(trace)
    charts = [chart for row in plot.rows for chart in row]
    by_title = {chart.title.partition(" [")[0]: chart for chart in charts}
    assert list(by_title) == ["tip, from its start", "turn", "rail", "energy"]
    assert [len(row) for row in plot.rows] == [2, 2]
    turn, rail = by_title["turn"], by_title["rail"]
    place = float(np.degrees(trace.qpos[0, TURN]))
    assert turn.curves[still.header.label][1] == pytest.approx(np.full(ROWS, place))
    assert turn.curves[COMMAND][1] == pytest.approx(np.full(ROWS, np.degrees(0.5)))
    assert rail.curves[still.header.label][1] == pytest.approx(1000 * trace.qpos[:, RAIL])
    assert rail.curves[COMMAND][1] == pytest.approx(np.full(ROWS, 250.0))
    assert turn.least == pytest.approx(20 * np.degrees(ENCODER_COUNT))
    assert rail.least == 0.0
    assert plot.labels == [still.header.label, COMMAND]
    assert plot.part is None


def test_the_sizes_of_an_uncertain_start_are_told_with_their_unit(still: Trace) -> None:
    comparison = compare(still, moved(still, TURN, 1.0))
    floor = replace(floor_of(comparison, turn=0.1), uncertain=Uncertainty(0.002, 0.0))
    told = " ".join(of_comparison(comparison, floor).notes)
    assert "2 mm" in told
    assert "°" not in told.partition("2 mm")[2][:12]


# Moments


def long_run(still: Trace, count: int, step: float) -> Trace:
    """Return a run of so many rows, so far apart [s]."""
    columns = {
        name: array[:0] if name.startswith("contact_") else np.repeat(array[:1], count, axis=0)
        for name, array in still.columns.items()
    }
    header = replace(still.header, timestep=step)
    return Trace(header, {**columns, "time": step * np.arange(count)})


@pytest.mark.parametrize(
    ("left", "right", "spacing"),
    [
        # Common moments are 10 ms, or 20 ms, or 70 ms apart; the longer step is 7 ms, 20 ms, 14 ms.
        ((0.005, 201), (0.01, 101), 0.01),
        ((0.01, 101), (0.02, 51), 0.02),
        ((0.01, 141), (0.014, 101), 0.01),
        ((0.014, 101), (0.01, 141), 0.014),
    ],
)
def test_moments_are_those_in_common_unless_they_are_too_far_apart(
    still: Trace, left: tuple[float, int], right: tuple[float, int], spacing: float
) -> None:
    runs = [long_run(still, count, step) for step, count in (left, right)]
    times, hidden = moments_of(runs[0], runs[1])
    assert np.diff(times) == pytest.approx(np.full(len(times) - 1, spacing))
    assert times[-1] == pytest.approx(runs[0].time[-1] if spacing != 0.02 else 1.0)
    assert hidden == 0


def test_of_many_moments_every_other_is_shown_with_those_that_have_to_be(still: Trace) -> None:
    long = long_run(still, 2001, STEP)
    times, hidden = moments_of(long, long, must=(0.03,))
    assert times[:4] == pytest.approx([0.0, 0.02, 0.03, 0.04])
    assert len(times) == 1002
    assert hidden == 2001 - 1002


def test_the_moments_end_with_the_shorter_run(still: Trace) -> None:
    times, _ = moments_of(still, cut(still, 15))
    assert times == pytest.approx(STEP * np.arange(15))


@pytest.mark.parametrize(
    ("until", "times"),
    [
        (3.966, [0, 1, 2, 3]),
        (2.0, [0, 0.5, 1, 1.5, 2]),
        (0.5, [0, 0.1, 0.2, 0.3, 0.4, 0.5]),
        (0.002, [0, 0.0005, 0.001, 0.0015, 0.002]),
    ],
)
def test_the_axis_of_time_has_round_moments(until: float, times: list[float]) -> None:
    assert round_times(until) == pytest.approx(times)
