"""The bodies of a model, loaded into a client of PyBullet's: trees, planes, and what touches what.

The engine's conventions end here and in what builds on it: quaternions (x, y, z, w), poses of a
body's inertial frame, joints by the index of their link.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from ...interface import Array
from ...rotations import matrix_from_quat, xyzw_from_wxyz
from ..compiled.algebra import quat_of_matrix
from ..compiled.model import gravity
from . import urdf
from .client import as_file, connect, disconnect, load_urdf, pb, times, turned
from .contacts import NO_CONTACT, Solid
from .plan import Plan
from .trees import FileTree, Tree

_PUSHES = 0.03  # of an overlap that a contact undoes in a step; the engine's own is 0.08
UNCLAMPED = 1e12  # [rad/s] beyond HUGE: PyBullet clamps joint speeds at 100 unless told otherwise


class LoadedBodies:
    """A client of PyBullet's and the bodies that were loaded into it.

    Attributes:
        client: What PyBullet's functions want as `physicsClientId`.
        close: Gives the client back. Idempotent.
        trees: The trees of the model, the world's own geoms first.
        geoms_of_links: By PyBullet's body and link, MuJoCo's body and its geoms that touch.
        geom_rotations: By geom that touches, the matrix (3, 3) from its body's axes into its own.
    """

    def __init__(self, plan: Plan, kind: Literal["stepped", "ghost", "engine"]) -> None:
        """Open a client, and load the trees of a model into it.

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
        self._planes: dict[int, int] = {}  # PyBullet's body of each plane
        self._of_file: FileTree | None = None
        self._load_trees(kind)
        self._frames = self._inertial_frames()

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

    def _base_of_file(self, tree: FileTree) -> tuple[Any, Any]:
        """Give the inertial frame of the base in the frame of the link that the free joint moves.

        They are held together by fixed joints. PyBullet reports centres of mass, in double
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

    def weigh(self) -> None:
        """Give every link the inertia of the compiled model's body, in place of its shapes'."""
        for body, link, b in self.links():
            self.change(body, link, localInertiaDiagonal=self._raw.body_inertia[b].tolist())

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

    def _add_contacts(self, kind: Literal["stepped", "engine"]) -> None:
        """Add planes, and settle what can touch what, and how."""
        raw, plan = self._raw, self._plan
        self._add_planes()
        self.geoms_of_links = {
            (body, link): (solid.body, solid.geoms) for body, link, solid in self.solids()
        }
        self.geom_rotations = {
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
        self._base_poses = [(b, pb.getBasePositionAndOrientation(b, self.client)) for b in bodies]

    def _take_surfaces(self) -> None:
        """Take the softness and friction of links, and which of them meet."""
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

    @property
    def stands(self) -> bool:
        """Tell whether the base does not move, though the model has a free joint there."""
        return self._of_file is not None and self._of_file.standing >= 0

    @property
    def reads_file(self) -> bool:
        """Tell whether PyBullet read the robot's file itself, and nothing else is here."""
        return self._of_file is not None

    @property
    def closed(self) -> bool:
        """Tell whether the client was given back; its number may be another's by now."""
        return not self.close.alive

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
        """Yield PyBullet's body and index of each joint, and its degree of freedom."""
        for tree in self.trees:
            for index, dof in zip(tree.joints, tree.dofs[tree.base :].tolist(), strict=True):
                yield tree.body, index, dof

    def links(self) -> Iterator[tuple[int, int, int]]:
        """Yield PyBullet's body and link, and MuJoCo's body, of each that has a mass."""
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
        """Change the same of the base and all links of a body."""
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

    def set_collision_groups(self, group: int = 0, mask: int = 0) -> None:
        """Set the group and the mask of all that can touch; by default nothing meets anything."""
        for body, link in self.geoms_of_links:
            pb.setCollisionFilterGroupMask(body, link, group, mask, self.client)
