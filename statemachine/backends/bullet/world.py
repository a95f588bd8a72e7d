"""One hidden world of PyBullet: the bodies of a model, and the state that they are in.

The engine's conventions end here: quaternions (x, y, z, w), poses and velocities of a
body's inertial frame, joints by the index of their link.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ...interface import Array
from ...rotations import INVERSE, cross, matrix_from_quat, xyzw_from_wxyz
from ...rotations import times as quat_times
from .. import dense
from ..compiled.stages import compute_kinematics
from .client import Quat, pb, times, turned
from .plan import Plan
from .tree_dynamics import TreeDynamics
from .trees import Tree

if TYPE_CHECKING:
    from ..compiled.types import MjData

_AWAY = 1000.0  # [m] between bodies that a reset has set apart
_TILT = 5e-4  # half the angle [rad] by which it tilts a free body to find its contacts
_REST = math.sqrt(1 - 2 * _TILT**2)
ENGINE_TIMESTEP = 1 / 240


class World(TreeDynamics):
    """Bodies in a client of PyBullet's, and their state: set, followed and read.

    Attributes:
        client, close, trees, geoms_of_links, geom_rotations: As of LoadedBodies.
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
        super().__init__(plan, kind)
        self._mocap_poses = b""  # what `move_mocap` was called with last
        # Where a base stands that PyBullet does not move, though it has a free joint.
        self._stands: Array | None = None
        self._last: dict[int, Quat] = dict.fromkeys(self._frames, (0.0, 0.0, 0.0, 1.0))
        if kind != "ghost":
            pb.setTimeStep(plan.raw.opt.timestep, self.client)
            self._add_contacts(kind)

    @cached_property
    def still(self) -> MjData:
        """Return where bodies and sites are that no joint moves; those on mocap bodies as they
        are led.
        """
        return self._plan.standing()

    def move_mocap(self, poses: Array) -> bool:
        """Put the mocap bodies (7·n,) where `HiddenWorld.command` wants them; whether one moved."""
        raw, still = self._raw, self.still
        if poses.tobytes() == self._mocap_poses:
            return False
        self._mocap_poses = poses.tobytes()
        still.mocap_pos.flat, still.mocap_quat.flat = np.split(poses, [3 * raw.nmocap])
        compute_kinematics(raw, still)
        for number, tree in enumerate(self.trees):
            if raw.body_mocapid[tree.root] >= 0:
                # The base is a link without mass at the world's origin, and carries the body.
                turn = quat_times(still.xquat[tree.root], raw.body_quat[tree.root] * INVERSE)
                shift = dense.times(matrix_from_quat(turn), raw.body_pos[tree.root])
                pose = (still.xpos[tree.root] - shift).tolist(), xyzw_from_wxyz(turn).tolist()
                self._base_poses[number] = tree.body, pose
                pb.resetBasePositionAndOrientation(tree.body, *pose, self.client)
        return True

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
        for i, (body, (_, quat)) in enumerate(self._base_poses, start=1):
            pb.resetBasePositionAndOrientation(body, (0, 0, _AWAY * i), quat, self.client)
        pb.performCollisionDetection(self.client)
        self.set_collision_groups(1, -1)
        for body, (pos, quat) in self._base_poses:
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
        speed = qvel[:3] + cross(spin, arm)
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
        """Return the pose of a base; of a quaternion and its negative the one nearer to the last.

        They are one rotation. The engine changes between them at will, MuJoCo never:
        to be passed after each step, so that a body that turns far keeps its sign.
        """
        where, quat = pb.getBasePositionAndOrientation(body, self.client)
        x, y, z, w = quat
        nx, ny, nz, nw = self._last[body]
        if x * nx + y * ny + z * nz + w * nw < 0:
            quat = (-x, -y, -z, -w)
        self._last[body] = quat
        return where, quat

    def read_free(self, tree: Tree) -> tuple[list[float], list[float]]:
        """Return qpos (7,) and qvel (6,) of a free joint, in MuJoCo's conventions."""
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
        """Return the positions (nq,) and velocities (nv,) that the engine has."""
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
        """Return the positions and velocities of one tree, in the order of its `qpos` and
        `qvel`.
        """
        if not tree.joints:
            return self.read_free(tree) if tree.free else ((), ())
        q, v, _, _ = zip(*pb.getJointStates(tree.body, tree.joints, self.client), strict=True)
        if tree.free:
            pose, twist = self.read_free(tree)
            return (*pose, *q), (*twist, *v)
        return q, v
