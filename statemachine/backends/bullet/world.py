"""One hidden world of PyBullet: a DIRECT client, and the bodies of a model in it.

The engine's conventions end here: quaternions (x, y, z, w), poses and velocities of a
body's inertial frame, joints by the index of their link.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ...installed import silence
from ...interface import Array
from ...rotations import INVERSE, matrix_from_quat, wxyz_from_xyzw, xyzw_from_wxyz
from ...rotations import times as quat_times
from .. import dense
from ..compiled import gravity
from ..compiled_algebra import quat_of_matrix
from ..compiled_stages import compute_kinematics
from ..hidden_world import HiddenWorld
from . import urdf
from .client import (
    Quat,
    as_file,
    connect,
    disconnect,
    load_urdf,
    pb,
    times,
    turned,
)
from .contacts import NO_CONTACT, Solid
from .plan import Plan
from .trees import FileTree, Tree

if TYPE_CHECKING:
    from ..compiled_types import MjData

_PUSHES = 0.03  # of an overlap that a contact undoes in a step; the engine's own is 0.08
_AWAY = 1000.0  # [m] between bodies that a reset has set apart
_TILT = 5e-4  # half the angle [rad] by which it tilts a free body to find its contacts
_ORIGIN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # a pose, as the engine has them
_REST = math.sqrt(1 - 2 * _TILT**2)


class World:
    """A client of PyBullet's and what is in it.

    Attributes:
        client: What PyBullet's functions want as `physicsClientId`.
        close: Gives the client back. Idempotent.
        trees: The trees of the model, the world's own geoms first.
        geoms_of_links: By PyBullet's body and link, MuJoCo's body and its geoms that touch.
        geom_turns: By geom that touches, the matrix (3, 3) from its body's axes into its own.
    """

    def __init__(self, plan: Plan, kind: Literal["stepped", "ghost", "engine"]) -> None:
        """Make a world.

        Args:
            plan: The compiled model and what follows from it.
            kind: "stepped" for the emulated contract; "ghost" for the true inertias of
                what has joints, never to be stepped; "engine" for PyBullet as it comes.

        Raises:
            EngineError: The process has no room for another client.
            ModelError: PyBullet cannot read what was written for it.
        """
        self._plan, self._raw, self._surfaces = plan, plan.raw, plan.surfaces
        raw = plan.raw
        self.client = connect()
        self.close = weakref.finalize(self, disconnect, self.client)
        pb.setPhysicsEngineParameter(enableFileCaching=0, physicsClientId=self.client)
        self._gravity = gravity(raw).tolist()
        pb.setGravity(*self._gravity, self.client)
        self.trees: list[Tree] = []
        self._led = b""  # what `lead` was told last
        self._planes: dict[int, int] = {}  # PyBullet's body of each plane
        self._of_file: FileTree | None = None
        self._load_trees(kind)
        self._frames = self._inertial_frames()
        # The axes of each body in those of its inertia, which armature turns in what is stepped.
        self._inward = raw.body_iquat * INVERSE
        if kind == "stepped":
            for body, link, b in self.links():
                axes = pb.getDynamicsInfo(body, link, self.client)[4]
                self._inward[b] = wxyz_from_xyzw(np.array(axes)) * INVERSE
        # Of their bases: what of T is constant, see `_base_axes`, and the body's axes in the frame.
        self._changes = {body: _base_change(*frame) for body, frame in self._frames.items()}
        self._known_base: Any = (None, None, None)
        # Where a base stands that PyBullet does not move, though it has a free joint.
        self._stands: Array | None = None
        self._last: dict[int, Quat] = dict.fromkeys(self._frames, (0.0, 0.0, 0.0, 1.0))
        self._turns_gravity = any(tree.free and tree.driven for tree in self.trees)
        with silence():  # what it has to say of a tree, it says the first time
            for tree in self.trees:
                if tree.driven:
                    zero = [0.0] * len(tree.dofs)
                    pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0] if tree.free else []
                    self.needed(tree, [*pose, *zero[tree.base :]], zero, zero)
        if kind != "ghost":
            pb.setTimeStep(raw.opt.timestep, self.client)
            self._add_contacts(kind)

    def _load_trees(self, kind: Literal["stepped", "ghost", "engine"]) -> None:
        """Load the robot as its file has it, or what was written of each tree."""
        plan = self._plan
        if kind == "engine" and plan.file:
            self._of_file = FileTree(plan, plan.file.load(self.client), self.client)
            self.trees.append(self._of_file)
            return
        for root in (0, *plan.roots):
            if plan.driven(root) or kind != "ghost":
                self._load(root, kind)

    def _inertial_frames(self) -> dict[int, Any]:
        """Return of each free body the inertial frame in the body's own: place and quaternion."""
        frames = {
            tree.body: pb.getDynamicsInfo(tree.body, -1, self.client)[3:5]
            for tree in self.trees
            if tree.free
        }
        if self._of_file and self._of_file.carrier >= 0:
            frames[self._of_file.body] = self._base_of_file(self._of_file)
        return frames

    def _add_contacts(self, kind: Literal["stepped", "engine"]) -> None:
        """Add planes, and settle what can touch what, and how."""
        raw, plan = self._raw, self._plan
        self._add_planes()
        self.geoms_of_links = {
            (body, link): (solid.body, solid.geoms) for body, link, solid in self.solids()
        }
        self.geom_turns = {
            g: matrix_from_quat(raw.geom_quat[g]).T.copy()
            for _, geoms in self.geoms_of_links.values()
            for g in geoms
        }
        if kind == "engine" and (plan.weighed or (plan.file and raw.opt.disableflags & NO_CONTACT)):
            self.set_collision_groups()
        if kind == "stepped":
            pb.setPhysicsEngineParameter(
                deterministicOverlappingPairs=1, physicsClientId=self.client
            )
            self._take_surfaces()
        bodies = [tree.body for tree in self.trees] + list(self._planes.values())
        self._homes = [(b, pb.getBasePositionAndOrientation(b, self.client)) for b in bodies]

    @property
    def stands(self) -> bool:
        """Whether the base does not move, though the model has a free joint there."""
        return self._of_file is not None and self._of_file.standing >= 0

    @property
    def reads_file(self) -> bool:
        """Whether PyBullet read the robot's file itself, and nothing else is here."""
        return self._of_file is not None

    @property
    def closed(self) -> bool:
        """Whether the client was given back; its number may be another's by now."""
        return not self.close.alive

    @cached_property
    def still(self) -> MjData:
        """Where bodies and sites are that no joint moves; those on mocap bodies as they are led."""
        return self._plan.standing()

    def lead(self, poses: Array) -> bool:
        """Put the mocap bodies (7·n,) where `HiddenWorld.command` wants them; whether one moved."""
        raw, still = self._raw, self.still
        if poses.tobytes() == self._led:
            return False
        self._led = poses.tobytes()
        still.mocap_pos.flat, still.mocap_quat.flat = np.split(poses, [3 * raw.nmocap])
        compute_kinematics(raw, still)
        for number, tree in enumerate(self.trees):
            if raw.body_mocapid[tree.root] >= 0:
                # The base is a link without mass at the world's origin, and carries the body.
                turn = quat_times(still.xquat[tree.root], raw.body_quat[tree.root] * INVERSE)
                shift = dense.times(matrix_from_quat(turn), raw.body_pos[tree.root])
                pose = (still.xpos[tree.root] - shift).tolist(), xyzw_from_wxyz(turn).tolist()
                self._homes[number] = tree.body, pose
                pb.resetBasePositionAndOrientation(tree.body, *pose, self.client)
        return True

    def _base_of_file(self, tree: FileTree) -> tuple[Any, Any]:
        """Give the inertial frame of the base in the frame of the link that the free joint moves.

        They are held together by fixed joints. PyBullet tells of centres of mass, in double
        precision.
        """
        state = pb.getLinkState(
            tree.body, tree.carrier, computeForwardKinematics=1, physicsClientId=self.client
        )
        inner, (x, y, z, w) = pb.getDynamicsInfo(tree.body, tree.carrier, self.client)[3:5]
        link = times(state[1], (-x, -y, -z, w))
        origin = np.subtract(state[0], turned(link, inner))
        where, quat = pb.getBasePositionAndOrientation(tree.body, self.client)
        back = (-link[0], -link[1], -link[2], link[3])
        return turned(back, np.subtract(where, origin).tolist()), times(back, quat)

    def weigh(self) -> None:
        """Give every link the inertia of the compiled model's body, in place of its shapes'."""
        for body, link, b in self.links():
            self.change(body, link, localInertiaDiagonal=self._raw.body_inertia[b].tolist())

    def _load(self, root: int, kind: str) -> None:
        raw = self._raw
        text, files = self._plan.described(root, kind)
        if not root and "<collision" not in text:
            return
        flags = (
            pb.URDF_USE_INERTIA_FROM_FILE
            | pb.URDF_USE_SELF_COLLISION
            | pb.URDF_USE_SELF_COLLISION_INCLUDE_PARENT  # which pairs meet, _take_surfaces says
            | pb.URDF_USE_IMPLICIT_CYLINDER  # else a polygon, and a millimetre too large
        )
        with as_file(text, files) as name:
            body = load_urdf(
                self.client,
                name,
                "the URDF of this model",
                useFixedBase=not urdf.floats(raw, root),
                flags=0 if kind == "engine" else flags,
            )
        tree = Tree(self._plan, root, body, self.client)
        self.trees.append(tree)
        if kind == "engine":
            if self._plan.weighed:
                self.weigh()
            return
        self.change_all(body, linearDamping=0, angularDamping=0, maxJointVelocity=UNCLAMPED)
        for index in tree.joints:  # each comes with a motor that holds it
            pb.setJointMotorControl2(
                body, index, pb.VELOCITY_CONTROL, force=0, physicsClientId=self.client
            )

    def _add_planes(self) -> None:
        for solid in self._surfaces.solids:
            if solid.plane:
                (geom,) = solid.geoms
                quat = quat_of_matrix(self._plan.still.geom_xmat[geom])
                shape = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=self.client)
                self._planes[geom] = pb.createMultiBody(
                    0,
                    shape,
                    basePosition=self._plan.still.geom_xpos[geom].tolist(),
                    baseOrientation=xyzw_from_wxyz(quat).tolist(),
                    physicsClientId=self.client,
                )

    def solids(self) -> Iterator[tuple[int, int, Solid]]:
        """Yield PyBullet's body and link of all that can touch.

        In the order of the surfaces; of a robot that PyBullet read itself in that of its links,
        each with the geoms of the body that it is a part of.
        """
        if self._of_file:
            yield from self._solids_of_file(self._of_file)
            return
        links = {}
        for tree in self.trees:
            own = {(b, 0): link for b, link in tree.links.items()} | tree.parts
            links |= {place: (tree.body, link) for place, link in own.items()}
        for solid in self._surfaces.solids:
            body, link = (
                (self._planes[solid.geoms[0]], -1) if solid.plane else links[solid.body, solid.part]
            )
            yield body, link, solid

    def _solids_of_file(self, tree: FileTree) -> Iterator[tuple[int, int, Solid]]:
        raw = self._raw
        touching = (raw.geom_contype | raw.geom_conaffinity).astype(bool)
        for link in range(-1, len(tree.bodies) - 1):
            if pb.getCollisionShapeData(tree.body, link, self.client):
                body = tree.bodies[link]
                geoms = np.flatnonzero(touching & (raw.geom_bodyid == body)).tolist()
                yield tree.body, link, Solid(body, tuple(geoms))

    def joints(self) -> Iterator[tuple[int, int, int]]:
        """PyBullet's body and index of each joint, and its degree of freedom."""
        for tree in self.trees:
            for index, dof in zip(tree.joints, tree.dofs[tree.base :].tolist(), strict=True):
                yield tree.body, index, dof

    def links(self) -> Iterator[tuple[int, int, int]]:
        """PyBullet's body and link, and MuJoCo's body, of all that has a mass."""
        for tree in self.trees:
            for b, link in tree.links.items():
                yield tree.body, link, b

    def soften(self) -> None:
        """Let contacts yield to their own force, and push apart slowly what overlaps."""
        pb.setPhysicsEngineParameter(
            globalCFM=self._plan.softness, contactERP=_PUSHES, physicsClientId=self.client
        )

    def change(self, body: int, link: int, **settings: Any) -> None:
        """Change what the engine keeps of a link, by its own names."""
        pb.changeDynamics(body, link, physicsClientId=self.client, **settings)

    def change_all(self, body: int, **settings: Any) -> None:
        """The same of the base and all links of a body."""
        for link in range(-1, pb.getNumJoints(body, self.client)):
            self.change(body, link, **settings)

    def set_friction(self, slide: Array, spin: Array, roll: Array) -> None:
        """Set the sliding, spinning and rolling friction (nsolid,) of all that can touch."""
        for k, (body, link, _) in enumerate(self.solids()):
            self.change(
                body,
                link,
                lateralFriction=float(slide[k]),
                spinningFriction=float(spin[k]),
                rollingFriction=float(roll[k]),
            )

    def _take_surfaces(self) -> None:
        """Softness and friction of links, and which of them meet."""
        self.soften()
        known = self._surfaces
        self.set_friction(known.slide, known.spin, known.roll)
        links = list(self.geoms_of_links)
        for (i, j), meet in known.pairs.items():
            if not meet:  # the others do, as they were loaded
                (body_a, link_a), (body_b, link_b) = links[i], links[j]
                pb.setCollisionFilterPair(
                    body_a, body_b, link_a, link_b, 0, physicsClientId=self.client
                )

    def set_collision_groups(self, group: int = 0, mask: int = 0) -> None:
        """Set the group and the mask of all that can touch; by default nothing meets anything."""
        for body, link in self.geoms_of_links:
            pb.setCollisionFilterGroupMask(body, link, group, mask, self.client)

    def place(self, qpos: Array, qvel: Array) -> None:
        """Set the state so that what follows depends on nothing that was before.

        PyBullet remembers contacts and which boxes overlap. Everything is taken far
        apart and brought back, in the new pose, which leaves it nothing to remember. It
        finds one point of a contact at a time, and would let a box at rest start on one
        corner: free bodies are tilted a little each way, so that it finds all of them.
        """
        self.put(qpos, qvel)
        # Links of one body cannot be taken apart: for a moment they do not meet.
        self.set_collision_groups(0, 0)
        for i, (body, (_, quat)) in enumerate(self._homes, start=1):
            pb.resetBasePositionAndOrientation(body, (0, 0, _AWAY * i), quat, self.client)
        pb.performCollisionDetection(self.client)
        self.set_collision_groups(1, -1)
        for body, (pos, quat) in self._homes:
            if body not in self._frames:
                pb.resetBasePositionAndOrientation(body, pos, quat, self.client)
        self.put(qpos, qvel)
        if not self._frames:
            return
        poses = {body: pb.getBasePositionAndOrientation(body, self.client) for body in self._frames}
        for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
            for body, (pos, quat) in poses.items():
                tilted = times((x * _TILT, y * _TILT, 0.0, _REST), quat)
                pb.resetBasePositionAndOrientation(body, pos, tilted, self.client)
            pb.performCollisionDetection(self.client)
        for tree in self.trees:
            if tree.free:
                self._put_free(tree, qpos, qvel)

    def put(self, qpos: Array, qvel: Array) -> None:
        """Set the state, and nothing else."""
        if self._of_file and self._of_file.standing >= 0:
            start = int(self._raw.jnt_qposadr[self._of_file.standing])
            self._stands = qpos[start : start + 7].copy()
            where, pose, _, _ = self._base_at(self._of_file.body, self._stands)
            pb.resetBasePositionAndOrientation(self._of_file.body, where, pose, self.client)
        for tree in self.trees:
            if tree.free:
                self._put_free(tree, qpos, qvel)
            if tree.joints:
                positions = qpos[tree.qpos][-len(tree.joints) :, None].tolist()
                velocities = qvel[tree.qvel][-len(tree.joints) :, None].tolist()
                pb.resetJointStatesMultiDof(
                    tree.body, tree.joints, positions, velocities, physicsClientId=self.client
                )

    def _put_free(self, tree: Tree, qpos: Array, qvel: Array) -> None:
        body, qpos, qvel = tree.body, qpos[tree.qpos][:7], qvel[tree.qvel][:6]
        where, pose, turn, arm = self._base_at(body, qpos)
        spin = dense.times(turn, qvel[3:])
        speed = qvel[:3] + np.cross(spin, arm)
        self._last[body] = pose
        pb.resetBasePositionAndOrientation(body, where, pose, self.client)
        pb.resetBaseVelocity(body, speed.tolist(), spin.tolist(), self.client)

    def _base_at(self, body: int, qpos: Array) -> tuple[list[float], Quat, Array, Array]:
        """Give where the engine has a base whose free joint is at qpos (7,).

        Returns:
            Its centre of mass and the quaternion (x, y, z, w) of its inertial frame; the axes
            (3, 3) of the body, and from its origin to that centre (3,), in the world.
        """
        centre, axes = self._frames[body]
        quat = qpos[3:] / math.hypot(*qpos[3:])
        turn = matrix_from_quat(quat)
        arm = dense.times(turn, np.array(centre))
        pose = times(xyzw_from_wxyz(quat).tolist(), axes)
        return (qpos[:3] + arm).tolist(), pose, turn, arm

    def follow(self, body: int) -> tuple[Any, Quat]:
        """Where a base is; of a quaternion and its negative the one nearer to the last.

        They are one rotation. The engine changes between them at will, MuJoCo never:
        to be told after each step, so that a body that turns far keeps its sign.
        """
        where, quat = pb.getBasePositionAndOrientation(body, self.client)
        x, y, z, w = quat
        nx, ny, nz, nw = self._last[body]
        if x * nx + y * ny + z * nz + w * nw < 0:
            quat = (-x, -y, -z, -w)
        self._last[body] = quat
        return where, quat

    def read_free(self, tree: Tree) -> tuple[list[float], list[float]]:
        """What of qpos (7,) and qvel (6,) is a free joint's, in MuJoCo's conventions."""
        centre, (ax, ay, az, aw) = self._frames[tree.body]
        (px, py, pz), pose = self.follow(tree.body)
        (vx, vy, vz), spin = pb.getBaseVelocity(tree.body, self.client)
        quat = pose
        if aw != 1 or any(centre):  # else the frames are one
            quat = times(pose, (-ax, -ay, -az, aw))
            # r: from the body's origin to its centre of mass, in world axes.
            rx, ry, rz = turned(quat, centre)
            wx, wy, wz = spin
            px, py, pz = px - rx, py - ry, pz - rz
            vx = vx - wy * rz + wz * ry
            vy = vy - wz * rx + wx * rz
            vz = vz - wx * ry + wy * rx
        x, y, z, w = quat
        spin = turned((-x, -y, -z, w), spin)
        return [px, py, pz, w, x, y, z], [vx, vy, vz, *spin]

    def read(self) -> tuple[Array, Array]:
        """What the engine tells of positions (nq,) and velocities (nv,)."""
        qpos, qvel = np.zeros(self._raw.nq), np.zeros(self._raw.nv)
        self.read_standing(qpos)
        for tree in self.trees:
            qpos[tree.qpos], qvel[tree.qvel] = self.read_tree(tree)
        return qpos, qvel

    def read_standing(self, qpos: Array) -> bool:
        """Write the position of a base that has a free joint and stands into qpos (nq,), if any."""
        if self._stands is None or self._of_file is None:
            return False
        start = int(self._raw.jnt_qposadr[self._of_file.standing])
        qpos[start : start + 7] = self._stands
        return True

    def read_tree(self, tree: Tree) -> tuple[Sequence[float], Sequence[float]]:
        """The same of one tree, in the order of its `qpos` and `qvel`."""
        if not tree.joints:
            return self.read_free(tree) if tree.free else ((), ())
        q, v, _, _ = zip(*pb.getJointStates(tree.body, tree.joints, self.client), strict=True)
        if tree.free:
            pose, twist = self.read_free(tree)
            return (*pose, *q), (*twist, *v)
        return q, v

    def needed(
        self, tree: Tree, q: Sequence[float], v: Sequence[float], rate: Sequence[float]
    ) -> Sequence[float]:
        """The generalised force (n,) that gives a tree an acceleration, by inverse dynamics.

        PyBullet takes the angles of a base in another order than it gives them. So a tree that
        floats is told to it in the axes of its base, and gravity turned into them.

        Args:
            tree: The tree.
            q: Its positions, in the order of its `qpos`.
            v: Its velocities, in the order of its `qvel`.
            rate: (n,) its acceleration, as qacc.
        """
        if tree is self._of_file and not tree.free:
            return self._needed_on_a_base(tree.body, q, v, rate)
        if not tree.free:
            if not self._turns_gravity:
                return pb.calculateInverseDynamics(tree.body, q, v, rate, 0, self.client)
            with HiddenWorld.lock:
                return pb.calculateInverseDynamics(tree.body, q, v, rate, 0, self.client)
        (centre, axes), (w, x, y, z) = self._frames[tree.body], q[3:7]
        own = (x, y, z, w)
        pose, inward = times(own, axes), (-axes[0], -axes[1], -axes[2], axes[3])
        back, lift = (-pose[0], -pose[1], -pose[2], pose[3]), rate[:3]
        if any(centre):  # only of a tree as it comes: of others the base is the body's origin
            spin = np.array(v[3:6])
            swing = np.cross(rate[3:6], centre) + np.cross(spin, np.cross(spin, centre))
            lift = np.add(lift, turned(own, swing.tolist())).tolist()
        place = [*_ORIGIN, *q[7:]]
        velocity = [*turned(inward, v[3:6]), 0.0, 0.0, 0.0, *v[6:]]
        acceleration = [*turned(inward, rate[3:6]), *turned(back, lift), *rate[6:]]
        with HiddenWorld.lock:  # gravity is all trees' of a client
            try:
                pb.setGravity(*turned(back, self._gravity), self.client)
                force = pb.calculateInverseDynamics(
                    tree.body, place, velocity, acceleration, 0, self.client
                )
            finally:
                pb.setGravity(*self._gravity, self.client)
        moment = turned(axes, force[3:6])
        if any(centre):
            moment = np.add(moment, np.cross(centre, turned(axes, force[:3]))).tolist()
        return [*turned(pose, force[:3]), *moment, *force[6:]]

    def _needed_on_a_base(
        self, body: int, q: Sequence[float], v: Sequence[float], rate: Sequence[float]
    ) -> Sequence[float]:
        """Give the same of a tree whose base stands and weighs something in its file.

        The engine takes gravity in the principal axes of such a base: it is turned into them.
        """
        _, (x, y, z, w) = pb.getBasePositionAndOrientation(body, self.client)
        with HiddenWorld.lock:  # gravity is all trees' of a client
            try:
                pb.setGravity(*turned((-x, -y, -z, w), self._gravity), self.client)
                return pb.calculateInverseDynamics(body, q, v, rate, 0, self.client)
            finally:
                pb.setGravity(*self._gravity, self.client)

    def mass_matrix(self, tree: Tree, q: Sequence[float]) -> Array:
        """M (n, n) of a tree where its `qpos` are q, in the coordinates of its `qvel`."""
        n = len(tree.dofs)
        rows = pb.calculateMassMatrix(tree.body, q[7 * tree.free :], 0, self.client)
        # Faster than np.array.
        mass = np.fromiter(chain.from_iterable(rows), np.float64, n * n).reshape(n, n)
        if tree.free:
            axes, _ = self._base_axes(tree, q)
            mass[:, :6] = dense.product(mass[:, :6].copy(), axes)
            mass[:6] = dense.product(axes.T.copy(), mass[:6].copy())
        return mass

    def _base_axes(self, tree: Tree, q: Sequence[float]) -> tuple[Array, Array]:
        """Of the base of a tree that floats, at its positions q, two matrices.

        T (6, 6), by which the engine's velocities of it are T·qvel: it turns, then moves, in its
        own axes. And where the body's axes (3, 3) point.
        """
        known, at = self._known_base, (tree.body, *q[3:7])
        if known[0] != at:  # all bodies of a tree ask
            change, inward = self._changes[tree.body]
            change, turn = change.copy(), matrix_from_quat(np.array(q[3:7]))
            change[3:, :3] = dense.product(inward, turn.T.copy())
            self._known_base = known = at, change, turn
        return known[1:]

    def body_poses(self, tree: Tree, bodies: Sequence[int]) -> tuple[Array, Array]:
        """The xpos (n, 3) and xquat (n, 4) of bodies that are not the engine's base."""
        links = [tree.links[body] for body in bodies]
        return self.frames(bodies, *self.centres(tree, links))

    def frames(self, bodies: Sequence[int], centres: Array, axes: Array) -> tuple[Array, Array]:
        """The xpos (n, 3) and xquat (n, 4) of bodies, from what `centres` tells of their links."""
        quats = quat_times(wxyz_from_xyzw(axes), self._inward[bodies])
        turns = matrix_from_quat(quats)
        return centres - np.einsum("bij,bj->bi", turns, self._raw.body_ipos[bodies]), quats

    def centres(self, tree: Tree, links: Sequence[int]) -> tuple[Array, Array]:
        """Centres of mass (n, 3), and their axes (n, 4) (x, y, z, w), of some links."""
        if not links:
            return np.empty((0, 3)), np.empty((0, 4))
        states = pb.getLinkStates(
            tree.body, links, computeForwardKinematics=1, physicsClientId=self.client
        )
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def jacobian(
        self, tree: Tree, q: Sequence[float], body: int, pose: tuple[Array, Array], point: Array
    ) -> Array:
        """How a point that is fixed to a body moves, then turns, by the tree's `qvel`: (6, n).

        Args:
            tree: The tree, which the world has in the same pose.
            q: Its `qpos`.
            body: MuJoCo's id.
            pose: xpos (3,) and the body's axes (3, 3).
            point: (3,) in the world.
        """
        where, turned = pose
        # What the engine tells is of the origin of the link, where its last joint is.
        origin = where + dense.times(turned, urdf.anchor(self._raw, body))
        zeros, angles = [0.0] * len(tree.joints), q[7 * tree.free :]
        if tree.joints:
            rows = pb.calculateJacobian(
                tree.body, tree.links[body], (0.0, 0.0, 0.0), angles, zeros, zeros, self.client
            )
        else:  # of a body without joints it tells nothing
            rows, origin = (np.eye(6)[3:], np.eye(6)[:3]), np.array(q[:3])
        moving, turning = (np.array(part) for part in rows)
        if tree.free:
            axes, turn = self._base_axes(tree, q)
            for rows in (moving, turning):
                rows[:, :6] = dense.product(rows[:, :6].copy(), axes)
            moving, turning = dense.product(turn, moving), dense.product(turn, turning)
        return np.vstack([moving + np.cross(turning, point - origin, axisa=0).T, turning])

    def push(self, tree: Tree, q: Sequence[float], force: Array) -> None:
        """Let a generalised force (n,) act on a tree, whose `qpos` are q, in the next step."""
        if tree.free:
            body, moment = tree.body, force[3:6].tolist()
            pb.applyExternalForce(body, -1, force[:3].tolist(), q[:3], pb.WORLD_FRAME, self.client)
            pb.applyExternalTorque(body, -1, moment, pb.LINK_FRAME, self.client)
        if tree.joints:
            pb.setJointMotorControlArray(
                tree.body,
                tree.joints,
                pb.TORQUE_CONTROL,
                forces=force[tree.base :].tolist(),
                physicsClientId=self.client,
            )


def _base_change(centre: Any, axes: Any) -> tuple[Array, Array]:
    """Return what of T is constant (6, 6), and the body's axes (3, 3) in the inertial frame.

    Args:
        centre: (3,) where the inertial frame is in the body's own.
        axes: Its quaternion (x, y, z, w).
    """
    inward = matrix_from_quat(wxyz_from_xyzw(np.array(axes))).T.copy()
    # Times w: w × centre.
    lever = np.array(np.cross(np.eye(3), centre).T, dtype=np.float64, order="C")
    change = np.zeros((6, 6))
    change[:3, 3:], change[3:, 3:] = inward, dense.product(inward, lever)
    return change, inward


ENGINE_TIMESTEP = 1 / 240
UNCLAMPED = 1e12  # [rad/s] beyond HUGE: PyBullet clamps joint speeds at 100 unless told otherwise
