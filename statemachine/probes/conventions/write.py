"""Whether what is derived from the state is stale after a write into it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...installed import require
from . import UNDECIDED, Figure, Finding, Findings, Question
from . import _floor as floor
from ._bullet import load, world
from ._pendulum import MJCF, URDF, tip_at

QUESTION = Question(
    "You write a position: is what depends on it stale?",
    "A stale pose looks like a pose. A controller that reads one aims at where the arm was.",
)
_ANGLE = 0.4
_SAME = 1e-6  # m; PyBullet tells a link's frame in single precision
_DEEP = 0.01


def found(read: Any, recomputed: Any, true: Any, of: str) -> Finding:
    """Stale or fresh [m]: how far off is what is read, and what is recomputed then?"""
    off, again = (float(np.linalg.norm(np.subtract(each, true))) for each in (read, recomputed))
    answer = "fresh" if off < _SAME else "stale" if again < _SAME else UNDECIDED
    return Finding(answer, (Figure("off by", off, "m"), Figure("recomputed", again, "m")), of)


def mujoco() -> Findings:
    """Write qpos of a pendulum, then of a ball that is put into the floor."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF % "")
    data = mj.MjData(model)
    mj.mj_forward(model, data)
    data.qpos[0] = _ANGLE
    read = np.array(data.site("tip").xpos)
    mj.mj_forward(model, data)
    tip = found(read, data.site("tip").xpos, tip_at(_ANGLE), "the tip")

    model = mj.MjModel.from_xml_string(floor.MJCF)
    data = mj.MjData(model)
    mj.mj_forward(model, data)
    data.qpos[2] = floor.RADIUS - _DEEP
    deep = floor.depth(data)
    mj.mj_forward(model, data)
    return tip, found(deep, floor.depth(data), _DEEP, "the contact")


def pybullet() -> Findings:
    """Write by resetJointState to a pendulum, then a ball that is put into the floor."""
    with world() as (pb, client):
        body = load(pb, client, URDF, fixed=True)
        pb.getLinkState(body, 1, computeForwardKinematics=1, physicsClientId=client)
        pb.resetJointState(body, 0, _ANGLE, 0, client)
        read = pb.getLinkState(body, 1, physicsClientId=client)[4]
        again = pb.getLinkState(body, 1, computeForwardKinematics=1, physicsClientId=client)[4]
        tip = found(read, again, tip_at(_ANGLE), "the tip")
    with world() as (pb, client):
        ball = floor.in_pybullet(pb, client, 1)
        pb.performCollisionDetection(client)
        at = (0, 0, floor.RADIUS - _DEEP)
        pb.resetBasePositionAndOrientation(ball, at, (0, 0, 0, 1), client)
        read = floor.depth_in_pybullet(pb, client)
        pb.performCollisionDetection(client)
        return tip, found(read, floor.depth_in_pybullet(pb, client), _DEEP, "the contact")


def pinocchio() -> Findings:
    """Another q, handed to one function after the other."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF)
    data, tip = model.createData(), model.getFrameId("tip")
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    q = np.array([_ANGLE])
    reads = [np.array(data.oMf[tip].translation)]
    pin.forwardKinematics(model, data, q)
    reads.append(np.array(data.oMf[tip].translation))
    pin.updateFramePlacements(model, data)
    now = data.oMf[tip].translation
    return (
        found(reads[0], now, tip_at(_ANGLE), "the tip"),
        found(reads[1], now, tip_at(_ANGLE), "the tip, after forwardKinematics"),
    )
