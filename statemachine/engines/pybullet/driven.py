"""A model's bodies in a client of their own, driven as PyBullet's users drive them.

The bodies are those that the backend loads. From then on only the engine's own functions are
called. The joints are driven by POSITION_CONTROL; the backend's servo has no part in this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from ...backends.bullet.client import pb
from ...backends.bullet.world import World
from ...interface import Array, Model, make_data


class DrivenClient:
    """A PyBullet client whose position motors follow the commands.

    Attributes:
        world: The bodies and their ids.
        client: PyBullet's number of it.
    """

    def __init__(self, model: Model, world: World) -> None:
        self.world, self.client = world, world.client
        self._range = model.actuator_ctrlrange.T
        self._servos = {  # actuators by degree of freedom
            int(model.jnt_dofadr[joint]): actuator
            for actuator, joint in enumerate(model.actuator_jntid.tolist())
            if joint >= 0
        }

    def start(self, qpos: Array, qvel: Array, ctrl: Array) -> None:
        """Put the bodies to positions (nq,) and velocities (nv,), and command ctrl (nu,)."""
        self.world.put(qpos, qvel)
        self.command(ctrl)

    def command(self, ctrl: Array) -> None:
        """Set the targets of the engine's own motors to ctrl (nu,) [rad or m], within its range."""
        targets = np.clip(ctrl, *self._range)
        for body, index, dof in self.world.joints():
            if dof in self._servos:
                pb.setJointMotorControl2(
                    body,
                    index,
                    pb.POSITION_CONTROL,
                    targetPosition=float(targets[self._servos[dof]]),
                    physicsClientId=self.client,
                )

    def advance(self, steps: int) -> None:
        """Take `steps` of the engine's own steps."""
        for _ in range(steps):
            pb.stepSimulation(self.client)

    def positions(self) -> Array:
        """Return the joints' positions [rad or m], then place and quaternion of each free base."""
        places = [
            pb.getJointState(body, index, self.client)[0] for body, index, _ in self.world.joints()
        ]
        for tree in self.world.trees:
            if tree.free:
                for part in pb.getBasePositionAndOrientation(tree.body, self.client):
                    places += part
        return np.array(places)

    def positions_along(self, steps: int) -> Array:
        """Advance by `steps`; return the positions (steps, k), as of `positions`, after each."""
        rows = []
        for _ in range(steps):
            self.advance(1)
            rows.append(self.positions())
        return np.array(rows)

    def contacts(self) -> int:
        """Return the number of contacts at which surfaces touch."""
        points = pb.getContactPoints(physicsClientId=self.client)
        return sum(point[8] <= 0 for point in points)


@contextmanager
def stepper(
    model: Model, qpos: Array, qvel: Array, ctrl: Array
) -> Iterator[Callable[[int], object]]:
    """Yield a function that takes so many steps, from this start under this command."""
    with make_data(model) as data:  # its bodies; none of its verbs is called
        driven = DrivenClient(model, data.raw)
        driven.start(qpos, qvel, ctrl)
        yield driven.advance
