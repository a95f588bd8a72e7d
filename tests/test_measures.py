"""Figures of the measures: floors, tolerances, gaps, moments, and numbers as text."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from statemachine.errors import BadInputError, TraceError, UnknownNameError
from statemachine.interface import Array
from statemachine.measures import (
    ContactNames,
    Deviation,
    Gap,
    JointAddresses,
    RobotScale,
    Tolerance,
    at_moments,
    common_moments,
    contacts_in_words,
    joint_gap,
    nearest,
    overlaps,
    parse_amount,
    parse_tolerances,
    robot_points,
    rotation_angles,
    tolerance_of,
    with_left_pair_names,
)
from statemachine.measures import text as words
from statemachine.measures.floors import energy_floor, force_floor, moving_bodies

from .support.small_models import loaded

SINGLE = 2.0**-23  # what a number in single precision keeps


# Numbers as text.


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (1.0, "1.00"),
        (9.994, "9.99"),
        (10.0, "10.0"),
        (123.4, "123"),
        (99999.0, "99999"),
        (100000.0, "1e5"),
        (-100000.0, "-1e5"),
        (0.001, "0.0010"),
        (0.00099, "1e-3"),
        (0.0123, "0.0123"),
        (math.inf, "inf"),
        (math.nan, "no number"),
    ],
)
def test_a_figure_has_three_digits(value: float, text: str) -> None:
    assert words.figure(value) == text


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (None, "m", "–"),
        (math.nan, "m", "none"),
        (0.0025, "m", "2.50 mm"),
        (0.0025, "s", "2.50 ms"),
        (math.pi, "rad", "180°"),
        (2.5, "N", "2.50 N"),
        (2.5, "", "2.50"),
    ],
)
def test_a_quantity_is_read_in_its_unit(value: float | None, unit: str, text: str) -> None:
    assert words.quantity(value, unit) == text


@pytest.mark.parametrize(
    ("size", "unit", "text"),
    [
        (1e-9, "m", "1e-06 mm"),
        (0.99e-9, "m", "below 1e-06 mm"),
        (1.01e-6, "N", "1.01e-06 N"),
        (0.99e-6, "N", "below 1e-06 N"),
        (0.25, "m", "250 mm"),
    ],
)
def test_a_distance_below_a_millionth_is_only_called_so(size: float, unit: str, text: str) -> None:
    assert words.distance(size, unit) == text


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0, "N", "0 N"),
        (0.001, "N", "0.001 N"),
        (0.00099, "N", "1e-03 N"),
        (99.4, "N", "99 N"),
        (100.0, "N", "100 N"),
        (123.4, "N", "123 N"),
        (0.1234, "m", "123 mm"),
        (math.inf, "m", "beyond all mm"),
    ],
)
def test_a_rough_size_has_two_digits(value: float, unit: str, text: str) -> None:
    assert words.rough(value, unit) == text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (12345.0, 4, "12340"),
        (999999.0, 4, "1000000"),
        (1e6, 4, "1e+06"),
        (1.23456, 4, "1.235"),
        (1.23456, 3, "1.23"),
    ],
)
def test_significant_digits_have_no_power_of_ten_below_a_million(
    value: float, digits: int, text: str
) -> None:
    assert words.significant(value, digits) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0.00004, "0.0000"), (-0.00004, "0.0000"), (0.5, "+0.5000"), (-0.5, "-0.5000")],
)
def test_a_signed_number_has_no_sign_at_zero(value: float | None, text: str) -> None:
    assert words.signed(value) == text


@pytest.mark.parametrize(
    ("part", "text"),
    [
        (None, "–"),
        (0.0, "0 %"),
        (0.000499, "< 0.1 %"),
        (-0.000499, "< 0.1 %"),
        (0.0005, "0.1 %"),
        (0.123, "12.3 %"),
        (0.9994, "99.9 %"),
        (0.9995, "> 99.9 %"),
        (1.0, "100.0 %"),
        (9.99, "999.0 %"),
        (10.0, "10 times"),
        (594.49, "594 times"),
        (-0.5, "-50.0 %"),
    ],
)
def test_a_share_is_a_percentage(part: float | None, text: str) -> None:
    assert words.percent(part) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(5e-7, "0.5 µs"), (0.000999, "999 µs"), (0.001, "1 ms"), (0.5, "500 ms"), (1.0, "1 s")],
)
def test_a_wall_time_is_in_the_unit_that_reads_best(seconds: float, text: str) -> None:
    assert words.duration(seconds) == text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (words.degrees(math.pi / 8), "22.50°"),
        (words.degrees(math.pi / 8, 1), "22.5°"),
        (words.millimetres(0.0125), "12.50 mm"),
        (words.position(0.0125, slide=True, decimals=1), "12.5 mm"),
        (words.position(math.pi / 8, slide=False, decimals=1), "22.5°"),
        (words.joint_difference(0.0123, slide=True), "12 mm"),
        (words.joint_difference(math.pi / 8, slide=False), "22°"),
        (words.milliseconds(1 / 240), "4.167 ms"),
        (words.milliseconds(1 / 240, 3), "4.17 ms"),
        (words.short_time(1.23456), "1.235 s"),
        (words.vector([0.12345, -0.00001]), "[0.1235 0.0000]"),
        (words.vector([0.12345], 2), "[0.12]"),
        (words.rounded(0.0123456, "m"), "12.3 mm"),
        (words.count(1, "step"), "1 step"),
        (words.count(2000, "step"), "2,000 steps"),
        (words.count(0, "step", "no"), "no steps"),
        (words.count(0, "step"), "0 steps"),
        (words.listed(["a"]), "a"),
        (words.listed(["a", "b"]), "a and b"),
        (words.listed(["a", "b", "c"]), "a, b and c"),
        (words.few(["a", "b", "c"]), "a, b, c"),
        (words.few(["a", "b", "c", "d", "e"]), "a, b, c and 2 more"),
        (words.few(["a", "b", "c"], 1, "; "), "a and 2 more"),
        (words.on_label("pybullet"), "on pybullet"),
        (words.on_label("kp=5"), "with kp=5"),
        (words.capital("some text"), "Some text"),
        (words.capital("mujoco does"), "mujoco does"),
        (words.capital("a.xml does"), "a.xml does"),
        (words.sentence("some text."), "Some text."),
        (words.sentence("some text"), "Some text."),
        (words.command(["a", "b c"], ("--x", 1, 1), ("--y", 2, 1)), "a 'b c' --y 2"),
        (words.command(["a"], ("--z", True, False)), "a --z"),
    ],
)
def test_values_and_words_as_text(text: str, expected: str) -> None:
    assert text == expected


# Floors.


def test_the_floors_of_a_run_are_a_ten_millionth_of_weight_and_size() -> None:
    robot = RobotScale(mass=2.0, size=0.5)
    assert robot.weight == pytest.approx(19.62)
    assert robot.force == pytest.approx(SINGLE * 19.62)
    assert robot.energy == pytest.approx(SINGLE * 19.62 * 0.5)


def test_the_floors_of_a_step_are_a_billionth() -> None:
    robot = RobotScale(mass=2.0, size=0.5)
    assert robot.acceleration == pytest.approx(9.81e-9)
    assert robot.angular_acceleration == pytest.approx(19.62e-9)
    assert robot.length == pytest.approx(0.5e-9)
    assert robot.angle == pytest.approx(1e-9)


def test_two_robots_have_the_floors_of_the_smaller_one() -> None:
    assert RobotScale(2.0, 0.5).smaller(RobotScale(1.0, 0.7)) == RobotScale(1.0, 0.5)


def test_a_step_in_single_precision_has_higher_floors() -> None:
    """A millionth of 0.5 m, of a radian and of g, where the other side has a billionth."""
    single = RobotScale(2.0, 0.5).smaller(RobotScale(2.0, 0.5, step_share=1e-6))
    assert (single.length, single.angle) == pytest.approx((5e-7, 1e-6))
    assert single.acceleration == pytest.approx(9.81e-6)
    assert single.force == RobotScale(2.0, 0.5).force


@pytest.mark.parametrize(
    ("floor", "unknown", "known"),
    [(force_floor, 1e-6, SINGLE * 19.62), (energy_floor, 1e-9, SINGLE * 19.62 * 0.5)],
)
def test_a_robot_of_unknown_weight_has_floors_too(
    floor: Callable[[RobotScale | None], float], unknown: float, known: float
) -> None:
    assert floor(None) == unknown
    assert floor(RobotScale(2.0, 0.5)) == pytest.approx(known)


# A foot that is fixed to the world, on which an arm stands; a post that carries nothing.
STANDING = (
    '<body name="post" pos="9 9 9"><geom size=".1" mass="7"/><site name="far"/></body>'
    '<body name="foot" pos="0 0 1"><geom size=".1" mass="5"/><site name="sole"/>'
    '<body name="arm" pos="0 0 .3"><joint axis="0 1 0"/><geom size=".2" mass="2"/>'
    '<body name="hand" pos="0 0 .4"><geom size=".1" mass="1"/><site name="tip" pos="0 0 .2"/>'
    "</body></body></body>"
)


def test_what_a_joint_carries_moves_and_what_carries_it_does_not(tmp_path: Path) -> None:
    model = loaded(tmp_path, STANDING)
    assert {model.body_names[body] for body in moving_bodies(model)} == {"arm", "hand"}


def test_the_foot_and_what_moves_are_points_of_the_robot(tmp_path: Path) -> None:
    model = loaded(tmp_path, STANDING)
    places = np.arange(3.0 * model.nbody).reshape(-1, 3)
    sites = 100 + np.arange(3.0 * model.nsite).reshape(-1, 3)
    points = robot_points(model, places, sites)
    ids = [model.body_id(name) for name in ("foot", "arm", "hand")]
    marks = [model.site_id(name) for name in ("sole", "tip")]
    assert points.tolist() == [*places[ids].tolist(), *sites[marks].tolist()]


def test_a_robot_weighs_what_moves_of_it(tmp_path: Path) -> None:
    scale = RobotScale.of(loaded(tmp_path, STANDING), np.array([[0, 0, 0], [0.3, 0, 0.4]]))
    assert (scale.mass, scale.size) == pytest.approx((3.0, 0.5))


def test_of_one_point_the_shape_that_moves_is_the_size(tmp_path: Path) -> None:
    scale = RobotScale.of(loaded(tmp_path, STANDING), np.zeros((1, 3)))
    assert scale.size == pytest.approx(2 * 0.2)


def test_a_robot_without_points_or_shapes_has_the_size_of_a_metre(tmp_path: Path) -> None:
    bare = '<body><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
    assert RobotScale.of(loaded(tmp_path, bare), np.empty((0, 3))).size == 1.0


# Tolerances.

COUNT = 2 * math.pi / 4096


def tolerance(kind: str, left: object = (), right: object = (), **options: object) -> float:
    """Return a tolerance, at a reach of 0.4 m and 2 ms a step where nothing else is given."""
    settings = {"reach": 0.4, "timestep": 0.002} | options
    sides = np.asarray(left, dtype=float), np.asarray(right, dtype=float)
    return tolerance_of(kind, *sides, **settings).value  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("joint", COUNT),
        ("slide", 1e-4),
        ("tip", COUNT * 0.4),
        ("tip rotation", COUNT),
        ("body", 1e-3),
        ("body rotation", math.radians(1)),
        ("base", 1e-3),
        ("base rotation", math.radians(0.1)),
        ("fall", 0.02),
        ("tracking", COUNT),
        ("slide tracking", 1e-4),
        ("contact", 0.002 * (1 + 1e-9)),
    ],
)
def test_each_kind_has_its_tolerance(kind: str, value: float) -> None:
    assert tolerance(kind) == pytest.approx(value, rel=1e-12)


def test_a_tip_without_a_lever_arm_has_the_tolerance_of_a_slide() -> None:
    assert tolerance("tip", reach=0.0649) == 1e-4
    assert tolerance("tip", reach=0.065) == pytest.approx(COUNT * 0.065)


def test_a_tolerance_that_is_given_wins() -> None:
    assert tolerance("tip", given={"tip": 0.5}) == 0.5
    assert tolerance("tip", given={"joint": 0.5}) == pytest.approx(COUNT * 0.4)


@pytest.mark.parametrize(
    ("left", "right", "value"),
    [(2.0, 3.0, 0.03), (3.0, 2.0, 0.03), (0.1, 0.0, 1e-3), (0.09, 0.01, 1e-3), (0.11, 0, 1.1e-3)],
)
def test_of_a_distance_a_hundredth_matters_or_a_millimetre(
    left: float, right: float, value: float
) -> None:
    assert tolerance("distance", [left], [right]) == pytest.approx(value)


@pytest.mark.parametrize(
    ("left", "right", "value"),
    [
        ([1.0, 3.0, 2.0], [1.0, 1.5, 1.0], 0.02),
        ([1.0, 1.5, 1.0], [1.0, 4.0, math.nan], 0.03),
        ([math.nan], [math.inf], 1e-9),
    ],
)
def test_of_an_energy_a_hundredth_of_its_change_matters(
    left: list[float], right: list[float], value: float
) -> None:
    assert tolerance("energy", left, right) == pytest.approx(value)


@pytest.mark.parametrize(
    ("left", "right", "value"),
    [
        ([0.0, 10.0, 30.0, 0.0], [0.0, 10.0, 0.0, 0.0], 1.0),
        ([0.0, 0.0], [0.0, 4.0], 0.2),
        ([0.0], [0.0], 1e-6),
    ],
)
def test_of_a_force_a_twentieth_of_its_mean_while_it_acts_matters(
    left: list[float], right: list[float], value: float
) -> None:
    assert tolerance("force", left, right) == pytest.approx(value)


@pytest.mark.parametrize(
    ("kind", "floor"), [("force", SINGLE * 9810.0), ("energy", SINGLE * 9810.0 * 2)]
)
def test_no_tolerance_is_below_the_floor_of_the_robot(kind: str, floor: float) -> None:
    heavy = RobotScale(mass=1000.0, size=2.0)
    assert tolerance(kind, [0, 1e-6], [0, 0], scale=heavy) == pytest.approx(floor)


def test_a_tolerance_says_why() -> None:
    nothing = np.zeros(1)
    assert tolerance_of("joint", nothing, nothing, 1.0, 0.1, {"joint": 2.0}) == Tolerance(
        2.0, "as given"
    )


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("180deg", math.pi, "rad"),
        ("2rad", 2.0, "rad"),
        ("2mm", 0.002, "m"),
        ("2cm", 0.02, "m"),
        ("2m", 2.0, "m"),
        ("2ms", 0.002, "s"),
        ("2s", 2.0, "s"),
        ("2mJ", 0.002, "J"),
        ("2J", 2.0, "J"),
        ("2N", 2.0, "N"),
    ],
)
def test_an_amount_is_parsed_into_its_si_unit(text: str, value: float, unit: str) -> None:
    amount, of = parse_amount(text)
    assert (amount, of) == (pytest.approx(value), unit)


@pytest.mark.parametrize("text", ["0mm", "-1mm", "infm", "nanm", "xmm", "5", ""])
def test_an_amount_that_is_no_size_is_no_number(text: str) -> None:
    assert math.isnan(parse_amount(text)[0])


def test_tolerances_are_parsed_by_kind() -> None:
    given = parse_tolerances(["tip-rotation=180deg", "slide=2mm"])
    assert given == pytest.approx({"tip rotation": math.pi, "slide": 0.002})


@pytest.mark.parametrize("word", ["joint=2mm", "tip=0mm", "tip=2", "tip"])
def test_a_tolerance_in_another_unit_is_refused(word: str) -> None:
    with pytest.raises(BadInputError):
        parse_tolerances([word])


def test_a_tolerance_of_an_unknown_kind_is_refused() -> None:
    with pytest.raises(UnknownNameError):
        parse_tolerances(["speed=2m"])


# Gaps.


def test_a_gap_is_the_largest_with_its_name() -> None:
    assert Gap.of(np.array([1.0, 3.0, 2.0]), "m", "abc") == Gap(3.0, "m", "b")


@pytest.mark.parametrize(
    ("gap", "shown", "text"),
    [
        (Gap(0.002, "m", "tip"), 2.0, "2 mm at tip"),
        (Gap(math.pi, "rad"), 180.0, "180°"),
        (Gap(1.0, "appears"), 1.0, "1 appears"),
        (Gap(2.0, "appears"), 2.0, "2 appear"),
        (Gap(3.0, "vanishes", "a on b"), 3.0, "3 vanish at a on b"),
    ],
)
def test_a_gap_as_it_is_read(gap: Gap, shown: float, text: str) -> None:
    assert (gap.shown, str(gap)) == (pytest.approx(shown), text)


def test_a_gap_without_a_size_is_infinite() -> None:
    assert Gap(None, "rad").shown == math.inf


def test_a_deviation_has_its_worst_moment_its_mean_square_and_its_end() -> None:
    sizes, time = np.array([0.0, 4.0, 3.0, 0.0]), np.array([0.0, 0.5, 1.0, 1.5])
    assert Deviation.of(sizes, time, "m") == Deviation("m", 4.0, 0.5, 2.5, 0.0)


def test_the_addresses_of_each_kind_of_joint() -> None:
    # A free body, a ball, a hinge, a slide, another free body.
    addresses = JointAddresses.of([0, 1, 3, 2, 0], [0, 7, 11, 12, 13])
    assert addresses.hinges.tolist() == [11]
    assert addresses.slides.tolist() == [12]
    assert addresses.quats.tolist() == [7, 3, 16]
    assert addresses.positions.tolist() == [0, 1, 2, 13, 14, 15]
    assert addresses.width == 20


def test_hinges_come_before_slides_in_the_gap_of_joints() -> None:
    left, right = np.array([0.0, 1.0, 2.0]), np.array([9.0, 0.5, 2.25])
    assert joint_gap("abc", [2, 3, 3], [0, 1, 2], left, right) == Gap(0.5, "rad", "b")
    assert joint_gap("ab", [2, 0], [0, 1], left, right) == Gap(9.0, "m", "a")
    assert joint_gap("a", [0], [0], left, right) is None


def test_the_angle_between_quaternions_is_that_of_the_rotation() -> None:
    half = 0.3
    turned = np.array([math.cos(half), 0, math.sin(half), 0])
    rest = np.array([1.0, 0, 0, 0])
    assert rotation_angles(rest, turned) == pytest.approx(2 * half)
    assert rotation_angles(rest, -turned) == pytest.approx(2 * half)
    assert rotation_angles(rest, np.array([0, 1.0, 0, 0])) == pytest.approx(math.pi)


# Moments.


def moments(count: int, step: float, start: float = 0.0) -> Array:
    """Return so many moments, a step apart [s]."""
    return np.array([start + k * step for k in range(count)])


def test_the_nearest_moment_is_before_or_after() -> None:
    time = np.array([0.0, 1.0, 2.0, 4.0])
    wanted = np.array([-1.0, 0.4, 0.6, 1.0, 2.9, 3.1, 9.0])
    assert nearest(time, wanted).tolist() == [0, 0, 1, 1, 2, 3, 3]


def test_two_runs_share_the_moments_since_their_starts() -> None:
    left, right = moments(13, 0.005, 5.0), moments(31, 0.002, 1.0)
    common = common_moments(left, right, (0.005, 0.002))
    assert common.time == pytest.approx(moments(7, 0.01))
    assert common.left.tolist() == [0, 2, 4, 6, 8, 10, 12]
    assert common.right.tolist() == [0, 5, 10, 15, 20, 25, 30]


@pytest.mark.parametrize(("off", "shared"), [(0.9e-6, 5), (1.1e-6, 0)])
def test_moments_are_the_same_within_a_millionth_of_the_shorter_step(
    off: float, shared: int
) -> None:
    left = moments(5, 0.5)
    right = left.copy()
    right[1:] += off * 0.5
    if shared:
        assert len(common_moments(left, right, (0.5, 2.0)).time) == shared
    else:
        with pytest.raises(TraceError):
            common_moments(left, right, (0.5, 2.0))


def test_five_moments_in_common_are_enough() -> None:
    left, right = moments(41, 1.0), moments(5, 10.0)
    assert len(common_moments(left, right, (1.0, 10.0)).time) == 5
    with pytest.raises(TraceError):
        common_moments(left, moments(5, 10.5), (1.0, 10.5))


def test_short_runs_share_as_many_moments_as_they_have() -> None:
    assert len(common_moments(moments(2, 1.0), moments(9, 1.0), (1.0, 1.0)).time) == 2


def test_values_at_other_moments_are_on_the_line_between() -> None:
    time, values = np.array([0.0, 1.0, 2.0]), np.array([[0.0, 5.0], [10.0, 6.0], [20.0, 0.0]])
    wanted = np.array([0.25, 1.0, 1.5])
    assert at_moments(time, values, wanted, 0.01).tolist() == [[2.5, 5.25], [10, 6], [15, 3]]


def test_a_moment_within_the_slack_has_the_value_of_its_row() -> None:
    time, values = np.array([0.0, 1.0]), np.array([[0.0], [10.0]])
    assert at_moments(time, values, np.array([0.1, 0.8]), 0.1).tolist() == [[0.0], [8.0]]


# Contacts.

# The world, a base on it, an arm on that, and a box.
NAMES = ContactNames(
    ["world", "base", "arm", "box"],
    ["floor", "base", "finger", "", ""],
    [0, 1, 2, 3, 0],
    [0, 0, 1, 0],
)


@pytest.mark.parametrize(
    ("left", "right", "pair", "geoms"),
    [
        (0, 2, "arm on floor", "arm on floor (finger)"),
        (2, 0, "arm on floor", "arm on floor (finger)"),
        (2, 1, "arm on base", "arm on base (finger)"),
        (1, 3, "box on base", "box on base"),
        (3, 4, "box on world", "box on world"),
    ],
)
def test_what_is_farther_from_the_world_is_on_the_other(
    left: int, right: int, pair: str, geoms: str
) -> None:
    assert (NAMES.pair(left, right), NAMES.geoms(left, right)) == (pair, geoms)


def test_a_body_that_hangs_on_itself_has_a_name_too() -> None:
    names = ContactNames(["world", ""], ["floor", ""], [0, 1], [0, 1])
    assert names.pair(0, 1) == "body 1 on floor"


def test_overlaps_are_those_of_more_than_a_millimetre_the_deepest_first() -> None:
    geoms = np.array([[0, 2], [1, 3], [2, 1], [-1, 2], [0, 2], [3, 0]])
    distances = np.array([-0.002, -0.151, -0.0009, -0.5, -0.004, 0.2])
    assert overlaps(NAMES, geoms, distances) == ["box on base by 151 mm", "arm on floor by 4 mm"]


def test_the_geoms_of_a_pair_are_listed_together() -> None:
    contacts = ["a on b (c)", "e on f", "a on b (d)"]
    assert contacts_in_words(contacts) == "a on b (c, d), e on f"


def test_eight_pairs_are_listed() -> None:
    pairs = [f"{k} on floor" for k in range(10)]
    assert contacts_in_words(pairs[:8]) == ", ".join(pairs[:8])
    assert contacts_in_words(pairs) == ", ".join(pairs[:8]) + " and 2 more"


def test_pairs_have_the_names_of_the_left() -> None:
    left = {"a on b": 1, "c on d": 2}
    assert with_left_pair_names(left, {"b on a": 3, "c on d": 4, "x on y": 5}) == {
        "a on b": 3,
        "c on d": 4,
        "x on y": 5,
    }


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.999, "m", "999 mm"),
        (1.0, "m", "1.00 m"),
        (-2.68, "m", "-2.68 m"),
        (2.0, "s", "2.00 s"),
        (0.005, "s", "5.00 ms"),
    ],
)
def test_a_long_way_and_a_long_time_are_in_metres_and_seconds(
    value: float, unit: str, text: str
) -> None:
    assert words.quantity(value, unit) == text
