"""Whether a joint that nobody commands falls."""

from __future__ import annotations

import numpy as np

from ...installed import require
from . import UNDECIDED, Figure, Finding, Findings, Question
from ._bullet import load, world
from ._pendulum import GRAVITY, MJCF, RATE, TORQUE, URDF, limp

QUESTION = Question(
    "Does a joint fall that nobody commands?",
    "Writing no command is not the same as no torque. Look for a motor that is on from the "
    "start, and for an actuator to which zero is a target, before you blame gravity.",
)
_SECONDS = 0.25


def _found(of: str, verb: str, moved: float, free: float, unit: str, *more: Figure) -> Finding:
    """What a joint does, by how it moves and how it would move if nothing held it."""
    share = moved / free
    answer = "falls" if 0.9 < share < 1.1 else "held" if abs(share) < 0.1 else UNDECIDED
    return Finding(answer, (Figure(verb, moved, unit), Figure("limp", free, unit), *more), of)


def mujoco() -> Findings:
    """Without an actuator, and with one that is never written to."""
    mj = require("mujoco")
    found = []
    for of, actuator in (
        ("no actuator", ""),
        ("a position actuator", '<actuator><position joint="j" kp="1000" kv="50"/></actuator>'),
    ):
        model = mj.MjModel.from_xml_string(MJCF % actuator)
        data = mj.MjData(model)
        mj.mj_step(model, data, round(_SECONDS / model.opt.timestep))
        more = [Figure("it exerts", float(data.qfrc_actuator[0]), "N·m")] if actuator else []
        found.append(_found(of, "moves", float(data.qpos[0]), limp(data.time), "rad", *more))
    return tuple(found)


def pybullet() -> Findings:
    """As loadURDF leaves the joint, with gravity set, and with its motor switched off."""
    found = []
    for of, off in (("as loaded", False), ("motor off", True)):
        with world() as (pb, client):
            body = load(pb, client, URDF, fixed=True)
            pb.setGravity(0, 0, -GRAVITY, client)
            if off:
                pb.setJointMotorControl2(
                    body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=client
                )
            step = pb.getPhysicsEngineParameters(client)["fixedTimeStep"]
            steps = round(_SECONDS / step)
            for _ in range(steps):
                pb.stepSimulation(client)
            angle, _, _, torque = pb.getJointState(body, 0, client)
            more = Figure("its motor exerts", torque, "N·m"), Figure("gravity", TORQUE, "N·m")
            found.append(_found(of, "moves", angle, limp(steps * step), "rad", *more))
    return tuple(found)


def pinocchio() -> Findings:
    """The acceleration at zero torque: there is nothing else that could act."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF)
    rest = np.zeros(model.nv)
    started = float(pin.aba(model, model.createData(), pin.neutral(model), rest, rest)[0])
    return (_found("aba at zero torque", "starts with", started, RATE, "rad/s²"),)
