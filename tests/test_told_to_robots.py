"""What a robot of any kind is told, how long it runs, and which of its parts are whose."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, EngineWarning, TraceError
from statemachine.interface import Model
from statemachine.lab.recordings import Trace, record
from statemachine.lab.recordings.repetition import is_stale, put_row
from statemachine.lab.runs.call_period import CallPeriods, call_periods, steps_of
from statemachine.lab.runs.drive import check_length, drive, number_of_steps, progress_of_stage
from statemachine.lab.runs.floor import has_floor
from statemachine.lab.runs.interleaved_timing import Ratio, time_interleaved
from statemachine.lab.runs.robot import (
    actuated_bodies,
    actuated_trees,
    carried_by,
    holding_force_size,
    target_towards_farther_end,
    warn_of_start,
)
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.lab.runs.usual_commands import draw_waves, hold_ctrl, start_ctrl

from .support.small_models import loaded
from .support.still_runs import BALL, FLOOR, moved, robot, still_run, touching
from .support.traces import changed

RADIAN = '<compiler angle="radian" autolimits="true"/><option timestep="0.002"/>'


def driven(folder: Path, joint: str, actuator: str, rest: str = "", option: str = RADIAN) -> Model:
    """Return a body of 2 kg, 0.5 m from its joint, that an actuator drives."""
    body = f'<body><joint name="j" {joint}/><geom size="0.1" pos="0.5 0 0" mass="2"/></body>'
    drive_it = f"<actuator>{actuator}</actuator>{rest}"
    return loaded(folder, body, drive_it, option=option)


WIDE = '<position joint="j" kp="5" ctrlrange="-8 9"'
HINGE, SLIDE = 'axis="0 1 0"', 'type="slide" axis="0 0 1"'


# A pose to hold


@pytest.mark.parametrize(
    ("begin", "ends", "most", "target"),
    [
        (0.0, (-1.0, 3.0), math.inf, 1.0),
        (2.0, (-1.0, 3.0), math.inf, 1.0),
        (1.0, (-1.0, 3.0), math.inf, 2.0),  # as far to either side
        (0.0, (-1.0, 3.0), 0.5, 0.5),
        (-9.0, (-1.0, 3.0), math.inf, 0.0),
        (9.0, (-1.0, 3.0), math.inf, 2.0),
    ],
)
def test_a_target_is_a_quarter_of_the_range_towards_the_farther_end(
    begin: float, ends: tuple[float, float], most: float, target: float
) -> None:
    assert target_towards_farther_end(begin, ends, most) == target


@pytest.mark.parametrize(
    ("joint", "actuator", "expected"),
    [
        (HINGE, '<position joint="j" kp="5" ctrlrange="-1 0.6"/>', -0.4),
        (HINGE, '<position joint="j" kp="5" ctrlrange="-8 9"/>', 0.5),
        (SLIDE, '<position joint="j" kp="5" ctrlrange="-8 9"/>', 0.1),
        (HINGE, '<position joint="j" kp="5" ctrlrange="-8 9" gear="-2"/>', 1.0),
        # The joint's own range is narrower: from -0.2 to 0.4.
        (f'{HINGE} range="-0.2 0.4"', '<position joint="j" kp="5" ctrlrange="-8 9"/>', 0.15),
        (
            f'{HINGE} range="-0.2 0.4"',
            '<position joint="j" kp="5" ctrlrange="-8 9" gear="-2"/>',
            -0.3,
        ),
        # No target is in both.
        (f'{HINGE} range="-0.2 0.4"', '<position joint="j" kp="5" ctrlrange="1 3"/>', 1.5),
        # The force that holds 2 kg at 0.5 m, and as much of it as the range lets.
        (HINGE, '<motor joint="j"/>', -9.81),
        (HINGE, '<motor joint="j" gear="-2"/>', 4.905),
        (HINGE, '<motor joint="j" ctrlrange="-3 3"/>', -3.0),
        (SLIDE, '<motor joint="j"/>', 19.62),
        (f'{HINGE} springref="0.5" stiffness="2"', '<motor joint="j"/>', -10.81),
        (HINGE, '<motor joint="j" gear="0"/>', 0.0),
        (HINGE, '<velocity joint="j" kv="1"/>', 0.0),
    ],
)
def test_what_holds_a_joint(tmp_path: Path, joint: str, actuator: str, expected: float) -> None:
    (ctrl,) = hold_ctrl(driven(tmp_path, joint, actuator))
    assert ctrl == pytest.approx(expected, abs=1e-12)


def test_two_motors_share_what_holds_their_joint(tmp_path: Path) -> None:
    both = '<motor joint="j"/><motor joint="j" gear="0.5"/>'
    assert hold_ctrl(driven(tmp_path, HINGE, both)).tolist() == [-4.905, -9.81]


def test_a_motor_of_a_robot_that_floats_is_left_alone(tmp_path: Path) -> None:
    body = (
        '<body name="base"><freejoint/><geom size="0.1"/><body name="leg" pos="0.2 0 0">'
        '<joint name="j" axis="0 1 0"/><geom size="0.1" pos="0.5 0 0"/></body></body>'
    )
    model = loaded(tmp_path, body, '<actuator><motor joint="j"/></actuator>', option=RADIAN)
    assert hold_ctrl(model).tolist() == [0.0]


def test_a_servo_starts_from_the_command_of_its_keyframe(tmp_path: Path) -> None:
    key = '<keyframe><key name="home" qpos="0.3" ctrl="-0.7"/></keyframe>'
    servo = '<position joint="j" kp="5" ctrlrange="-1 1"/>'
    model = driven(tmp_path, HINGE, servo, key)
    assert start_ctrl(model).tolist() == [-0.7]
    assert hold_ctrl(model) == pytest.approx([-0.2])
    other = driven(tmp_path, HINGE, servo, key.replace("home", "up"))
    assert start_ctrl(other).tolist() == [0.0]
    assert hold_ctrl(other) == pytest.approx([0.5])


def test_the_force_that_holds_a_joint_has_a_size(tmp_path: Path) -> None:
    assert holding_force_size(driven(tmp_path, HINGE, '<motor joint="j"/>')) == pytest.approx(
        [9.81]
    )


# Waves


def test_waves_stay_within_the_middle_half_of_a_range(tmp_path: Path) -> None:
    servos = '<position joint="j" kp="5" ctrlrange="-1 3"/><position joint="j" kp="5"/>'
    middle, size, frequency, phase = draw_waves(driven(tmp_path, HINGE, servos), 3)
    assert middle.tolist() == [1.0, 0.0]
    assert size.sum(axis=0) == pytest.approx([1.0, 0.5])
    assert (size > 0).all()
    assert size.shape == frequency.shape == phase.shape == (3, 2)
    for drawn, low, high in ((frequency, 0.2, 1.5), (phase, 0.0, 2 * np.pi)):
        assert low <= drawn.min() < drawn.max() <= high
    again = draw_waves(driven(tmp_path, HINGE, servos), 3)
    assert again[1].tolist() == size.tolist()
    assert draw_waves(driven(tmp_path, HINGE, servos), 4)[1].tolist() != size.tolist()


def test_many_waves_fill_what_they_are_drawn_from(tmp_path: Path) -> None:
    servos = '<position joint="j" kp="5" ctrlrange="-1 1"/>' * 400
    _, size, frequency, phase = draw_waves(driven(tmp_path, HINGE, servos), 0)
    assert (frequency.min(), frequency.max()) == pytest.approx((0.2, 1.5), abs=0.01)
    assert (phase.min(), phase.max()) == pytest.approx((0.0, 2 * np.pi), abs=0.02)
    # The three sizes of a joint are drawn from 0.2 to 1 before they are scaled.
    assert 4.0 < (size.max(axis=0) / size.min(axis=0)).max() <= 5.0


@pytest.mark.parametrize(("ctrl", "middle"), [(0.9, 0.5), (0.3, 0.3), (-0.9, -0.5)])
def test_waves_are_about_the_command_of_home_as_far_as_the_range_lets(
    tmp_path: Path, ctrl: float, middle: float
) -> None:
    key = f'<keyframe><key name="home" qpos="0.3" ctrl="{ctrl}"/></keyframe>'
    model = driven(tmp_path, HINGE, '<position joint="j" kp="5" ctrlrange="-1 1"/>', key)
    assert draw_waves(model, 0)[0].tolist() == [middle]


def test_a_negative_seed_draws_nothing(tmp_path: Path) -> None:
    model = driven(tmp_path, HINGE, '<motor joint="j"/>')
    draw_waves(model, 0)
    with pytest.raises(BadInputError):
        draw_waves(model, -1)


def test_waves_grow_in_over_half_a_second(tmp_path: Path) -> None:
    model = driven(tmp_path, HINGE, '<position joint="j" kp="5" ctrlrange="-1 1"/>')
    controller = SCENARIOS["waves"].controller(model, 5)
    middle, size, frequency, phase = draw_waves(model, 5)
    with sm.make_data(model) as data:
        for time, grown in ((0.0, 0.0), (0.25, 0.5), (0.5, 1.0), (1.5, 1.0)):
            data.time = time
            sines = (size * np.sin(2 * np.pi * frequency * time + phase)).sum(axis=0)
            assert controller(model, data) == pytest.approx(middle + grown * sines)


# Parts of a robot


TWO_TREES = """<geom name="floor" type="plane" size="1 1 1" pos="0 0 -5"/>
<body name="cart"><joint name="rail" type="slide"/><geom size="0.1"/>
  <body name="arm" pos="0.5 0 0"><joint name="hip"/><geom size="0.1"/>
    <body name="hand" pos="0.5 0 0"><geom size="0.1"/></body></body></body>
<body name="box" pos="3 0 1"><freejoint/><geom size="0.1"/></body>"""


def test_what_an_actuator_carries_is_below_its_joint(tmp_path: Path) -> None:
    model = loaded(tmp_path, TWO_TREES, '<actuator><motor joint="hip"/></actuator>')
    cart, arm, hand, box = (model.body_id(name) for name in ("cart", "arm", "hand", "box"))
    assert actuated_bodies(model) == {arm, hand}
    assert actuated_trees(model) == {cart, arm, hand}
    assert carried_by(model, [cart]) == {cart, arm, hand}
    assert carried_by(model, [box]) == {box}
    unactuated = loaded(tmp_path, TWO_TREES)
    assert actuated_bodies(unactuated) == frozenset()
    assert actuated_trees(unactuated) == {cart, arm, hand, box}


@pytest.mark.parametrize(
    ("geom", "is_floor"),
    [
        ('type="plane" size="1 1 1"', True),
        ('type="plane" size="1 1 1" contype="0"', True),
        ('type="plane" size="1 1 1" conaffinity="0"', True),
        ('type="plane" size="1 1 1" contype="0" conaffinity="0"', False),
        ('type="box" size="1 1 1"', True),
    ],
)
def test_a_floor_is_what_stands_still_and_can_be_touched(
    tmp_path: Path, geom: str, is_floor: bool
) -> None:
    body = '<body pos="0 0 3"><freejoint/><geom size="0.1"/></body>'
    assert has_floor(loaded(tmp_path, f"<geom {geom}/>{body}")) is is_floor


@pytest.mark.parametrize(
    ("geom", "is_floor"), [('type="plane" size="1 1 1"', True), ('type="box" size="1 1 1"', False)]
)
def test_a_box_beside_a_fixed_robot_may_be_its_base(
    tmp_path: Path, geom: str, is_floor: bool
) -> None:
    body = '<body pos="0 0 3"><joint/><geom size="0.1"/></body>'
    assert has_floor(loaded(tmp_path, f"<geom {geom}/>{body}")) is is_floor


@pytest.mark.parametrize(
    ("qpos", "is_outside"), [(1.0009, False), (1.0011, True), (-1.0011, True), (-1.0009, False)]
)
def test_a_start_may_be_beyond_a_limit_by_a_thousandth(
    tmp_path: Path, qpos: float, is_outside: bool
) -> None:
    model = driven(tmp_path, f'{HINGE} range="-1 1"', '<motor joint="j"/>')
    with sm.make_data(model) as data:
        data.qpos[0] = qpos
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            warn_of_start(model, data)
    assert bool([each for each in caught if each.category is EngineWarning]) is is_outside


def test_the_keyframes_that_start_inside_are_named(tmp_path: Path) -> None:
    keys = '<keyframe><key name="in" qpos="0.5"/><key name="out" qpos="1.5"/></keyframe>'
    model = driven(tmp_path, f'{HINGE} range="-1 1"', '<motor joint="j"/>', keys)
    with sm.make_data(model) as data:
        data.qpos[0] = 1.25
        with pytest.warns(EngineWarning, match=r"j by 0\.25; inside with --keyframe in$"):
            warn_of_start(model, data)


# How long, and how often


@pytest.mark.parametrize(
    ("seconds", "steps"), [(0.1, 50), (0.0001, 1), (0.0029, 1), (0.0031, 2), (1.0, 500)]
)
def test_a_run_has_whole_steps_and_at_least_one(tmp_path: Path, seconds: float, steps: int) -> None:
    assert number_of_steps(driven(tmp_path, HINGE, '<motor joint="j"/>'), seconds) == steps


@pytest.mark.parametrize("seconds", [0.0, -1.0, math.nan, math.inf, 20_001.0])
def test_a_run_of_no_time_or_of_too_much_is_refused(tmp_path: Path, seconds: float) -> None:
    """Ten million steps of 2 ms are 20 000 s."""
    model = driven(tmp_path, HINGE, '<motor joint="j"/>')
    assert number_of_steps(model, 20_000.0) == 10_000_000
    with pytest.raises(BadInputError):
        number_of_steps(model, seconds)
    with pytest.raises(BadInputError):
        number_of_steps(model.replace(substeps=2), 10_001.0)


def test_a_run_is_at_least_as_long_as_a_step(tmp_path: Path) -> None:
    model = driven(tmp_path, HINGE, '<motor joint="j"/>')
    check_length(model, 0.002)
    with pytest.raises(BadInputError):
        check_length(model, 0.0019)


@pytest.mark.parametrize(("once_more", "asked"), [(False, 3), (True, 4)])
def test_a_controller_is_asked_before_each_step(
    tmp_path: Path, once_more: bool, asked: int
) -> None:
    model = driven(tmp_path, HINGE, '<motor joint="j"/>')
    seen: list[float] = []

    def controller(_model: Model, data: sm.Data) -> Any:
        seen.append(data.time)
        return [float(len(seen))] if len(seen) != 2 else None

    with sm.make_data(model) as data:
        times: list[float] = []
        ctrl: list[float] = []
        for time in drive(model, data, controller, 3, once_more=once_more):
            times.append(time)
            ctrl.append(float(data.ctrl[0]))
    assert times == pytest.approx([0.0, 0.002, 0.004, 0.006])
    assert seen == pytest.approx(times[:asked])
    assert ctrl == ([1.0, 1.0, 3.0, 4.0] if once_more else [1.0, 1.0, 3.0, 3.0])


def test_a_stage_is_a_share_of_the_whole() -> None:
    told: list[float] = []
    progress = progress_of_stage(told.append, 0.25, 0.5)
    for fraction in (0.0, 0.5, 1.0):
        progress(fraction)
    assert told == [0.25, 0.5, 0.75]


@pytest.mark.parametrize(
    ("every", "timestep", "steps"),
    [(3, 0.002, 3), ("6ms", 0.002, 3), ("2ms", 0.002, 1), ("0.1s", 0.002, 50)],
)
def test_a_time_is_so_many_steps(every: int | str, timestep: float, steps: int) -> None:
    assert steps_of(every, timestep) == steps


@pytest.mark.parametrize("every", ["1ms", "3ms", "2.00001ms"])
def test_a_time_that_is_no_whole_number_of_steps_is_refused(every: str) -> None:
    assert steps_of("2.000000001ms", 0.002) == 1
    with pytest.raises(BadInputError):
        steps_of(every, 0.002)


@pytest.mark.parametrize(
    ("every", "timesteps", "periods"),
    [
        (1, (0.002, 0.004), (0.002, 0.004, 0.004)),
        (1, (0.004, 0.002), (0.004, 0.002, 0.004)),
        (2, (0.002, 0.004), (0.004, 0.008, 0.004)),
        (1, (0.004, 0.006), (0.004, 0.006, 0.012)),
        ("12ms", (0.004, 0.006), (0.012, 0.012, 0.012)),
    ],
)
def test_the_periods_of_two_sides(
    every: int | str, timesteps: tuple[float, float], periods: tuple[float, float, float]
) -> None:
    found = call_periods(every, timesteps)
    assert (found.left, found.right, found.common) == pytest.approx(periods)
    assert found.differ is (periods[0] != periods[1])
    assert found.common_word == f"{1000 * periods[2]:g}ms"


def test_periods_that_rounding_tells_apart_are_one() -> None:
    assert not CallPeriods(0.002, 0.002 * (1 + 1e-9), 0.002).differ
    assert CallPeriods(0.002, 0.002 * (1 + 1e-5), 0.002).differ


# Times


def test_a_ratio_is_the_median_of_its_rounds_with_their_middle_half() -> None:
    ratio = Ratio.of("ours", [2.0, 4.0, 6.0, 8.0, 10.0], [2.0, 2.0, 2.0, 2.0, 2.0])
    assert (ratio.low, ratio.median, ratio.high, ratio.rounds) == (1.5, 3.0, 4.5, 5)
    once = Ratio.of("ours", [3.0], [2.0])
    assert (once.median, once.low, once.high, once.rounds) == (1.5, 1.5, 1.5, 1)
    assert ratio.spread("x", 1) == "3.0x  (1.5 to 4.5)"


@pytest.mark.parametrize(
    ("low", "high", "rounds", "differs"),
    [
        (1.06, 1.2, 5, True),
        (1.05, 1.2, 5, False),
        (0.8, 0.94, 5, True),
        (0.8, 0.95, 5, False),
        (1.06, 1.2, 4, False),
    ],
)
def test_two_ratios_differ_whose_middle_halves_lie_apart(
    low: float, high: float, rounds: int, differs: bool
) -> None:
    null = Ratio("null", 1.0, 0.95, 1.05, 9)
    assert Ratio("ours", (low + high) / 2, low, high, rounds).differs_from(null) is differs
    few = Ratio("null", 1.0, 0.95, 1.05, 4)
    assert not Ratio("ours", 2.0, 2.0, 2.0, 9).differs_from(few)


def test_each_way_is_called_once_a_round_in_an_order_of_the_seed() -> None:
    def calls(seed: int) -> tuple[list[str], list[float]]:
        order: list[str] = []
        told: list[float] = []
        ways = {name: (lambda name=name: order.append(name)) for name in "abc"}
        times = time_interleaved(ways, 4, told.append, seed)
        assert {name: len(of_way) for name, of_way in times.items()} == dict.fromkeys("abc", 4)
        assert min(min(of_way) for of_way in times.values()) >= 0.0
        return order, told

    order, told = calls(1)
    assert [sorted(order[k : k + 3]) for k in range(0, 12, 3)] == [["a", "b", "c"]] * 4
    assert told == pytest.approx([(k + 1) / 12 for k in range(12)])
    assert calls(1)[0] == order
    assert any(calls(seed)[0] != order for seed in (2, 3, 4))


# Rows of a trace


@pytest.fixture(scope="module")
def still(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    return still_run(robot(tmp_path_factory.mktemp("told")))


@pytest.mark.parametrize("row", [0, 7, 19])
def test_the_row_after_which_time_does_not_go_on_is_named(still: Trace, row: int) -> None:
    time = np.array(still.time)
    time[row + 1] = time[row]
    with pytest.raises(TraceError, match=rf"after row {row}, at {time[row]:g} s"):
        changed(still, time=time)


@pytest.mark.parametrize(
    ("rows", "geoms", "is_right"),
    [
        ((0, 20), (0, 1), True),
        ((0, 21), (0, 1), False),
        ((-1, 0), (0, 1), False),
        ((5, 4), (0, 1), False),
        ((4, 4), (0, 1), True),
        ((0, 1), (0, -1), False),
        ((0, 1), (0, 4), False),
        ((0, 1), (0, 3), True),
    ],
)
def test_contacts_are_of_rows_and_geoms_that_are_there(
    still: Trace, rows: tuple[int, int], geoms: tuple[int, int], is_right: bool
) -> None:
    assert len(still.header.geoms) == 4
    contacts = [(row, geoms, (1.0, 0.0, 0.0), 0.0) for row in rows]
    if is_right:
        assert len(touching(still, *contacts)["contact_row"]) == 2
        return
    with pytest.raises(TraceError):
        touching(still, *contacts)


def test_only_what_overlaps_in_the_first_row_is_told(still: Trace) -> None:
    for row, depth, count in ((0, -0.05, 1), (1, -0.05, 0), (0, 0.01, 0)):
        trace = touching(still, (row, (FLOOR, BALL), (1.0, 0.0, 0.0), depth))
        assert len(trace.overlaps) == count
    bare = {n: a for n, a in still.columns.items() if not n.startswith("contact_")}
    assert Trace(still.header, bare).overlaps == []


@pytest.mark.parametrize(("size", "is_right"), [(1e100, True), (1.1e100, False), (-1.1e100, False)])
def test_a_number_of_a_column_has_a_largest_size(still: Trace, size: float, is_right: bool) -> None:
    energy = np.array(still["energy"])
    energy[3, 0], energy[4, 0] = size, np.nan
    if is_right:
        assert changed(still, energy=energy)["energy"][3, 0] == size
        return
    with pytest.raises(TraceError):
        changed(still, energy=energy)


def test_an_input_is_finite(still: Trace) -> None:
    for value in (np.nan, np.inf):
        with pytest.raises(TraceError):
            moved(still, 8, value, rows=3)


def test_an_engine_is_read_after_a_step_where_that_is_of_the_state_before(tmp_path: Path) -> None:
    model = driven(tmp_path, HINGE, '<motor joint="j"/>')
    assert is_stale(model)
    assert not is_stale(model.replace(substeps=2))
    rk4 = RADIAN.replace("<option", '<option integrator="RK4"')
    assert not is_stale(driven(tmp_path, HINGE, '<motor joint="j"/>', option=rk4))


def test_a_row_that_began_in_another_state_is_told(tmp_path: Path) -> None:
    model = driven(tmp_path, HINGE, '<motor joint="j"/>')
    trace = record(model, seconds=0.01)
    with sm.make_data(model) as data:
        assert not put_row(data, trace.columns, 0)
        assert put_row(data, trace.columns, 3)
        assert data.qpos.tolist() == trace.qpos[3].tolist()
        assert data.qvel.tolist() == trace.qvel[3].tolist()
        assert not put_row(data, trace.columns, 3)
        data.qvel[0] += 1e-15
        assert put_row(data, trace.columns, 3)
