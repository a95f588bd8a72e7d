"""The joints of one tree in a stepped world, and what drives them.

`Arm` drives them by the model's own law, `Motors` as PyBullet's users do.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from ..interface import Array
from . import _dense as dense
from ._bullet_client import pb
from ._bullet_law import Law, Solution, in_force
from ._bullet_world import Tree, World


class Arm:
    """One tree of joints in a stepped world, driven by its law.

    Attributes:
        q, v: Positions and velocities, as the engine has them; `angles` and `speed` are
            the same as arrays.
        friction: (n,) the dry friction of the last step [N·m or N].
        last: What the last step was driven with.
    """

    def __init__(self, world: World, tree: Tree, ghost: World, law: Law) -> None:
        twin = next(other for other in ghost.trees if other.root == tree.root)
        self._ghost = (twin.body, ghost.client)
        self._client, self._body = world.client, tree.body
        self.tree, self.law = tree, law
        self.last: Solution | None = None
        self.angles = self.speed = np.zeros(len(tree.dofs))
        self.q: Sequence[float] = []
        self.v: Sequence[float] = []
        self.nothing = self.friction = np.zeros(len(tree.dofs))
        self._contact: Array | None = self.nothing

    def place(self, qpos: Array, qvel: Array, contact: Array, friction: Array) -> None:
        """Start from a state; contact and friction (n,) are those of the step before it."""
        self._take(qpos[self.tree.qpos].tolist(), qvel[self.tree.qvel].tolist())
        self._contact, self.friction = contact, friction
        self.last = None

    def read(self) -> None:
        """Take over what the engine made of the last step."""
        states = pb.getJointStates(self._body, self.tree.joints, self._client)
        q, v, _, _ = zip(*states, strict=True)
        self._take(q, v)
        self._contact = None

    def _take(self, q: Sequence[float], v: Sequence[float]) -> None:
        self.q, self.v = q, v
        self._x = x = np.array([*q, *v, 1.0])
        self.angles, self.speed = x[: len(q)], x[len(q) : -1]

    @property
    def contact(self) -> Array:
        """(n,) the generalised force of contacts during the last step [N·m or N]."""
        if self._contact is None:
            last = self.last
            assert last is not None  # it was read after a step
            rate = ((self.speed - last.speed) / self.law.timestep).tolist()
            needed = pb.calculateInverseDynamics(
                self._body, last.qpos, last.qvel, rate, 0, self._client
            )
            self._contact = np.array(needed) - self._torque
        return self._contact

    def forces(self) -> dict[str, Array]:
        """Accelerations and forces of the last step, by their names in the contract."""
        last, contact = self.last, self.contact
        assert last is not None  # it was read after a step
        total = last.actuator + last.passive + last.friction + last.limit + contact
        factor = dense.factored(last.mass + np.diag(self.law.armature))
        return {
            "qacc": dense.solved(factor, total - last.bias),
            "qfrc_bias": last.bias,
            "qfrc_actuator": last.actuator,
            "qfrc_passive": last.passive,
            "qfrc_friction": last.friction,
            "qfrc_limit": last.limit,
            "qfrc_contact": contact,
        }

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model."""
        self._aim = self.law.aim(ctrl)

    def drive(self, afresh: bool = False) -> None:
        """Give the engine the torque of the next step."""
        contact = self.contact
        self.last = last = self.law.solve(
            self._ghost, self.q, self.v, self._x, self._aim, contact, self.friction, afresh
        )
        self.friction = last.friction
        needed = pb.calculateInverseDynamics(
            self._body, self.q, self.v, last.acceleration.tolist(), 0, self._client
        )
        self._torque = np.array(needed) - contact
        pb.setJointMotorControlArray(
            self._body,
            self.tree.joints,
            pb.TORQUE_CONTROL,
            forces=self._torque.tolist(),
            physicsClientId=self._client,
        )


class Motors:
    """One tree of joints as PyBullet's users drive it: POSITION_CONTROL to ctrl."""

    def __init__(self, world: World, tree: Tree, raw: mujoco.MjModel) -> None:
        self._world, self.tree = world, tree
        joints = raw.dof_jntid[tree.dofs].tolist()
        pairs = [
            (joints.index(raw.actuator_trnid[a, 0]), int(raw.actuator_ctrladr[a]))
            for a in np.flatnonzero(in_force(raw))
            if raw.actuator_trnid[a, 0] in joints
        ]
        self.contact = self.friction = self.nothing = np.zeros(len(tree.dofs))
        self._driven = [tree.joints[place] for place, _ in pairs]
        self._ids = [a for _, a in pairs]

    def place(self, qpos: Array, qvel: Array, *_: Array) -> None:
        """Start from a state."""
        # Copies: a slice would follow what is written into the arrays.
        self.angles, self.speed = qpos[self.tree.qpos].copy(), qvel[self.tree.qvel].copy()

    def read(self) -> None:
        """Take over what the engine made of the last step."""
        states = pb.getJointStates(self.tree.body, self.tree.joints, self._world.client)
        self.angles, self.speed, self.torque = np.array([(s[0], s[1], s[3]) for s in states]).T

    def forces(self) -> dict[str, Array]:
        """What the engine tells: its bias, and the torque of its motors in the last step."""
        angles, speed = self._before
        bias = pb.calculateInverseDynamics(
            self.tree.body,
            angles.tolist(),
            speed.tolist(),
            self.nothing.tolist(),
            physicsClientId=self._world.client,
        )
        return {"qfrc_bias": np.array(bias), "qfrc_actuator": self.torque}

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model."""
        self._targets = ctrl[self._ids].tolist()

    def drive(self, afresh: bool = False) -> None:
        """Command the motors, as a PyBullet user would; without actuation, nothing is said."""
        self._before = self.angles, self.speed
        if self._driven:
            pb.setJointMotorControlArray(
                self.tree.body,
                self._driven,
                pb.POSITION_CONTROL,
                targetPositions=self._targets,
                physicsClientId=self._world.client,
            )
