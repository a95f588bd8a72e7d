"""A stepped world of PyBullet's with what drives its joints: what is PyBullet's own of a Data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..interface import DERIVED, POSES, Array
from ..rotations import matrix_from_quat
from . import _dense as dense
from ._bullet_arm import Arm, Motors
from ._bullet_client import pb
from ._bullet_contacts import contacts
from ._bullet_law import Law
from ._bullet_shared import Shared, free_dynamics
from ._bullet_world import World
from ._hidden_world import HiddenWorld, Moment, Read, bounded

_TOLD = ("qfrc_bias", "qfrc_actuator")  # of the forces, by PyBullet as it comes

# What each arm knows of the step before: contact (n,) and friction (n,).
Observed = list[tuple[Array, Array]]


class DrivenWorld(HiddenWorld):
    """A world, the arms in it, and the free bodies."""

    engine = "PyBullet"
    errors = (pb.error,)
    raw: World

    def __init__(self, shared: Shared) -> None:
        raw = shared.raw
        self._shared, self._nq, self._nv = shared, int(raw.nq), int(raw.nv)
        self.timestep, self.qpos0 = float(raw.opt.timestep), raw.qpos0
        self.raw = world = World(shared.plan, shared.kind)
        trees = [tree for tree in world.trees if tree.joints]
        self._free = [tree for tree in world.trees if tree.free]
        self._arms: list[Any]
        if shared.kind == "engine":
            self._arms = [Motors(world, tree, raw) for tree in trees]
            self.untold = frozenset(DERIVED) - {*POSES, *_TOLD}
        else:
            self._arms = [Arm(world, tree, shared.ghost, Law(raw, tree)) for tree in trees]
            self.memory_layout = (("contact", raw.nv), ("friction", raw.nv))
        # Whether the arrays of one arm, in their order, are those of the whole model.
        self._alone = not self._free and [type(tree.qpos) for tree in trees] == [slice]
        self._blank = [(arm.nothing, arm.nothing) for arm in self._arms]
        self._driven = False

    def place(self, qpos: Array, qvel: Array, memory: Observed) -> None:
        """As the base says."""
        if self._driven:  # it was interrupted: let go of what it was driven with
            pb.stepSimulation(self.raw.client)
            self._driven = False
        place = self.raw.put if self._shared.kind == "engine" else self.raw.place
        place(qpos, qvel)
        for arm, known in zip(self._arms, memory, strict=True):
            arm.place(qpos, qvel, *known)

    def command(self, ctrl: Array) -> None:
        """To every arm."""
        for arm in self._arms:
            arm.command(ctrl)

    def step(self, afresh: bool = False) -> None:
        """Drive every arm, and let the engine go on."""
        self._driven = True  # torques add up until a step takes them
        for arm in self._arms:
            arm.drive(afresh)
        pb.stepSimulation(self.raw.client)
        self._driven = False
        for tree in self._free:
            self.raw.follow(tree.body)
        for arm in self._arms:
            arm.read()

    def diverging(self) -> bool:
        """Looks at the arms only: to read free bodies takes longer."""
        return not all(bounded(arm.angles, arm.speed, self.fastest) for arm in self._arms)

    def read(self) -> tuple[Array, Array]:
        """As the base says."""
        if self._alone:
            return self._arms[0].angles, self._arms[0].speed
        qpos, qvel = np.empty(self._nq), np.empty(self._nv)
        for arm in self._arms:
            qpos[arm.tree.qpos], qvel[arm.tree.qvel] = arm.angles, arm.speed
        for tree in self._free:
            qpos[tree.qpos], qvel[tree.qvel] = self.raw.read_free(tree)
        self._speed = qvel
        return qpos, qvel

    def renewed(self) -> HiddenWorld:
        """As it comes, only a world that is loaded anew starts alike."""
        if self._shared.kind != "engine":
            return self
        other = self._anew()
        self.close()
        return other

    def _anew(self) -> DrivenWorld:
        """Another one, opened as this one was."""
        return DrivenWorld(self._shared)

    def close(self) -> None:
        """Give the client back."""
        self.raw.close()

    @property
    def memory(self) -> Observed:
        """What each arm knows of the last step."""
        return [(arm.contact, arm.friction) for arm in self._arms]

    @property
    def blank(self) -> Observed:
        """Zeros."""
        return self._blank

    def packed(self, memory: Observed) -> Sequence[Array]:
        """Contact and friction of the arms as arrays (nv,); the engine as it comes has none."""
        contact, friction = np.zeros(self._nv), np.zeros(self._nv)
        for arm, known in zip(self._arms, memory, strict=True):
            contact[arm.tree.dofs], friction[arm.tree.dofs] = known
        return (contact, friction) if self.memory_layout else ()

    def unpacked(self, parts: Sequence[Array]) -> Observed:
        """The other way round."""
        if not parts:
            return self._blank
        contact, friction = parts
        return [(contact[arm.tree.dofs], friction[arm.tree.dofs]) for arm in self._arms]

    def look(self, moment: Moment) -> None:
        """Take one step from it, whose law is solved as if there had been none before."""
        self.place(moment.qpos, moment.qvel, moment.memory)
        self.command(moment.ctrl)
        self.step(afresh=True)
        self.read()

    def kinematics(self, qpos: Array, name: str) -> dict[str, Array]:
        """By the engine's own, in a world that is never stepped."""
        return self._shared.poses(qpos, name)

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        """Contacts, which the step found before it moved; or accelerations and forces."""
        if name == "contacts":
            return {
                name: contacts(self._shared.raw, self.raw, lambda: (read("xpos"), read("xquat")))
            }
        return self._forces(moment, read)

    def _forces(self, moment: Moment, read: Read) -> dict[str, Array]:
        raw = self._shared.raw
        values = {name: np.zeros(raw.nv) for name in DERIVED if name not in POSES}
        for arm in self._arms:
            for name, array in arm.forces().items():
                values[name][arm.tree.dofs] = array
        touched = set(raw.geom_bodyid[read("contacts").geom].ravel().tolist())
        for tree in self._free:
            own, turn = tree.qvel, matrix_from_quat(read("xquat")[tree.root])
            inertia, bias = free_dynamics(raw, tree.root, turn, moment.qvel[own])
            values["qfrc_bias"][own] = bias
            if tree.root in touched:  # what it did beyond falling, contact did
                rate = (self._speed[own] - moment.qvel[own]) / self.timestep
                values["qfrc_contact"][own] = dense.times(inertia, rate) + bias
            pushed = values["qfrc_contact"][own] - bias
            values["qacc"][own] = dense.solved(dense.factored(inertia), pushed)
        for part in ("contact", "friction", "limit"):
            values["qfrc_constraint"] += values[f"qfrc_{part}"]
        return values
