"""What two runs come to whose rows are written here: figures of each quantity, and of the floor.

Both are copies of one run in which nothing moves: a robot that floats, with an arm that a servo
holds, beside a rail. Each test moves one column by amounts that are seen at a glance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from statemachine.errors import BadInputError, TraceError
from statemachine.interface import Model
from statemachine.lab.compare import Agreement, Comparison, chaos, chaos_floor, compare
from statemachine.lab.compare.chaos import Band, ChaosFloor, against_floor
from statemachine.lab.compare.motion import least_motions, motion_of
from statemachine.lab.compare.series import (
    at_the_end,
    base_label,
    default_tip,
    joint_columns,
    normal_forces,
    series,
    total_forces,
    touches,
    world_forces,
)
from statemachine.lab.recordings import Rerun, Trace, record
from statemachine.measures import QUANTITIES

from .support.small_models import loaded
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
from .support.traces import changed, named


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return robot(tmp_path_factory.mktemp("rows"))


@pytest.fixture(scope="module")
def still(model: Model) -> Trace:
    """Return a run of 0.2 s in which nothing moves and nothing touches."""
    return still_run(model)


def agreement_of(left: Trace, right: Trace, name: str, **how: Any) -> Agreement:
    return named(compare(left, right, **how))[name]


# Figures of one quantity


def test_the_figures_of_a_joint_are_those_of_its_rows(still: Trace) -> None:
    gaps = np.zeros(ROWS)
    gaps[[5, 8, 19, 20]] = 0.3, -0.5, 0.2, 0.4
    found = agreement_of(still, moved(still, TURN, gaps), "turn")
    assert found.max == pytest.approx(0.5)
    assert found.at == pytest.approx(0.08)
    assert found.since == pytest.approx(0.05)
    assert found.rms == pytest.approx(math.sqrt((0.09 + 0.25 + 0.04 + 0.16) / ROWS))
    assert found.settled == pytest.approx((0.2 + 0.4) / 3)  # of 0.18, 0.19 and 0.20 s
    assert (found.verdict, found.kind, found.unit) == ("differs", "joint", "rad")


@pytest.mark.parametrize(
    ("gap", "verdict"), [(0.01, "agrees"), (0.0101, "differs"), (-0.0101, "differs")]
)
def test_a_joint_may_be_off_by_its_tolerance(still: Trace, gap: float, verdict: str) -> None:
    found = agreement_of(still, moved(still, TURN, gap), "turn", tolerances={"joint": 0.01})
    assert found.verdict == verdict
    assert found.since == (None if verdict == "agrees" else 0.0)
    assert found.tolerance == 0.01


@pytest.mark.parametrize(("last", "verdict"), [(0.03, "settles"), (0.0301, "differs")])
def test_a_joint_settles_whose_mean_over_the_last_tenth_is_within(
    still: Trace, last: float, verdict: str
) -> None:
    """Of three moments of which one alone is off."""
    other = moved(still, TURN, last, rows=20)
    assert agreement_of(still, other, "turn", tolerances={"joint": 0.01}).verdict == verdict


def test_a_value_that_is_no_number_never_agrees(still: Trace) -> None:
    energy = np.array(still["energy"])
    energy[[3, 4], 0] = np.nan
    found = agreement_of(still, changed(still, energy=energy), "energy")
    assert (found.verdict, found.since) == ("differs", pytest.approx(0.03))
    assert "2 of 21" in found.note


@pytest.mark.parametrize(
    ("most", "tolerance", "share"),
    [(0.0, 0.0, 0.0), (1.0, 0.0, math.inf), (1.0, 0.5, 2.0), (math.nan, 0.5, math.inf)],
)
def test_a_gap_in_tolerances(still: Trace, most: float, tolerance: float, share: float) -> None:
    found = agreement_of(still, still, "turn")
    assert replace(found, max=most, tolerance=tolerance).tolerances() == share


# What is compared, and how far it is


def curve_of(left: Trace, right: Trace, name: str) -> Any:
    (curve,) = [curve for curve in series(left, right) if curve.name == name]
    return curve


def test_the_difference_of_a_place_is_the_length_of_a_vector(still: Trace) -> None:
    other = moved(moved(still, 0, 3.0), 1, -4.0)
    curve = curve_of(still, other, "base, position")
    assert curve.difference == pytest.approx(np.full(ROWS, 5.0))
    assert (curve.kind, curve.unit) == ("base", "m")


@pytest.mark.parametrize("length", [1.0, 2.0, -1.0])
def test_the_difference_of_a_rotation_is_its_angle_whatever_the_quaternions_length(
    still: Trace, length: float
) -> None:
    qpos = np.array(still.qpos)
    qpos[:, 3:7] = length * np.array([math.cos(0.3), 0.0, math.sin(0.3), 0.0])
    curve = curve_of(still, changed(still, qpos=qpos), "base, rotation")
    assert curve.difference == pytest.approx(np.full(ROWS, 0.6))
    assert curve.kind == "base rotation"
    assert curve.left.size == 0


def test_a_slide_is_compared_in_metres_and_keeps_both_sides(still: Trace) -> None:
    curve = curve_of(still, moved(still, RAIL, np.arange(ROWS) * -0.1), "rail")
    assert (curve.kind, curve.unit) == ("slide", "m")
    assert curve.difference == pytest.approx(0.1 * np.arange(ROWS))
    assert curve.right - curve.left == pytest.approx(-0.1 * np.arange(ROWS))


def test_an_energy_counts_from_the_start_of_its_side(still: Trace) -> None:
    shifted = changed(still, energy=still["energy"] + 7.0)
    assert curve_of(still, shifted, "energy").difference == pytest.approx(np.zeros(ROWS))
    grows = changed(still, energy=still["energy"] + np.outer(np.arange(ROWS), [2.0, -0.5]))
    assert curve_of(still, grows, "energy").right == pytest.approx(1.5 * np.arange(ROWS))


def test_a_site_is_compared_by_place_and_rotation(still: Trace) -> None:
    places = np.array(still["site_xpos"]) + np.array([0.0, 0.3, 0.4])
    other = changed(still, site_xpos=places)
    assert curve_of(still, other, "tip, position").difference == pytest.approx(np.full(ROWS, 0.5))
    assert curve_of(still, other, "tip, rotation").difference == pytest.approx(np.zeros(ROWS))
    assert not [each for each in series(still, other, "") if "tip" in each.kind]


def test_a_column_without_a_number_is_not_compared(still: Trace) -> None:
    for name, kind in (("energy", "energy"), ("site_xpos", "tip"), ("site_xmat", "tip")):
        empty = changed(still, None, **{name: np.full_like(still[name], np.nan)})
        for pair in ((still, empty), (empty, still)):
            kinds = {curve.kind for curve in series(*pair)}
            assert kind not in kinds
            assert "joint" in kinds


def test_the_columns_of_a_joint_are_those_of_its_kind(still: Trace) -> None:
    base = base_label(still.header)
    free, turn = joint_columns(still.header, base), joint_columns(still.header, "turn")
    assert (free.qpos, free.qvel) == (slice(0, 7), slice(0, 6))
    assert (turn.qpos, turn.qvel) == (slice(7, 8), slice(6, 7))


def test_a_base_is_one_where_it_floats_in_all_runs(still: Trace, tmp_path: Any) -> None:
    text = '<body name="arm"><joint name="turn"/><geom size="0.1"/><site name="tip"/></body>'
    fixed = record(loaded(tmp_path, text), seconds=0.02)
    assert base_label(still.header, still.header)
    assert base_label(still.header, fixed.header) == ""
    assert default_tip(still.header, fixed.header) == "tip"


@pytest.mark.parametrize(
    ("time", "count"), [(np.arange(21.0), 3), (np.arange(20.0), 2), (5.0 + np.arange(21.0), 3)]
)
def test_the_end_is_the_last_tenth_of_the_time(time: np.ndarray, count: int) -> None:
    assert np.flatnonzero(at_the_end(time)).tolist() == list(range(len(time)))[-count:]


# Contacts


def test_forces_of_a_pair_add_up_in_each_row(still: Trace) -> None:
    trace = touching(
        still,
        (2, (FLOOR, BALL), (3.0, 0.0, 4.0), -0.01),
        (2, (FLOOR, BALL), (1.0, 0.0, -4.0), -0.02),
        (5, (FLOOR, BALL), (3.0, 4.0, 0.0), -0.03),
        (5, (FLOOR, ARM), (7.0, 0.0, 0.0), -0.01),
    )
    normal, total = normal_forces(trace), total_forces(trace)
    ball, arm = normal
    assert normal[ball][[0, 2, 5]].tolist() == [0.0, 4.0, 3.0]
    assert total[ball][[0, 2, 5]].tolist() == [0.0, 4.0, 5.0]
    assert normal[arm][[2, 5]].tolist() == [0.0, 7.0]


def test_a_force_in_world_axes_is_that_on_the_body_with_the_larger_number(still: Trace) -> None:
    force = (1.0, 2.0, 3.0)
    one = touching(still, (0, (FLOOR, BALL), force, 0.0), (1, (BALL, FLOOR), force, 0.0))
    assert world_forces(one).tolist() == [[-3.0, 2.0, 1.0], [3.0, -2.0, -1.0]]


def test_the_contacts_of_a_pair_come_to_figures(still: Trace) -> None:
    trace = touching(
        still,
        (4, (FLOOR, BALL), (9.0, 0.0, 0.0), -0.01),
        (6, (FLOOR, BALL), (9.0, 0.0, 0.0), -0.04),
        (7, (FLOOR, BALL), (9.0, 0.0, 0.0), 0.02),
        (18, (FLOOR, BALL), (3.0, 0.0, 4.0), 0.0),
        (19, (FLOOR, BALL), (6.0, 0.0, 0.0), 0.0),
    )
    (touch,) = touches(trace, still)
    left = touch.left
    assert (left.first, left.last) == pytest.approx((0.04, 0.19))
    assert left.share == pytest.approx(5 / 21)
    assert (left.force, left.total) == pytest.approx((9 / 3, 11 / 3))  # of the last three rows
    assert (left.deepest, left.deepest_at) == pytest.approx((0.04, 0.06))
    assert left.ends is False
    assert (touch.right.first, touch.right.share) == (None, 0.0)


def test_a_pair_that_touches_at_the_last_moment_ends_touching(still: Trace) -> None:
    for row, ends in ((20, True), (19, False)):
        contact = (row, (FLOOR, BALL), (1.0, 0.0, 0.0), 0.0)
        (touch,) = touches(still, touching(still, contact))
        assert touch.right.ends is ends


def test_shapes_that_are_apart_are_no_depth(still: Trace) -> None:
    (touch,) = touches(touching(still, (3, (FLOOR, BALL), (1.0, 0.0, 0.0), 0.01)), still)
    assert touch.left.deepest == 0.0


def touch_at(still: Trace, left: int | None, right: int | None, **how: Any) -> Agreement:
    """Return the agreement of a first touch in these rows."""
    sides = [
        still if row is None else touching(still, (row, (FLOOR, BALL), (1.0, 0.0, 0.0), 0.0))
        for row in (left, right)
    ]
    (found,) = [each for each in compare(*sides, **how).agreements if each.kind == "contact"]
    return found


@pytest.mark.parametrize(
    ("left", "right", "gap", "at", "verdict"),
    [
        (4, 5, 0.01, 0.04, "agrees"),
        (4, 6, 0.02, 0.04, "differs"),
        (7, 4, 0.03, 0.04, "differs"),
        (4, None, 0.16, 0.04, "differs"),
        (None, 20, 0.0, 0.2, "differs"),  # at any size
    ],
)
def test_a_first_touch_may_be_late_by_a_step(
    still: Trace, left: int | None, right: int | None, gap: float, at: float, verdict: str
) -> None:
    found = touch_at(still, left, right)
    assert (found.max, found.at) == pytest.approx((gap, at))
    assert found.max == found.rms == found.settled
    assert found.verdict == verdict
    assert found.since == (None if verdict == "agrees" else pytest.approx(at))
    assert bool(found.note) is (None in (left, right))


def test_the_settled_gap_of_a_force_is_that_of_the_means(still: Trace) -> None:
    """One side rings about what the other presses with."""
    rings = [(row, (FLOOR, BALL), (force, 0.0, 0.0), 0.0) for row, force in ((18, 3.0), (19, 9.0))]
    calm = [(row, (FLOOR, BALL), (6.0, 0.0, 0.0), 0.0) for row in (18, 19)]
    (found,) = [
        each
        for each in compare(touching(still, *rings), touching(still, *calm)).agreements
        if each.kind == "force"
    ]
    assert found.max == 3.0
    assert found.settled == 0.0


# What came of a robot that floats


def outcome_of(left: Trace, right: Trace, name: str) -> Any:
    (found,) = [each for each in compare(left, right).outcomes if each.name == name]
    return found


@pytest.mark.parametrize(("height", "falls"), [(0.301, False), (0.299, True)])
def test_a_base_has_fallen_below_a_third_of_its_height(
    still: Trace, height: float, falls: bool
) -> None:
    low = moved(still, 2, height - 0.9, rows=slice(5, 8))
    found = outcome_of(still, low, "fell")
    assert (found.left, found.right) == (None, pytest.approx(0.05) if falls else None)
    assert found.is_on_one_side is falls
    assert found.verdict == ("differs" if falls else "agrees")
    assert found.difference == pytest.approx(0.15 if falls else 0.0)


@pytest.mark.parametrize(("angle", "falls"), [(1.56, False), (1.58, True)])
def test_a_base_has_fallen_that_is_turned_over(still: Trace, angle: float, falls: bool) -> None:
    qpos = np.array(still.qpos)
    qpos[6:, 3:7] = math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0
    found = outcome_of(changed(still, qpos=qpos), still, "fell")
    assert found.left == (pytest.approx(0.06) if falls else None)


def test_two_falls_are_as_far_apart_as_their_times(still: Trace) -> None:
    left, right = (moved(still, 2, -0.8, rows=slice(row, None)) for row in (4, 9))
    found = outcome_of(left, right, "fell")
    assert (found.left, found.right) == pytest.approx((0.04, 0.09))
    assert found.difference == pytest.approx(0.05)
    assert found.first == pytest.approx(0.04)
    of_sides = named(compare(left, right))["fell"]
    assert of_sides.at == pytest.approx(0.04)


def test_the_distance_travelled_is_level_and_from_start_to_end(still: Trace) -> None:
    walked = moved(moved(moved(still, 0, 3.0, 20), 1, -4.0, 20), 2, 9.0, 20)
    found = outcome_of(moved(walked, 0, 50.0, 10), still, "distance travelled")
    assert (found.left, found.right, found.difference) == (5.0, 0.0, 5.0)


def test_the_tracking_error_is_of_each_command_and_the_row_after_it(still: Trace) -> None:
    ctrl = np.array(still.ctrl)
    ctrl[3], ctrl[20] = (2.0, 0.5), (100.0, 100.0)  # the last is never carried out
    trace = moved(changed(still, ctrl=ctrl), TURN, 0.4, rows=4)
    found = outcome_of(still, trace, "tracking error")
    # The command is 2 on a gear of 2: the target is 1, and the joint is at 0.4 a step later.
    assert (found.left, found.right) == pytest.approx((0.0, 0.6 / math.sqrt(20)))
    slides = outcome_of(still, trace, "tracking error of slides")
    assert slides.right == pytest.approx(0.5 / math.sqrt(20))


# How far the runs move


def test_a_motion_is_the_largest_way_from_the_start_on_either_side(still: Trace) -> None:
    swings = moved(still, TURN, [-0.2, 0.7], rows=[4, 9])
    slides = moved(moved(still, RAIL, -0.3, rows=6), 0, 0.25, rows=8)
    sides = [(swings, ["turn", "rail"]), (slides, ["turn", "rail"])]
    least = {"joint": 0.69, "slide": 0.31}
    found = motion_of(sides, least, 0.2)
    assert (found.angle, found.length) == pytest.approx((0.7, 0.3))
    assert found.moved
    assert not motion_of(sides, {"joint": 0.71, "slide": 0.31}, 0.2).moved
    # What comes later does not count, nor what is not named.
    assert motion_of(sides, least, 0.05).angle == pytest.approx(0.2)
    assert motion_of([(swings, ["turn"])], least, 0.2).length is None
    base = base_label(still.header)
    assert motion_of([(slides, [base])], dict.fromkeys(QUANTITIES, 1.0), 0.2).length == 0.25


def test_what_is_no_motion_is_a_tolerance_and_a_wider_one_moves_nothing_less() -> None:
    usual = least_motions(None)
    assert usual["joint"] == QUANTITIES["joint"].tolerance
    assert least_motions({"joint": usual["joint"] / 2})["joint"] == usual["joint"] / 2
    assert least_motions({"joint": usual["joint"] * 2})["joint"] == usual["joint"]
    assert set(usual) == {
        kind for kind, of in QUANTITIES.items() if of.is_coordinate and of.tolerance is not None
    }


def test_the_outcome_of_a_comparison_is_the_gravest(still: Trace) -> None:
    swings = moved(still, TURN, 0.5, rows=slice(9, None))
    ended = changed(still, {"ended": "it left every bound"})
    for left, right, outcome in (
        (still, still, "nothing moved"),
        (swings, swings, "agrees"),
        (still, swings, "differs"),
        (swings, still, "differs"),
        (still, ended, "ended"),
        (ended, swings, "ended"),
    ):
        found = compare(left, right)
        assert found.outcome == outcome
        assert found.agrees is (outcome == "agrees")


def test_runs_without_a_coordinate_in_common_are_refused(still: Trace) -> None:
    header = still.header
    joints = tuple(f"{name} 2" for name in header.joints)
    bodies = tuple(f"{name} 2" for name in header.bodies)
    with pytest.raises(TraceError):
        compare(still, changed(still, {"joints": joints, "bodies": bodies, "sites": ("end",)}))


# The chaos floor


@pytest.mark.parametrize(
    ("gap", "chance"),
    [
        (0.99, "inside"),
        (1.0, "cannot be told"),
        (3.0, "cannot be told"),
        (3.01, "beyond"),
        (math.nan, "beyond"),
    ],
)
def test_a_gap_is_chance_below_the_floor_and_none_above_three_times(
    gap: float, chance: str
) -> None:
    assert against_floor(gap, 1.0) == chance


LONG = 201  # moments of 0.01 s: the window is 5 to either side, "later" is 10


def long(trace: Trace) -> Trace:
    """Return a run of 2 s in which nothing moves."""
    columns = {
        name: array if name.startswith("contact_") else np.repeat(array[:1], LONG, axis=0)
        for name, array in trace.columns.items()
    }
    return Trace(trace.header, {**columns, "time": STEP * np.arange(LONG)})


def floor_of(
    patch: pytest.MonkeyPatch,
    model: Model,
    sides: tuple[Trace, Trace],
    perturbed: Callable[[int, int], Trace],
    both: bool = False,
    **how: Any,
) -> tuple[ChaosFloor, Comparison]:
    """Return the floor of two runs; `perturbed` gives a run by its number and its side."""
    reruns = [Rerun(model, lambda _: None, 2.0) for _ in range(1 + both)]

    def run(rerun: Rerun, k: int, **_: Any) -> Trace:
        return perturbed(k, 0 if rerun is reruns[0] else 1)

    patch.setattr(chaos, "perturbed_run", run)
    comparison = compare(*sides)
    asked = [*reruns, None][:2]
    return chaos_floor(comparison, asked, jobs=1, **how), comparison


def band(floor: ChaosFloor, name: str = "turn") -> Band:
    (found,) = [each for each in floor.bands if each.name == name]
    return found


def test_the_width_of_a_band_is_the_largest_departure_nearby(
    still: Trace, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = long(still)
    departures = (moved(run, TURN, 0.2, rows=100), moved(run, TURN, -0.3, rows=104))
    floor, _ = floor_of(monkeypatch, model, (run, run), lambda k, _: departures[k], runs=2)
    width = band(floor).width
    expected = np.zeros(LONG)
    expected[95:106] = 0.2
    expected[99:110] = 0.3
    assert width == pytest.approx(expected)
    assert (band(floor).most, band(floor).end) == pytest.approx((0.3, 0.0))
    assert (floor.runs, floor.sides, floor.ended) == (2, (0,), 0)
    assert band(floor).chance is None  # it agrees
    assert band(floor).inside_from == 0.0


def test_a_gap_lies_inside_from_the_moment_after_the_last_that_does_not(
    still: Trace, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = long(still)
    for rows, since in ((slice(20, 51), 0.51), (slice(20, None), None)):
        other = moved(run, TURN, 0.5, rows=rows)
        floor, _ = floor_of(monkeypatch, model, (run, other), lambda *_: run, runs=1)
        assert band(floor).inside_from == (None if since is None else pytest.approx(since))


@pytest.mark.parametrize(
    ("gap", "width", "chance"),
    [
        ((0.5, 0.0), (0.6, 0.0), "inside"),
        ((0.5, 0.0), (0.4, 0.0), "cannot be told"),
        ((0.5, 0.0), (0.1, 0.0), "beyond"),
        # Of the last tenth its mean counts too.
        ((0.5, 0.1), (0.6, 0.2), "inside"),
        ((0.5, 0.1), (0.6, 0.05), "cannot be told"),
        ((0.5, 0.1), (0.6, 0.02), "beyond"),
    ],
)
def test_a_gap_is_held_against_the_floor_before_and_at_the_end(
    still: Trace,
    model: Model,
    monkeypatch: pytest.MonkeyPatch,
    gap: tuple[float, float],
    width: tuple[float, float],
    chance: str,
) -> None:
    run = long(still)

    def off(by: tuple[float, float]) -> Trace:
        first = moved(run, TURN, by[0], rows=slice(60, 160))
        return moved(first, TURN, by[1], rows=slice(170, None))

    floor, _ = floor_of(monkeypatch, model, (run, off(gap)), lambda *_: off(width), runs=1)
    assert band(floor).chance == chance
    assert floor.chance("turn") == chance


@pytest.mark.parametrize(("row", "chance"), [(75, "inside"), (77, "beyond")])
def test_an_event_may_come_a_twentieth_of_the_time_later_in_another_run(
    still: Trace, model: Model, monkeypatch: pytest.MonkeyPatch, row: int, chance: str
) -> None:
    """The gap begins in row 60; the band, which is five rows wider, where that of a run does."""
    run = long(still)
    other = moved(run, TURN, 0.5, rows=slice(60, 160))
    departed = moved(run, TURN, 0.6, rows=slice(row, 165))
    floor, _ = floor_of(monkeypatch, model, (run, other), lambda *_: departed, runs=1)
    assert band(floor).chance == chance


def test_a_perturbed_run_that_ends_early_has_no_bound_from_then_on(
    still: Trace, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = long(still)
    columns = {
        name: array if name.startswith("contact_") else array[:100]
        for name, array in run.columns.items()
    }
    short = changed(Trace(run.header, columns), {"ended": "it left every bound"})
    floor, _ = floor_of(monkeypatch, model, (run, run), lambda *_: short, runs=3)
    assert floor.ended == 3
    assert np.isinf(band(floor).width).sum() == LONG - 95
    assert band(floor, "distance travelled").width.tolist() == [math.inf]


def test_the_floor_is_the_larger_of_both_sides_each_against_itself(
    still: Trace, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = long(still)
    right = moved(left, TURN, 1.0)
    seen: list[tuple[int, int]] = []

    def perturbed(k: int, side: int) -> Trace:
        seen.append((k, side))
        return moved((left, right)[side], TURN, (0.1, 0.3)[side])

    fractions: list[float] = []
    floor, _ = floor_of(
        monkeypatch, model, (left, right), perturbed, both=True, runs=2, progress=fractions.append
    )
    assert seen == [(0, 0), (0, 1), (1, 0), (1, 1)]
    assert fractions == [0.25, 0.5, 0.75, 1.0]
    assert floor.sides == (0, 1)
    assert band(floor).most == pytest.approx(0.3)


def test_a_first_touch_has_a_floor_of_one_number(
    still: Trace, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    def at(row: int) -> Trace:
        return touching(long(still), (row, (FLOOR, BALL), (1.0, 0.0, 0.0), 0.0))

    for gap, width, chance in ((5, 6, "inside"), (5, 2, "cannot be told"), (5, 1, "beyond")):
        floor, comparison = floor_of(
            monkeypatch,
            model,
            (at(50), at(50 + gap)),
            lambda *_, width=width: at(50 + width),
            runs=1,
        )
        (name,) = [each.name for each in comparison.agreements if each.kind == "contact"]
        found = band(floor, name)
        assert found.width == pytest.approx([0.01 * width])
        assert found.inside_from == (0.0 if chance == "inside" else None)
        assert found.chance == chance


@pytest.mark.parametrize(("runs", "reruns"), [(0, 1), (1, 0)])
def test_a_floor_wants_a_run_and_a_side_that_can_be_run(
    still: Trace, model: Model, runs: int, reruns: int
) -> None:
    rerun = Rerun(model, lambda _: None, 2.0) if reruns else None
    with pytest.raises(BadInputError):
        chaos_floor(compare(still, still), [rerun, None], runs=runs)
