"""Whether what is derived from the state is that of the state after a step."""

from __future__ import annotations

import numpy as np

from ...installed import require
from . import Findings, Question
from . import _floor as floor
from ._bullet import load, world
from ._lacking import lacking
from ._pendulum import MJCF, URDF, tip_at
from .write import found

QUESTION = Question(
    "You have stepped: is what you read the new state's?",
    "Positions of the joints and poses of the links, read in one breath, may belong to two "
    "moments. A camera or a controller that mixes them is one step late.",
)
_SPEED = 3.0  # rad/s of the pendulum, m/s of the ball
_DEEP = 0.02  # more than it comes out in one step


def mujoco() -> Findings:
    """A pendulum on its way, and a ball on its way out of the floor."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF % "")
    data = mj.MjData(model)
    data.qvel[0] = _SPEED
    mj.mj_step(model, data)
    read = np.array(data.site("tip").xpos)
    mj.mj_kinematics(model, data)
    tip = found(read, data.site("tip").xpos, tip_at(data.qpos[0]), "the tip")

    model = mj.MjModel.from_xml_string(floor.MJCF)
    data = mj.MjData(model)
    data.qpos[2], data.qvel[2] = floor.RADIUS - _DEEP, _SPEED
    mj.mj_step(model, data)
    read = floor.depth(data)
    mj.mj_forward(model, data)
    deep = max(floor.RADIUS - float(data.qpos[2]), 0.0)
    return tip, found(read, floor.depth(data), deep, "the contact")


def pybullet() -> Findings:
    """A limp pendulum on its way, and a ball on its way out of the floor."""
    with world() as (pb, client):
        body = load(pb, client, URDF, fixed=True)
        pb.setJointMotorControl2(body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)
        pb.resetJointState(body, 0, 0, _SPEED, client)
        pb.stepSimulation(client)
        read = pb.getLinkState(body, 1, physicsClientId=client)[4]
        again = pb.getLinkState(body, 1, computeForwardKinematics=1, physicsClientId=client)[4]
        angle = pb.getJointState(body, 0, client)[0]
        tip = found(read, again, tip_at(angle), "the tip")
    with world() as (pb, client):
        ball = floor.in_pybullet(pb, client, floor.RADIUS - _DEEP)
        pb.resetBaseVelocity(ball, (0, 0, _SPEED), (0, 0, 0), client)
        pb.stepSimulation(client)
        read = floor.depth_in_pybullet(pb, client)
        pb.performCollisionDetection(client)
        deep = max(floor.RADIUS - pb.getBasePositionAndOrientation(ball, client)[0][2], 0.0)
        return tip, found(read, floor.depth_in_pybullet(pb, client), deep, "the contact")


def pinocchio() -> Findings:
    """Whether there is a step at all."""
    return (lacking(require("pinocchio"), "step", "simul"),)
