"""Figures of the path against plain MuJoCo, which knows nothing of this package."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.course.lessons.time import NAP
from statemachine.models import models_dir

from .support.pages import lesson_result
from .support.requirements import ROOT

_HOLD = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)


def _raw(scene: str) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Load a scene of the arm as MuJoCo's own users do."""
    model = mujoco.MjModel.from_xml_path(str(models_dir() / "so101" / f"{scene}.xml"))
    return model, mujoco.MjData(model)


def test_the_arm_is_nowhere_until_forward() -> None:
    found = lesson_result("nowhere", sm.load("so101/scene"))
    model, data = _raw("scene")
    assert found.first.tolist() == data.site("gripperframe").xpos.tolist() == [0, 0, 0]
    mujoco.mj_forward(model, data)
    assert found.second.tolist() == data.site("gripperframe").xpos.tolist()
    assert found.second.round(4).tolist() == [0.3914, -0.0010, 0.2463]


@pytest.mark.usefixtures("pinocchio")
def test_another_library_computes_the_same_fingertip() -> None:
    found = lesson_result("nowhere", sm.load("so101/scene"), further=True)
    assert found.witness.gap < 1e-12
    assert found.witness.fingertip == pytest.approx(found.second, abs=1e-12)


def test_what_the_servos_exert_is_what_plain_mujoco_gives() -> None:
    torques = lesson_result("hold", sm.load("so101/scene")).torques
    model, data = _raw("scene")
    data.ctrl[:] = _HOLD
    rows = []
    for _ in range(400):
        mujoco.mj_step(model, data)
        rows.append(data.qfrc_actuator.copy())
    assert torques.exerted.tolist() == np.array(rows).tolist()
    assert torques.most.max() == torques.common_limit == 2.94
    assert torques.last[model.joint("wrist_flex").dofadr[0]] == -2.94  # it presses on the floor
    assert torques.steps_at_limit == 400


def test_how_much_of_it_holds_the_arm_up() -> None:
    found = lesson_result("gravity", sm.load("so101/scene"), seconds=1.0)
    model, data = _raw("scene")
    for _ in range(200):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    assert found.servos_on.forces.actuator == data.qfrc_actuator[1]
    assert found.limit == model.actuator_forcerange[1, 1] == 2.94
    assert abs(found.servos_on.forces.actuator) / found.limit == pytest.approx(0.194, abs=1e-3)


def _swing(change: Callable[[int, mujoco.MjModel, mujoco.MjData, np.ndarray], None]) -> np.ndarray:
    """Run the swing of the lesson, and return qpos after each step.

    Args:
        change: Called before each step with its number and the command.
    """
    model, data = _raw("scene_box")
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.time = 0
    command = data.ctrl.copy()
    command[:2] += (0.4, -0.2)
    rows = [data.qpos.copy()]
    for k in range(600):
        change(k, model, data, command)
        if k == 0:
            rows[0] = data.qpos.copy()
        mujoco.mj_step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


def test_a_gap_of_one_step_grows_and_shrinks() -> None:
    def whole(k: int, _model: object, data: mujoco.MjData, command: np.ndarray) -> None:
        data.ctrl[:] = command

    def extra(k: int, model: mujoco.MjModel, data: mujoco.MjData, command: np.ndarray) -> None:
        data.ctrl[:] = command
        if k == 0:
            mujoco.mj_step(model, data)

    def late(k: int, _model: object, data: mujoco.MjData, command: np.ndarray) -> None:
        if k == 1:
            data.ctrl[:] = command

    found = lesson_result("replay", sm.load("so101/scene_box"))
    first = _swing(whole)
    assert found.identical
    for run, change in zip(found.breaks, (extra, late), strict=True):
        second = _swing(change)
        gap = np.abs(first - second).max(axis=1)
        assert run.gap.tolist() == gap.tolist()
        assert run.course == "shrinks"
        assert run.close == np.allclose(first[-1], second[-1])
        assert not np.array_equal(first[-1], second[-1])
    assert all(run.close for run in found.breaks)  # close enough misses both


def test_what_a_step_leaves_is_one_step_old() -> None:
    found = lesson_result("forward", sm.load("so101/scene"))
    model, data = _raw("scene")
    tip = data.site("gripperframe").xpos
    data.qpos[1] = found.value
    mujoco.mj_forward(model, data)
    before = tip.copy()
    mujoco.mj_step(model, data)
    left = tip.copy()
    mujoco.mj_forward(model, data)
    assert found.stepped.of_before
    assert left.tolist() == before.tolist()
    assert found.stepped.behind == float(np.linalg.norm(tip - left)) > 0


@pytest.mark.filterwarnings("ignore:Attach")
def test_a_crate_before_the_arm_parts_the_addresses() -> None:
    found = lesson_result("questions", sm.load("so101/scene_box"))
    here, _ = _raw("scene_box")
    assert here.jnt_qposadr.tolist() == here.jnt_dofadr.tolist()
    assert len(found.answers.state.joints) == here.njnt == 7
    spec = mujoco.MjSpec.from_file(str(models_dir() / "so101" / "scene_box.xml"))
    while spec.keys:  # a keyframe has one length of qpos
        spec.delete(spec.keys[0])
    crate = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body name='crate'><freejoint/><geom size='.05'/></body>"
        "<site name='rest'/></worldbody></mujoco>"
    )
    arm = crate.site("rest").attach_body(spec.body("base"), "", "")
    assert arm.name == "base"
    behind = crate.compile().joint(found.behind_crate.name)
    assert found.behind_crate.qpos_start == behind.qposadr[0] == 7
    assert found.behind_crate.qvel_start == behind.dofadr[0] == 6


def test_the_time_in_sleep_is_all_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    slept: list[float] = []
    sleep = time.sleep

    def timed(seconds: float) -> None:
        began = time.perf_counter()
        sleep(seconds)
        if seconds != NAP:  # the nap of the run without waiting
            slept.append(time.perf_counter() - began)

    monkeypatch.setattr(time, "sleep", timed)
    model = sm.load("so101/scene_box")
    found = lesson_result("time", model, steps=20, realtime=True, seconds=0.5)
    assert len(slept) >= 20
    assert found.waited == pytest.approx(sum(slept), rel=0.1, abs=0.02)
    assert found.waited <= found.paced


def test_the_time_of_the_lesson_is_a_sum_of_timesteps() -> None:
    found = lesson_result("time", sm.load("so101/scene_box"), steps=400)
    model, data = _raw("scene_box")
    for _ in range(400):
        mujoco.mj_step(model, data)
    assert found.end == data.time != 2.0
    assert (found.passed, found.moved, found.exact, found.identical) == (0, False, True, True)


@pytest.fixture(scope="module")
def summary() -> Any:
    """Return the result of the summary on the arm with a box."""
    return lesson_result("summary", sm.load("so101/scene_box"))


def test_the_summary_has_a_line_for_each_lesson_of_the_path(summary: Any) -> None:
    path = "nowhere objects state forward hold gravity reset replay time"
    assert list(summary.lines) == path.split()


def test_how_far_the_arm_sags_in_the_summary_is_what_plain_mujoco_gives(summary: Any) -> None:
    model, data = _raw("scene_box")
    mujoco.mj_step(model, data, 100)
    assert summary.sagged == data.qpos[1]
    assert summary.lines["gravity"].startswith(f"{np.degrees(data.qpos[1]):.3f}")


def test_the_sizes_and_the_restart_of_the_summary_are_those_of_the_model(summary: Any) -> None:
    model, _ = _raw("scene_box")
    assert (summary.nq, summary.nv) == (model.nq, model.nv) == (13, 12)
    assert summary.restart == model.key_time[0] == 6.0


def test_the_replay_of_the_summary_is_the_same_run(summary: Any) -> None:
    assert summary.same
    assert set(summary.changed_lines) <= {"time"}


def test_what_is_slow_to_load_is_counted() -> None:
    raw = mujoco.MjModel.from_xml_path(str(ROOT / "models" / "so101" / "scene.xml"))
    result = lesson_result("objects", sm.load("so101/scene"))
    assert (result.meshes, result.triangles) == (raw.nmesh, raw.mesh_facenum.sum())
