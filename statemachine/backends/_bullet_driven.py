"""A stepped world of PyBullet's with what drives its joints: what is PyBullet's own of a Data.

`Law` drives them by the model's own law, `Motors` as PyBullet's users do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import mujoco
import numpy as np

from ..interface import DERIVED, POSES, Array, Contacts
from ..rotations import matrix_from_quat
from . import _dense as dense
from ._bullet_client import pb
from ._bullet_ghost import free_dynamics, ghost_of
from ._bullet_law import Law, in_force
from ._bullet_plan import Plan
from ._bullet_world import Tree, World
from ._hidden_world import HiddenWorld, Memory, Moment, Read, bounded

_TOLD = ("qfrc_bias", "qfrc_actuator")  # of the forces, by PyBullet as it comes
_GEOM = mujoco.mjtGeom
Act = Callable[[World], None]  # sets something in a world that was opened


class DrivenWorld(HiddenWorld):
    """A world, what drives its trees of joints, and the free bodies."""

    engine = "PyBullet"
    errors = (pb.error,)
    raw: World

    def __init__(
        self, plan: Plan, kind: Literal["stepped", "engine"], acts: tuple[Act, ...] = ()
    ) -> None:
        """Open one.

        Args:
            plan: The compiled model, and what follows from it.
            kind: "stepped" for the emulated contract, "engine" for PyBullet as it comes.
            acts: What is set in the world then.
        """
        raw = plan.raw
        self._plan, self._kind, self._acts = plan, kind, acts
        self._nq, self._nv = int(raw.nq), int(raw.nv)
        self.timestep, self.qpos0 = float(raw.opt.timestep), raw.qpos0
        self.raw = world = World(plan, kind)
        trees = [tree for tree in world.trees if tree.joints]
        self._free = [tree for tree in world.trees if tree.free]
        self._arms: list[Any]
        if kind == "engine":
            self._arms = [Motors(world, tree, raw) for tree in trees]
            self.untold = frozenset(DERIVED) - {*POSES, *_TOLD}
        else:
            self._arms = [Law(raw, world, tree, ghost_of(plan)) for tree in trees]
            self.memory_layout = (("contact", self._nv), ("friction", self._nv))
        # Whether the arrays of one arm, in their order, are those of the whole model.
        self._alone = not self._free and [type(tree.qpos) for tree in trees] == [slice]
        self._driven = False
        for act in acts:
            act(world)

    def place(self, qpos: Array, qvel: Array, memory: Memory) -> None:
        """As the base says."""
        if self._driven:  # it was interrupted: let go of what it was driven with
            pb.stepSimulation(self.raw.client)
            self._driven = False
        place = self.raw.put if self._kind == "engine" else self.raw.place
        place(qpos, qvel)
        for arm in self._arms:
            arm.place(qpos, qvel, *(part[arm.tree.qvel] for part in memory))

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

    def diverging(self, fastest: float) -> bool:
        """Looks at the arms only: to read free bodies takes longer."""
        return not all(bounded(arm.angles, arm.speed, fastest) for arm in self._arms)

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
        if self._kind != "engine":
            return self
        other = DrivenWorld(self._plan, self._kind, self._acts)
        self.close()
        return other

    def close(self) -> None:
        """Give the client back."""
        self.raw.close()

    @property
    def memory(self) -> Memory:
        """Contact and friction (nv,) of the last step; the engine as it comes has none."""
        if self._kind == "engine":
            return ()
        if self._alone:
            return self._arms[0].contact, self._arms[0].friction
        contact, friction = np.zeros(self._nv), np.zeros(self._nv)
        for arm in self._arms:
            own = arm.tree.qvel
            contact[own], friction[own] = arm.contact, arm.friction
        return contact, friction

    def look(self, moment: Moment) -> None:
        """Take one step from it, whose law is solved as if there had been none before."""
        self.place(moment.qpos, moment.qvel, moment.memory)
        self.command(moment.ctrl)
        self.step(afresh=True)
        self.read()

    def kinematics(self, qpos: Array, name: str) -> dict[str, Array]:
        """By the engine's own, in a world that is never stepped."""
        return ghost_of(self._plan).poses(qpos, name)

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        """Contacts, which the step found before it moved; or accelerations and forces."""
        if name == "contacts":
            return {name: contacts_of(self._plan.raw, self.raw, read)}
        raw = self._plan.raw
        values = {name: np.zeros(raw.nv) for name in DERIVED if name not in POSES}
        for arm in self._arms:
            for part, array in arm.forces().items():
                values[part][arm.tree.dofs] = array
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
            [0.0] * len(angles),
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


def contacts_of(raw: mujoco.MjModel, world: World, read: Read) -> Contacts:
    """The contacts that a world found at the beginning of its last step.

    PyBullet knows which links touch. A link may have several geoms: the one whose
    surface is nearest to the point is taken.

    Args:
        raw: The compiled model.
        world: The world; points that are apart and carry no force are left out.
        read: Gives xpos and xquat of that moment by name; asked only where a link has several
            geoms.
    """
    geoms = world.geoms_of_links
    turns: dict[int, Array] = {}  # by body, into its own axes

    def geom_at(body: int, link: int, point: Array) -> int:
        b, candidates = geoms[body, link]
        if len(candidates) == 1:
            return candidates[0]
        if b not in turns:
            turns[b] = matrix_from_quat(read("xquat")[b]).T.copy()
        local = dense.times(turns[b], point - read("xpos")[b])
        return min(candidates, key=lambda g: abs(_distance(raw, g, world.geom_turns[g], local)))

    found: list[tuple[Any, ...]] = []
    for point in world.contact_points():
        _, body_a, body_b, link_a, link_b, on_a, on_b, normal, dist, push = point[:10]
        if dist > 0 and not push:
            continue
        on_a, on_b, normal = np.array(on_a), np.array(on_b), np.array(normal)
        pair = geom_at(body_b, link_b, on_b), geom_at(body_a, link_a, on_a)
        # The normal goes from B to A; friction is what A feels.
        force = push * normal
        for size, direction in (point[10:12], point[12:14]):
            force = force + size * np.array(direction)
        if pair[0] > pair[1]:
            pair, normal, force = pair[::-1], -normal, -force
        frame = _axes(normal)
        found.append((pair, dist, (on_a + on_b) / 2, frame, dense.times(frame, force)))
    count = len(found)
    columns = list(zip(*found, strict=True)) or [()] * 5
    return Contacts(
        geom=np.array(columns[0], dtype=np.int64).reshape(count, 2),
        dist=np.array(columns[1], dtype=np.float64),
        pos=np.array(columns[2], dtype=np.float64).reshape(count, 3),
        frame=np.array(columns[3], dtype=np.float64).reshape(count, 3, 3),
        force=np.array(columns[4], dtype=np.float64).reshape(count, 3),
        torque=np.zeros((count, 3)),
    )


def _axes(normal: Array) -> Array:
    """Contact axes (3, 3) as rows, the first the normal."""
    aside = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.5 else np.array([0.0, 0.0, 1.0])
    first = aside - normal * dense.dot(normal, aside)
    first /= math.hypot(*first)
    return np.array([normal, first, np.cross(normal, first)])


def _distance(raw: mujoco.MjModel, geom: int, turn: Array, point: Array) -> float:
    """Signed distance of a point, in the body's frame, from the surface of its geom [m].

    Args:
        raw: The compiled model.
        geom: Of the body.
        turn: (3, 3) from the body's axes into the geom's.
        point: (3,) [m].
    """
    local = dense.times(turn, point - raw.geom_pos[geom])
    size, kind, box = raw.geom_size[geom], int(raw.geom_type[geom]), raw.geom_aabb[geom]
    if kind in (int(_GEOM.mjGEOM_SPHERE), int(_GEOM.mjGEOM_CAPSULE)):
        # From the middle, or the middle line; a sphere has no second size.
        return float(math.hypot(*local[:2], max(abs(local[2]) - size[1], 0.0)) - size[0])
    if kind == int(_GEOM.mjGEOM_CYLINDER):
        beyond = np.array([np.hypot(local[0], local[1]) - size[0], abs(local[2]) - size[1]])
    else:  # a mesh by the box around it
        beyond = np.abs(local - box[:3]) - box[3:]
    return float(math.hypot(*np.maximum(beyond, 0)) + min(beyond.max(), 0.0))
