"""What is rounding is no difference, and what is small and real is one."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import EngineWarning
from statemachine.interface import Array
from statemachine.lab.compare.one_step import OneStep, one_step
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.questions.requests.gap import CompareRequest, CompareResult, answer
from statemachine.lab.recordings import Rerun
from statemachine.measures import RobotScale, robot_points, tolerance_of

from .support.files import written
from .support.small_models import model_of

# 0.612 kg, 6.0 N, 0.4 m; the wrist is five hundred times lighter than the upper arm. No armature.
ARM = """<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
<worldbody>
  <body name="upper" pos="0 0 0.5"><joint name="shoulder" axis="0 1 0" damping="0.02"/>
    <inertial pos="0.1 0 0" mass="0.4" diaginertia="4e-4 8e-4 8e-4"/>
    <body name="lower" pos="0.2 0 0"><joint name="elbow" axis="0 1 0" damping="0.02"/>
      <inertial pos="0.08 0 0" mass="0.2" diaginertia="2e-4 4e-4 4e-4"/>
      <body name="hand" pos="0.18 0 0"><joint name="wrist" axis="1 0 0" damping="1e-5"/>
        <inertial pos="0 0 0.01" mass="0.012" diaginertia="1e-6 1e-6 1e-6"/>
        <site name="tip" pos="0.02 0 0"/>
</body></body></body></worldbody>
<actuator><position name="s" joint="shoulder" kp="20"/><position name="e" joint="elbow" kp="20"/>
  <position name="w" joint="wrist" kp="0.01"/></actuator></mujoco>"""

# A body that a weld to a mocap body holds: every torque on it is rounding.
WELDED = """<mujoco><option timestep="0.002"/><worldbody>
  <body name="target" mocap="true" pos="0.2 0 0.6" quat="0.9238795 0 0.3826834 0"/>
  <body name="hand" pos="0 0 0.5"><freejoint name="free"/>
    <geom type="box" size="0.03 0.02 0.05" mass="0.6"/></body>
</worldbody><equality><weld body1="target" body2="hand" relpose="0 0 0 0 0 0 0"/></equality>
</mujoco>"""

# A disc of next to no weight slides on a table, along which alone it can move, beside an arm of
# 8 kg. The margin of the table makes MuJoCo push before they touch.
DISC = """<mujoco><option timestep="0.01" gravity="0 0 0"/><worldbody>
  <geom name="table" type="plane" size="1 1 0.1" margin="0.002" condim="1"/>
  <body name="arm" pos="0 0 0.5"><joint name="pan" axis="0 0 1" armature="0.04"/>
    <geom type="capsule" fromto="0 0 0 0.6 0 0" size="0.06" mass="8" contype="0" conaffinity="0"/>
  </body>
  <body name="disc" pos="0.4 0 0.05"><joint name="x" type="slide" axis="1 0 0"/>
    <joint name="y" type="slide" axis="0 1 0"/>
    <geom type="cylinder" size="0.05 0.05" density="0.00001" condim="1"/></body>
</worldbody><actuator><motor joint="pan" ctrlrange="-2 2" ctrllimited="true"/></actuator>
</mujoco>"""


def scale_of(model: sm.Model) -> RobotScale:
    with sm.make_data(model) as data:
        sm.forward(model, data)
        return RobotScale.of(model, robot_points(model, data.xpos, data.site_xpos))


def raw(text: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def inertias_of(text: str) -> Array:
    """Return the diagonal of the mass matrix, from MuJoCo itself."""
    model, data = raw(text)
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full.diagonal()


def pushed(text: str, push: Array, seconds: float = 2.0) -> tuple[Array, Array]:
    """Return where joints and tip of an arm are after a constant force (nv,), by MuJoCo."""
    model, data = raw(text)
    data.qfrc_applied[:] = push
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    return data.qpos.copy(), data.site_xpos[0].copy()


def stepped(folder: Path, text: str, other: str) -> OneStep:
    left = model_of(folder, text, "left.xml")
    run = Rerun(left, lambda _: lambda _model, _data: (0.3, -0.4, 0.5), 0.4)
    return one_step(run, model_of(folder, other, "right.xml"))


def compared(experiment: str, *files: Path, engines: tuple[str, str] = ("mujoco", "mujoco")
             ) -> CompareResult:  # fmt: skip
    left, right = files[0], files[-1]
    sides = (Side(str(left), engines[0]), Side(str(right), engines[1]))
    return answer(CompareRequest(Request((experiment,), sides=sides), uncertainty=None))


def test_weight_and_size_are_those_of_what_moves(tmp_path: Path) -> None:
    scale = scale_of(model_of(tmp_path, ARM))
    model, _ = raw(ARM)
    assert scale.mass == pytest.approx(model.body_mass.sum(), rel=1e-12)
    assert scale.size == pytest.approx(0.4, rel=1e-9)
    scenery = ARM.replace("<worldbody>", '<worldbody><geom type="box" size="5 5 5" pos="9 9 9"/>')
    assert scale_of(model_of(tmp_path, scenery, "scenery.xml")) == scale


def test_one_body_is_as_large_as_its_shape(tmp_path: Path) -> None:
    scale = scale_of(model_of(tmp_path, WELDED))
    assert scale.size == pytest.approx(2 * np.sqrt(0.03**2 + 0.02**2 + 0.05**2), rel=1e-6)


@pytest.mark.parametrize("dof", range(3))
def test_a_force_at_its_floor_moves_nothing_that_can_be_seen(dof: int, tmp_path: Path) -> None:
    """Raw MuJoCo, 2 s with the servos on: the tip is within 0.1 µm, as is where each joint is."""
    scale = scale_of(model_of(tmp_path, ARM))
    push = np.zeros(3)
    push[dof] = inertias_of(ARM)[dof] * scale.angular_acceleration
    calm, calm_tip = pushed(ARM, np.zeros(3))
    moved, moved_tip = pushed(ARM, push)
    assert 0 < np.abs(moved - calm).max() < 1e-3 * 2 * np.pi / 4096
    assert np.linalg.norm(moved_tip - calm_tip) < 1e-7


def test_a_contact_force_at_its_floor_moves_a_robot_by_micrometres(tmp_path: Path) -> None:
    """Raw MuJoCo, without gravity and without anything that holds it, for 2 s."""
    scale = scale_of(model_of(tmp_path, WELDED))
    model, data = raw(WELDED.replace('<option timestep="0.002"', '<option gravity="0 0 0"'))
    model.eq_data[:], data.eq_active[:] = 0, 0
    data.qfrc_applied[0] = scale.force
    while data.time < 2:
        mujoco.mj_step(model, data)
    assert data.qpos[0] == pytest.approx(0.5 * 2.0**-23 * 9.81 * 2**2, rel=0.01)
    assert data.qpos[0] < 3e-6


REAL = {
    "a mass of 0.1 g more in the hand": ('mass="0.012"', 'mass="0.0121"', "mass matrix"),
    "a mass of 0.1 g more in the upper arm": ('mass="0.4"', 'mass="0.4001"', "mass matrix"),
    "a tip that is 1 µm farther": ('pos="0.02 0 0"', 'pos="0.020001 0 0"', "kinematics"),
    "a link that is 1 µm longer": ('pos="0.18 0 0"', 'pos="0.180001 0 0"', "kinematics"),
    "a servo that is stiffer by a thousandth": ('kp="0.01"', 'kp="0.01001"', "actuator"),
    "damping that is more by a thousandth": ('damping="1e-5"', 'damping="1.001e-5"', "passive"),
}


@pytest.mark.parametrize("what", REAL)
def test_a_small_real_difference_is_seen_in_one_step(what: str, tmp_path: Path) -> None:
    old, new, stage = REAL[what]
    assert ARM.count(old) == 1
    found = stepped(tmp_path, ARM, ARM.replace(old, new))
    assert found.first is not None
    assert found.first.stage == stage
    assert found.first.worst > max(found.first.floor, found.first.tolerance)


@pytest.mark.usefixtures("bullet")
def test_torques_that_are_rounding_alone_are_the_same(tmp_path: Path) -> None:
    left = model_of(tmp_path, WELDED)
    right = sm.load(left.path, backend="pybullet")
    found = one_step(Rerun(left, lambda _: None, 0.2), right)
    assert found.first is None
    model, data = raw(WELDED)
    torques: list[float] = []
    for _ in range(100):
        mujoco.mj_step(model, data)
        torques.append(float(np.abs(data.qfrc_bias[3:]).max()))
    assert 0 < max(torques) < 1e-25


@pytest.mark.usefixtures("bullet")
def test_the_parts_of_what_a_weld_does_are_told_by_both_engines(tmp_path: Path) -> None:
    left = model_of(tmp_path, WELDED)
    for model in (left, sm.load(left.path, backend="pybullet")):
        with sm.make_data(model) as data:
            sm.step(model, data, 50)
            parts = data.qfrc_contact + data.qfrc_friction + data.qfrc_limit + data.qfrc_equality
            assert np.allclose(parts, data.qfrc_constraint, atol=1e-9)
            assert data.qfrc_equality[2] > 4  # it carries the weight


@pytest.mark.usefixtures("bullet")
def test_a_force_on_what_weighs_nothing_is_no_difference(tmp_path: Path) -> None:
    file = written(tmp_path / "m.xml", DISC)
    with pytest.warns(EngineWarning, match="margin"):
        result = compared("hold", file, engines=("mujoco", "pybullet"))
    (force,) = (a for a in result.comparison.agreements if a.kind == "force")
    assert 1e-6 < force.max < force.tolerance  # what was the tolerance, and is
    assert force.verdict == "agrees"
    assert force.tolerance == pytest.approx(2.0**-23 * 9.81 * 8, rel=1e-4)


def test_a_force_of_a_gram_beside_a_heavy_robot_is_one(tmp_path: Path) -> None:
    """The robot weighs 8 kg: a ball of 1 g presses with 10,000 floors, and one of 2 g differs."""
    ball = DISC.replace('gravity="0 0 0"', "").replace(
        "</worldbody>",
        '<body name="ball" pos="-0.5 0 0.01"><freejoint/><geom type="sphere" size="0.01" '
        'mass="0.001"/></body></worldbody>',
    )
    one = written(tmp_path / "one.xml", ball)
    two = written(tmp_path / "two.xml", ball.replace('mass="0.001"', 'mass="0.002"'))
    agreements = compared("hold", one, two).comparison.agreements
    force = next(a for a in agreements if a.name.startswith("ball on table, normal"))
    assert force.verdict == "differs"
    assert force.settled == pytest.approx(0.001 * 9.81, rel=0.01)


def test_a_share_wins_where_it_is_above_the_floor() -> None:
    forces, robot = np.full(10, 3.0), RobotScale(mass=1.0, size=0.5)
    assert tolerance_of("force", forces, forces, 0.0, 0.002, None, robot).value == 0.05 * 3.0
    faint = np.full(10, 1e-7)
    floored = tolerance_of("force", faint, faint, 0.0, 0.002, None, robot)
    assert floored.value == robot.force
    assert "weight" in floored.reason
    still = np.zeros(10)
    energy = tolerance_of("energy", still, still, 0.0, 0.002, None, robot).value
    assert energy == robot.energy == pytest.approx(2.0**-23 * 9.81 * 0.5)


def test_a_robot_of_milligrams_has_a_floor_of_its_own() -> None:
    """A floor that were the same for all would call all that it does rounding."""
    gnat, forces = RobotScale(mass=1e-6, size=1e-3), np.full(10, 1e-5)
    other = tolerance_of("force", forces, 2 * forces, 0.0, 0.002, None, gnat)
    assert other.value == pytest.approx(0.05 * 2e-5)
