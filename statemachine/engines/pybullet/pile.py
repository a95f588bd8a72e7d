"""PyBullet's world in which something can be kept and forgotten: boxes, a driven joint.

Not all of it can be read from the engine. A motor's target and a force that waits for the
next step show in what the next step does.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import ClassVar

import numpy as np

from ...backends.bullet.client import pb
from ...interface import Array
from ..pile import HALF, PLACES, TILT, Pile, Read, Write
from ..samples import GRAVITY, PENDULUM_URDF
from .world import (
    fresh_world,
    load,
    put,
    put_floor,
    saved_in_a_file,
    saved_in_memory,
    timestep,
    written,
)

_TURNS = (np.array((*TILT[1:], TILT[0])) / np.linalg.norm(TILT), *[np.array((0, 0, 0, 1.0))] * 2)


def _position(scene: BulletPile) -> float:
    """Return the position of the driven joint [rad]."""
    return pb.getJointState(scene.arm, 0, scene.client)[0]


def _velocity(scene: BulletPile) -> float:
    """Return the velocity of the driven joint [rad/s]."""
    return pb.getJointState(scene.arm, 0, scene.client)[1]


def _stepped(read: Read) -> Read:
    def after(scene: BulletPile) -> float:
        pb.stepSimulation(scene.client)
        return read(scene)

    return after


def _base_velocity(scene: BulletPile) -> float:
    return pb.getBaseVelocity(scene.box, scene.client)[0][0]


def _set_target(scene: BulletPile, value: float) -> None:
    pb.setJointMotorControl2(
        scene.arm, 0, pb.VELOCITY_CONTROL, targetVelocity=value, physicsClientId=scene.client
    )


def _push(scene: BulletPile, value: float) -> None:
    """Apply the force that gives this speed in one step of 1/240 s; the box weighs 1 kg."""
    at = pb.getBasePositionAndOrientation(scene.box, scene.client)[0]
    pb.applyExternalForce(
        scene.box, -1, (240 * value, 0, 0), at, pb.WORLD_FRAME, physicsClientId=scene.client
    )


def _moved(scene: BulletPile) -> float:
    """Return how far the box moves in a step at 100 m/s, which tells the step that is taken [m]."""
    pb.resetBaseVelocity(scene.box, (100, 0, 0), (0, 0, 0), scene.client)
    start = _base_position(scene)
    pb.stepSimulation(scene.client)
    return _base_position(scene) - start


def _set_position(scene: BulletPile, value: float) -> None:
    pb.resetJointState(scene.arm, 0, value, _velocity(scene), scene.client)


def _set_velocity(scene: BulletPile, value: float) -> None:
    pb.resetJointState(scene.arm, 0, _position(scene), value, scene.client)


def _set_base_position(scene: BulletPile, value: float) -> None:
    pb.resetBasePositionAndOrientation(scene.box, (value, 0, 1), (0, 0, 0, 1), scene.client)


def _base_position(scene: BulletPile) -> float:
    return pb.getBasePositionAndOrientation(scene.box, scene.client)[0][0]


def _set_base_velocity(scene: BulletPile, value: float) -> None:
    pb.resetBaseVelocity(scene.box, (value, 0, 0), (0, 0, 0), scene.client)


def _set_gravity(scene: BulletPile, value: float) -> None:
    """Set the gravity that gives this speed in one step of 1/240 s."""
    pb.setGravity(240 * value, 0, 0, scene.client)


def _set_timestep(scene: BulletPile, value: float) -> None:
    pb.setTimeStep(value / 100, scene.client)


# Nothing else acts while one of these is looked at; the box is in the air.
_QUANTITIES: Mapping[str, tuple[Write, Read]] = {
    "joint position": (_set_position, _position),
    "joint velocity": (_set_velocity, _velocity),
    "base position": (_set_base_position, _base_position),
    "base velocity": (_set_base_velocity, _base_velocity),
    "motor target": (_set_target, _stepped(_velocity)),
    "applied force": (_push, _stepped(_base_velocity)),
    "gravity": (_set_gravity, _stepped(_base_velocity)),
    "timestep": (_set_timestep, _moved),
}


def _put_back(scene: BulletPile) -> None:
    for box, place, turn in zip(scene.bases, PLACES, _TURNS, strict=True):
        pb.resetBasePositionAndOrientation(box, place, turn.tolist(), scene.client)
    pb.resetJointState(scene.arm, 0, 0, 0, scene.client)


class BulletPile(Pile):
    """A world's client, and the numbers of its bodies."""

    quantities = _QUANTITIES
    near = 0.05  # a motor's target is met that well in one step
    resets: ClassVar = {
        "resetSimulation": lambda scene: pb.resetSimulation(physicsClientId=scene.client),
        "resetBase…, resetJointState": _put_back,
    }
    ways_to_save: ClassVar = {
        "positions, velocities written": written,
        "saveState, restoreState": saved_in_memory,
        "saveBullet, restoreState": saved_in_a_file,
    }

    def __init__(self, client: int) -> None:
        """Put the bodies into an empty world; what else is set there stays."""
        self.client = client
        put_floor(client)
        self.bases: Sequence[int] = tuple(
            put(client, pb.GEOM_BOX, place, turn.tolist(), halfExtents=(HALF, HALF, HALF))
            for place, turn in zip(PLACES, _TURNS, strict=True)
        )
        self.box = self.bases[0]  # the lowest, at which quantities are looked at
        self.arm = load(client, PENDULUM_URDF, fixed=True)
        self.joints: Sequence[tuple[int, int]] = [(self.arm, 0)]
        pb.resetBasePositionAndOrientation(self.arm, (2, 0, 2), (0, 0, 0, 1), client)

    @classmethod
    @contextmanager
    def fresh(cls) -> Iterator[BulletPile]:
        with fresh_world() as client:
            yield cls(client)

    @property
    def timestep(self) -> float:
        return timestep(self.client)

    def bodies(self) -> int:
        return pb.getNumBodies(self.client)

    def disturb(self, quantity: str) -> None:
        if quantity == "applied force":  # there is one until the next step
            pb.stepSimulation(self.client)
        else:
            super().disturb(quantity)

    def refilled(self) -> BulletPile:
        return self if self.bodies() else BulletPile(self.client)

    def run(self, steps: int) -> Array:
        client = self.client
        pb.setGravity(0, 0, -GRAVITY, client)
        trace = []
        for _ in range(steps):
            pb.stepSimulation(client)
            numbers: list[float] = []
            for box in self.bases:
                place, turn = pb.getBasePositionAndOrientation(box, client)
                numbers += (*place, *turn)
            trace.append((*numbers, _position(self)))
        return np.array(trace)
