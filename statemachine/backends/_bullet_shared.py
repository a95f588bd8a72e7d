"""What the Data of one Model share: its description, and kinematics that have no state."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, Literal

import mujoco
import numpy as np

from ..interface import POSES, Array
from ..rotations import matrix_from_quat, times, wxyz_from_xyzw
from . import _dense as dense
from ._bullet_plan import Plan
from ._bullet_world import World
from ._hidden_world import HiddenWorld
from .compiled import gravity

_INVERSE = np.array([1.0, -1.0, -1.0, -1.0])  # of a unit quaternion


class Shared:
    """What the Data of one Model share: the description, and worlds that have no state.

    Attributes:
        plan: What every world is made from; raw: its compiled model.
        kind: "stepped" for the emulated contract, "engine" for PyBullet as it comes.
        made_ghost: The `ghost`, if it was needed already.
    """

    def __init__(self, plan: Plan, kind: Literal["stepped", "engine"]) -> None:
        self.plan, self.raw = plan, plan.raw
        self.kind: Literal["stepped", "engine"] = kind
        self.made_ghost: World | None = None
        self._known: dict[bool, list[tuple[Array, Array]]] = {}  # of the sites, and of the bodies
        self._known_at = b"?"

    def __reduce__(self) -> tuple[Any, ...]:
        return Shared, (self.plan, self.kind)

    @property
    def ghost(self) -> World:
        """The true arm in a client that is never stepped: kinematics and dynamics."""
        with HiddenWorld.lock:  # for two threads that make the first Data at once
            if self.made_ghost is None:
                self.made_ghost = World(self.plan, "ghost")
            return self.made_ghost

    @cached_property
    def still(self) -> tuple[Array, Array, Array, Array]:
        """xpos, xquat, site_xpos and site_xmat of what never moves."""
        data = mujoco.MjData(self.raw)
        mujoco.mj_kinematics(self.raw, data)
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
        raw = self.raw
        xpos, xquat = (array.copy() for array in self.still[:2])
        for tree, (where, turned) in zip(self.ghost.trees, self._states(qpos), strict=True):
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
        raw, values = self.raw, self.still[POSES.index(name)].copy()
        for tree, (where, turned) in zip(self.ghost.trees, self._states(qpos, True), strict=True):
            sites = list(tree.tips)
            if name == "site_xpos":
                values[sites] = where
            else:
                values[sites] = matrix_from_quat(wxyz_from_xyzw(turned)).reshape(-1, 9)
        sites = self._carried_sites
        if len(sites):
            bodies, poses = raw.site_bodyid[sites], self.poses(qpos, "xpos")
            turns = matrix_from_quat(poses["xquat"][bodies])
            if name == "site_xpos":
                offset = np.einsum("bij,bj->bi", turns, raw.site_pos[sites])
                values[sites] = poses["xpos"][bodies] + offset
            else:
                own = matrix_from_quat(raw.site_quat[sites])
                values[sites] = np.einsum("bij,bjk->bik", turns, own).reshape(-1, 9)
        return values

    @cached_property
    def _carried_sites(self) -> Any:
        """Sites that move and have no link: of free bodies, and of trees without room for it."""
        linked = [site for tree in self.ghost.trees for site in tree.tips]
        moving = self.raw.body_weldid[self.raw.site_bodyid] > 0
        return np.flatnonzero(moving & ~np.isin(np.arange(self.raw.nsite), linked))

    def _states(self, qpos: Array, sites: bool = False) -> list[tuple[Array, Array]]:
        """Of each tree of joints its bodies or sites: centres of mass, and axes (x, y, z, w)."""
        at = qpos.tobytes()
        with HiddenWorld.lock:
            if self._known_at != at:
                self._known, self._known_at = {}, at
            if sites not in self._known:
                self.ghost.put_joints(qpos)
                self._known[sites] = [
                    self.ghost.link_states(tree, tree.tips if sites else tree.links)
                    for tree in self.ghost.trees
                ]
            return self._known[sites]


def free_dynamics(raw: mujoco.MjModel, body: int, turn: Array, qvel: Array) -> tuple[Array, Array]:
    """Mass matrix (6, 6) and bias (6,) of a free body, in MuJoCo's coordinates.

    Newton's and Euler's equations about the centre of mass, whose velocity is J·qvel.
    """
    mass, centre = float(raw.body_mass[body]), raw.body_ipos[body]
    axes = matrix_from_quat(raw.body_iquat[body])
    inertia = np.einsum("ij,j,kj->ik", axes, raw.body_inertia[body], axes)
    spin = qvel[3:]
    cross = np.cross(np.eye(3), centre)  # cross @ w = w × centre … of rows
    jacobian = np.zeros((3, 6))
    jacobian[:, :3], jacobian[:, 3:] = (
        np.eye(3),
        dense.product(turn, np.asarray(cross.T, dtype=np.float64)),
    )
    total = mass * dense.product(jacobian.T, jacobian)
    total[3:, 3:] += inertia
    whirl = dense.times(turn, np.asarray(np.cross(spin, np.cross(spin, centre)), dtype=np.float64))
    bias = dense.times(jacobian.T, mass * (whirl - gravity(raw)))
    bias[3:] += np.cross(spin, dense.times(inertia, spin))
    return total, bias
