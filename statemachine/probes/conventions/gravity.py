"""Which gravity a fresh engine has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...installed import require
from . import Figure, Finding, Findings, Question
from ._bullet import load, world
from ._marked import URDF

QUESTION = Question(
    "Which gravity does a fresh engine have?",
    "An arm that holds itself up without any control may only be an arm that weighs nothing.",
)
_STEPS = 50
_SAME = 1e-6  # m/s²


def _found(told: Sequence[float], measured: Sequence[float]) -> Findings:
    """The gravity (3,) [m/s²] that a body feels, unless the engine tells of another."""
    felt, said = (" ".join(f"{g:g}" for g in np.round(each, 2) + 0.0) for each in (measured, told))
    agree = np.allclose(told, measured, atol=_SAME)
    figures = (Figure("falls with", tuple(map(float, measured)), "m/s²"),)
    return (Finding(felt if agree else f"told {said}, felt {felt}", figures),)


def mujoco() -> Findings:
    """A body in a model that says nothing of gravity, let go."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(
        '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    )
    data = mj.MjData(model)
    mj.mj_step(model, data, _STEPS)
    return _found(model.opt.gravity, data.qvel[:3] / data.time)


def pybullet() -> Findings:
    """A body in a world that was told nothing, let go; without the damping that bodies have."""
    with world() as (pb, client):
        body = load(pb, client, URDF)
        pb.changeDynamics(body, -1, linearDamping=0, physicsClientId=client)
        told = pb.getPhysicsEngineParameters(client)
        for _ in range(_STEPS):
            pb.stepSimulation(client)
        fall = np.array(pb.getBaseVelocity(body, client)[0]) / (_STEPS * told["fixedTimeStep"])
        return _found([told[f"gravityAcceleration{axis}"] for axis in "XYZ"], fall)


def pinocchio() -> Findings:
    """The acceleration of a free body on which nothing else acts."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    still = np.zeros(model.nv)
    # At a pose without turn the body's axes are the world's.
    fall = pin.aba(model, model.createData(), pin.neutral(model), still, still)
    return _found(model.gravity.linear, fall[:3])
