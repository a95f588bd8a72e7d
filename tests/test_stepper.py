"""The step of Pinocchio against that of MuJoCo, and what each of its terms is worth."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import DivergedError, MissingEngineError, UnsupportedError
from statemachine.interface import Array
from statemachine.lab.validate.stepper import ALL_TERMS, Stepper, StepTerms, bounded_force

pytestmark = pytest.mark.usefixtures("pinocchio")

STEPS = 400
TARGET = np.array([0.0, -0.6, 1.2, 0.5, 0.0, 0.6])  # [rad]; of the scenario hold
# Two hinges off their principal axes, one with a gear and a reference, and a slide.
LINKS = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.004" integrator="implicitfast"/>
  <worldbody>
    <body name="upper" euler="0.3 0.1 -0.4">
      <joint name="shoulder" axis="0 1 0.2" damping="0.2" armature="0.05" frictionloss="0.3"/>
      <inertial pos="0.1 0.02 -0.3" quat="0.9 0.1 0.2 0.3" mass="2" diaginertia="0.03 0.02 0.01"/>
      <body name="lower" pos="0 0.1 -0.6">
        <joint name="elbow" axis="1 0 0" ref="0.4" damping="0.1" frictionloss="0.1"
          solreffriction="0.05 0.7" solimpfriction="0.8 0.97 0.01"/>
        <inertial pos="0 0 -0.2" mass="1" diaginertia="0.01 0.01 0.002"/>
        <body name="rod" pos="0 0 -0.4">
          <joint name="slide" type="slide" axis="0 0 1" damping="3" frictionloss="0.5"
            solreffriction="-100 -30"/>
          <inertial pos="0.05 0 -0.1" mass="0.5" diaginertia="0.001 0.001 0.001"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="40" kv="2" gear="1.5" forcerange="-6 6"/>
    <position joint="elbow" kp="20" kv="0.5" ctrlrange="-0.5 0.5"/>
    <position joint="slide" kp="200" kv="4" forcerange="-3 3"/>
  </actuator>
</mujoco>
"""


@pytest.fixture
def arm() -> sm.Model:
    return sm.load("so101/scene").replace(contacts=False, limits=False)


def _written(folder: Path, text: str) -> sm.Model:
    path = folder / "robot.xml"
    path.write_text(text, encoding="utf-8")
    return sm.load(path)


def _stepped(model: sm.Model, ctrl: Array, terms: StepTerms = ALL_TERMS) -> Array:
    """Return the positions after each step (STEPS, nq) by Pinocchio."""
    stepper = Stepper(model, terms)
    stepper.ctrl[:] = ctrl
    positions: list[Array] = []
    for _ in range(STEPS):
        stepper.step()
        positions.append(stepper.qpos.copy())
    return np.array(positions)


def _raw(
    model: sm.Model, ctrl: Array, change: Callable[[mujoco.MjModel], None] | None = None
) -> Array:
    """Return the positions after each step (STEPS, nq) by plain MuJoCo, contact-free."""
    raw = mujoco.MjModel.from_xml_path(str(model.path))
    raw.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    raw.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    raw.opt.tolerance, raw.opt.iterations = 0.0, 100
    if change is not None:
        change(raw)
    data = mujoco.MjData(raw)
    data.ctrl[:] = ctrl
    positions: list[Array] = []
    for _ in range(STEPS):
        mujoco.mj_step(raw, data)
        positions.append(data.qpos.copy())
    return np.array(positions)


def _worst(left: Array, right: Array) -> float:
    return float(np.abs(left - right).max())


def test_the_hold_of_the_arm_is_that_of_implicitfast(arm: sm.Model) -> None:
    assert _worst(_stepped(arm, TARGET), _raw(arm, TARGET)) < 1e-9


def test_a_robot_with_a_slide_a_gear_and_a_reference_steps_alike(tmp_path: Path) -> None:
    model = _written(tmp_path, LINKS)
    ctrl = np.array([0.8, 0.9, 0.2])
    assert np.ptp(_raw(model, ctrl), axis=0).min() > 0.05
    assert _worst(_stepped(model, ctrl), _raw(model, ctrl)) < 1e-9


def test_explicit_servo_damping_is_the_step_of_euler(arm: sm.Model) -> None:
    def with_euler(raw: mujoco.MjModel) -> None:
        raw.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER

    terms = StepTerms(servo_damping="explicit")
    assert _worst(_stepped(arm, TARGET, terms), _raw(arm, TARGET, with_euler)) < 1e-9


def _without_gravity(raw: mujoco.MjModel) -> None:
    raw.opt.gravity[:] = 0.0


def _without_armature(raw: mujoco.MjModel) -> None:
    raw.dof_armature[:] = 0.0
    mujoco.mj_setConst(raw, mujoco.MjData(raw))  # the friction's softness depends on it


def _without_damping(raw: mujoco.MjModel) -> None:
    raw.dof_damping[:] = 0.0


def _without_stiffness(raw: mujoco.MjModel) -> None:
    raw.actuator_gainprm[:, 0] = 0.0
    raw.actuator_biasprm[:, 1] = 0.0


def _without_servo_damping(raw: mujoco.MjModel) -> None:
    raw.actuator_biasprm[:, 2] = 0.0


def _without_force_limits(raw: mujoco.MjModel) -> None:
    raw.actuator_forcelimited[:] = False


def _without_friction(raw: mujoco.MjModel) -> None:
    raw.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS


def _with_euler_and_explicit_damping(raw: mujoco.MjModel) -> None:
    raw.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    raw.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_EULERDAMP


# What plain MuJoCo is told for the same to be left out, or to be computed likewise.
LEFT_OUT = {
    "gravity": (StepTerms(gravity=False), _without_gravity),
    "armature": (StepTerms(armature=False), _without_armature),
    "damping": (StepTerms(damping="none"), _without_damping),
    "explicit damping": (
        StepTerms(damping="explicit", servo_damping="explicit"),
        _with_euler_and_explicit_damping,
    ),
    "servo stiffness": (StepTerms(servo_stiffness=False), _without_stiffness),
    "servo damping": (StepTerms(servo_damping="none"), _without_servo_damping),
    "force limits": (StepTerms(force_limits=False), _without_force_limits),
    "dry friction": (StepTerms(friction_loss=False), _without_friction),
}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_a_step_without_a_term_is_that_of_mujoco_without_it(name: str, arm: sm.Model) -> None:
    terms, change = LEFT_OUT[name]
    without = _stepped(arm, TARGET, terms)
    assert _worst(without, _raw(arm, TARGET, change)) < 1e-8
    assert _worst(without, _raw(arm, TARGET)) > 1e-3


def test_the_old_velocity_moves_positions_as_an_explicit_euler_step_does(arm: sm.Model) -> None:
    stepper = Stepper(arm, StepTerms(position_update="old velocity"))
    stepper.qvel[:] = [0.1, -0.2, 0.3, 0.4, 0.5, -0.6]
    before, velocity = stepper.qpos.copy(), stepper.qvel.copy()
    stepper.step()
    assert np.array_equal(stepper.qpos, before + arm.timestep * velocity)
    assert not np.array_equal(stepper.qvel, velocity)


def test_without_coriolis_forces_the_bias_is_that_of_a_robot_at_rest(arm: sm.Model) -> None:
    moving = Stepper(arm, StepTerms(coriolis=False))
    moving.qvel[:] = [1.0, -2.0, 3.0, 4.0, 5.0, -6.0]
    assert np.array_equal(moving.bias(), Stepper(arm).bias())
    with_all = Stepper(arm)
    with_all.qvel[:] = moving.qvel
    assert np.abs(with_all.bias() - moving.bias()).max() > 1e-3


def test_bounded_forces_solve_their_rows_or_are_at_their_limit() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        factor = rng.normal(size=(7, 5))
        compliance = factor.T @ factor + 0.1 * np.eye(5)
        target, limit = 10.0 * rng.normal(size=5), np.abs(rng.normal(size=5))
        force = bounded_force(compliance, target, limit, np.zeros(5), 0.0)
        missing = target - compliance @ force
        inside = np.abs(force) < limit
        assert (np.abs(force) <= limit).all()
        assert np.abs(missing[inside]).max(initial=0.0) < 1e-10
        # A force at its limit would be larger, and not smaller, without it.
        assert (missing[~inside] * force[~inside] >= 0).all()


def test_a_run_that_grows_without_bound_is_reported(arm: sm.Model) -> None:
    stepper = Stepper(arm.replace(timestep=0.5), StepTerms(damping="explicit"))
    stepper.ctrl[:] = TARGET
    stepper.qvel[:] = 1e150
    with pytest.raises(DivergedError), np.errstate(all="ignore"):
        stepper.step(100)


def test_the_joint_that_diverged_is_named(tmp_path: Path) -> None:
    """Nothing brakes a slide that is so fast that its position is no number after a step."""
    unbraked = re.sub(r' (damping|frictionloss)="\S+"', "", LINKS)
    stepper = Stepper(
        _written(tmp_path, unbraked).replace(timestep=10.0), StepTerms(coriolis=False)
    )
    stepper.qvel[2] = 1e308
    with pytest.raises(DivergedError, match=r"first at joint 2$"), np.errstate(all="ignore"):
        stepper.step(1)


REFUSED = {
    "contacts": {"limits": False},
    "joint limits": {"contacts": False},
    "servos that are switched off": {"contacts": False, "limits": False, "actuation": False},
}


@pytest.mark.parametrize("feature", REFUSED)
def test_what_the_step_leaves_out_is_refused(feature: str) -> None:
    model = sm.load("so101/scene").replace(**REFUSED[feature])
    with pytest.raises(UnsupportedError) as caught:
        Stepper(model)
    assert any(named.startswith(feature) for named in caught.value.features)


BODY = '<body><joint name="joint" {joint}/><inertial pos="0 0 -1" mass="1" diaginertia="1 1 1"/>'
WRITTEN = {
    "joint springs": BODY.format(joint='stiffness="2"') + "</body>",
    "free and ball joints": BODY.format(joint='type="ball"') + "</body>",
    "gravity compensation": BODY.replace("<body>", '<body gravcomp="1">').format(joint="")
    + "</body>",
}


@pytest.mark.parametrize("feature", WRITTEN)
def test_what_a_file_has_and_the_step_leaves_out_is_refused(feature: str, tmp_path: Path) -> None:
    model = _written(tmp_path, f"<mujoco><worldbody>{WRITTEN[feature]}</worldbody></mujoco>")
    with pytest.raises(UnsupportedError) as caught:
        Stepper(model)
    assert caught.value.feature == feature


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "discrete"])
def test_another_integrator_of_the_file_is_refused(integrator: str, tmp_path: Path) -> None:
    model = _written(tmp_path, LINKS.replace("implicitfast", integrator))
    with pytest.raises(UnsupportedError) as caught:
        Stepper(model)
    (feature,) = caught.value.features
    assert f"integrator {integrator} " in feature
    Stepper(model.replace(integrator="implicitfast"))


def test_a_file_without_an_integrator_is_refused_as_one_with_euler(tmp_path: Path) -> None:
    model = _written(tmp_path, LINKS.replace('integrator="implicitfast"', ""))
    with pytest.raises(UnsupportedError) as caught:
        Stepper(model)
    assert "integrator Euler " in caught.value.feature


def _flagged(flag: str, word: str) -> str:
    """Return the links with a flag of their file."""
    text = LINKS.replace(
        'integrator="implicitfast"/>', 'integrator="implicitfast"><flag/></option>'
    )
    return text.replace("<flag/>", f'<flag {flag}="{word}"/>')


FLAGS = (
    ("constraint", "disable"),
    ("frictionloss", "disable"),
    ("damper", "disable"),
    ("gravity", "disable"),
    ("clampctrl", "disable"),
    ("actuation", "disable"),
    ("refsafe", "disable"),
    ("diagexact", "enable"),
    ("sleep", "enable"),
)


@pytest.mark.parametrize(("flag", "word"), FLAGS)
def test_a_flag_of_the_file_that_changes_the_step_is_refused(
    flag: str, word: str, tmp_path: Path
) -> None:
    with pytest.raises(UnsupportedError) as caught:
        Stepper(_written(tmp_path, _flagged(flag, word)))
    assert caught.value.features == (f'the flag {flag}="{word}"',)


@pytest.mark.parametrize("flag", ["warmstart", "eulerdamp", "spring", "equality", "island"])
def test_a_flag_that_changes_nothing_of_the_step_is_taken(flag: str, tmp_path: Path) -> None:
    model = _written(tmp_path, _flagged(flag, "disable"))
    ctrl = np.array([0.8, 0.9, 0.2])
    assert _worst(_stepped(model, ctrl), _raw(model, ctrl)) < 1e-9


def test_a_flag_that_acts_on_nothing_of_the_robot_is_taken(tmp_path: Path) -> None:
    option = '<option integrator="implicitfast"><flag damper="disable"/></option>'
    body = f"{BODY.format(joint='')}</body>"
    model = _written(tmp_path, f"<mujoco>{option}<worldbody>{body}</worldbody></mujoco>")
    assert model.nv == 1
    Stepper(model)


def test_a_group_of_actuators_that_is_switched_off_is_refused(tmp_path: Path) -> None:
    text = LINKS.replace(
        'integrator="implicitfast"/>', 'integrator="implicitfast" actuatorgroupdisable="0"/>'
    )
    with pytest.raises(UnsupportedError) as caught:
        Stepper(_written(tmp_path, text))
    assert len(caught.value.features) == 1


def test_a_motor_is_refused(tmp_path: Path) -> None:
    text = (
        f"<mujoco><worldbody>{BODY.format(joint='')}</body></worldbody>"
        '<actuator><motor joint="joint"/></actuator></mujoco>'
    )
    with pytest.raises(UnsupportedError) as caught:
        Stepper(_written(tmp_path, text))
    assert "actuators" in caught.value.feature


def test_without_pinocchio_the_error_names_what_to_install(
    arm: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pinocchio", None)
    with pytest.raises(MissingEngineError, match="pip install"):
        Stepper(arm)


@pytest.mark.usefixtures("bullet")
def test_a_model_of_pybullet_is_stepped_by_the_same_numbers(arm: sm.Model) -> None:
    other = sm.load("so101/scene", backend="pybullet").replace(contacts=False, limits=False)
    assert np.array_equal(_stepped(other, TARGET), _stepped(arm, TARGET))
