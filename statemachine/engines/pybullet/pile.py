"""PyBullet's world in which something can be kept and forgotten: boxes, a driven joint.

Not all of it can be read from the engine. A motor's target and a force that waits for the
next step show in what the next step does.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...backends._bullet_client import pb
from ...interface import Array
from ...silence import silence
from ..samples.pendulum import GRAVITY, URDF
from ..samples.pile import HALF, PLACES, TILT
from .world import fresh_world, load, put_floor

_TURNS = (np.array((*TILT[1:], TILT[0])) / np.linalg.norm(TILT), *[np.array((0, 0, 0, 1.0))] * 2)
_NEAR = 0.05  # of what was written; a motor's target is met that well in one step


@dataclass(frozen=True)
class Pile:
    """A world's client, and the numbers of its bodies."""

    client: int
    boxes: tuple[int, ...]
    arm: int

    @property
    def box(self) -> int:
        """The lowest box, at which quantities are looked at."""
        return self.boxes[0]


def build(client: int) -> Pile:
    """Put the bodies into an empty world; what else is set there stays."""
    put_floor(client)
    edges = (HALF, HALF, HALF)
    shape = pb.createCollisionShape(pb.GEOM_BOX, halfExtents=edges, physicsClientId=client)
    boxes = tuple(
        pb.createMultiBody(
            1,
            shape,
            basePosition=place,
            baseOrientation=turn.tolist(),
            physicsClientId=client,
        )
        for place, turn in zip(PLACES, _TURNS, strict=True)
    )
    arm = load(client, URDF, fixed=True)
    pb.resetBasePositionAndOrientation(arm, (2, 0, 2), (0, 0, 0, 1), client)
    return Pile(client, boxes, arm)


# Saves when it is entered, and gives the function that restores.
Saved = Callable[[Pile], AbstractContextManager[Callable[[], None]]]


@dataclass(frozen=True)
class PileQuantity:
    """Something that decides the future: how it is written, and what shows it.

    Attributes:
        write: Puts a number there.
        read: Tells the number; may take a step for it.
    """

    write: Callable[[Pile, float], None]
    read: Callable[[Pile], float]


def _joint(scene: Pile, k: int) -> float:
    return pb.getJointState(scene.arm, 0, scene.client)[k]


def _stepped(read: Callable[[Pile], float]) -> Callable[[Pile], float]:
    def after(scene: Pile) -> float:
        pb.stepSimulation(scene.client)
        return read(scene)

    return after


def _base_velocity(scene: Pile) -> float:
    return pb.getBaseVelocity(scene.box, scene.client)[0][0]


def _set_target(scene: Pile, value: float) -> None:
    pb.setJointMotorControl2(
        scene.arm, 0, pb.VELOCITY_CONTROL, targetVelocity=value, physicsClientId=scene.client
    )


def _push(scene: Pile, value: float) -> None:
    """A force that makes up this speed in one step of 1/240 s; the box weighs 1 kg."""
    at = pb.getBasePositionAndOrientation(scene.box, scene.client)[0]
    force = (240 * value, 0, 0)
    pb.applyExternalForce(scene.box, -1, force, at, pb.WORLD_FRAME, physicsClientId=scene.client)


def _moved(scene: Pile) -> float:
    """How far the box comes in a step at 100 m/s: what step the engine takes, not what it tells."""
    pb.resetBaseVelocity(scene.box, (100, 0, 0), (0, 0, 0), scene.client)
    start = pb.getBasePositionAndOrientation(scene.box, scene.client)[0][0]
    pb.stepSimulation(scene.client)
    return pb.getBasePositionAndOrientation(scene.box, scene.client)[0][0] - start


# Nothing else acts while one of these is looked at; the box is in the air.
QUANTITIES = {
    "joint position": PileQuantity(
        lambda s, x: pb.resetJointState(s.arm, 0, x, _joint(s, 1), s.client),
        lambda s: _joint(s, 0),
    ),
    "joint velocity": PileQuantity(
        lambda s, x: pb.resetJointState(s.arm, 0, _joint(s, 0), x, s.client),
        lambda s: _joint(s, 1),
    ),
    "base position": PileQuantity(
        lambda s, x: pb.resetBasePositionAndOrientation(s.box, (x, 0, 1), (0, 0, 0, 1), s.client),
        lambda s: pb.getBasePositionAndOrientation(s.box, s.client)[0][0],
    ),
    "base velocity": PileQuantity(
        lambda s, x: pb.resetBaseVelocity(s.box, (x, 0, 0), (0, 0, 0), s.client),
        _base_velocity,
    ),
    "motor target": PileQuantity(_set_target, _stepped(lambda s: _joint(s, 1))),
    "applied force": PileQuantity(_push, _stepped(_base_velocity)),
    "gravity": PileQuantity(
        # As much as makes up this speed in one step.
        lambda s, x: pb.setGravity(240 * x, 0, 0, s.client),
        _stepped(_base_velocity),
    ),
    "timestep": PileQuantity(lambda s, x: pb.setTimeStep(x / 100, s.client), _moved),
}


def survives(quantity: str, value: float, way: Callable[[Pile], Pile]) -> bool:
    """Whether a number that was written is there after a way, in a world of its own."""
    with fresh_world() as client:
        scene = build(client)
        QUANTITIES[quantity].write(scene, value)
        return abs(QUANTITIES[quantity].read(way(scene)) - value) < _NEAR * abs(value)


@dataclass(frozen=True)
class Restart:
    """A way to the start.

    Attributes:
        call: What the engine is asked to do.
        again: What its user must do then; gives the world as it began.
    """

    call: Callable[[Pile], None]
    again: Callable[[Pile], Pile]

    def __call__(self, scene: Pile) -> Pile:
        self.call(scene)
        return self.again(scene)


def _put_back(scene: Pile) -> None:
    for box, place, turn in zip(scene.boxes, PLACES, _TURNS, strict=True):
        pb.resetBasePositionAndOrientation(box, place, turn.tolist(), scene.client)
    pb.resetJointState(scene.arm, 0, 0, 0, scene.client)


RESETS = {
    "resetSimulation": Restart(
        lambda scene: pb.resetSimulation(physicsClientId=scene.client),
        lambda scene: build(scene.client),
    ),
    "resetBase…, resetJointState": Restart(_put_back, lambda scene: scene),
}


def _in_memory(scene: Pile) -> Iterator[Callable[[], None]]:
    state = pb.saveState(scene.client)
    yield lambda: pb.restoreState(state, physicsClientId=scene.client)


def _in_a_file(scene: Pile) -> Iterator[Callable[[], None]]:
    with tempfile.TemporaryDirectory() as folder:
        file = os.fspath(Path(folder) / "world.bullet")
        with silence():
            pb.saveBullet(file, physicsClientId=scene.client)

        def restore() -> None:
            with silence():
                pb.restoreState(fileName=file, physicsClientId=scene.client)

        yield restore


def _read_and_written(scene: Pile) -> Iterator[Callable[[], None]]:
    client = scene.client
    poses = [pb.getBasePositionAndOrientation(box, client) for box in scene.boxes]
    rates = [pb.getBaseVelocity(box, client) for box in scene.boxes]
    joint = pb.getJointState(scene.arm, 0, client)[:2]

    def restore() -> None:
        for box, pose, rate in zip(scene.boxes, poses, rates, strict=True):
            pb.resetBasePositionAndOrientation(box, *pose, client)
            pb.resetBaseVelocity(box, *rate, client)
        pb.resetJointState(scene.arm, 0, *joint, client)

    yield restore


WAYS_TO_SAVE: dict[str, Saved] = {
    "positions, velocities written": contextmanager(_read_and_written),
    "saveState, restoreState": contextmanager(_in_memory),
    "saveBullet, restoreState": contextmanager(_in_a_file),
}


def run(scene: Pile, steps: int) -> Array:
    """Go on under gravity; coordinates of boxes and joint (steps, 22) after every step."""
    client = scene.client
    pb.setGravity(0, 0, -GRAVITY, client)
    trace = []
    for _ in range(steps):
        pb.stepSimulation(client)
        places: list[float] = []
        for box in scene.boxes:
            pos, quat = pb.getBasePositionAndOrientation(box, client)
            places += (*pos, *quat)
        trace.append((*places, _joint(scene, 0)))
    return np.array(trace)
