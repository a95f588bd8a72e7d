"""The quadruped of our own: its figures, how it stands, and that its contract is of this robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml

import statemachine as sm
from statemachine.models import models_dir, resolve

from .support.requirements import need_engine

FOLDER = models_dir() / "quadruped"
LEGS = ("FL", "FR", "RL", "RR")
# What each body is of: solids of uniform density, with these masses [kg].
SOLIDS = {
    "trunk": '<geom type="box" size="0.18 0.09 0.045" mass="4.8"/>',
    "hip": '<geom type="cylinder" size="0.035 0.02" euler="90 0 0" mass="0.4"/>',
    "thigh": '<geom type="capsule" size="0.018" fromto="0 0 0 0 0 -0.18" mass="0.26"/>',
    "shank": '<geom type="capsule" size="0.012" fromto="0 0 0 0 0 -0.16" mass="0.1"/>'
    '<geom type="sphere" size="0.02" pos="0 0 -0.18" mass="0.04"/>',
}


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(resolve("quadruped/scene")))


@pytest.fixture(scope="module")
def contract() -> dict[str, Any]:
    return yaml.safe_load((FOLDER / "contract.yaml").read_text("utf-8"))


def test_it_weighs_eight_kilograms(model: mujoco.MjModel) -> None:
    assert model.body_mass.sum() == pytest.approx(8.0)


@pytest.mark.parametrize("part", SOLIDS)
def test_an_inertia_is_that_of_the_body_s_shapes(model: mujoco.MjModel, part: str) -> None:
    text = f"<mujoco><worldbody><body>{SOLIDS[part]}</body></worldbody></mujoco>"
    solid = mujoco.MjModel.from_xml_string(text)
    names = ["trunk"] if part == "trunk" else [f"{leg}_{part}" for leg in LEGS]
    for name in names:
        body = model.body(name)
        assert body.mass == pytest.approx(solid.body_mass[1])
        assert body.ipos == pytest.approx(solid.body_ipos[1], abs=1e-6)
        moments, expected = sorted(body.inertia), sorted(solid.body_inertia[1])
        assert moments == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("backend", ["mujoco", "pybullet", "motrix"])
def test_it_stands(backend: str) -> None:
    need_engine(backend)
    robot = sm.load("quadruped/scene", backend=backend)
    with sm.make_data(robot) as data:
        sm.reset(robot, data, keyframe="home")
        sm.step(robot, data, 500)
        assert 0.28 < data.qpos[2] < 0.30
        assert data.qpos[3] > np.cos(np.radians(1) / 2)


def test_nothing_but_its_feet_touches_the_floor(model: mujoco.MjModel) -> None:
    """As it lies on its back, too: the floor holds the feet and lets the trunk through."""
    data = mujoco.MjData(model)
    touching = set()
    for turned in ([1, 0, 0, 0], [0, 1, 0, 0], [0.7071, 0.7071, 0, 0]):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        data.qpos[2], data.qpos[3:7] = 0.1, turned
        mujoco.mj_forward(model, data)
        touching |= {model.geom(number).name for pair in data.contact.geom for number in pair}
    assert touching == {"floor", *(f"{leg}_foot" for leg in LEGS)}


def test_the_contract_names_the_joints_of_the_robot(
    model: mujoco.MjModel, contract: dict[str, Any]
) -> None:
    names = contract["policy_io"]["joints"]["names"]
    hinges = [model.joint(number).name for number in range(1, model.njnt)]
    assert sorted(names) == sorted(hinges)
    assert names != hinges  # or who forgets to reorder would not notice


def test_the_contract_starts_at_the_keyframe(
    model: mujoco.MjModel, contract: dict[str, Any]
) -> None:
    home = model.key("home").qpos
    angles = {model.joint(n).name: home[model.jnt_qposadr[n]] for n in range(1, model.njnt)}
    assert contract["control"]["default_joint_pos"] == pytest.approx(angles)
    assert contract["control"]["actions"]["joint_pos"]["offset"] == pytest.approx(angles)


def test_the_contract_has_the_figures_of_the_servos(
    model: mujoco.MjModel, contract: dict[str, Any]
) -> None:
    servos, body = contract["control"]["actuators"], contract["model"]
    for number in range(model.nu):
        name, joint = model.actuator(number).name, model.actuator_trnid[number, 0]
        dof = model.jnt_dofadr[joint]
        assert model.joint(joint).name == name
        assert servos["kp"][name] == model.actuator_gainprm[number, 0]
        assert servos["kd"][name] == -model.actuator_biasprm[number, 2]
        assert body["effort_limit"][name] == model.actuator_forcerange[number, 1]
        assert body["armature"][name] == model.dof_armature[dof]
        assert body["joint_friction"][name] == model.dof_frictionloss[dof]
        assert body["joint_damping"][name] == model.dof_damping[dof]


def test_the_contract_has_the_timestep_of_the_scene(
    model: mujoco.MjModel, contract: dict[str, Any]
) -> None:
    timing = contract["timing"]
    assert timing["sim_dt"] == model.opt.timestep
    assert timing["policy_dt"] == pytest.approx(timing["decimation"] * timing["sim_dt"])


def test_the_imu_is_at_the_origin_of_the_trunk(
    model: mujoco.MjModel, contract: dict[str, Any]
) -> None:
    """So that a velocity there is the free joint's, for whoever measures at the site."""
    site = model.site(contract["policy_io"]["imu"]["site"])
    assert site.bodyid == model.body("trunk").id
    assert site.pos.tolist() == [0, 0, 0]
    assert site.quat.tolist() == [1, 0, 0, 0]


def test_the_network_takes_what_the_contract_gives(contract: dict[str, Any]) -> None:
    onnxruntime = pytest.importorskip("onnxruntime")
    session = onnxruntime.InferenceSession(Path(FOLDER / "policy.onnx").as_posix())
    (seen,), (acted,) = session.get_inputs(), session.get_outputs()
    terms = contract["policy_io"]["observation_groups"]["policy"]["terms"]
    names = contract["policy_io"]["joints"]["names"]
    assert (seen.name, seen.shape) == ("obs", [1, sum(term["dim"] for term in terms)])
    assert (acted.name, acted.shape) == ("actions", [1, len(names)])
    assert session.get_modelmeta().custom_metadata_map["joint_names"] == ",".join(names)
    assert all(len(term["scale"]) == term["dim"] for term in terms)
