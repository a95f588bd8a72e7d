"""PyBullet itself: a client, stepSimulation, its own motors and its own ways to save.

The bodies are those that the backend loads (`data.raw`): frictions, masses and filters are the
model's. From then on only the engine's own functions are called. Its joints are driven as its
users drive them, by POSITION_CONTROL; the backend's servo has no part in this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...backends._bullet_client import pb
from ...interface import Array, JointType, Model, make_data
from ...measures import JointPlaces
from ..auditing import (
    Disturbance,
    Driver,
    HiddenState,
    Measured,
    Restore,
    Save,
    SaveMethod,
    SavePoint,
)
from .world import aim, read_into, saved_in_a_file, saved_in_memory, servos_of

_RETARGET = 0.2  # what a target is changed by, to see whether a restore brings it back [rad or m]
_PUSH = 5.0  # of a force that waits for the next step [N]
_BEST = "written + targets"  # all that can be read and written
_SLIPPERY = 0.05  # a friction that the model does not have


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


class PybulletDriver(Driver):
    """The engine through its own functions."""

    layer = "engine"
    legend = (
        "'written' is what getJointStates and getBase… gave, put back by resetJointState and "
        "resetBase…; '+ targets' commands the motors once more, and the caller sets the clock "
        "back that it keeps itself; 'taken apart' moves every body far away before it is written. "
        "saveState stays in the world that it was made in."
    )
    several = False  # stepSimulation takes one step
    resets = False  # resetSimulation empties the world; `conventions` tries it

    def __init__(self, model: Model, seed: int) -> None:
        super().__init__(model, seed)
        self.name = f"PyBullet {model.engine_version} itself"
        self._servos = servos_of(model)

    def lacks(self, point: SavePoint) -> str:
        limits = point.model.capabilities.behaviours["joint limits"]
        if not point.at_limit or limits.support == "native":
            return ""
        return f"joint limits are {limits.support} ({limits.note})"

    @cached_property
    def coordinates(self) -> JointPlaces:
        """Joints, tree by tree; then position and quaternion of each free base."""
        with make_data(self.model) as data:
            machine = Client(data)
            trees = [tree.dofs for tree in machine.world.trees if tree.joints]
            joints = np.concatenate([*trees, np.zeros(0, int)])
            free = len(joints) + 7 * np.arange(len(list(bases(machine))))
        types = dict(zip(self.model.jnt_dofadr.tolist(), self.model.jnt_type.tolist(), strict=True))
        kinds = [types[dof] for dof in joints.tolist()] + [int(JointType.FREE)] * len(free)
        return JointPlaces.of(kinds, [*range(len(joints)), *free.tolist()])

    def fresh(self, point: SavePoint) -> Client:
        return Client(make_data(point.model))

    def close(self, machine: Client) -> None:
        machine.data.close()

    def start(self, machine: Client, point: SavePoint) -> None:
        machine.world.put(point.qpos, point.qvel)
        if point.powered:
            self.command(machine, point.ctrl)

    def command(self, machine: Client, ctrl: Array) -> None:
        machine.targets = np.clip(ctrl, *self.model.actuator_ctrlrange.T)
        aim(machine.world, self._servos, machine.targets)

    def advance(self, machine: Client, nstep: int = 1) -> None:
        for _ in range(nstep):
            pb.stepSimulation(machine.id)
            machine.time += self.model.timestep

    def read(self, machine: Client) -> Array:
        places, speeds = [], []
        for joint in self._joints(machine):
            places.append(joint[0])
            speeds.append(joint[1])
        for body in bases(machine):
            pos, quat = pb.getBasePositionAndOrientation(body, machine.id)
            linear, angular = pb.getBaseVelocity(body, machine.id)
            places += (*pos, *quat)
            speeds += (*linear, *angular)
        return np.array(places + speeds)

    def _joints(self, machine: Client) -> Iterator[Any]:
        for tree in machine.world.trees:
            if tree.joints:
                yield from pb.getJointStates(tree.body, tree.joints, machine.id)

    def time(self, machine: Client) -> float:
        return machine.time

    def _measure(self, point: SavePoint) -> Measured:
        with self.at(point) as machine:
            speeds = self.read(machine)[self.coordinates.width :]
            points = pb.getContactPoints(physicsClientId=machine.id)
            return Measured(
                point.name,
                point.how,
                machine.time,
                sum(each[8] <= 0 for each in points),
                None,
                float(np.abs(speeds).max(initial=0.0)),
            )

    def save_methods(self, point: SavePoint) -> tuple[SaveMethod, ...]:
        """The engine's ways with and without what its user must add: targets and time."""
        return (
            SaveMethod("written", self._way(written, known=False)),
            SaveMethod(_BEST, self._way(written)),
            SaveMethod("saveState + targets", self._way(in_memory), travels=False),
            SaveMethod("saveBullet + targets", self._way(in_a_file)),
            SaveMethod("taken apart + targets", self._way(taken_apart)),
        )

    def _way(self, save: Callable[[Client], Iterator[Restore]], known: bool = True) -> Save:
        """A way to save; `known`: with what the user knows and the engine does not tell."""

        @contextmanager
        def whole(machine: Client) -> Iterator[Restore]:
            time = machine.time
            targets = None if machine.targets is None else machine.targets.copy()
            with contextmanager(save)(machine) as restore:

                def back(other: Client) -> None:
                    restore(other)
                    if known:
                        other.time = time
                        if targets is not None:
                            self.command(other, targets)

                yield back

        return whole

    def hidden_state(self, point: SavePoint) -> HiddenState:
        """What the engine's ways forget, each way without what its user must add."""
        ways = {
            "written": self._way(written, known=False),
            "saveState": self._way(in_memory, known=False),
            "saveBullet": self._way(in_a_file, known=False),
        }
        best = SaveMethod(_BEST, self._way(written))
        return HiddenState(ways, self._changes(point), let_pass, best)

    def _changes(self, point: SavePoint) -> dict[str, Callable[[Client], None]]:
        def motor_targets(machine: Client) -> None:
            self.command(machine, point.ctrl - _RETARGET)

        def waiting_force(machine: Client) -> None:
            for body, link in solids(machine):
                pb.applyExternalForce(
                    body, link, (_PUSH, 0, 0), (0, 0, 0), pb.LINK_FRAME, physicsClientId=machine.id
                )

        def friction(machine: Client) -> None:
            for body, link in solids(machine):
                pb.changeDynamics(body, link, lateralFriction=_SLIPPERY, physicsClientId=machine.id)

        found: dict[str, Callable[[Client], None]] = {
            "motor targets": motor_targets,
            "a waiting force": waiting_force,
            "collision masks": let_pass,
            "frictions": friction,
        }
        if not point.powered or not self._servos:
            found.pop("motor targets")
        return found

    def disturbances(self, point: SavePoint) -> tuple[Disturbance, ...]:
        def links(machine: Client) -> None:
            for tree in machine.world.trees:
                for index in range(pb.getNumJoints(tree.body, machine.id)):
                    pb.getLinkState(
                        tree.body, index, computeForwardKinematics=1, physicsClientId=machine.id
                    )

        def dynamics(machine: Client) -> None:
            for tree in machine.world.trees:
                if tree.joints and not tree.free:
                    places = [s[0] for s in pb.getJointStates(tree.body, tree.joints, machine.id)]
                    none = [0.0] * len(places)
                    pb.calculateInverseDynamics(
                        tree.body, places, none, none, physicsClientId=machine.id
                    )
                    pb.calculateMassMatrix(tree.body, places, physicsClientId=machine.id)

        def save(machine: Client) -> None:
            state = pb.saveState(machine.id)
            pb.removeState(state, physicsClientId=machine.id)

        return (
            Disturbance("getLinkState, forward kinematics", links),
            Disturbance("getContactPoints", lambda m: pb.getContactPoints(physicsClientId=m.id)),
            Disturbance("inverse dynamics, mass matrix", dynamics),
            Disturbance("saveState", save),
            Disturbance(
                "performCollisionDetection",
                lambda m: pb.performCollisionDetection(m.id),
                promised=False,
            ),
        )
