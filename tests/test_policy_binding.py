"""Where the joints and sensors of a contract are in a model, and what a model lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from statemachine import load
from statemachine.errors import BadInputError, UnknownNameError
from statemachine.lab.policy.binding import Binding, bind
from statemachine.lab.policy.misspellings import nearest_name

from .support.policies import contract, robot, servos, with_terms
from .support.requirements import need_engine

pytest.importorskip("yaml")
JOINTS = "policy_io.joints.names"


def bound(
    folder: Path, changes: dict[str, Any] | None = None, old: str = "", new: str = ""
) -> Binding:
    """Return where a contract is in the robot, of whose file a part is replaced."""
    need_engine("mujoco")
    file = robot(folder)
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    return bind(contract(folder, changes), load(file))


def test_joints_and_servos_are_found_by_their_names(tmp_path: Path) -> None:
    binding = bound(tmp_path)
    assert binding.qpos.tolist() == [8, 7]
    assert binding.qvel.tolist() == [7, 6]
    assert binding.ctrl.tolist() == [1, 0]


def test_a_servo_is_that_of_the_joint_and_not_the_one_of_its_name(tmp_path: Path) -> None:
    swapped = servos().replace('name="left"', 'name="x"').replace('name="right"', 'name="left"')
    assert bound(tmp_path, None, servos(), swapped).ctrl.tolist() == [1, 0]


def test_a_sensor_is_where_its_site_is(tmp_path: Path) -> None:
    mount = bound(tmp_path, {"policy_io.imu.site": "imu"}).mounts["imu"]
    assert mount.pos == pytest.approx((0.1, 0.02, 0.03))
    assert mount.rotation[:, 0] == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)


def test_a_joint_that_the_model_lacks_is_answered_with_the_nearest(tmp_path: Path) -> None:
    changes = {JOINTS: ["right", "leftt"]}
    with pytest.raises(BadInputError, match=r"leftt.*Did you mean left"):
        bound(tmp_path, changes)


@pytest.mark.parametrize("joint", ["hip", "lower_left_ankle"])
def test_a_joint_that_is_near_none_is_answered_with_all(tmp_path: Path, joint: str) -> None:
    with pytest.raises(BadInputError, match=r"its hinges are left, right$"):
        bound(tmp_path, {JOINTS: ["right", joint]})


def test_of_several_joints_that_are_as_near_none_is_guessed() -> None:
    hips = ["FL_hip_joint", "FR_hip_joint", "RL_hip_joint"]
    assert nearest_name("left_hip_joint", hips) == ""
    assert nearest_name("FL_hipp_joint", hips) == "FL_hip_joint"


def test_a_robot_without_a_floating_base_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="floating base"):
        bound(tmp_path, None, '<freejoint name="root"/>', "")


def test_a_joint_that_slides_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"'left'.*no hinge"):
        bound(tmp_path, None, '<joint name="left"', '<joint type="slide" name="left"')


@pytest.mark.parametrize(
    "actuators",
    [servos().split("/>")[0] + "/>", servos() + servos().replace('" joint', '2" joint')],
)
def test_a_joint_needs_one_actuator(tmp_path: Path, actuators: str) -> None:
    with pytest.raises(BadInputError, match="the joint '"):
        bound(tmp_path, None, servos(), actuators)


def test_a_site_that_the_model_lacks_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="imu"):
        bound(tmp_path, {"policy_io.imu.site": "imuu"})


def test_a_sensor_that_is_not_on_the_base_is_refused(tmp_path: Path) -> None:
    terms = with_terms({"id": "base_ang_vel", "params": {"site": "foot"}})
    with pytest.raises(BadInputError, match="'left_leg'"):
        bound(tmp_path, terms, '<joint name="left"', '<site name="foot"/><joint name="left"')
