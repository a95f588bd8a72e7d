"""How the friction of two bodies becomes the friction between them."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...engines import require
from . import Figure, Finding, Findings, Question, closest
from ._bullet import world
from ._lacking import lacking

QUESTION = Question(
    "Two bodies touch: which friction is between them?",
    "A grip that is tuned on one engine drops its object on another, with the same two numbers "
    "in the file.",
)
SMOOTH, ROUGH = 0.25, 0.75
_RULES: dict[str, Callable[[float, float], float]] = {
    "the larger": max,
    "the smaller": min,
    "their product": lambda block, floor: block * floor,
    "their mean": lambda block, floor: (block + floor) / 2,
    "their geometric mean": lambda block, floor: math.sqrt(block * floor),
    "the block's": lambda block, floor: block,
    "the floor's": lambda block, floor: floor,
}
_GRAVITY, _SPEED = 10.0, 3.0  # m/s², m/s
_HALF = (0.2, 0.2, 0.05)  # of the block, m
_REST, _SLIDE = 0.5, 0.1  # s

Slide = Callable[[float, float], float]


def _rule(slide: Slide, of: str = "") -> Finding:
    """Which rule explains both slides.

    Args:
        slide: By what a block with one friction is slowed down on a floor with another,
            as a part of gravity.
        of: What is special about it.
    """
    pairs = ((SMOOTH, ROUGH), (ROUGH, SMOOTH))
    measured = [slide(*pair) for pair in pairs]
    answer, _, _ = closest(
        {
            name: float(np.abs([rule(*pair) - mu for pair, mu in zip(pairs, measured, strict=True)]).max())
            for name, rule in _RULES.items()
        }
    )
    figures = [
        Figure(f"{block:g} on {floor:g} slides with", mu)
        for (block, floor), mu in zip(pairs, measured, strict=True)
    ]
    return Finding(answer, tuple(figures), of)


def mujoco() -> Findings:
    """A block on a floor, with elliptic cones: the same friction in every direction."""
    mj = require("mujoco")

    def slide(block: float, floor: float, priority: int = 0) -> float:
        model = mj.MjModel.from_xml_string(
            f'<mujoco><option gravity="0 0 {-_GRAVITY}" cone="elliptic"/><worldbody>'
            f'<geom type="plane" size="9 9 1" friction="{floor}"/>'
            f'<body pos="0 0 {_HALF[2]}"><freejoint/><geom type="box" size="{_HALF[0]} {_HALF[1]} '
            f'{_HALF[2]}" friction="{block}" priority="{priority}"/></body></worldbody></mujoco>'
        )
        data = mj.MjData(model)
        mj.mj_step(model, data, round(_REST / model.opt.timestep))
        data.qvel[0] = _SPEED
        mj.mj_step(model, data, round(_SLIDE / model.opt.timestep))
        return (_SPEED - float(data.qvel[0])) / (_GRAVITY * _SLIDE)

    return (
        _rule(slide, "equal priority"),
        _rule(lambda block, floor: slide(block, floor, 1), "the block has priority"),
    )


def pybullet() -> Findings:
    """A block on a floor, without the damping that bodies have."""

    def slide(block: float, floor: float) -> float:
        with world() as (pb, client):
            shapes = (
                pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client),
                pb.createCollisionShape(pb.GEOM_BOX, halfExtents=_HALF, physicsClientId=client),
            )
            ground = pb.createMultiBody(0, shapes[0], physicsClientId=client)
            body = pb.createMultiBody(
                1, shapes[1], basePosition=(0, 0, _HALF[2]), physicsClientId=client
            )
            pb.changeDynamics(ground, -1, lateralFriction=floor, physicsClientId=client)
            pb.changeDynamics(
                body, -1, lateralFriction=block, linearDamping=0, physicsClientId=client
            )
            pb.setGravity(0, 0, -_GRAVITY, client)
            step = pb.getPhysicsEngineParameters(client)["fixedTimeStep"]
            for _ in range(round(_REST / step)):
                pb.stepSimulation(client)
            pb.resetBaseVelocity(body, (_SPEED, 0, 0), (0, 0, 0), client)
            for _ in range(round(_SLIDE / step)):
                pb.stepSimulation(client)
            return (_SPEED - pb.getBaseVelocity(body, client)[0][0]) / (_GRAVITY * _SLIDE)

    return (_rule(slide),)


def pinocchio() -> Findings:
    """Whether anything slides at all."""
    return (lacking(require("pinocchio"), "step", "simul"),)
