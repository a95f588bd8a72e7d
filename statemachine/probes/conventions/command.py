"""For how long a command that is given once acts."""

from __future__ import annotations

from collections.abc import Callable

from ...installed import require
from . import UNDECIDED, Figure, Finding, Findings, Question
from ._bullet import load, world
from ._lacking import lacking
from ._pendulum import MJCF, URDF

QUESTION = Question(
    "You command once, and step twice: does the command still act?",
    "A command that lasts one step has to be given before every step; one that stays has to be "
    "taken back.",
)
_TORQUE = 1.0  # N·m


def _found(of: str, speed: Callable[[], float], step: Callable[[], None]) -> Finding:
    """From the change of speed in a first step and in a second."""
    speeds = [speed()]
    for _ in range(2):
        step()
        speeds.append(speed())
    first, second = speeds[1] - speeds[0], speeds[2] - speeds[1]
    share = second / first if first else float("nan")
    answer = "stays" if 0.9 < share < 1.1 else "lasts one step" if abs(share) < 0.1 else UNDECIDED
    figures = Figure("first step", first, "rad/s"), Figure("second", second, "rad/s")
    return Finding(answer, figures, of)


def mujoco() -> Findings:
    """A motor, without gravity."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF % '<actuator><motor joint="j"/></actuator>')
    model.opt.gravity[:] = 0
    data = mj.MjData(model)
    data.ctrl[0] = _TORQUE
    return (_found("ctrl", lambda: float(data.qvel[0]), lambda: mj.mj_step(model, data)),)


def pybullet() -> Findings:
    """A torque, and a velocity motor that cannot reach its target so soon; without gravity."""
    found = []
    for mode, value in (("TORQUE_CONTROL", "force"), ("VELOCITY_CONTROL", "targetVelocity")):
        with world() as (pb, client):
            body = load(pb, client, URDF, fixed=True)

            def control(kind: int, pb=pb, client=client, body=body, **values: float) -> None:
                pb.setJointMotorControl2(body, 0, kind, physicsClientId=client, **values)

            def speed(pb=pb, client=client, body=body) -> float:
                return pb.getJointState(body, 0, client)[1]

            control(pb.VELOCITY_CONTROL, force=0)
            if value == "force":
                control(pb.TORQUE_CONTROL, force=_TORQUE)
            else:
                control(pb.VELOCITY_CONTROL, targetVelocity=1e3, force=_TORQUE)
            found.append(_found(mode, speed, lambda pb=pb, w=client: pb.stepSimulation(w)))
    return tuple(found)


def pinocchio() -> Findings:
    """Whether it steps at all; a torque is an argument of each call."""
    return (lacking(require("pinocchio"), "step", "simul"),)
