"""MotrixSim's own functions beside the backend's, and gains it is given, by closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines import raw_engine_of

from .support.files import written
from .support.motions import opened
from .support.requirements import need_engine
from .support.small_models import CART

STEP, MASS = 0.002, 2.0
SERVO = '<position name="s" joint="rail" kp="20" kv="3"/>'
GENERAL = (
    '<general name="s" joint="rail" biastype="affine" gainprm="20" biasprm="0 -20 -3"'
    ' gaintype="fixed"/>'
)


@pytest.fixture(autouse=True)
def motrix() -> Any:
    need_engine("motrix")
    return raw_engine_of("motrix")


@pytest.mark.parametrize("actuator", [SERVO, GENERAL])
@pytest.mark.parametrize(
    ("options", "kp", "kv"),
    [({}, 20.0, 3.0), ({"kp": 50.0}, 50.0, 3.0), ({"kv": 7.0}, 20.0, 7.0)],
)
def test_a_servo_pushes_by_the_gains_that_it_is_given(
    actuator: str, options: dict[str, float], kp: float, kv: float, tmp_path: Path
) -> None:
    file = written(tmp_path / "cart.xml", CART.format(actuators=actuator))
    model = sm.load(file, backend="motrix").replace(**options)
    qpos, qvel, ctrl = 0.1, 0.4, 0.6
    with opened(model, qpos=[qpos, 0], qvel=[qvel, 0], ctrl=[ctrl], nstep=1) as (_, data):
        gained = data.qvel[0] - qvel
    force = kp * (ctrl - qpos) - kv * qvel
    # It takes the damping of a servo at the end of the step.
    assert gained == pytest.approx(force * STEP / (MASS + STEP * kv), rel=5e-4)


def test_the_gains_of_a_model_are_those_that_it_was_given(tmp_path: Path) -> None:
    file = written(tmp_path / "cart.xml", CART.format(actuators=SERVO))
    model = sm.load(file, backend="motrix").replace(kp=50.0, kv=7.0)
    assert (model.actuator_kp.tolist(), model.actuator_kv.tolist()) == ([50.0], [7.0])


@pytest.mark.parametrize("keyframe", [None, 0])
def test_a_plain_run_moves_as_the_equation_of_motion_says(
    keyframe: int | None, tmp_path: Path, motrix: Any
) -> None:
    motor = CART.format(actuators='<motor name="m" joint="rail"/>')
    key = '<keyframe><key qpos="0.3 -0.2" qvel="0.5 0.1"/></keyframe></mujoco>'
    file = written(tmp_path / "cart.xml", motor.replace("</mujoco>", key))
    forces = np.array([[1.0], [2.0], [-3.0], [0.5]])
    rows = motrix.plain_run(file, forces, keyframe)
    place, speed = (0.3, 0.5) if keyframe == 0 else (0.0, 0.0)
    expected = [(place, speed)]
    for force in forces[:, 0]:
        speed += STEP * force / MASS
        place += STEP * speed
        expected.append((place, speed))
    np.testing.assert_allclose(rows[:, [0, 2]], expected, atol=1e-5)
    assert rows.shape == (5, 4)


def test_of_a_urdf_there_is_no_plain_run(tmp_path: Path, motrix: Any) -> None:
    assert motrix.plain_run(tmp_path / "a.URDF", np.zeros((1, 1)), None) is None


def test_a_new_scene_data_in_the_same_state_has_the_same_future(motrix: Any) -> None:
    ways = motrix.restore_methods(sm.load("so101/scene_box", backend="motrix"))
    assert (len(ways), ways[0].difference) == (3, 0.0)


def test_what_is_written_back_in_a_contact_has_another_future(motrix: Any) -> None:
    _, same, new = motrix.restore_methods(sm.load("so101/scene_box", backend="motrix"))
    for way in (same, new):
        assert 0 < way.difference < 1
        assert "25 steps" in way.name


def test_what_meets_nothing_has_the_same_future_when_it_is_written_back(
    tmp_path: Path, motrix: Any
) -> None:
    key = '<keyframe><key qpos="0.3 0" qvel="0.5 0.1" ctrl="0.2"/></keyframe></mujoco>'
    text = CART.format(actuators=SERVO).replace("</mujoco>", key)
    file = written(tmp_path / "cart.xml", text)
    ways = motrix.restore_methods(sm.load(file, backend="motrix"))
    assert [way.difference for way in ways] == [0.0, 0.0, 0.0]


def test_a_data_of_the_engine_starts_where_it_is_put(tmp_path: Path) -> None:
    from statemachine.engines.motrix.plain_runs import data_in

    file = written(tmp_path / "cart.xml", CART.format(actuators=SERVO))
    model = sm.load(file, backend="motrix")
    data = data_in(model, np.array([0.1, 0.2]), np.array([0.3, 0.4]), np.array([0.5]))
    np.testing.assert_allclose(data.dof_pos, (0.1, 0.2), rtol=1e-6)
    np.testing.assert_allclose(data.dof_vel, (0.3, 0.4), rtol=1e-6)
    np.testing.assert_allclose(data.actuator_ctrls, (0.5,), rtol=1e-6)


def test_a_model_of_another_engine_has_no_data_of_it() -> None:
    from statemachine.engines.motrix.plain_runs import data_in

    model = sm.load("so101")
    with pytest.raises(TypeError):
        data_in(model, np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nu))


def test_a_joint_has_its_place_in_the_interface_and_in_the_engine(
    tmp_path: Path, motrix: Any
) -> None:
    model = sm.load(written(tmp_path / "cart.xml", CART.format(actuators="")), backend="motrix")
    term = motrix.terms(model)[0]
    assert (term.thing, term.ours, term.engine) == ("joint rail", "qpos[0]", "dof_pos[0]")
