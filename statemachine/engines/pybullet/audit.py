"""PyBullet itself: a client, stepSimulation, its own motors and its own ways to save.

The bodies are those that the backend loads (`data.raw`): frictions, masses and filters are the
model's. From then on only the engine's own functions are called. Its joints are driven as its
users drive them, by POSITION_CONTROL; the backend's servo has no part in this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property

import numpy as np

from ...backends._bullet_client import pb
from ...backends._bullet_world import World
from ...interface import Array, Data, JointType, Model, make_data
from ...measures import JointPlaces
from ...page import Figures
from ..auditing import (
    Disturbance,
    Driver,
    Restore,
    Save,
    SaveMethod,
    SavePoint,
    copied,
)
from .world import poses_and_rates, saved_in_a_file, saved_in_memory, written

_RETARGET = 0.2  # what a target is changed by, to see whether a restore brings it back [rad or m]
_PUSH = 5.0  # of a force that waits for the next step [N]
_BEST = "written + targets"  # all that can be read and written
_SLIPPERY = 0.05  # a friction that the model does not have


class Client:
    """A world, and what its user knows of it that the engine does not tell.

    Attributes:
        world: The bodies and their ids; client: its number.
        joints: PyBullet's body and index of each; bases: PyBullet's ids of the free bodies.
        solids: PyBullet's body and link of all that can touch.
        time: Simulated time [s]: the engine has no clock.
        targets: (nu,) what the motors aim at; None where they are off.
    """

    def __init__(self, world: World, owner: World | Data) -> None:
        """Of a world; the owner gives it back."""
        self.world, self.client, self.close = world, world.client, owner.close
        self.joints: Sequence[tuple[int, int]] = [joint[:2] for joint in world.joints()]
        self.bases: Sequence[int] = [tree.body for tree in world.trees if tree.free]
        self.solids = [(body, link) for body, link, _ in world.solids()]
        self.time = 0.0
        self.targets: Array | None = None


# What can be read of positions and velocities, as the backend writes it. To "place" them takes
# every body far away and brings it back, which leaves no memory of contacts.
put_back = copied(lambda m: m.world.read(), lambda m, state: m.world.put(*state))
taken_apart = copied(lambda m: m.world.read(), lambda m, state: m.world.place(*state))


def let_pass(machine: Client) -> None:
    """Nothing touches anything any more."""
    machine.world.set_collision_groups()
    pb.performCollisionDetection(machine.client)


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
        self._servos = {  # actuators by degree of freedom
            int(model.jnt_dofadr[joint]): actuator
            for actuator, joint in enumerate(model.actuator_jntid.tolist())
            if joint >= 0
        }

    def lacks(self, point: SavePoint) -> str:
        limits = point.model.capabilities.behaviours["joint limits"]
        if not point.at_limit or limits.support == "native":
            return ""
        return f"joint limits are {limits.support} ({limits.note})"

    @cached_property
    def coordinates(self) -> JointPlaces:
        """Joints, tree by tree; then position and quaternion of each free base."""
        machine = self.opened(self.model)
        dofs = [dof for _, _, dof in machine.world.joints()]
        count, free = len(dofs), len(machine.bases)
        machine.close()
        types = dict(zip(self.model.jnt_dofadr.tolist(), self.model.jnt_type.tolist(), strict=True))
        kinds = [types[dof] for dof in dofs] + [int(JointType.FREE)] * free
        return JointPlaces.of(kinds, [*range(count), *range(count, count + 7 * free, 7)])

    def opened(self, model: Model) -> Client:
        """The bodies of a Data; none of its verbs is called."""
        data = make_data(model)
        return Client(data.raw, data)

    def fresh(self, point: SavePoint) -> Client:
        return self.opened(point.model)

    def start(self, machine: Client, point: SavePoint) -> None:
        machine.world.put(point.qpos, point.qvel)
        if point.powered:
            self.command(machine, point.ctrl)

    def command(self, machine: Client, ctrl: Array) -> None:
        """Let the engine's own motors go to ctrl [rad or m]."""
        machine.targets = targets = np.clip(ctrl, *self.model.actuator_ctrlrange.T)
        for body, index, dof in machine.world.joints():
            if dof in self._servos:
                pb.setJointMotorControl2(
                    body,
                    index,
                    pb.POSITION_CONTROL,
                    targetPosition=float(targets[self._servos[dof]]),
                    physicsClientId=machine.client,
                )

    def advance(self, machine: Client, nstep: int = 1) -> None:
        for _ in range(nstep):
            pb.stepSimulation(machine.client)
            machine.time += self.model.timestep

    def read(self, machine: Client) -> Array:
        states = [pb.getJointState(*joint, machine.client) for joint in machine.joints]
        bodies = poses_and_rates(machine)
        places = [*(state[0] for state in states), *(x for (a, b), _ in bodies for x in (*a, *b))]
        speeds = [*(state[1] for state in states), *(x for _, (a, b) in bodies for x in (*a, *b))]
        return np.array(places + speeds)

    def touching(self, machine: Client) -> tuple[int, None]:
        points = pb.getContactPoints(physicsClientId=machine.client)
        return sum(point[8] <= 0 for point in points), None

    def save_methods(self, point: SavePoint) -> tuple[SaveMethod, ...]:
        """The engine's ways with and without what its user must add: targets and time."""
        return (
            SaveMethod("written", written),
            SaveMethod(_BEST, self._with_targets(written)),
            SaveMethod("saveState + targets", self._with_targets(saved_in_memory), portable=False),
            SaveMethod("saveBullet + targets", self._with_targets(saved_in_a_file)),
            SaveMethod("taken apart + targets", self._with_targets(taken_apart)),
        )

    def _with_targets(self, save: Save) -> Save:
        """A way to save, and beside it what the user knows and the engine does not tell."""

        @contextmanager
        def save_both(machine: Client) -> Iterator[Restore]:
            time, targets = machine.time, machine.targets
            with save(machine) as restore:

                def back(other: Client) -> None:
                    restore(other)
                    other.time = time
                    if targets is not None:
                        self.command(other, targets)

                yield back

        return save_both

    def hidden_state(self, point: SavePoint) -> Figures:
        """What the engine's ways forget, each way without what its user must add."""

        def waiting_force(machine: Client) -> None:
            for body, link in machine.solids:
                pb.applyExternalForce(
                    body,
                    link,
                    (_PUSH, 0, 0),
                    (0, 0, 0),
                    pb.LINK_FRAME,
                    physicsClientId=machine.client,
                )

        def friction(machine: Client) -> None:
            for body, link in machine.solids:
                machine.world.change(body, link, lateralFriction=_SLIPPERY)

        changes: dict[str, Callable[[Client], None]] = {
            "motor targets": lambda machine: self.command(machine, point.ctrl - _RETARGET),
            "a waiting force": waiting_force,
            "collision masks": let_pass,
            "frictions": friction,
        }
        if not (point.powered and self._servos):
            del changes["motor targets"]
        ways = {"written": written, "saveState": saved_in_memory, "saveBullet": saved_in_a_file}
        best = SaveMethod(_BEST, self._with_targets(written))
        return Figures(ways=ways, changes=changes, let_pass=let_pass, best=best)

    def disturbances(self, point: SavePoint) -> tuple[Disturbance, ...]:
        def links(machine: Client) -> None:
            for body, link, _ in machine.world.links():
                if link >= 0:
                    pb.getLinkState(
                        body, link, computeForwardKinematics=1, physicsClientId=machine.client
                    )

        def dynamics(machine: Client) -> None:
            qpos, _ = machine.world.read()
            for tree in machine.world.trees:
                if tree.driven:
                    places, none = qpos[tree.qpos].tolist(), [0.0] * len(tree.dofs)
                    machine.world.needed(tree, places, none, none)
                    machine.world.mass_matrix(tree, places)

        return (
            Disturbance("getLinkState, forward kinematics", links),
            Disturbance(
                "getContactPoints", lambda m: pb.getContactPoints(physicsClientId=m.client)
            ),
            Disturbance("inverse dynamics, mass matrix", dynamics),
            Disturbance(
                "saveState",
                lambda m: pb.removeState(pb.saveState(m.client), physicsClientId=m.client),
            ),
            Disturbance(
                "performCollisionDetection",
                lambda m: pb.performCollisionDetection(m.client),
                promised=False,
            ),
        )
