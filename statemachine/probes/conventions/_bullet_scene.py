"""PyBullet's world in which something can be kept and forgotten: boxes, a driven joint.

Not all of it can be read from the engine. A motor's target and a force that waits for the
next step show in what the next step does.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Array
from ._bullet import load, world
from ._mujoco_scene import BOX, PILE, TILT
from ._pendulum import URDF

GRAVITY = -9.81
_TURNS = (np.array((*TILT[1:], TILT[0])) / np.linalg.norm(TILT), *[np.array((0, 0, 0, 1.0))] * 2)
_NEAR = 0.05  # of what was written; a motor's target is met that well in one step


@dataclass(frozen=True)
class Scene:
    """A world's client, and the numbers of its bodies."""

    pb: Any
    client: int
    boxes: tuple[int, ...]
    arm: int

    @property
    def box(self) -> int:
        """The lowest box, at which quantities are looked at."""
        return self.boxes[0]


def build(pb: Any, client: int) -> Scene:
    """Put the bodies into an empty world; what else is set there stays."""
    plane = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
    pb.createMultiBody(0, plane, physicsClientId=client)
    edges = (BOX, BOX, BOX)
    shape = pb.createCollisionShape(pb.GEOM_BOX, halfExtents=edges, physicsClientId=client)
    boxes = tuple(
        pb.createMultiBody(
            1,
            shape,
            basePosition=place,
            baseOrientation=turn.tolist(),
            physicsClientId=client,
        )
        for place, turn in zip(PILE, _TURNS, strict=True)
    )
    arm = load(pb, client, URDF, fixed=True)
    pb.resetBasePositionAndOrientation(arm, (2, 0, 2), (0, 0, 0, 1), client)
    return Scene(pb, client, boxes, arm)


# Saves when it is entered, and gives the function that restores.
Saved = Callable[[Scene], AbstractContextManager[Callable[[], None]]]


@dataclass(frozen=True)
class Quantity:
    """Something that decides the future: how it is written, and what shows it.

    Attributes:
        write: Puts a number there.
        read: Tells the number; may take a step for it.
    """

    write: Callable[[Scene, float], None]
    read: Callable[[Scene], float]


def _joint(scene: Scene, k: int) -> float:
    return scene.pb.getJointState(scene.arm, 0, scene.client)[k]


def _stepped(read: Callable[[Scene], float]) -> Callable[[Scene], float]:
    def after(scene: Scene) -> float:
        scene.pb.stepSimulation(scene.client)
        return read(scene)

    return after


def _base_velocity(scene: Scene) -> float:
    return scene.pb.getBaseVelocity(scene.box, scene.client)[0][0]


def _set_target(scene: Scene, value: float) -> None:
    pb = scene.pb
    pb.setJointMotorControl2(
        scene.arm, 0, pb.VELOCITY_CONTROL, targetVelocity=value, physicsClientId=scene.client
    )


def _push(scene: Scene, value: float) -> None:
    """A force that makes up this speed in one step of 1/240 s; the box weighs 1 kg."""
    at = scene.pb.getBasePositionAndOrientation(scene.box, scene.client)[0]
    force = (240 * value, 0, 0)
    scene.pb.applyExternalForce(
        scene.box, -1, force, at, scene.pb.WORLD_FRAME, physicsClientId=scene.client
    )


def _moved(scene: Scene) -> float:
    """How far the box comes in a step at 100 m/s: what step the engine takes, not what it tells."""
    scene.pb.resetBaseVelocity(scene.box, (100, 0, 0), (0, 0, 0), scene.client)
    start = scene.pb.getBasePositionAndOrientation(scene.box, scene.client)[0][0]
    scene.pb.stepSimulation(scene.client)
    return scene.pb.getBasePositionAndOrientation(scene.box, scene.client)[0][0] - start


# Nothing else acts while one of these is looked at; the box is in the air.
QUANTITIES = {
    "joint position": Quantity(
        lambda s, x: s.pb.resetJointState(s.arm, 0, x, _joint(s, 1), s.client),
        lambda s: _joint(s, 0),
    ),
    "joint velocity": Quantity(
        lambda s, x: s.pb.resetJointState(s.arm, 0, _joint(s, 0), x, s.client),
        lambda s: _joint(s, 1),
    ),
    "base position": Quantity(
        lambda s, x: s.pb.resetBasePositionAndOrientation(s.box, (x, 0, 1), (0, 0, 0, 1), s.client),
        lambda s: s.pb.getBasePositionAndOrientation(s.box, s.client)[0][0],
    ),
    "base velocity": Quantity(
        lambda s, x: s.pb.resetBaseVelocity(s.box, (x, 0, 0), (0, 0, 0), s.client),
        _base_velocity,
    ),
    "motor target": Quantity(_set_target, _stepped(lambda s: _joint(s, 1))),
    "applied force": Quantity(_push, _stepped(_base_velocity)),
    "gravity": Quantity(
        # As much as makes up this speed in one step.
        lambda s, x: s.pb.setGravity(240 * x, 0, 0, s.client),
        _stepped(_base_velocity),
    ),
    "timestep": Quantity(lambda s, x: s.pb.setTimeStep(x / 100, s.client), _moved),
}


def survives(quantity: str, value: float, way: Callable[[Scene], Scene]) -> bool:
    """Whether a number that was written is there after a way, in a world of its own."""
    with world() as (pb, client):
        scene = build(pb, client)
        QUANTITIES[quantity].write(scene, value)
        return abs(QUANTITIES[quantity].read(way(scene)) - value) < _NEAR * abs(value)


@dataclass(frozen=True)
class Reset:
    """A way to the start.

    Attributes:
        call: What the engine is asked to do.
        again: What its user must do then; gives the world as it began.
    """

    call: Callable[[Scene], None]
    again: Callable[[Scene], Scene]

    def __call__(self, scene: Scene) -> Scene:
        self.call(scene)
        return self.again(scene)


def _put_back(scene: Scene) -> None:
    for box, place, turn in zip(scene.boxes, PILE, _TURNS, strict=True):
        scene.pb.resetBasePositionAndOrientation(box, place, turn.tolist(), scene.client)
    scene.pb.resetJointState(scene.arm, 0, 0, 0, scene.client)


RESETS = {
    "resetSimulation": Reset(
        lambda scene: scene.pb.resetSimulation(physicsClientId=scene.client),
        lambda scene: build(scene.pb, scene.client),
    ),
    "resetBase…, resetJointState": Reset(_put_back, lambda scene: scene),
}


def run(scene: Scene, steps: int) -> Array:
    """Go on under gravity, and tell where boxes and joint are at every step."""
    pb, client = scene.pb, scene.client
    pb.setGravity(0, 0, GRAVITY, client)
    trace = []
    for _ in range(steps):
        pb.stepSimulation(client)
        places: list[float] = []
        for box in scene.boxes:
            pos, quat = pb.getBasePositionAndOrientation(box, client)
            places += (*pos, *quat)
        trace.append((*places, _joint(scene, 0)))
    return np.array(trace)
