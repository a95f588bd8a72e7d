"""`compare --why` measures a robot that floats by its base, and by an outcome where it is asked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import UnknownNameError
from statemachine.interface import Array
from statemachine.lab.runs.scenarios import Scenario, scenario
from statemachine.lab.why import Explanation, WhyRequest, explain

from .support.legged import mjcf, written

SECONDS, STEP = 0.3, 0.002
HOLD = replace(scenario("hold"), seconds=SECONDS)
LEFT, SOFTER, RIGHT = (100.0, 6.0), (80.0, 6.0), (80.0, 7.0)  # kp and mass of the trunk


def _text(robot: tuple[float, float]) -> str:
    kp, mass = robot
    return mjcf(kp=kp, mass=mass)


def _why(folder: Path, quantity: str | None = None, what: Scenario = HOLD) -> Explanation:
    left = sm.load(written(folder, "left.xml", _text(LEFT)))
    right = sm.load(written(folder, "right.xml", _text(RIGHT)))
    return explain(WhyRequest(left, right, what, quantity=quantity, uncertain=None))


def _raw(ctrl: Array, robot: tuple[float, float]) -> tuple[Array, Array]:
    """Return qpos (n + 1, nq) of a run by plain MuJoCo, and its command (nu,)."""
    raw = mujoco.MjModel.from_xml_string(_text(robot))
    data = mujoco.MjData(raw)
    data.ctrl[:] = ctrl
    positions = [data.qpos.copy()]
    for _ in range(round(SECONDS / STEP)):
        mujoco.mj_step(raw, data)
        positions.append(data.qpos.copy())
    return np.array(positions), ctrl


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """Return what `hold` commands."""
    path = written(tmp_path_factory.mktemp("model"), "left.xml", mjcf())
    model = sm.load(path)
    with sm.make_data(model) as data:
        sm.reset(model, data)
        return np.array(HOLD.controller(model, 0)(model, data))


def test_the_base_is_measured_unless_another_quantity_is_asked_for(tmp_path, command):
    result = _why(tmp_path)
    assert result.quantity in ("base", "base, rotation")
    left, right = (_raw(command, robot)[0] for robot in (LEFT, RIGHT))
    gap = np.linalg.norm(left[:, :3] - right[:, :3], axis=1).max()
    assert result.first["base"].worst == pytest.approx(gap, rel=1e-6)


def _share_alone(result: Explanation, subject: str) -> float | None:
    (row,) = [row for row in result.shares if row.name.lower().startswith(subject)]
    return row.alone


@pytest.mark.parametrize(("quantity", "axis"), [("base x", 0), ("base z", 2)])
def test_an_axis_of_the_base_is_explained_as_plain_mujoco_has_it(tmp_path, command, quantity, axis):
    result = _why(tmp_path, quantity)
    left, mass_alone, right = (_raw(command, robot)[0][:, axis] for robot in (LEFT, SOFTER, RIGHT))
    gap = np.abs(left - right).max()
    assert result.quantity == quantity
    assert result.gap == pytest.approx(gap, rel=1e-6)
    share = 1 - np.abs(left - mass_alone).max() / gap
    assert _share_alone(result, "mass") == pytest.approx(share, abs=1e-6)


def test_a_tracking_error_is_explained_as_plain_mujoco_has_it(tmp_path, command):
    result = _why(tmp_path, "tracking error")

    def error(robot: tuple[float, float]) -> float:
        positions, ctrl = _raw(command, robot)
        return float(np.sqrt(np.mean((ctrl - positions[1:, 7:]) ** 2)))

    gap = abs(error(LEFT) - error(RIGHT))
    assert result.unit == "rad"
    assert result.gap == pytest.approx(gap, rel=1e-6)
    share = 1 - abs(error(LEFT) - error(SOFTER)) / gap
    assert _share_alone(result, "mass") == pytest.approx(share, abs=1e-6)


def test_a_distance_travelled_is_explained_as_plain_mujoco_has_it(tmp_path, command):
    result = _why(tmp_path, "distance travelled")

    def distance(robot: tuple[float, float]) -> float:
        positions, _ = _raw(command, robot)
        return float(np.hypot(*(positions[-1, :2] - positions[0, :2])))

    assert result.gap == pytest.approx(abs(distance(LEFT) - distance(RIGHT)), rel=1e-6)


def test_who_falls_earlier_is_explained(tmp_path):
    # Without servos both fall to where gravity takes them; a lower gravity takes longer.
    fall = replace(scenario("fall"), seconds=0.4)
    left = sm.load(written(tmp_path, "left.xml", mjcf()))
    right = sm.load(written(tmp_path, "right.xml", mjcf()), gravity=[0, 0, -5.0])
    result = explain(WhyRequest(left, right, fall, quantity="fell", uncertain=None))
    falls = [np.sqrt(2 * (2 / 3) * 0.305 / gravity) for gravity in (9.81, 5.0)]
    assert result.unit == "s"
    assert result.gap == pytest.approx(falls[1] - falls[0], abs=2 * STEP)
    (row,) = result.shares
    assert row.share == pytest.approx(1.0)


def test_an_outcome_is_no_quantity_of_a_robot_that_is_fixed(tmp_path):
    models = [sm.load(written(tmp_path, f"{kp}.xml", mjcf("", kp=kp))) for kp in (90.0, 100.0)]
    with pytest.raises(UnknownNameError):
        explain(WhyRequest(models[0], models[1], HOLD, quantity="fell", uncertain=None))
