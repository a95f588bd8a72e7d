"""A world of PyBullet's, as its users have it: opened, filled, commanded, read and saved."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from ...backends.bullet.client import as_file, connect, disconnect, load_urdf, pb
from ...installed import silence


class HasClient(Protocol):
    """A world: its number."""

    client: int


class HasBodies(HasClient, Protocol):
    """A world: the numbers of its free bodies, and its joints, body by index."""

    bases: Sequence[int]
    joints: Sequence[tuple[int, int]]


Restore = Callable[[HasClient], None]  # puts what was saved into a world


@contextmanager
def fresh_world() -> Iterator[int]:
    """Yield the number of a client that is disconnected afterwards."""
    client = connect()
    try:
        # Not the default: or a text under a name that was used before is the old text.
        pb.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=client)
        yield client
    finally:
        disconnect(client)


def load(client: int, text: str, fixed: bool = False) -> int:
    """Put a URDF text, with the inertias that it states, into a world; the body's number."""
    with as_file(text) as file:
        flags = pb.URDF_USE_INERTIA_FROM_FILE
        return load_urdf(client, file, "this text", useFixedBase=fixed, flags=flags)


def limp(body: int, client: int, joint: int = 0) -> None:
    """Switch off the motor of a joint."""
    pb.setJointMotorControl2(body, joint, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)


def timestep(client: int) -> float:
    """Return the step that the engine reports [s]."""
    return pb.getPhysicsEngineParameters(client)["fixedTimeStep"]


def gravity_of(client: int) -> tuple[float, float, float]:
    """Return the gravity that the engine reports [m/s²]."""
    parameters = pb.getPhysicsEngineParameters(client)
    return tuple(parameters[f"gravityAcceleration{axis}"] for axis in "XYZ")


def poses_and_rates(machine: HasBodies) -> list[tuple[Any, Any]]:
    """Return of each free body its position and quaternion, and its linear and angular velocity."""
    client = machine.client
    return [
        (pb.getBasePositionAndOrientation(b, client), pb.getBaseVelocity(b, client))
        for b in machine.bases
    ]


@contextmanager
def written(machine: HasBodies) -> Iterator[Callable[[HasBodies], None]]:
    """Yield a restore that writes back what can be read of positions and velocities."""
    bodies = poses_and_rates(machine)
    states = [pb.getJointState(*joint, machine.client)[:2] for joint in machine.joints]

    def restore(other: HasBodies) -> None:
        for (body, index), state in zip(other.joints, states, strict=True):
            pb.resetJointState(body, index, *state, other.client)
        for body, (pose, rates) in zip(other.bases, bodies, strict=True):
            pb.resetBasePositionAndOrientation(body, *pose, other.client)
            pb.resetBaseVelocity(body, *rates, other.client)

    yield restore


@contextmanager
def saved_in_memory(machine: HasClient) -> Iterator[Restore]:
    """Yield a restore by the engine's saveState: for the world that it was made in."""
    state = pb.saveState(machine.client)
    try:
        yield lambda other: pb.restoreState(state, physicsClientId=other.client)
    finally:
        pb.removeState(state, physicsClientId=machine.client)


@contextmanager
def saved_in_a_file(machine: HasClient) -> Iterator[Restore]:
    """Yield a restore by the engine's file, which another world of the same bodies takes too."""
    with tempfile.TemporaryDirectory() as folder:
        file = os.fspath(Path(folder) / "world.bullet")
        with silence():
            pb.saveBullet(file, physicsClientId=machine.client)

        def restore(other: HasClient) -> None:
            with silence():
                pb.restoreState(fileName=file, physicsClientId=other.client)

        yield restore


def put_floor(client: int) -> int:
    """Put a plane that does not move, and return its number."""
    return put(client, pb.GEOM_PLANE, mass=0)


def put(
    client: int,
    kind: int,
    place: Sequence[float] = (0, 0, 0),
    turn: Sequence[float] = (0, 0, 0, 1),
    mass: float = 1,
    **size: Any,
) -> int:
    """Put a body of one shape into a world; its number.

    Args:
        client: The world's number.
        kind: A number of PyBullet's, as GEOM_BOX.
        place: Of its centre (3,) [m].
        turn: Its axes, a quaternion (x, y, z, w).
        mass: What it weighs [kg]; a body of 0 does not move.
        **size: As createCollisionShape takes it [m].
    """
    shape = pb.createCollisionShape(kind, physicsClientId=client, **size)
    return pb.createMultiBody(
        mass, shape, basePosition=place, baseOrientation=turn, physicsClientId=client
    )
