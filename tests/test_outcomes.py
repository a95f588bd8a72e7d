"""What came of the run of a robot that floats: fell, distance travelled, tracking error."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.interface import Array, Data, Model
from statemachine.lab.compare.agreement import Comparison, compare
from statemachine.lab.compare.outcomes import DISTANCE, FELL, TRACKING, outcomes_of_run
from statemachine.lab.recordings import Rerun, Trace

from .support.backends import BOTH
from .support.legged import mjcf, written
from .support.requirements import need_engine

SECONDS, STEP = 1.0, 0.002
PUSH = (0.4, 0.0, 1.5, 9.0, 0.0, 0.0)  # m/s and rad/s: it jumps forward, and turns over


def _swing(_model: Model, data: Data) -> Array:
    return 0.5 * np.sin(6.0 * data.time + np.arange(4))


def _run(model: Model, qvel: tuple[float, ...] = PUSH, seconds: float = SECONDS) -> Trace:
    velocity = np.zeros(model.nv)
    velocity[:6] = qvel
    return Rerun(model, lambda _: _swing, seconds, qvel=velocity).record()


def _model(folder: Path, backend: str = "mujoco", kp: float = 100.0, mass: float = 6.0) -> Model:
    return sm.load(written(folder, "robot.xml", mjcf(kp=kp, mass=mass)), backend)


def _raw(folder: Path, qvel: tuple[float, ...]) -> tuple[Array, Array]:
    """Return qpos (n + 1, nq) and ctrl (n, nu) of the same run by plain MuJoCo."""
    raw = mujoco.MjModel.from_xml_string(mjcf())
    data = mujoco.MjData(raw)
    data.qvel[:6] = qvel
    positions, commands = [data.qpos.copy()], []
    for step in range(round(SECONDS / STEP)):
        data.ctrl[:] = 0.5 * np.sin(6.0 * step * STEP + np.arange(4))
        commands.append(data.ctrl.copy())
        mujoco.mj_step(raw, data)
        positions.append(data.qpos.copy())
    return np.array(positions), np.array(commands)


def _fallen(pose: Array, start: Array) -> bool:
    turned, mat, mat_at_start = np.zeros(4), np.zeros(9), np.zeros(9)
    mujoco.mju_copy(turned, pose[3:7])
    mujoco.mju_quat2Mat(mat, turned)
    mujoco.mju_quat2Mat(mat_at_start, start[3:7].copy())
    tilt = np.arccos(np.clip(mat[6:] @ mat_at_start[6:], -1, 1))
    return bool(pose[2] < start[2] / 3 or tilt > np.pi / 2)


def test_the_outcomes_of_a_run_are_those_of_plain_mujoco(tmp_path):
    outcomes = outcomes_of_run(_run(_model(tmp_path)), SECONDS)
    positions, commands = _raw(tmp_path, PUSH)
    falls = [row for row, qpos in enumerate(positions) if _fallen(qpos, positions[0])]
    assert falls
    assert outcomes[FELL] == pytest.approx(falls[0] * STEP)
    gone = np.hypot(*(positions[-1, :2] - positions[0, :2]))
    assert outcomes[DISTANCE] == pytest.approx(gone, rel=1e-9)
    apart = commands - positions[1:, 7:]
    assert outcomes[TRACKING] == pytest.approx(np.sqrt((apart**2).mean()), rel=1e-9)


@pytest.mark.parametrize("backend", BOTH)
def test_a_robot_that_stands_has_not_fallen(tmp_path, backend):
    need_engine(backend)
    assert outcomes_of_run(_run(_model(tmp_path, backend), qvel=(0,) * 6), SECONDS)[FELL] is None


def test_a_robot_that_starts_on_its_back_has_not_turned_over(tmp_path):
    model = _model(tmp_path)
    start = np.zeros(model.nq)
    start[:7] = 0.0, 0.0, 0.06, 0.0, 1.0, 0.0, 0.0
    trace = Rerun(model, lambda _: None, 0.2, qpos=start).record()
    assert outcomes_of_run(trace, 0.2)[FELL] is None


def test_only_what_is_compared_counts(tmp_path):
    trace = _run(_model(tmp_path))
    assert outcomes_of_run(trace, 0.05)[FELL] is None


def _compared(
    folder: Path, seconds: float = SECONDS, kp: float = 100.0, mass: float = 6.0
) -> Comparison:
    left = _run(_model(folder), seconds=seconds)
    return compare(left, _run(_model(folder, kp=kp, mass=mass), seconds=seconds))


@pytest.fixture
def left_falls(tmp_path: Path) -> Comparison:
    """Return the comparison of a robot that falls with one that stands."""
    return compare(_run(_model(tmp_path)), _run(_model(tmp_path), qvel=(0,) * 6))


def test_where_one_side_falls_the_sides_differ(left_falls: Comparison) -> None:
    (fell,) = [outcome for outcome in left_falls.outcomes if outcome.name == FELL]
    assert fell.left is not None
    assert fell.right is None
    assert fell.is_on_one_side
    assert fell.verdict == "differs"


def test_where_one_side_falls_the_gap_is_until_the_end(left_falls: Comparison) -> None:
    (fell,) = [outcome for outcome in left_falls.outcomes if outcome.name == FELL]
    assert fell.left is not None
    assert fell.difference == pytest.approx(left_falls.until - fell.left)
    (gap,) = [gap for gap in left_falls.agreements if gap.name == FELL]
    assert (gap.max, gap.unit, gap.verdict) == (fell.difference, "s", "differs")
    assert gap.note


def test_the_same_run_has_the_same_outcomes(tmp_path):
    outcomes = _compared(tmp_path).outcomes
    assert [outcome.name for outcome in outcomes] == [FELL, DISTANCE, TRACKING]
    assert {outcome.verdict for outcome in outcomes} == {"agrees"}
    assert {outcome.difference for outcome in outcomes} == {0.0}


def test_the_tolerance_of_a_distance_is_a_hundredth_of_it(tmp_path):
    (distance,) = [o for o in _compared(tmp_path, mass=7.0).outcomes if o.name == DISTANCE]
    assert distance.left is not None
    assert distance.right is not None
    assert distance.tolerance == pytest.approx(0.01 * max(distance.left, distance.right))


def test_the_pose_of_the_base_is_farthest_beyond_though_a_joint_is_by_more_tolerances(tmp_path):
    comparison = _compared(tmp_path, 0.1, kp=90.0)
    most = max(comparison.agreements, key=lambda gap: gap.tolerances())
    assert most.kind not in ("base", "base rotation")
    assert comparison.worst is not None
    assert comparison.worst.kind in ("base", "base rotation")


def test_a_robot_on_a_fixed_base_has_no_outcomes(tmp_path):
    path = written(tmp_path, "robot.xml", mjcf(""))
    trace = Rerun(sm.load(path), lambda _: _swing, 0.1).record()
    assert compare(trace, trace).outcomes == ()


def test_a_box_that_flies_alone_is_no_robot(tmp_path):
    text = "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    trace = Rerun(sm.load(written(tmp_path, "box.xml", text)), lambda _: None, 0.1).record()
    comparison = compare(trace, trace)
    assert comparison.outcomes == ()
    assert {gap.kind for gap in comparison.agreements} >= {"body", "body rotation"}
