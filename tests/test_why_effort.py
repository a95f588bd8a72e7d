"""The effort limit of a URDF is a cause, though without it Euler diverges: the integrator first."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from statemachine.interface import Array
from statemachine.lab.compare import Request, Side
from statemachine.lab.questions.requests.causes import ExplainRequest, answer
from statemachine.lab.why import Explanation
from statemachine.lab.why.stiff_servos import has_stiff_servo, stiffness_of_servos

from .support.legged import written
from .support.requirements import need_engine

EULER = mujoco.mjtIntegrator.mjINT_EULER
IMPLICIT = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
KP, KV = 2000.0, 200.0
SECONDS = 0.6
LINK = (
    '<link name="{0}"><inertial><origin xyz="0 0 {1}"/><mass value="{2}"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>'
    '<origin xyz="0 0 {3}"/><axis xyz="0 1 0"/>'
    '<limit lower="-3" upper="3" effort="{effort}" velocity="10"/></joint>'
)


def _arm(effort: float) -> str:
    parts = [
        LINK.format("base", 0, 5),
        LINK.format("upper", 0.2, 5),
        LINK.format("fore", 0.15, 2),
        JOINT.format("shoulder", "base", "upper", 0.1, effort=effort),
        JOINT.format("elbow", "upper", "fore", 0.4, effort=effort),
    ]
    return f'<robot name="arm">{"".join(parts)}</robot>'


def _with_servos(urdf: Path, integrator: mujoco.mjtIntegrator) -> mujoco.MjSpec:
    """Return a URDF's arm with stiff servos."""
    spec = mujoco.MjSpec.from_file(str(urdf))
    for geom in list(spec.geoms):
        spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    for joint in list(spec.joints):
        drive = spec.add_actuator(name=f"{joint.name}_servo", target=joint.name)
        drive.trntype = mujoco.mjtTrn.mjTRN_JOINT
        drive.set_to_position(kp=KP, kv=KV)
        drive.ctrllimited, drive.ctrlrange = 1, [-3, 3]
    spec.option.integrator = integrator
    return spec


def _raw(urdf: Path, command: Array, *, limited: bool, euler: bool) -> Array:
    """Return qpos (n + 1, nq) of a run by plain MuJoCo; the rows until it diverges, if it does."""
    raw = _with_servos(urdf, EULER if euler else IMPLICIT).compile()
    if not limited:
        raw.jnt_actfrclimited[:] = 0
    data = mujoco.MjData(raw)
    data.ctrl[:] = command
    rows = [data.qpos.copy()]
    for _ in range(round(SECONDS / raw.opt.timestep)):
        mujoco.mj_step(raw, data)
        if data.warning.number.any():
            break
        rows.append(data.qpos.copy())
    return np.array(rows)


def _explained(folder: Path, urdf: Path) -> tuple[Explanation, Array]:
    """Explain the gap of an arm without a limit under implicitfast, and of its URDF under Euler.

    Returns:
        What explains it, and the command of the run.
    """
    spec = _with_servos(urdf, IMPLICIT)
    for joint in spec.joints:
        joint.actfrclimited = 0
    spec.compile()
    left = Side(str(written(folder, "left.xml", spec.to_xml())))
    right = Side(str(urdf), options={"meshes": False}).taking(["actuators"], left, {})
    run = Request(("hold",), sides=(left, right), seconds=SECONDS)
    result = answer(ExplainRequest(run, uncertainty=None))
    model = left.load()
    return result, run.scenario().on(model).controller(model, 0)(0.0, None)  # type: ignore[arg-type]


def _shares(result: Explanation) -> tuple[float | None, float | None]:
    """Return the shares of the force limit and of the integrator."""
    (limit,) = [row.share for row in result.shares if row.name.lower().startswith("force limit")]
    (integrator,) = [row.share for row in result.shares if row.name.lower() == "integrator"]
    return limit, integrator


def _check(folder: Path, urdf: Path) -> None:
    """Check the shares of an arm against plain MuJoCo."""
    result, command = _explained(folder, urdf)
    reference = _raw(urdf, command, limited=False, euler=False)
    as_they_come = np.abs(reference - _raw(urdf, command, limited=True, euler=True)).max()
    one_integrator = np.abs(reference - _raw(urdf, command, limited=True, euler=False)).max()
    assert len(_raw(urdf, command, limited=False, euler=True)) < len(reference)  # it diverges
    assert result.gap == pytest.approx(as_they_come, rel=1e-6)
    limit, integrator = _shares(result)
    assert limit == pytest.approx(one_integrator / as_they_come, abs=1e-6)
    assert integrator == pytest.approx(1 - one_integrator / as_they_come, abs=1e-6)
    assert limit is not None
    assert limit > 0.5


@pytest.mark.filterwarnings("ignore::statemachine.errors.EngineWarning")
def test_the_effort_of_a_urdf_is_a_cause_with_the_share_of_plain_mujoco(tmp_path):
    _check(tmp_path, written(tmp_path, "arm.urdf", _arm(30.0)))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::statemachine.errors.EngineWarning")
def test_the_effort_of_the_public_kuka_is_a_cause(tmp_path):
    need_engine("pybullet")
    import pybullet_data

    _check(tmp_path, Path(pybullet_data.getDataPath()) / "kuka_iiwa" / "model.urdf")


@pytest.mark.parametrize(("kv", "is_stiff"), [(1.0, False), (KV, True)])
def test_a_servo_is_stiff_where_its_damping_turns_the_speed_around(tmp_path, kv, is_stiff):
    text = (
        '<mujoco><option timestep="0.002"/><worldbody><body><joint name="j" axis="0 1 0"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>'
        f'<actuator><position joint="j" kp="100" kv="{kv}" gear="2"/></actuator></mujoco>'
    )
    model = Side(str(written(tmp_path, "one.xml", text))).load()
    assert stiffness_of_servos(model).tolist() == pytest.approx([kv * 4 * 0.002 / 0.1])
    assert has_stiff_servo(model) is is_stiff
