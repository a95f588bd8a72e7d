"""A world of PyBullet's, as its users have it: opened, filled, commanded, read and saved."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ...backends._bullet_client import as_file, connect, disconnect, pb
from ...backends._bullet_world import World
from ...interface import Array, Model
from ...silence import silence

Restore = Callable[[int], None]  # puts what was saved into the world with this number


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


def limp(body: int, client: int, joint: int = 0) -> None:
    """Switch off the motor of a joint."""
    pb.setJointMotorControl2(body, joint, pb.VELOCITY_CONTROL, force=0, physicsClientId=client)


def servos_of(model: Model) -> dict[int, int]:
    """The actuator of each degree of freedom that has one."""
    return {
        int(model.jnt_dofadr[joint]): actuator
        for actuator, joint in enumerate(model.actuator_jntid.tolist())
        if joint >= 0
    }


def aim(world: World, servos: dict[int, int], targets: Array) -> None:
    """Let the engine's own motors go to targets (nu,) [rad or m]."""
    for tree in world.trees:
        for index, dof in zip(tree.joints, tree.dofs.tolist() if tree.joints else (), strict=False):
            if dof in servos:
                pb.setJointMotorControl2(
                    tree.body,
                    index,
                    pb.POSITION_CONTROL,
                    targetPosition=float(targets[servos[dof]]),
                    physicsClientId=world.client,
                )


def read_into(world: World, qpos: Array, qvel: Array) -> None:
    """Write what the engine tells of positions (nq,) and velocities (nv,)."""
    for tree in world.trees:
        if tree.joints:
            states = pb.getJointStates(tree.body, tree.joints, world.client)
            qpos[tree.qpos], qvel[tree.qvel] = [s[0] for s in states], [s[1] for s in states]
        if tree.free:
            qpos[tree.qpos], qvel[tree.qvel] = world.read_free(tree)


def timestep(client: int) -> float:
    """What the engine tells of its step [s]."""
    return pb.getPhysicsEngineParameters(client)["fixedTimeStep"]


def gravity_of(client: int) -> tuple[float, float, float]:
    """What the engine tells of its gravity [m/s²]."""
    told = pb.getPhysicsEngineParameters(client)
    return tuple(told[f"gravityAcceleration{axis}"] for axis in "XYZ")


@contextmanager
def saved_in_memory(client: int) -> Iterator[Restore]:
    """The engine's saveState: for the world that it was made in."""
    state = pb.saveState(client)
    try:
        yield lambda other: pb.restoreState(state, physicsClientId=other)
    finally:
        pb.removeState(state, physicsClientId=client)


@contextmanager
def saved_in_a_file(client: int) -> Iterator[Restore]:
    """The engine's file, which another world of the same bodies takes too."""
    with tempfile.TemporaryDirectory() as folder:
        file = os.fspath(Path(folder) / "world.bullet")
        with silence():
            pb.saveBullet(file, physicsClientId=client)

        def restore(other: int) -> None:
            with silence():
                pb.restoreState(fileName=file, physicsClientId=other)

        yield restore


def put_floor(client: int) -> int:
    """A plane that does not move; its number."""
    plane = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
    return pb.createMultiBody(0, plane, physicsClientId=client)
