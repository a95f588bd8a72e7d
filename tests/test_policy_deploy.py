"""A contract from Unitree's `deploy.yaml`: orders of motors, observations, actions, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine import load
from statemachine.errors import BadInputError
from statemachine.lab.policy.command import Command
from statemachine.lab.policy.contract import Clock, Contract
from statemachine.lab.policy.contract_fields import UnreadField
from statemachine.lab.policy.contract_file import read_contract
from statemachine.lab.policy.network import Network
from statemachine.lab.policy.on_model import PolicyOnModel
from statemachine.lab.policy.unitree_deploy import ORDERS
from statemachine.lab.policy.walk import walked

from .support.policies import contract_file
from .support.requirements import SHARED, need_engine, shared

pytest.importorskip("yaml")

# As Isaac Lab orders the joints of a Go2: hips, thighs, calves, each left before right.
GO2 = [3, 0, 9, 6, 4, 1, 10, 7, 5, 2, 11, 8]
# As unitree_rl_lab writes it for the G1: breadth first through its tree.
G1 = [0, 6, 12, 1, 7, 13, 2, 8, 14, 3, 9, 15, 22, 4, 10, 16, 23, 5, 11, 17, 24, 18, 25, 19, 26]
G1 += [20, 27, 21, 28]
G1_OF_23 = [0, 6, 12, 1, 7, 15, 22, 2, 8, 16, 23, 3, 9, 17, 24, 4, 10, 18, 25, 5, 11, 19, 26]
LEGS = ("FL", "FR", "RL", "RR")
H1 = [motor for motor in range(20) if motor != 9]


def deploy(ids: list[int], motors: int, **changes: Any) -> dict[str, Any]:
    """Return what stands in a file; a change to None removes a field."""
    n = len(ids)
    fields: dict[str, Any] = {
        "joint_ids_map": ids,
        "step_dt": 0.02,
        "stiffness": [100.0 + motor for motor in range(motors)],
        "damping": [1.0 + motor for motor in range(motors)],
        "default_joint_pos": [0.1 * number for number in range(n)],
        "commands": {
            "base_velocity": {
                "ranges": {
                    "lin_vel_x": [-0.5, 1.0],
                    "lin_vel_y": [-0.3, 0.3],
                    "ang_vel_z": [-0.2, 0.2],
                    "heading": None,
                }
            }
        },
        "actions": {
            "JointPositionAction": {
                "clip": None,
                "joint_names": [".*"],
                "scale": [0.25] * n,
                "offset": [0.1 * number for number in range(n)],
                "joint_ids": None,
            }
        },
        "observations": {
            "base_ang_vel": {"params": {}, "clip": [-100, 100], "scale": [0.2] * 3},
            "projected_gravity": {"params": {}, "scale": None},
            "velocity_commands": {"params": {"command_name": "base_velocity"}},
            "joint_pos_rel": {"params": {}, "scale": [1.0] * n},
            "joint_vel_rel": {"params": {}, "scale": [0.05] * n},
            "last_action": {},
        },
    }
    fields.update(changes)
    return {key: value for key, value in fields.items() if value is not None}


def read(folder: Path, fields: dict[str, Any]) -> Contract:
    return read_contract(contract_file(folder, fields))


def of_go2(folder: Path, **changes: Any) -> Contract:
    return read(folder, deploy(GO2, 12, **changes))


def with_lengths(**lengths: int) -> dict[str, Any]:
    """Return observations of speeds with lengths of their history."""
    return {name: {"history_length": length} for name, length in lengths.items()}


def test_a_go2_has_its_joints_in_the_order_of_the_policy(tmp_path: Path) -> None:
    names = [f"{leg}_{part}_joint" for part in ("hip", "thigh", "calf") for leg in LEGS]
    assert list(of_go2(tmp_path).joints) == names


@pytest.mark.parametrize(
    ("ids", "motors", "first"),
    [
        (G1, 29, ["left_hip_pitch_joint", "right_hip_pitch_joint", "waist_yaw_joint"]),
        (G1_OF_23, 27, ["left_hip_pitch_joint", "right_hip_pitch_joint", "waist_yaw_joint"]),
        (H1, 20, ["right_hip_roll_joint", "right_hip_pitch_joint", "right_knee_joint"]),
    ],
)
def test_other_robots_are_known_by_their_motors(
    tmp_path: Path, ids: list[int], motors: int, first: list[str]
) -> None:
    assert list(read(tmp_path, deploy(ids, motors)).joints[:3]) == first


@pytest.mark.parametrize(
    ("ids", "motors", "last"),
    [
        (G1, 29, ["left_wrist_yaw_joint", "right_wrist_yaw_joint"]),
        (G1_OF_23, 27, ["left_wrist_roll_joint", "right_wrist_roll_joint"]),
        (H1, 20, ["left_shoulder_yaw_joint", "left_elbow_joint"]),
    ],
)
def test_and_so_are_their_last_joints(
    tmp_path: Path, ids: list[int], motors: int, last: list[str]
) -> None:
    assert list(read(tmp_path, deploy(ids, motors)).joints[-2:]) == last


def test_breadth_first_the_joints_of_a_g1_alternate_sides(tmp_path: Path) -> None:
    """So that an order of motors with a slip does not pass."""
    sided = [name for name in read(tmp_path, deploy(G1, 29)).joints if "waist" not in name]
    pairs = zip(sided[::2], sided[1::2], strict=True)
    assert all(left.replace("left", "right") == right for left, right in pairs)


@pytest.mark.parametrize("order", ORDERS, ids=lambda order: order.robot)
def test_no_motor_is_named_twice(order: Any) -> None:
    names = [name for name in order.joints if name]
    assert len(set(names)) == len(names)


def test_gains_stand_in_the_order_of_the_motors(tmp_path: Path) -> None:
    servos = of_go2(tmp_path).servos
    assert servos.kp is not None
    assert servos.kp.tolist() == [100.0 + motor for motor in GO2]
    assert servos.kd is not None
    assert servos.kd.tolist() == [1.0 + motor for motor in GO2]


def test_the_pose_stands_in_the_order_of_the_policy(tmp_path: Path) -> None:
    assert of_go2(tmp_path).default_joint_pos[:3].tolist() == pytest.approx([0.0, 0.1, 0.2])


def test_it_does_not_say_who_integrates_the_gains(tmp_path: Path) -> None:
    read_one = of_go2(tmp_path)
    assert (read_one.servos.kind, read_one.timing.decimation) == (None, None)


def test_it_is_called_once_a_step(tmp_path: Path) -> None:
    assert of_go2(tmp_path).timing.policy_dt == 0.02


def test_the_observation_has_the_terms_of_the_file(tmp_path: Path) -> None:
    assert of_go2(tmp_path).observation_size == 3 + 3 + 3 + 12 + 12 + 12


def test_scales_are_those_of_the_file_and_one_where_it_has_none(tmp_path: Path) -> None:
    scales = [term.scale[0] for term in of_go2(tmp_path).terms]
    assert scales == [0.2, 1.0, 1.0, 1.0, 0.05, 1.0]


@pytest.mark.parametrize("scale_first", [None, False, True])
def test_a_term_is_clipped_before_its_scale_unless_the_file_says_so(
    tmp_path: Path, scale_first: bool | None
) -> None:
    observations: dict[str, Any] = {"base_ang_vel": {}}
    if scale_first is not None:
        observations["scale_first"] = scale_first
    assert of_go2(tmp_path, observations=observations).clips_before_scale is not scale_first


def test_the_speeds_that_it_may_be_asked_for_are_in_the_file(tmp_path: Path) -> None:
    limits = of_go2(tmp_path).command_limits
    assert limits == {"vx": (-0.5, 1.0), "vy": (-0.3, 0.3), "wz": (-0.2, 0.2)}


def test_the_clock_is_two_steps_ahead_and_stands_with_the_robot(tmp_path: Path) -> None:
    observations = {"gait_phase": {"params": {"period": 0.8}}}
    (term,) = of_go2(tmp_path, observations=observations).terms
    assert term.clock == Clock(period=0.8, offset_steps=2, stand_threshold=0.1)


@pytest.mark.parametrize(
    ("use_gym_history", "layout"), [(None, "term_major"), (True, "time_major")]
)
def test_a_history_is_laid_out_term_by_term_unless_the_file_says_so(
    tmp_path: Path, use_gym_history: bool | None, layout: str
) -> None:
    observations: dict[str, Any] = with_lengths(base_ang_vel=5, last_action=5)
    if use_gym_history is not None:
        observations["use_gym_history"] = use_gym_history
    history = of_go2(tmp_path, observations=observations).history
    assert (history.length, history.layout) == (5, layout)


def test_a_history_begins_with_the_oldest_which_is_repeated(tmp_path: Path) -> None:
    history = of_go2(tmp_path).history
    assert (history.length, history.order, history.init) == (1, "oldest_first", "repeat_first")


def test_targets_are_scaled_set_off_and_clipped(tmp_path: Path) -> None:
    action = {"scale": [0.5] * 12, "offset": [0.1] * 12, "clip": [[-0.2, 0.3]] * 12}
    targets = of_go2(tmp_path, actions={"JointPositionAction": action}).action.targets
    assert targets(np.full(12, 0.2))[0] == pytest.approx(0.2)
    assert targets(np.full(12, 9.0))[0] == 0.3


def test_an_offset_that_is_missing_is_none(tmp_path: Path) -> None:
    """The program adds what the file says, and not the default pose."""
    actions = {"JointPositionAction": {"scale": [0.5] * 12}}
    assert of_go2(tmp_path, actions=actions).action.offset.tolist() == [0.0] * 12


def test_nothing_of_such_a_file_is_unread(tmp_path: Path) -> None:
    assert of_go2(tmp_path).unread == ()


def test_what_is_not_known_of_a_file_is_told_as_unread(tmp_path: Path) -> None:
    assert of_go2(tmp_path, torque_limit=3).unread == (UnreadField("torque_limit"),)


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("stiffness", {"stiffness": None}),
        ("stiffness", {"stiffness": [1.0] * 13}),
        ("stiffness", {"stiffness": [-1.0] * 12}),
        ("damping", {"damping": [1.0] * 11}),
        ("damping", {"damping": [float("nan")] * 12}),
        ("joint_ids_map", {"joint_ids_map": [0, 1, 12]}),
        ("joint_ids_map", {"joint_ids_map": [0, 0]}),
        ("joint_ids_map", {"joint_ids_map": [0.5, 1]}),
        ("joint_ids_map", {"joint_ids_map": [-1, 1]}),
        ("default_joint_pos", {"default_joint_pos": [0.0] * 11}),
        ("step_dt", {"step_dt": None}),
        ("step_dt", {"step_dt": 0.0}),
        ("actions.JointPositionAction", {"actions": None}),
        ("actions.JointVelocityAction", {"actions": {"JointVelocityAction": {}}}),
        (
            "actions.JointPositionAction.joint_ids",
            {"actions": {"JointPositionAction": {"joint_ids": [1, 0]}}},
        ),
        (
            "actions.JointPositionAction.scale",
            {"actions": {"JointPositionAction": {"scale": [0.5] * 3}}},
        ),
        ("observations.base_ang_vel", {"observations": None}),
        ("observations.height_scan", {"observations": {"height_scan": {"scale": 1.0}}}),
        ("observations.gait_phase.params.period", {"observations": {"gait_phase": {}}}),
        (
            "observations.joint_pos_rel.params.asset_cfg",
            {"observations": {"joint_pos_rel": {"params": {"asset_cfg": {"joint_ids": [0]}}}}},
        ),
        (
            "observations.last_action.history_length",
            {"observations": with_lengths(base_ang_vel=5, last_action=1)},
        ),
        (
            "commands.base_velocity.ranges.lin_vel_x",
            {"commands": {"base_velocity": {"ranges": {"lin_vel_x": [1, 0]}}}},
        ),
    ],
)
def test_a_wrong_field_is_refused_by_its_name(
    tmp_path: Path, field: str, changes: dict[str, Any]
) -> None:
    with pytest.raises(BadInputError) as caught:
        of_go2(tmp_path, **changes)
    assert f"contract.yaml: {field}" in str(caught.value)


def test_a_number_without_a_motor_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="joint_ids_map"):
        read(tmp_path, deploy([*H1[:-1], 9], 20))


def test_the_robots_that_are_known_are_named_where_none_fits(tmp_path: Path) -> None:
    with pytest.raises(BadInputError) as caught:
        read(tmp_path, deploy([0, 1], 2))
    assert all(order.robot in str(caught.value) for order in ORDERS)


def test_an_observation_that_is_misspelt_is_answered_with_the_nearest(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="Did you mean joint_pos_rel"):
        of_go2(tmp_path, observations={"joint_pos_rell": {"scale": 1.0}})


@pytest.mark.slow
def test_a_public_policy_walks_by_such_a_file(tmp_path: Path) -> None:
    """A Go1, whose motors are numbered as those of a Go2; its pose and gains are of its scene."""
    need_engine("mujoco")
    pytest.importorskip("onnxruntime")
    folder = shared(SHARED / "policies" / "go1")
    pose = [0.1, 0.9, -1.8, -0.1, 0.9, -1.8] * 2
    names = ["base_lin_vel", "base_ang_vel", "projected_gravity", "joint_pos_rel"]
    names += ["joint_vel_rel", "last_action", "velocity_commands"]
    model = load(folder / "scene.xml")
    fields = deploy(
        list(range(12)),
        12,
        stiffness=model.actuator_kp.tolist(),
        damping=model.actuator_kv.tolist(),
        default_joint_pos=pose,
        actions={"JointPositionAction": {"scale": [0.5] * 12, "offset": pose}},
        observations={name: {"history_length": 1} for name in names},
    )
    policy = PolicyOnModel.of(read(tmp_path, fields), Network(folder / "policy.onnx"), model)
    walk = walked(policy, Command(0.8), 4.0).walk
    assert walk.verdict == "walks"
    assert policy.driven.changes == ()
