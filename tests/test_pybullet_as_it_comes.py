"""PyBullet as it comes, between its own settings and the model's, by closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.engines import raw_engine_of
from statemachine.engines.records import Dials
from statemachine.interface import Array

from .support.files import written
from .support.small_models import mjcf

pytestmark = pytest.mark.usefixtures("bullet")

# A pendulum with a servo beside a stone; the pendulum's centre is 0.3 m from its axis.
PENDULUM = (
    '<body name="stone" pos="3 0 9"><freejoint name="stone"/>'
    '<inertial pos="0 0 0" mass="2" diaginertia=".1 .1 .1"/><geom size=".05" mass="0"/></body>'
    '<body name="arm" pos="0 0 1"><joint name="j" axis="0 1 0" damping=".5" range="-40 40"/>'
    '<inertial pos=".3 0 0" mass="1" diaginertia=".01 .01 .01"/><geom size=".05" mass="0"/></body>'
)
SERVO = '<actuator><position joint="j" kp="20" kv="1"/></actuator>'
INERTIA = 1.0 * 0.3**2 + 0.01
TORQUE = 1.0 * 9.81 * 0.3
# As it comes, the engine takes the inertia of the box around a shape, with a margin of 1 mm.
OF_SHAPES = 1.0 * 0.3**2 + 2 / 3 * 0.051**2
STEP = 1 / 240  # [s] of the engine as it comes


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The pendulum and the stone, as a file."""
    text = mjcf(PENDULUM, SERVO, '<compiler boundmass="1e-9"/><option timestep="0.002"/>')
    return written(tmp_path / "m.xml", text)


@pytest.fixture
def model(file: Path) -> sm.Model:
    """The pendulum and the stone on the engine as it comes."""
    return sm.load(file, backend="pybullet", defaults="engine")


def room() -> Any:
    """Return the room of the engine."""
    return raw_engine_of("pybullet")


def test_joints_and_free_bodies_have_their_names_in_the_engine(model: sm.Model) -> None:
    found = {term.thing: (term.ours, term.engine) for term in room().terms(model)}
    body = {thing: engine for thing, (_, engine) in found.items()}["joint j"].rpartition(" ")[2]
    assert found["joint j"] == ("qpos[7]", f"joint 0 of body {body}")
    assert found["stone, turned by 90° about z"] == (
        "w x y z: 0.7071 0 0 0.7071",
        "x y z w: 0 0 0.7071 0.7071",
    )
    assert found["stone, spinning about its x"] == ("own axes: 1 0 0", "world axes: 0 1 0")
    assert found["position of arm"] == ("its frame", "its centre of mass, 300.0 mm away")


@pytest.fixture
def alone(file: Path) -> Any:
    """The pendulum that nobody commands, in each of four ways, after a tenth of a second."""
    model = sm.load(file, backend="pybullet")
    return room().uncommanded_joint(model, 0.1, model.joint_id("j"))


def test_the_motor_holds_the_pendulum_as_loaded(alone: Any) -> None:
    as_loaded, with_gravity, _, _ = alone
    assert (as_loaded.position, as_loaded.motor) == pytest.approx((0, 0), abs=1e-6)
    assert with_gravity.position == pytest.approx(0, abs=1e-3)
    assert abs(with_gravity.motor) == pytest.approx(TORQUE, rel=1e-2)


def test_without_its_motor_the_pendulum_falls(alone: Any) -> None:
    *_, limp, undamped = alone
    # The parabola of the first moment, in 24 semi-implicit steps.
    parabola = 0.5 * TORQUE / OF_SHAPES * 0.1**2 * 25 / 24
    assert undamped.position == pytest.approx(parabola, rel=0.01)
    assert 0.7 * undamped.position < limp.position < undamped.position
    assert (limp.motor, undamped.motor) == (0, 0)


def test_each_run_says_how_long_and_how_far(alone: Any) -> None:
    for run in alone:
        assert (run.steps, run.time) == (24, pytest.approx(24 * STEP))
        assert run.gravity == 0
        assert run.widest == pytest.approx(abs(run.position))
    assert [run.turns for run in alone[2:]] == [0, 0]


def test_the_damping_that_is_applied_explicitly(alone: Any) -> None:
    explicit = [run.explicit for run in alone]
    assert explicit[:3] == pytest.approx([0.5 / OF_SHAPES * STEP] * 3, rel=1e-3)
    assert explicit[3] == pytest.approx(0, abs=1e-9)


def test_a_new_client_repeats_a_run_to_the_bit(model: sm.Model) -> None:
    ways = {way.name: way.difference for way in room().restore_methods(model)}
    assert ways["a new client, loaded again"] == 0
    assert [*ways][1] == "resetJointState, resetBase… to the start"
    assert all(math.isfinite(difference) for difference in ways.values())
    assert len(ways) == 4


# Dials.


@pytest.fixture
def dials(model: sm.Model) -> Dials:
    """What can be set in the engine's own way or in the model's."""
    found = room().dials(model, {})
    assert found is not None
    return found


VALUES: dict[str, Any] = {
    "gravity": np.array([0.0, 0.0, -9.81]),
    "timestep": (0.002, 1),
    "armature": np.zeros(7),
    "damping": np.array([0.0] * 6 + [0.5]),
    "frictionloss": np.zeros(7),
}


def moved(model: sm.Model, steps: int, **start: Array) -> tuple[Array, Array]:
    """Return where a state goes in some steps."""
    with sm.make_data(model) as data:
        for name, values in start.items():
            getattr(data, name)[:] = values
        sm.step(model, data, steps)
        return data.qpos.copy(), data.qvel.copy()


def state(stone: float = 0.0, joint: float = 0.0, speed: float = 0.0) -> dict[str, Array]:
    """Return a state: the speed of the stone along x, and the joint with its speed."""
    qpos = np.array([3.0, 0, 9, 1, 0, 0, 0, joint])
    qvel = np.array([stone, 0, 0, 0, 0, 0, speed])
    return {"qpos": qpos, "qvel": qvel}


def test_a_model_that_is_not_as_the_engine_comes_has_no_dials(file: Path) -> None:
    assert room().dials(sm.load(file, backend="pybullet"), {}) is None
    assert room().dials(sm.load(file), {}) is None


@pytest.mark.parametrize(("setting", "acceleration"), [(None, 0.0), ("off", 0.0), ("model", -9.81)])
def test_gravity_is_the_models_where_it_is_turned_to_it(
    dials: Dials, setting: Any, acceleration: float
) -> None:
    built = dials.build({} if setting is None else {"gravity": setting}, VALUES)
    _, qvel = moved(built, 1, **state())
    assert qvel[2] == pytest.approx(acceleration * built.timestep, abs=1e-3)


def test_the_timestep_is_the_models_where_it_is_turned_to_it(dials: Dials) -> None:
    assert dials.build({}, VALUES).timestep == pytest.approx(STEP)
    built = dials.build({"timestep": "model"}, VALUES)
    assert (built.timestep, built.substeps) == (0.002, 1)


@pytest.mark.parametrize(
    ("turned", "kept"), [({}, 0.925), ({"damping": "off"}, 1.0), ({"damping": "model"}, 1.0)]
)
def test_a_stone_loses_its_speed_as_the_engine_comes(
    dials: Dials, turned: Any, kept: float
) -> None:
    _, qvel = moved(dials.build(turned, VALUES), 240, **state(stone=1.0))
    assert qvel[0] == pytest.approx(kept, abs=2e-3)


@pytest.mark.parametrize("servo", [{}, {"servo": "model"}])
def test_a_joint_may_leave_its_range_where_limits_are_off(dials: Dials, servo: Any) -> None:
    """The command is 1.5 rad, and the range ends at 40°."""
    start = {**state(joint=0.6), "ctrl": np.array([1.5])}
    inside, _ = moved(dials.build(servo, VALUES), 60, **start)
    beyond, _ = moved(dials.build({**servo, "limits": "off"}, VALUES), 60, **start)
    assert inside[7] < math.radians(40) + 0.1
    assert beyond[7] > 1.0


def test_with_the_law_of_the_servo_its_gain_acts(dials: Dials) -> None:
    built = dials.build({"servo": "model", "timestep": "model", "inertia": "model"}, VALUES)
    _, qvel = moved(built, 1, **state(joint=0.1))
    assert qvel[6] == pytest.approx(-20 * 0.1 * 0.002 / INERTIA, rel=1e-6)


def test_every_body_has_the_friction_of_a_fresh_one(dials: Dials) -> None:
    assert set(dials.frictions.tolist()) == {0.5}
    assert dials.self_pairs == 0
    assert dials.words["limits"] == "hard"
