"""How the friction of two bodies becomes the friction between them."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from ...installed import require
from . import Figure, Finding, Findings, Question, closest
from ._bullet import world
from ._lacking import lacking

QUESTION = Question(
    "Two bodies touch: which friction is between them?",
    "A grip that is tuned on one engine may drop its object on another, with the same two "
    "numbers in the file.",
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
_GRAVITY = 10.0  # m/s²
_HALF = (0.2, 0.2, 0.05)  # of the block, m
_REST, _PULL = 0.5, 0.5  # s
# A block that MuJoCo holds creeps, by millimetres a second; one that slides gains more.
_SLIDES = 0.02  # m/s
_HALVINGS = 10

Speed = Callable[[float, float, float], float]


def _rule(speed: Speed, of: str = "") -> Finding:
    """Which rule explains on which slope a block begins to slide, one way round and the other.

    Args:
        speed: Of a block with one friction, after a while on a floor with another, with
            gravity leaning by a tangent [m/s].
        of: What is special about it.
    """
    pairs = ((SMOOTH, ROUGH), (ROUGH, SMOOTH))
    measured = [_slope(speed, *pair) for pair in pairs]
    answer, _, _ = closest(
        {
            name: max(abs(rule(*pair) - mu) for pair, mu in zip(pairs, measured, strict=True))
            for name, rule in _RULES.items()
        }
    )
    figures = [
        Figure(f"{block:g} on {floor:g} slides from", mu)
        for (block, floor), mu in zip(pairs, measured, strict=True)
    ]
    return Finding(answer, tuple(figures), of)


def _slope(speed: Speed, block: float, floor: float) -> float:
    """The tangent of the slope from which on a block slides: its friction, by halving."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if speed(block, floor, middle) > _SLIDES else (middle, high)
    return (low + high) / 2


def mujoco() -> Findings:
    """A block on a floor, with elliptic cones: the same friction in every direction."""
    mj = require("mujoco")

    def speed(block: float, floor: float, lean: float, priority: int = 0) -> float:
        model = mj.MjModel.from_xml_string(
            f'<mujoco><option gravity="0 0 {-_GRAVITY}" cone="elliptic"/><worldbody>'
            f'<geom type="plane" size="9 9 1" friction="{floor}"/>'
            f'<body pos="0 0 {_HALF[2]}"><freejoint/><geom type="box" size="{_HALF[0]} {_HALF[1]} '
            f'{_HALF[2]}" friction="{block}" priority="{priority}"/></body></worldbody></mujoco>'
        )
        data = mj.MjData(model)
        mj.mj_step(model, data, round(_REST / model.opt.timestep))
        model.opt.gravity[0] = lean * _GRAVITY
        mj.mj_step(model, data, round(_PULL / model.opt.timestep))
        return float(data.qvel[0])

    return (
        _rule(speed, "equal priority"),
        _rule(partial(speed, priority=1), "the block has priority"),
    )


def pybullet() -> Findings:
    """A block on a floor."""

    def speed(block: float, floor: float, lean: float) -> float:
        with world() as (pb, client):
            plane = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
            box = pb.createCollisionShape(pb.GEOM_BOX, halfExtents=_HALF, physicsClientId=client)
            ground = pb.createMultiBody(0, plane, physicsClientId=client)
            body = pb.createMultiBody(1, box, basePosition=(0, 0, _HALF[2]), physicsClientId=client)
            pb.changeDynamics(ground, -1, lateralFriction=floor, physicsClientId=client)
            pb.changeDynamics(body, -1, lateralFriction=block, physicsClientId=client)
            step = pb.getPhysicsEngineParameters(client)["fixedTimeStep"]
            for seconds, tangent in ((_REST, 0.0), (_PULL, lean)):
                pb.setGravity(tangent * _GRAVITY, 0, -_GRAVITY, client)
                for _ in range(round(seconds / step)):
                    pb.stepSimulation(client)
            return pb.getBaseVelocity(body, client)[0][0]

    return (_rule(speed),)


def pinocchio() -> Findings:
    """Whether anything slides at all."""
    return (lacking(require("pinocchio"), "step", "simul"),)
