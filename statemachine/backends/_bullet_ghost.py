"""What the Data of one Model share: kinematics that have no state."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from ..interface import POSES, Array
from ..rotations import matrix_from_quat, times, wxyz_from_xyzw
from . import _dense as dense
from ._bullet_client import pb
from ._bullet_plan import Plan
from ._bullet_world import World
from ._hidden_world import HiddenWorld
from .compiled import gravity

_INVERSE = np.array([1.0, -1.0, -1.0, -1.0])  # of a unit quaternion


def ghost_of(plan: Plan) -> Ghost:
    """The ghost of a plan: one for all Data of all Models that have the plan."""
    with HiddenWorld.lock:  # for two threads that make the first Data at once
        if plan.ghost is None:
            plan.ghost = Ghost(plan)
        return plan.ghost


class Ghost(World):
    """The true robot in a client that is never stepped: kinematics and dynamics of its joints."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan, "ghost")
        self._known: dict[bool, list[tuple[Array, Array]]] = {}  # of the sites, and of the bodies
        self._known_at, self._rest = b"?", np.zeros(plan.raw.nv)

    @cached_property
    def still(self) -> tuple[Array, Array, Array, Array]:
        """xpos, xquat, site_xpos and site_xmat of what never moves."""
        data = mujoco.MjData(self._raw)
        mujoco.mj_kinematics(self._raw, data)
        return data.xpos, data.xquat, data.site_xpos, data.site_xmat

    def poses(self, qpos: Array, name: str) -> dict[str, Array]:
        """Poses of bodies, or of sites, by the engine's own forward kinematics.

        Centres of mass and their axes are what PyBullet reports in double precision; a
        site is the centre of mass of a link of its own, where the tree has room for one.

        Args:
            qpos: (nq,) where the joints are.
            name: Of `POSES`; only what it needs is computed.
        """
        if name in ("site_xpos", "site_xmat"):
            return {name: self._sites(qpos, name)}
        raw = self._raw
        xpos, xquat = (array.copy() for array in self.still[:2])
        for tree, (where, turned) in zip(self.trees, self._states(qpos), strict=True):
            bodies = list(tree.links)
            xquat[bodies] = times(wxyz_from_xyzw(turned), raw.body_iquat[bodies] * _INVERSE)
            turns = matrix_from_quat(xquat[bodies])
            xpos[bodies] = where - np.einsum("bij,bj->bi", turns, raw.body_ipos[bodies])
        for joint in np.flatnonzero(raw.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)):
            body, start = int(raw.jnt_bodyid[joint]), int(raw.jnt_qposadr[joint])
            quat = qpos[start + 3 : start + 7]
            xpos[body], xquat[body] = qpos[start : start + 3], quat / math.hypot(*quat)
        return {"xpos": xpos, "xquat": xquat}

    def _sites(self, qpos: Array, name: str) -> Array:
        """site_xpos or site_xmat."""
        raw, values = self._raw, self.still[POSES.index(name)].copy()
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
        """Sites that move and have no link: of free bodies, and of trees without room for it."""
        linked = [site for tree in self.trees for site in tree.tips]
        moving = self._raw.body_weldid[self._raw.site_bodyid] > 0
        return np.flatnonzero(moving & ~np.isin(np.arange(self._raw.nsite), linked))

    def _states(self, qpos: Array, sites: bool = False) -> list[tuple[Array, Array]]:
        """Of each tree of joints its bodies or sites: centres of mass, and axes (x, y, z, w)."""
        at = qpos.tobytes()
        with HiddenWorld.lock:
            if self._known_at != at:
                self._known, self._known_at = {}, at
            if sites not in self._known:
                self.put(qpos, self._rest)
                self._known[sites] = [
                    self._centres(tree.body, [*(tree.tips if sites else tree.links).values()])
                    for tree in self.trees
                ]
            return self._known[sites]

    def _centres(self, body: int, links: list[int]) -> tuple[Array, Array]:
        """Centres of mass (n, 3), and their axes (n, 4) (x, y, z, w), of some links."""
        if not links:
            return np.empty((0, 3)), np.empty((0, 4))
        states = pb.getLinkStates(
            body, links, computeForwardKinematics=1, physicsClientId=self.client
        )
        return np.array([state[0] for state in states]), np.array([state[1] for state in states])


def free_dynamics(raw: mujoco.MjModel, body: int, turn: Array, qvel: Array) -> tuple[Array, Array]:
    """Mass matrix (6, 6) and bias (6,) of a free body, in MuJoCo's coordinates.

    Newton's and Euler's equations about the centre of mass, whose velocity is J·qvel.
    """
    mass, centre = float(raw.body_mass[body]), raw.body_ipos[body]
    axes = matrix_from_quat(raw.body_iquat[body])
    inertia = np.einsum("ij,j,kj->ik", axes, raw.body_inertia[body], axes)
    spin = qvel[3:]
    cross = np.cross(np.eye(3), centre)  # cross @ w = w × centre … of rows
    turning = dense.product(turn, np.asarray(cross.T, dtype=np.float64))
    jacobian = np.hstack([np.eye(3), turning])
    total = mass * dense.product(jacobian.T, jacobian)
    total[3:, 3:] += inertia
    whirl = dense.times(turn, np.asarray(np.cross(spin, np.cross(spin, centre)), dtype=np.float64))
    bias = dense.times(jacobian.T, mass * (whirl - gravity(raw)))
    bias[3:] += np.cross(spin, dense.times(inertia, spin))
    return total, bias
