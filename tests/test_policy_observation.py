"""Each term of an observation, by hand and by MuJoCo's own sensors; its history and its clock."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine import load
from statemachine.interface import Array
from statemachine.lab.policy.binding import bind
from statemachine.lab.policy.contract import Contract, History, Init, Layout, Order
from statemachine.lab.policy.observation import Mount, Observer, RobotState, Stack

from .support.policies import contract, robot, started, with_terms
from .support.requirements import need_engine

pytest.importorskip("yaml")
HALF = np.sqrt(0.5)
YAW_90 = np.array((HALF, 0.0, 0.0, HALF))  # x of the base points along y of the world
PITCH_90 = np.array((HALF, 0.0, HALF, 0.0))  # nose down
STATE = RobotState(
    quat=np.array((1.0, 0.0, 0.0, 0.0)),
    lin_vel=np.array((0.3, -0.2, 0.1)),
    ang_vel=np.array((1.0, 2.0, 3.0)),
    joint_pos=np.array((0.5, -0.5)),
    joint_vel=np.array((4.0, 5.0)),
    command=np.array((0.6, 0.1, -0.4)),
    last_action=np.array((7.0, 8.0)),
    calls=0,
)
AT = Mount(np.array((0.1, 0.0, 0.0)), np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]))  # turned 90°


def told(read: Contract, state: RobotState, mounts: dict[str, Mount] | None = None) -> Array:
    """Return what the only term of a contract tells."""
    (value,) = Observer.of(read, mounts or {}).values(state).values()
    return value


def one_term(
    folder: Path, term: str, changes: dict[str, Any] | None = None, **rest: Any
) -> Contract:
    """Return a contract with one term, whose further fields are `rest`."""
    return contract(folder, {**with_terms({"id": term, **rest}), **(changes or {})})


# -- by hand --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quat", "gravity"),
    [(STATE.quat, (0, 0, -1)), (YAW_90, (0, 0, -1)), (PITCH_90, (1, 0, 0))],
    ids=["upright", "yaw", "nose down"],
)
def test_gravity_is_told_in_the_axes_of_the_base(
    tmp_path: Path, quat: Array, gravity: tuple[float, ...]
) -> None:
    read = one_term(tmp_path, "projected_gravity")
    assert told(read, replace(STATE, quat=quat)) == pytest.approx(gravity, abs=1e-12)


@pytest.mark.parametrize(
    ("frame", "velocity"), [("body", (-0.2, -0.3, 0.1)), ("world", (0.3, -0.2, 0.1))]
)
def test_a_velocity_is_told_in_its_frame(
    tmp_path: Path, frame: str, velocity: tuple[float, ...]
) -> None:
    read = one_term(tmp_path, "base_lin_vel", params={"frame": frame})
    assert told(read, replace(STATE, quat=YAW_90)) == pytest.approx(velocity)


@pytest.mark.parametrize(("frame", "speed"), [("body", (1, 2, 3)), ("world", (-2, 1, 3))])
def test_the_gyroscope_is_told_in_its_frame(
    tmp_path: Path, frame: str, speed: tuple[float, ...]
) -> None:
    read = one_term(tmp_path, "base_ang_vel", {"policy_io.imu.frame": frame})
    assert told(read, replace(STATE, quat=YAW_90)) == pytest.approx(speed)


@pytest.mark.parametrize("frame", ["body", "world"])
def test_straight_on_no_frame_shows(tmp_path: Path, frame: str) -> None:
    read = one_term(tmp_path, "base_lin_vel", params={"frame": frame})
    assert told(read, STATE) == pytest.approx(STATE.lin_vel)


def test_a_velocity_off_the_origin_has_what_the_turning_adds(tmp_path: Path) -> None:
    """(1, 2, 3) × (0.1, 0, 0) = (0, 0.3, -0.2), on top of (0.3, -0.2, 0.1)."""
    read = one_term(tmp_path, "base_lin_vel", params={"site": "s"})
    straight = Mount(AT.pos, np.eye(3))
    assert told(read, STATE, {"s": straight}) == pytest.approx((0.3, 0.1, -0.1))


def test_a_velocity_at_a_turned_sensor_is_told_in_its_axes(tmp_path: Path) -> None:
    """The sensor's x is the base's y, and its y the base's -x."""
    read = one_term(tmp_path, "base_lin_vel", params={"site": "s"})
    assert told(read, STATE, {"s": AT}) == pytest.approx((0.1, -0.3, -0.1))


def test_a_turned_gyroscope_is_told_in_its_axes(tmp_path: Path) -> None:
    read = one_term(tmp_path, "base_ang_vel", {"policy_io.imu.site": "s"})
    assert told(read, STATE, {"s": AT}) == pytest.approx((2.0, -1.0, 3.0))


def test_in_world_axes_the_turn_of_a_sensor_does_not_count(tmp_path: Path) -> None:
    read = one_term(tmp_path, "base_ang_vel", params={"site": "s", "frame": "world"})
    assert told(read, STATE, {"s": AT}) == pytest.approx((1.0, 2.0, 3.0))


def test_a_quaternion_that_is_taken_for_another_order_turns_the_robot_over(tmp_path: Path) -> None:
    """(1, 0, 0, 0) taken as x, y, z, w is half a turn about x."""
    read = one_term(tmp_path, "projected_gravity", {"policy_io.imu.quat_order": "xyzw"})
    assert told(read, STATE) == pytest.approx((0.0, 0.0, 1.0))


def test_angles_are_told_from_the_default_pose(tmp_path: Path) -> None:
    assert told(one_term(tmp_path, "joint_pos_rel"), STATE) == pytest.approx((0.4, -0.7))


def test_angles_are_told_from_a_pose_of_their_own(tmp_path: Path) -> None:
    read = one_term(tmp_path, "joint_pos_rel", params={"default": 0.0})
    assert told(read, STATE).tolist() == [0.5, -0.5]


@pytest.mark.parametrize(
    ("term", "expected"), [("joint_pos_rel", (-0.7, 0.4)), ("joint_vel_rel", (5.0, 4.0))]
)
def test_joints_are_told_in_an_order_of_their_own(
    tmp_path: Path, term: str, expected: tuple[float, ...]
) -> None:
    read = one_term(tmp_path, term, params={"joints": ["left", "right"]})
    assert told(read, STATE) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("term", "expected"),
    [
        ("joint_vel_rel", (4.0, 5.0)),
        ("last_action", (7.0, 8.0)),
        ("velocity_commands", (0.6, 0.1, -0.4)),
    ],
)
def test_speeds_commands_and_the_raw_action_are_told_as_they_are(
    tmp_path: Path, term: str, expected: tuple[float, ...]
) -> None:
    assert told(one_term(tmp_path, term), STATE) == pytest.approx(expected)


def test_a_constant_is_told(tmp_path: Path) -> None:
    read = one_term(tmp_path, "constant", params={"value": [2.0, 3.0]})
    assert told(read, STATE).tolist() == [2.0, 3.0]


@pytest.mark.parametrize(("clip_then_scale", "expected"), [(True, 20.0), (False, 2.0)])
def test_the_clip_comes_before_or_after_the_scale(
    tmp_path: Path, clip_then_scale: bool, expected: float
) -> None:
    changes = {"policy_io.observation_groups.policy.clip_then_scale": clip_then_scale}
    read = one_term(tmp_path, "joint_vel_rel", changes, scale=10.0, clip=[-2.0, 2.0])
    assert told(read, STATE).tolist() == [expected, expected]


def test_a_scale_may_be_of_each_number(tmp_path: Path) -> None:
    read = one_term(tmp_path, "velocity_commands", scale=[2.0, 2.0, 0.25])
    assert told(read, STATE) == pytest.approx((1.2, 0.2, -0.1))


# -- by MuJoCo's own sensors ----------------------------------------------------

_SENSORS = """<sensor><velocimeter name="at" site="imu"/><gyro name="gyro" site="imu"/>
<framelinvel name="world" objtype="site" objname="imu"/>
<jointpos name="right" joint="right"/><jointpos name="left" joint="left"/>
<jointvel name="right'" joint="right"/><jointvel name="left'" joint="left"/></sensor></mujoco>"""


@pytest.mark.parametrize("seed", range(3))
def test_what_is_told_is_what_sensors_of_mujoco_read(tmp_path: Path, seed: int) -> None:
    """Turned and off the origin: the site is at (0.1, 0.02, 0.03), turned by 90°."""
    need_engine("mujoco")
    import mujoco

    file = robot(tmp_path)
    file.write_text(file.read_text().replace("</mujoco>", _SENSORS))
    terms = with_terms(
        {"id": "base_lin_vel", "params": {"site": "imu"}},
        {"id": "base_ang_vel", "params": {"site": "imu"}},
        {
            "id": "base_lin_vel",
            "source_name": "world",
            "params": {"site": "imu", "frame": "world"},
        },
        {"id": "joint_pos_rel", "params": {"default": 0.0}},
        {"id": "joint_vel_rel"},
    )
    read = contract(tmp_path, terms)
    model = load(file)
    binding = bind(read, model)
    random = np.random.default_rng(seed)
    with started(model) as data:
        data.qpos[:] = random.normal(size=model.nq)
        data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
        data.qvel[:] = random.normal(size=model.nv)
        mujoco.mj_forward(model.raw, data.raw)
        state = binding.state(data, np.zeros(3), np.zeros(2), 0)
        values = Observer.of(read, binding.mounts).values(state)
        assert np.concatenate(list(values.values())) == pytest.approx(data.raw.sensordata)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("quat_order", ["wxyz", "xyzw"])
def test_gravity_is_what_mujoco_turns_it_to(tmp_path: Path, seed: int, quat_order: str) -> None:
    need_engine("mujoco")
    import mujoco

    quat = np.random.default_rng(seed).normal(size=4)
    quat /= np.linalg.norm(quat)
    read = one_term(tmp_path, "projected_gravity", {"policy_io.imu.quat_order": quat_order})
    w, x, y, z = quat
    taken = np.array((w, -x, -y, -z))
    if quat_order == "xyzw":
        taken = np.array((z, -w, -x, -y))  # the numbers are x, y, z, w: conjugated, w first
    expected = np.zeros(3)
    mujoco.mju_rotVecQuat(expected, np.array((0.0, 0.0, -1.0)), taken)
    assert told(read, replace(STATE, quat=quat)) == pytest.approx(expected)


# -- the clock ------------------------------------------------------------------


def clock(folder: Path, calls: int, term: str = "gait_phase", **parameters: Any) -> Array:
    """Return what a clock of half a second tells, of a policy that is called each 0.02 s."""
    read = one_term(folder, term, params={"period": 0.5, **parameters})
    return told(read, replace(STATE, calls=calls))


@pytest.mark.parametrize(("calls", "turn"), [(0, 0.0), (5, 0.2), (25, 0.0), (30, 0.2)])
def test_the_clock_tells_sine_and_cosine_of_the_phase(
    tmp_path: Path, calls: int, turn: float
) -> None:
    angle = 2 * np.pi * turn
    assert clock(tmp_path, calls) == pytest.approx((np.sin(angle), np.cos(angle)), abs=1e-9)


def test_a_clock_may_be_ahead(tmp_path: Path) -> None:
    assert clock(tmp_path, 3, clock_offset_steps=2).tolist() == clock(tmp_path, 5).tolist()


def test_a_clock_of_two_legs_tells_both_sines_first(tmp_path: Path) -> None:
    """At a fifth of the period, and the other leg a quarter of it later."""
    one, other = 2 * np.pi * 0.2, 2 * np.pi * 0.45
    expected = (np.sin(one), np.sin(other), np.cos(one), np.cos(other))
    assert clock(tmp_path, 5, "gait_phase_legs", offset=0.25) == pytest.approx(expected)


def test_the_other_leg_is_half_a_period_behind_by_default(tmp_path: Path) -> None:
    sine, other, cosine, another = clock(tmp_path, 3, "gait_phase_legs")
    assert (other, another) == pytest.approx((-sine, -cosine))


@pytest.mark.parametrize(("speed", "stands"), [(0.05, True), (0.2, False)])
def test_a_clock_stands_below_its_threshold(tmp_path: Path, speed: float, stands: bool) -> None:
    read = one_term(tmp_path, "gait_phase", params={"period": 0.5, "stand_threshold": 0.1})
    value = told(read, replace(STATE, command=np.array((0.0, 0.0, -speed))))
    assert (value.tolist() == [0.0, 0.0]) is stands


def test_a_clock_without_a_threshold_never_stands(tmp_path: Path) -> None:
    read = one_term(tmp_path, "gait_phase", params={"period": 0.5})
    assert told(read, replace(STATE, command=np.zeros(3))).tolist() == [0.0, 1.0]


# -- the history ----------------------------------------------------------------

# What stands in an observation of two terms, a of two numbers and b of one, at three moments.
# A number of a at moment t is t or t.5, that of b is -t; the first moment is 1.
_AFTER = {
    ("term_major", "oldest_first", 4): [2, 2.5, 3, 3.5, 4, 4.5, -2, -3, -4],
    ("term_major", "newest_first", 4): [4, 4.5, 3, 3.5, 2, 2.5, -4, -3, -2],
    ("time_major", "oldest_first", 4): [2, 2.5, -2, 3, 3.5, -3, 4, 4.5, -4],
    ("time_major", "newest_first", 4): [4, 4.5, -4, 3, 3.5, -3, 2, 2.5, -2],
    ("term_major", "oldest_first", 2): [1, 1.5, 1, 1.5, 2, 2.5, -1, -1, -2],
    ("time_major", "newest_first", 2): [2, 2.5, -2, 1, 1.5, -1, 1, 1.5, -1],
}


def moment(time: int) -> dict[str, Array]:
    return {"a": np.array((time, time + 0.5)), "b": np.array((-float(time),))}


@pytest.mark.parametrize(("layout", "order", "moments"), _AFTER)
def test_moments_stand_in_their_layout_and_order(
    layout: Layout, order: Order, moments: int
) -> None:
    stack = Stack(History(3, layout, order, "repeat_first"))
    for time in range(1, moments):
        stack.add(moment(time))
    assert stack.add(moment(moments)).tolist() == _AFTER[layout, order, moments]


@pytest.mark.parametrize(
    ("init", "expected"),
    [
        ("repeat_first", [1, 1.5, 1, 1.5, 1, 1.5, -1, -1, -1]),
        ("zeros", [0, 0, 0, 0, 1, 1.5, 0, 0, -1]),
    ],
)
def test_before_the_reset_stands_the_first_moment_or_zeros(
    init: Init, expected: list[float]
) -> None:
    assert Stack(History(3, init=init)).add(moment(1)).tolist() == expected


def test_a_history_of_one_is_the_present() -> None:
    stack = Stack(History(1, init="zeros"))
    stack.add(moment(1))
    assert stack.add(moment(2)).tolist() == [2, 2.5, -2]


def test_what_was_handed_over_does_not_change_with_the_next_moment() -> None:
    stack = Stack(History(2))
    first = stack.add(moment(1))
    stack.add(moment(2))
    assert first.tolist() == [1, 1.5, 1, 1.5, -1, -1]
