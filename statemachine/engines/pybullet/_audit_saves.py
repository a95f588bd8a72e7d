"""PyBullet's own ways to save and restore a world, and what else decides its future."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ...backends._bullet_client import pb
from ...interface import Array
from ..auditing import Restore
from .world import read_into, saved_in_a_file, saved_in_memory


@dataclass
class Client:
    """A world, and what its user knows of it that the engine does not tell.

    Attributes:
        data: Holds the world; none of its verbs is called.
        time: Simulated time [s]: the engine has no clock.
        targets: (nu,) what the motors aim at; None where they are off.
    """

    data: Any
    time: float = 0.0
    targets: Array | None = None

    @property
    def world(self) -> Any:
        """The bodies and their ids."""
        return self.data.raw

    @property
    def id(self) -> int:
        """What the engine's functions want as physicsClientId."""
        return self.world.client


def bases(machine: Client) -> list[int]:
    """PyBullet's ids of the free bodies."""
    return [tree.body for tree in machine.world.trees if tree.free]


def solids(machine: Client) -> list[tuple[int, int]]:
    """PyBullet's body and link of all that can touch."""
    return [(body, link) for body, link, _ in machine.world.solids()]


def written(machine: Client) -> Iterator[Restore]:
    """What can be read of positions and velocities is written back."""
    joints = [
        pb.getJointStates(tree.body, tree.joints, machine.id) if tree.joints else ()
        for tree in machine.world.trees
    ]
    poses = [
        (pb.getBasePositionAndOrientation(b, machine.id), pb.getBaseVelocity(b, machine.id))
        for b in bases(machine)
    ]

    def restore(other: Client) -> None:
        for tree, states in zip(other.world.trees, joints, strict=True):
            for index, state in zip(tree.joints, states, strict=False):
                pb.resetJointState(tree.body, index, state[0], state[1], other.id)
        for body, (pose, rates) in zip(bases(other), poses, strict=True):
            pb.resetBasePositionAndOrientation(body, *pose, other.id)
            pb.resetBaseVelocity(body, *rates, other.id)

    yield restore


def in_memory(machine: Client) -> Iterator[Restore]:
    """The engine's saveState."""
    with saved_in_memory(machine.id) as restore:
        yield lambda other: restore(other.id)


def in_a_file(machine: Client) -> Iterator[Restore]:
    """The engine's file."""
    with saved_in_a_file(machine.id) as restore:
        yield lambda other: restore(other.id)


def put_back(machine: Client, how: str = "put") -> Iterator[Restore]:
    """What can be read of positions and velocities, as the backend writes it."""
    qpos, qvel = machine.data.qpos.copy(), machine.data.qvel.copy()
    read_into(machine.world, qpos, qvel)
    yield lambda other: getattr(other.world, how)(qpos, qvel)


def taken_apart(machine: Client) -> Iterator[Restore]:
    """Every body is taken far away and brought back, which leaves no memory of contacts."""
    yield from put_back(machine, "place")


def let_pass(machine: Client) -> None:
    """Nothing touches anything any more."""
    for body, link in solids(machine):
        pb.setCollisionFilterGroupMask(body, link, 0, 0, machine.id)
    pb.performCollisionDetection(machine.id)
