"""The kinematics and dynamics of the trees in a client of PyBullet's, by its own algorithms.

Inverse dynamics, mass matrix and Jacobians, in MuJoCo's coordinates: a floating base moves by
its origin in the world's axes, and turns in its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any, Literal

import numpy as np

from ...installed import silence
from ...interface import Array
from ...rotations import INVERSE, cross, matrix_from_quat, wxyz_from_xyzw
from ...rotations import times as quat_times
from .. import dense
from ..hidden_world import HiddenWorld
from . import urdf
from .client import pb, times, turned
from .loaded_bodies import LoadedBodies
from .plan import Plan
from .trees import Tree

_ORIGIN = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # a pose, as the engine has them


class TreeDynamics(LoadedBodies):
    """Bodies in a client, and what the engine computes of the trees that they are.

    Attributes:
        client, close, trees, geoms_of_links, geom_rotations: As of LoadedBodies.
    """

    def __init__(self, plan: Plan, kind: Literal["stepped", "ghost", "engine"]) -> None:
        """Load the trees, and let the engine say what it has to say of each.

        Args:
            plan: The compiled model and what follows from it.
            kind: "stepped" for the emulated contract; "ghost" for the true inertias of
                what has joints, never to be stepped; "engine" for PyBullet as it comes.

        Raises:
            EngineError: The process has no room for another client.
            ModelError: PyBullet cannot read what was written for it.
        """
        super().__init__(plan, kind)
        raw = plan.raw
        # The axes of each body in those of its inertia, which armature turns in what is stepped.
        self._inward = raw.body_iquat * INVERSE
        if kind == "stepped":
            for body, link, b in self.links():
                axes = pb.getDynamicsInfo(body, link, self.client)[4]
                self._inward[b] = wxyz_from_xyzw(np.array(axes)) * INVERSE
        # Of their bases: what of T is constant, see `_base_axes`, and the body's axes in the frame.
        self._changes = {body: _base_change(*frame) for body, frame in self._frames.items()}
        self._known_base: Any = (None, None, None)
        self._turns_gravity = any(tree.free and tree.driven for tree in self.trees)
        with silence():  # what it has to say of a tree, it says the first time
            for tree in self.trees:
                if tree.driven:
                    zero = [0.0] * len(tree.dofs)
                    pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0] if tree.free else []
                    self.needed(tree, [*pose, *zero[tree.base :]], zero, zero)

    def needed(
        self, tree: Tree, q: Sequence[float], v: Sequence[float], rate: Sequence[float]
    ) -> Sequence[float]:
        """Return the generalised force (n,) that gives a tree an acceleration, by inverse dynamics.

        PyBullet takes the angles of a base in another order than it gives them. So a tree that
        floats is passed to it in the axes of its base, and gravity turned into them.

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
            spin = v[3:6]
            swing = cross(rate[3:6], centre) + cross(spin, cross(spin, centre))
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
            moment = np.add(moment, cross(centre, turned(axes, force[:3]))).tolist()
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
        """Return M (n, n) of a tree where its `qpos` are q, in the coordinates of its `qvel`."""
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
        """Return two matrices of the base of a tree that floats, at its positions q.

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
        """Return the xpos (n, 3) and xquat (n, 4) of bodies that are not the engine's base."""
        links = [tree.links[body] for body in bodies]
        return self.frames(bodies, *self.centres(tree, links))

    def frames(self, bodies: Sequence[int], centres: Array, axes: Array) -> tuple[Array, Array]:
        """Return the xpos (n, 3) and xquat (n, 4) of bodies, from what `centres` returns of their
        links.
        """
        quats = quat_times(wxyz_from_xyzw(axes), self._inward[bodies])
        turns = matrix_from_quat(quats)
        return centres - np.einsum("bij,bj->bi", turns, self._raw.body_ipos[bodies]), quats

    def centres(self, tree: Tree, links: Sequence[int]) -> tuple[Array, Array]:
        """Return the centres of mass (n, 3), and their axes (n, 4) (x, y, z, w), of some links."""
        if not links:
            return np.empty((0, 3)), np.empty((0, 4))
        states = pb.getLinkStates(
            tree.body, links, computeForwardKinematics=1, physicsClientId=self.client
        )
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])

    def jacobian(
        self, tree: Tree, q: Sequence[float], body: int, pose: tuple[Array, Array], point: Array
    ) -> Array:
        """Return the Jacobian (6, n) of a point that is fixed to a body, linear rows first, by the
        tree's `qvel`.

        Args:
            tree: The tree, which the world has in the same pose.
            q: Its `qpos`.
            body: MuJoCo's id.
            pose: xpos (3,) and the body's axes (3, 3).
            point: (3,) in the world.
        """
        where, turned = pose
        # What the engine reports is of the origin of the link, where its last joint is.
        origin = where + dense.times(turned, urdf.anchor(self._raw, body))
        zeros, angles = [0.0] * len(tree.joints), q[7 * tree.free :]
        if tree.joints:
            rows = pb.calculateJacobian(
                tree.body, tree.links[body], (0.0, 0.0, 0.0), angles, zeros, zeros, self.client
            )
        else:  # of a body without joints it reports nothing
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
