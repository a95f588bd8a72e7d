"""A policy as a controller: when it is called, what acts when, and what its servos did."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from statemachine import load
from statemachine.errors import BadInputError
from statemachine.interface import Array, Model
from statemachine.lab.policy.command import Command
from statemachine.lab.policy.request import PolicyRequest, answer
from statemachine.lab.policy.walk import set_start, walked

from .support.backends import BOTH
from .support.policies import (
    SIZE,
    constant_network,
    content,
    contract_file,
    linear_network,
    motors,
    node,
    on_model,
    robot,
    run,
    saved,
    servos,
    started,
    tensor,
)
from .support.requirements import need_engine

pytest.importorskip("yaml")
pytest.importorskip("onnxruntime")
DELAY = "control.actions.joint_pos.delay_steps"
CLIP = "control.actions.joint_pos.clip"
EXPLICIT = {"control.actuators.kind": "explicit_pd"}
FREE = {"control.actuators.kd": 0.0, "model.effort_limit": 100.0, **EXPLICIT}


@pytest.fixture
def model(tmp_path: Path) -> Model:
    need_engine("mujoco")
    return load(robot(tmp_path))


def counting(folder: Path) -> Path:
    """Write a network whose action is the last one and one more."""
    weights = np.zeros((SIZE, 2))
    weights[5, 0] = weights[6, 1] = 1.0
    return linear_network(folder, weights, [1.0, 1.0])


@pytest.mark.parametrize(("sim_dt", "calls"), [(0.002, 3), (0.004, 6), (0.02, 30)])
def test_it_is_called_once_in_so_many_steps(
    tmp_path: Path, model: Model, sim_dt: float, calls: int
) -> None:
    policy = on_model(tmp_path, model, counting(tmp_path), {"timing.sim_dt": sim_dt})
    times = [call.time for call in run(policy, 30).controller.calls]
    assert times == pytest.approx([0.02 * number for number in range(calls)])


def test_the_target_is_held_between_calls(tmp_path: Path, model: Model) -> None:
    policy = on_model(tmp_path, model, counting(tmp_path))
    ctrl = run(policy, 20).ctrl
    assert np.ptp(ctrl[:10], axis=0).tolist() == [0.0, 0.0]
    assert ctrl[10] == pytest.approx(ctrl[9] + 0.5)


def test_targets_go_to_the_joints_by_their_names(tmp_path: Path, model: Model) -> None:
    """The policy has the right leg first, and the model the left one."""
    policy = on_model(tmp_path, model, constant_network(tmp_path, [1.0, -1.0]))
    assert run(policy, 1).ctrl[0] == pytest.approx((0.2 - 0.5, 0.1 + 0.5))


def test_the_last_action_is_told_as_the_network_gave_it(tmp_path: Path, model: Model) -> None:
    """Not as it was scaled and clipped."""
    policy = on_model(tmp_path, model, counting(tmp_path), {CLIP: [-0.2, 0.2]})
    actions = [call.action.tolist() for call in run(policy, 30).controller.calls]
    assert actions == [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_an_action_acts_so_many_calls_late(tmp_path: Path, model: Model, delay: int) -> None:
    policy = on_model(tmp_path, model, counting(tmp_path), {DELAY: delay})
    left = run(policy, 40).ctrl[::10, 0]
    acting = [max(0, number + 1 - delay) for number in range(4)]
    assert left == pytest.approx([0.2 + 0.5 * action for action in acting])


def test_a_late_action_is_told_in_time(tmp_path: Path, model: Model) -> None:
    policy = on_model(tmp_path, model, counting(tmp_path), {DELAY: 2})
    assert run(policy, 30).controller.calls[2].last_action.tolist() == [2.0, 2.0]


def test_the_command_is_told(tmp_path: Path, model: Model) -> None:
    weights = np.zeros((SIZE, 2))
    weights[7, 0] = weights[9, 1] = 1.0
    policy = on_model(tmp_path, model, linear_network(tmp_path, weights, [0.0, 0.0]))
    (call,) = run(policy, 1, (0.25, 0.0, -0.5)).controller.calls
    assert call.action.tolist() == [0.25, -0.5]


def test_targets_are_clipped_to_the_range_of_the_servos(tmp_path: Path) -> None:
    need_engine("mujoco")
    model = load(robot(tmp_path, servos(rest='ctrlrange="-0.4 0.4"')))
    policy = on_model(tmp_path, model, constant_network(tmp_path, [1.0, 1.0]))
    assert run(policy, 1).ctrl[0].tolist() == [0.4, 0.4]


# -- what the servos did --------------------------------------------------------


@pytest.mark.parametrize(("action", "share"), [(0.0, 0), (9.0, 1)])
def test_a_step_at_the_limit_is_counted(
    tmp_path: Path, model: Model, action: float, share: int
) -> None:
    """20 N·m/rad · 4.6 rad is above 8 N·m, and 20 · 0.1 is not."""
    policy = on_model(tmp_path, model, constant_network(tmp_path, [action, 0.0]))
    controller = run(policy, 1).controller
    assert (controller.saturated.tolist(), controller.steps) == ([share, 0], 1)


def test_without_a_limit_none_is_counted(tmp_path: Path, model: Model) -> None:
    limits = {"model.effort_limit": {"left": None, "right": None}}
    policy = on_model(tmp_path, model, constant_network(tmp_path, [9.0, 9.0]), limits)
    assert run(policy, 5).controller.saturated.tolist() == [0, 0]


def kinetic_energy(model: Model, speeds: Array, positions: Array) -> float:
    """Return the energy of motion [J], as MuJoCo tells it."""
    import mujoco

    raw, data = model.raw, mujoco.MjData(model.raw)
    data.qpos[:], data.qvel[:] = positions, speeds
    mujoco.mj_forward(raw, data)
    mujoco.mj_energyVel(raw, data)
    return float(data.energy[1])


def test_work_is_what_the_robot_gains_in_energy(tmp_path: Path) -> None:
    """In the air, without damping, while the legs speed up."""
    need_engine("mujoco")
    file = robot(tmp_path, joint='armature="0.01"', timestep=0.0005, gravity="0 0 0")
    changes = {**FREE, "timing.sim_dt": 0.0005}
    policy = on_model(tmp_path, load(file), constant_network(tmp_path, [0.5, 0.5]), changes)
    done = run(policy, 61)
    gained = kinetic_energy(policy.driven.model, done.qvel[-1], done.qpos[-1])
    assert gained > 0.05
    assert done.controller.work == pytest.approx(gained, rel=0.05)


def test_what_the_servos_take_back_does_not_count(tmp_path: Path) -> None:
    need_engine("mujoco")
    file = robot(tmp_path, gravity="0 0 0")
    policy = on_model(tmp_path, load(file), constant_network(tmp_path, [0.5, 0.5]), FREE)
    done = run(policy, 200)
    torque, speed = done.ctrl, done.qvel[:, 6:]
    assert (torque * speed).min() < -0.1
    given = float(np.maximum(torque * speed, 0.0).sum() * 0.002)
    assert done.controller.work == pytest.approx(given)


# -- runs -----------------------------------------------------------------------


@pytest.mark.parametrize("backend", BOTH)
@pytest.mark.parametrize("kind", ["implicit_pd", "explicit_pd"])
def test_a_run_is_repeated_bit_by_bit(tmp_path: Path, backend: str, kind: str) -> None:
    need_engine(backend)
    weights = np.random.default_rng(0).normal(size=(SIZE, 2))
    network = linear_network(tmp_path, weights, [0.1, -0.1])
    loaded = load(robot(tmp_path), backend=backend)
    policy = on_model(tmp_path, loaded, network, {"control.actuators.kind": kind})
    one, other = (walked(policy, Command(0.5), 0.3) for _ in range(2))
    assert len(one.calls) > 10
    assert [call.action.tolist() for call in one.calls] == [
        call.action.tolist() for call in other.calls
    ]
    assert one.walk == other.walk


def test_a_run_begins_without_memory_of_the_one_before(tmp_path: Path, model: Model) -> None:
    network = saved(
        tmp_path / "policy.onnx",
        [node("Identity", "before", "actions"), node("Add", "before one", "after")],
        [tensor("obs", [1, SIZE]), tensor("before", [1, 2])],
        [tensor("actions", [1, 2]), tensor("after", [1, 2])],
        {"one": np.ones((1, 2))},
    )
    policy = on_model(tmp_path, model, network)
    runs = [run(policy, 20).controller.calls for _ in range(2)]
    told = [[call.action[0] for call in calls] for calls in runs]
    assert told == [[0.0, 1.0], [0.0, 1.0]]


def test_joints_start_in_the_default_pose_where_the_model_has_no_keyframe(
    tmp_path: Path, model: Model
) -> None:
    policy = on_model(tmp_path, model, constant_network(tmp_path, [0.0, 0.0]))
    with started(model) as data:
        set_start(data, policy, None)
        assert data.qpos[7:].tolist() == [0.2, 0.1]


def test_an_action_that_is_no_number_is_refused_with_its_time(tmp_path: Path, model: Model) -> None:
    network = constant_network(tmp_path, [np.nan, 0.0])
    with pytest.raises(BadInputError, match=r"policy\.onnx gave at 0\.000 s"):
        run(on_model(tmp_path, model, network), 1)


@pytest.mark.parametrize(("action", "scale"), [(1e38, 1.0), (0.1, 1e308), (1.0, 1e11)])
def test_a_target_that_no_servo_can_be_told_is_refused_with_its_time(
    tmp_path: Path, model: Model, action: float, scale: float
) -> None:
    network = constant_network(tmp_path, [action, 0.0])
    policy = on_model(tmp_path, model, network, {"control.actions.joint_pos.scale": scale})
    with pytest.raises(BadInputError, match=r"policy\.onnx gave at 0\.000 s .* no servo"):
        run(policy, 1)


def test_a_torque_of_a_far_target_is_at_its_limit(tmp_path: Path) -> None:
    need_engine("mujoco")
    model = load(robot(tmp_path, motors(8.0)))
    policy = on_model(tmp_path, model, constant_network(tmp_path, [1e30, 1e30]), EXPLICIT)
    assert run(policy, 1).ctrl[0].tolist() == [8.0, 8.0]


def test_an_observation_beyond_single_precision_is_refused_with_its_time(
    tmp_path: Path, model: Model
) -> None:
    policy = on_model(tmp_path, model, constant_network(tmp_path, [0.0, 0.0]))
    with pytest.raises(BadInputError, match=r"contract\.yaml observes at 0\.000 s"):
        run(policy, 1, command=(1e300, 0.0, 0.0))


def test_a_run_that_is_over_before_the_second_call_is_refused(tmp_path: Path) -> None:
    need_engine("mujoco")
    network, file = constant_network(tmp_path, [0.0, 0.0]), contract_file(tmp_path, content())
    asked = PolicyRequest(network, file, robot(tmp_path), seconds=0.03)
    with pytest.raises(BadInputError, match=r"in 0\.03 s .* each 0\.02 s"):
        answer(asked)


def test_two_calls_are_enough_to_tell_a_speed(tmp_path: Path, model: Model) -> None:
    policy = on_model(tmp_path, model, constant_network(tmp_path, [0.0, 0.0]))
    assert walked(policy, Command(0.5), 0.04).walk.reached is not None


def test_another_number_of_actions_is_refused(tmp_path: Path, model: Model) -> None:
    network = saved(
        tmp_path / "policy.onnx",
        [node("Identity", "obs", "actions")],
        [tensor("obs", [1, "size"])],
        [tensor("actions", [1, "size"])],
    )
    with pytest.raises(BadInputError, match="2 finite numbers"):
        run(on_model(tmp_path, model, network), 1)


def test_what_the_policy_does_not_drive_keeps_its_command(tmp_path: Path) -> None:
    need_engine("mujoco")
    file = robot(tmp_path, servos() + '<motor name="more" joint="root" gear="0 0 1 0 0 0"/>')
    policy = on_model(tmp_path, load(file), constant_network(tmp_path, [1.0, 1.0]))
    assert run(policy, 1).ctrl[0].tolist() == pytest.approx([0.7, 0.6, 0.0])


def test_motors_are_commanded_torques(tmp_path: Path) -> None:
    need_engine("mujoco")
    model = load(robot(tmp_path, motors()))
    policy = on_model(tmp_path, model, constant_network(tmp_path, [0.0, 0.0]), EXPLICIT)
    assert run(policy, 1).ctrl[0] == pytest.approx((20.0 * 0.2, 20.0 * 0.1))


def test_the_height_of_a_walk_is_that_of_its_base(tmp_path: Path, model: Model) -> None:
    """It stands 0.3 m high, and falls in these 0.1 s by at most g t² / 2."""
    policy = on_model(tmp_path, model, constant_network(tmp_path, [0.0, 0.0]))
    height = walked(policy, Command(0.5), 0.1).walk.height
    assert height is not None
    assert 0.25 < height <= 0.3
