"""A stepped world of PyBullet's with what drives its joints: PyBullet's part of a Data.

`JointDynamics` drives them by the model's own dynamics, `Motors` as PyBullet's users do. The Data
of one Model share a `Ghost`, whose kinematics have no state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal
from weakref import proxy

import numpy as np

from ...interface import DERIVED, POSES, Array, JointType
from ...interface.records import Arrays
from ...rotations import cross, matrix_from_quat, wxyz_from_xyzw
from .. import dense
from ..compiled.model import gravity
from ..hidden_world import HiddenWorld, Memory, Moment, Read, bounded
from .client import pb
from .contacts import contacts_of
from .drives import in_force
from .joint_dynamics import JointDynamics
from .plan import Plan
from .world import Tree, World

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_AVAILABLE = ("qfrc_bias", "qfrc_actuator")  # of the forces, by PyBullet as it comes
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
        self._nq, self._nv, self._nu = int(raw.nq), int(raw.nv), int(raw.nu)
        self.timestep, self.qpos0 = float(raw.opt.timestep), raw.qpos0
        self.raw = world = World(plan, kind)
        trees = [tree for tree in world.trees if tree.driven]
        self._free = [tree for tree in world.trees if tree.free and not tree.driven]
        self._arms: list[Any]
        if kind == "engine":
            self._arms = [Motors(world, tree, raw) for tree in trees]
            self.unavailable = frozenset(DERIVED) - {*POSES, *_AVAILABLE}
        else:
            self._arms = [JointDynamics(raw, world, tree, ghost_of(plan)) for tree in trees]
            self.memory_layout = (("contact", self._nv), ("friction", self._nv))
            if raw.na:
                self.memory_layout += (("act", int(raw.na)),)
                self.kept_memory = ("act",)
        # Whether the arrays of one arm, in their order, are those of the whole model.
        self._alone = (
            not self._free
            and [type(tree.qpos) for tree in trees] == [slice]
            and sum(len(tree.dofs) for tree in trees) == self._nv
        )
        self._driven, self._placed = False, None
        for act in acts:
            act(world)

    def place(self, qpos: Array, qvel: Array, memory: Memory) -> None:
        """Place all bodies, as the base class says."""
        if self._driven:  # it was interrupted: let go of what it was driven with
            pb.stepSimulation(self.raw.client)
            self._driven = False
        place = self.raw.put if self._kind == "engine" else self.raw.place
        place(qpos, qvel)
        self._placed = qpos, qvel, memory
        for arm in self._arms:
            arm.place(qpos, qvel, *(part[arm.tree.qvel] for part in memory[:2]))
            if len(memory) > 2:
                arm.drives.act = memory[2][arm.drives.places]
        self._act = memory[2:]

    def command(self, ctrl: Array) -> None:
        """Command every arm, and place again what is fixed to a mocap body that moves."""
        if len(ctrl) > self._nu and self.raw.move_mocap(ctrl[self._nu :]) and self._placed:
            self.place(*self._placed)
        for arm in self._arms:
            arm.command(ctrl)

    def step(self, afresh: bool = False) -> None:
        """Drive every arm, and let the engine go on."""
        self._driven, self._placed = True, None  # torques add up until a step takes them
        for arm in self._arms:
            arm.drive(afresh)
        pb.stepSimulation(self.raw.client)
        self._driven = False
        for tree in self._free:
            self.raw.follow(tree.body)
        for arm in self._arms:
            arm.read()

    def diverging(self, fastest: float) -> bool:
        """Return a quick check of the arms only, as reading free bodies takes longer."""
        return not all(bounded(arm.positions, arm.speed, fastest) for arm in self._arms)

    def read(self) -> tuple[Array, Array]:
        """Return positions and velocities, as the base class says."""
        if self._alone:
            return self._arms[0].positions, self._arms[0].speed
        qpos, qvel = np.empty(self._nq), np.zeros(self._nv)
        self.raw.read_standing(qpos)
        for arm in self._arms:
            qpos[arm.tree.qpos], qvel[arm.tree.qvel] = arm.positions, arm.speed
        for tree in self._free:
            qpos[tree.qpos], qvel[tree.qvel] = self.raw.read_free(tree)
        self._speed = qvel
        return qpos, qvel

    def renewed(self) -> HiddenWorld:
        """Return this world, or as it comes a world that is loaded anew: only that starts alike."""
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
        """Return the contact and friction forces (nv,) of the last step, and activations; as it
        comes, none.
        """
        if self._kind == "engine":
            return ()
        if self._alone and not self.kept_memory:
            return self._arms[0].contact, self._arms[0].friction
        contact, friction = np.zeros(self._nv), np.zeros(self._nv)
        act = [values.copy() for values in self._act]  # of what is off, as it was
        for arm in self._arms:
            own = arm.tree.qvel
            contact[own], friction[own] = arm.contact, arm.friction
            for values in act:
                values[arm.drives.places] = arm.drives.act
        return contact, friction, *act

    def memory_at(self, key: int | None) -> Memory:
        """Return the memory of a keyframe: its activations."""
        memory = super().memory_at(key)
        if key is None or not self.kept_memory:
            return memory
        return *memory[:2], self._plan.raw.key_act[key]

    def look(self, moment: Moment) -> None:
        """Take one step from a moment, with joint dynamics solved as if no step preceded it."""
        self.place(moment.qpos, moment.qvel, moment.memory)
        self.command(moment.ctrl)
        self.step(afresh=True)
        self.read()

    def kinematics(self, moment: Moment, name: str) -> Arrays:
        """Return poses by the engine's own kinematics, in a world that is never stepped."""
        with HiddenWorld.lock:
            ghost = ghost_of(self._plan)
            ghost.move_mocap(moment.ctrl[self._nu :])
            return ghost.poses(moment.qpos, name)

    def derive(self, name: str, moment: Moment, read: Read) -> dict[str, Any]:
        """Return the Contacts, which the step found before it moved, or accelerations and
        forces.
        """
        world, raw = self.raw, self._plan.raw
        if name == "contacts":
            points = pb.getContactPoints(physicsClientId=world.client)
            return {
                name: contacts_of(raw, points, world.geoms_of_links, world.geom_rotations, read)
            }
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
        for part in ("contact", "friction", "limit", "equality"):
            values["qfrc_constraint"] += values[f"qfrc_{part}"]
        return values


class Motors:
    """One tree of joints as PyBullet's users drive it: POSITION_CONTROL to ctrl."""

    def __init__(self, world: World, tree: Tree, raw: MjModel) -> None:
        self._world, self.tree = world, tree
        joints = raw.dof_jntid[tree.dofs[tree.base :]].tolist()
        self._driven: list[int] = []  # PyBullet's index of each joint that is driven
        self._ids: list[int] = []  # and the number of ctrl that it takes
        for a in np.flatnonzero(in_force(raw)).tolist():
            joint = int(raw.actuator_trnid[a, 0])
            if joint in joints:
                self._driven.append(tree.joints[joints.index(joint)])
                self._ids.append(int(raw.actuator_ctrladr[a]))

    def place(self, qpos: Array, qvel: Array, *_: Array) -> None:
        """Start from a state."""
        # Copies: a slice would follow what is written into the arrays.
        self.positions, self.speed = qpos[self.tree.qpos].copy(), qvel[self.tree.qvel].copy()

    def read(self) -> None:
        """Take over what the engine made of the last step."""
        positions, speed = self._world.read_tree(self.tree)
        self.positions, self.speed = np.array(positions), np.array(speed)

    def forces(self) -> Arrays:
        """Return the forces that the engine offers: its bias, and the torque of its motors in
        the last step.
        """
        positions, speed = (array.tolist() for array in self._before)
        bias = self._world.needed(self.tree, positions, speed, [0.0] * len(speed))
        torque = np.zeros(len(speed))
        states = pb.getJointStates(self.tree.body, self.tree.joints, self._world.client)
        torque[self.tree.base :] = [state[3] for state in states]
        return {"qfrc_bias": np.array(bias), "qfrc_actuator": torque}

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model."""
        self._targets = ctrl[self._ids].tolist()

    def drive(self, afresh: bool = False) -> None:
        """Command the motors, as a PyBullet user would; without actuation, give no command."""
        self._before = self.positions, self.speed
        if self._driven:
            pb.setJointMotorControlArray(
                self.tree.body,
                self._driven,
                pb.POSITION_CONTROL,
                targetPositions=self._targets,
                physicsClientId=self._world.client,
            )


def ghost_of(plan: Plan) -> Ghost:
    """Return the ghost of a plan: one for all Data of all Models that have the plan."""
    with HiddenWorld.lock:  # for two threads that make the first Data at once
        if plan.ghost is None:
            plan.ghost = Ghost(plan)
        return plan.ghost


class Ghost(World):
    """The true robot in a client that is never stepped: kinematics and dynamics of its joints."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(proxy(plan), "ghost")  # a Plan has its ghost: no circle keeps both
        self._known: dict[bool, list[tuple[Array, Array]]] = {}  # of the sites, and of the bodies
        self._known_at, self._rest = b"?", np.zeros(plan.raw.nv)

    def poses(self, qpos: Array, name: str) -> Arrays:
        """Return the poses of bodies, or of sites, by the engine's own forward kinematics.

        Centres of mass and their axes are what PyBullet reports in double precision; a
        site is the centre of mass of a link of its own, where the tree has room for one.

        Args:
            qpos: (nq,) where the joints are.
            name: Of `POSES`; only what it needs is computed.
        """
        if name in ("site_xpos", "site_xmat"):
            return {name: self._sites(qpos, name)}
        raw = self._raw
        xpos, xquat = self.still.xpos.copy(), self.still.xquat.copy()
        for tree, centres in zip(self.trees, self._states(qpos), strict=True):
            bodies = list(tree.links)
            xpos[bodies], xquat[bodies] = self.frames(bodies, *centres)
        for joint in np.flatnonzero(raw.jnt_type == JointType.FREE):
            body, start = int(raw.jnt_bodyid[joint]), int(raw.jnt_qposadr[joint])
            quat = qpos[start + 3 : start + 7]
            xpos[body], xquat[body] = qpos[start : start + 3], quat / math.hypot(*quat)
        return {"xpos": xpos, "xquat": xquat}

    def _sites(self, qpos: Array, name: str) -> Array:
        """Return site_xpos or site_xmat."""
        raw, values = self._raw, np.array(getattr(self.still, name))
        placed = name == "site_xpos"
        for tree, (where, turned) in zip(self.trees, self._states(qpos, True), strict=True):
            values[list(tree.tips)] = (
                where if placed else matrix_from_quat(wxyz_from_xyzw(turned)).reshape(-1, 9)
            )
        sites = self._carried_sites
        if len(sites):
            bodies, poses = raw.site_bodyid[sites], self.poses(qpos, "xpos")
            turns = matrix_from_quat(poses["xquat"][bodies])
            if placed:
                offset = np.einsum("bij,bj->bi", turns, raw.site_pos[sites])
                values[sites] = poses["xpos"][bodies] + offset
            else:
                own = matrix_from_quat(raw.site_quat[sites])
                values[sites] = np.einsum("bij,bjk->bik", turns, own).reshape(-1, 9)
        return values

    @cached_property
    def _carried_sites(self) -> Any:
        """Return the sites that move and have no link: of free bodies, and of trees without room
        for it.
        """
        linked = [site for tree in self.trees for site in tree.tips]
        moving = self._raw.body_weldid[self._raw.site_bodyid] > 0
        return np.flatnonzero(moving & ~np.isin(np.arange(self._raw.nsite), linked))

    def _states(self, qpos: Array, sites: bool = False) -> list[tuple[Array, Array]]:
        """Return centres of mass and axes (x, y, z, w) of the bodies or sites of each tree of
        joints.
        """
        at = qpos.tobytes()
        with HiddenWorld.lock:
            if self._known_at != at:
                self._known, self._known_at = {}, at
            if sites not in self._known:
                self.put(qpos, self._rest)
                self._known[sites] = [
                    self.centres(tree, [*(tree.tips if sites else tree.links).values()])
                    for tree in self.trees
                ]
            return self._known[sites]


def free_dynamics(raw: MjModel, body: int, turn: Array, qvel: Array) -> tuple[Array, Array]:
    """Return the mass matrix (6, 6) and bias (6,) of a free body, in MuJoCo's coordinates.

    Newton's and Euler's equations about the centre of mass, whose velocity is J·qvel.
    """
    mass, centre = float(raw.body_mass[body]), raw.body_ipos[body]
    axes = matrix_from_quat(raw.body_iquat[body])
    inertia = np.einsum("ij,j,kj->ik", axes, raw.body_inertia[body], axes)
    spin = qvel[3:]
    lever = np.cross(np.eye(3), centre)  # lever @ w = w × centre … of rows
    turning = dense.product(turn, np.asarray(lever.T, dtype=np.float64))
    jacobian = np.hstack([np.eye(3), turning])
    total = mass * dense.product(jacobian.T, jacobian)
    total[3:, 3:] += inertia
    whirl = dense.times(turn, cross(spin, cross(spin, centre)))
    bias = dense.times(jacobian.T, mass * (whirl - gravity(raw)))
    bias[3:] += cross(spin, dense.times(inertia, spin))
    return total, bias
