"""Whether a body, or a joint, that nothing brakes keeps its speed."""

from __future__ import annotations

from ...installed import require
from . import Figure, Finding, Findings, Question
from ._bullet import load, world
from ._lacking import lacking
from ._marked import MJCF, URDF
from ._pendulum import MJCF as PENDULUM
from ._pendulum import URDF as PENDULUM_URDF

QUESTION = Question(
    "Nothing brakes: does a body keep its speed, and a fast joint?",
    "Energy that an engine takes away by default looks like friction of the robot. What is cut "
    "off at some speed looks like a motor's limit.",
)
_SECONDS = 1.0
_FAST = 200.0  # rad/s
_SAME = 1e-6


def _kept(of: str, start: float, end: float) -> Finding:
    share = end / start
    answer = "keeps it" if abs(share - 1) < _SAME else f"loses {100 * (1 - share):.1f} % in 1 s"
    return Finding(answer, (Figure("left after 1 s", share),), of)


def _cut(end: float) -> Finding:
    answer = "keeps it" if abs(end / _FAST - 1) < 1e-3 else f"cut to {end:.3g} rad/s"
    return Finding(answer, (Figure("one step after", end, "rad/s"),), "a joint at 200 rad/s")


def mujoco() -> Findings:
    """A free body for a second; a joint for a step."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF)
    data = mj.MjData(model)
    data.qvel[0] = 1
    mj.mj_step(model, data, round(_SECONDS / model.opt.timestep))
    joint = mj.MjModel.from_xml_string(PENDULUM % "")
    joint.opt.gravity[:] = 0
    turning = mj.MjData(joint)
    turning.qvel[0] = _FAST
    mj.mj_step(joint, turning)
    return _kept("a body at 1 m/s", 1.0, float(data.qvel[0])), _cut(float(turning.qvel[0]))


def pybullet() -> Findings:
    """As loadURDF leaves them; of the joint, the motor is switched off."""
    with world() as (pb, client):
        body = load(pb, client, URDF)
        pb.resetBaseVelocity(body, (1, 0, 0), (0, 0, 0), client)
        step = pb.getPhysicsEngineParameters(client)["fixedTimeStep"]
        for _ in range(round(_SECONDS / step)):
            pb.stepSimulation(client)
        end = pb.getBaseVelocity(body, client)[0][0]
    with world() as (pb, client):
        body = load(pb, client, PENDULUM_URDF, fixed=True)
        pb.setJointMotorControl2(body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)
        pb.resetJointState(body, 0, 0, _FAST, physicsClientId=client)
        pb.stepSimulation(client)
        fast = pb.getJointState(body, 0, client)[1]
    return _kept("a body at 1 m/s", 1.0, end), _cut(fast)


def pinocchio() -> Findings:
    """Whether it steps at all."""
    return (lacking(require("pinocchio"), "step", "simul"),)
