"""How much time a step takes, and who keeps count of it."""

from __future__ import annotations

import numpy as np

from ...installed import require
from . import Figure, Finding, Findings, Question
from ._bullet import load, world
from ._lacking import lacking
from ._marked import MJCF, URDF

QUESTION = Question(
    "How long is one step of a fresh engine, and who counts the time?",
    "The same number of steps is another span of time on each engine. A controller that runs "
    "at a fixed rate must know how many steps there are to one of its own.",
)
_SAME = 1e-6  # s


def _found(told: float, moved: float, clock: str, ticked: float) -> Findings:
    """The step [s] that a body at 1 m/s tells by how far it comes, and the engine's clock."""
    told_ms, moved_ms = (f"{span * 1e3:.4g} ms" for span in (told, moved))
    answer = moved_ms if abs(told - moved) < _SAME else f"told {told_ms}, moves {moved_ms}"
    return (
        Finding(answer, (Figure("at 1 m/s a body moves", moved, "m"),), "one step"),
        Finding(clock if ticked else "none", (Figure("it goes on by", ticked, "s"),), "clock"),
    )


def mujoco() -> Findings:
    """A body at 1 m/s, one step."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF)
    data = mj.MjData(model)
    data.qvel[0] = 1
    mj.mj_step(model, data)
    return _found(model.opt.timestep, float(data.qpos[0]), "data.time", float(data.time))


def pybullet() -> Findings:
    """A body at 1 m/s, one step; and whatever number of the world's has changed in it."""
    with world() as (pb, client):
        body = load(pb, client, URDF)
        pb.changeDynamics(body, -1, linearDamping=0, physicsClientId=client)
        start = pb.getBasePositionAndOrientation(body, client)[0][0]
        pb.resetBaseVelocity(body, (1, 0, 0), (0, 0, 0), client)
        told = pb.getPhysicsEngineParameters(client)
        pb.stepSimulation(client)
        moved = pb.getBasePositionAndOrientation(body, client)[0][0] - start
        after = pb.getPhysicsEngineParameters(client)
        changed = {name: after[name] - told[name] for name in told if after[name] != told[name]}
        name, ticked = next(iter(changed.items()), ("", 0.0))
        return _found(told["fixedTimeStep"], moved, name, ticked)


def pinocchio() -> Findings:
    """Whether there is a step at all; integrate takes the time from its caller."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    q, v = pin.neutral(model), np.zeros(model.nv)
    v[0] = 1
    moved = float(pin.integrate(model, q, v)[0] - q[0])
    given = Figure("integrate at 1 m/s moves by", f"{moved:g} m")
    found = lacking(pin, "step", "simul", of="one step")
    return (Finding(found.answer, (*found.figures, given), found.of),)
