"""A fresh world of PyBullet's, as its users get it, and files put into it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ...backends._bullet_client import as_file, connect, disconnect, pb
from ...silence import silence


@contextmanager
def fresh_world() -> Iterator[int]:
    """The number of a client of its own, which is gone afterwards."""
    client = connect()
    try:
        # Not the default: or a text under a name that was used before is the old text.
        pb.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=client)
        yield client
    finally:
        disconnect(client)


def load(client: int, text: str, fixed: bool = False) -> int:
    """Put a URDF text, with the inertias that it states, into a world; the body's number."""
    with as_file(text) as file, silence():
        return pb.loadURDF(
            file,
            useFixedBase=fixed,
            flags=pb.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )


def limp(body: int, client: int) -> None:
    """Switch off the motor of a body's first joint."""
    pb.setJointMotorControl2(body, 0, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)


def timestep(client: int) -> float:
    """What the engine tells of its step [s]."""
    return pb.getPhysicsEngineParameters(client)["fixedTimeStep"]


def put_floor(client: int) -> int:
    """A plane that does not move; its number."""
    plane = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
    return pb.createMultiBody(0, plane, physicsClientId=client)
