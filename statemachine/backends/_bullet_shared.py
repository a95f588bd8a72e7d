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
        self._still_joints = np.zeros(plan.raw.nv)

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

    def poses(self, qpos: Array) -> dict[str, Array]:
        """xpos, xquat, site_xpos and site_xmat, by the engine's own forward kinematics.

        Centres of mass and their axes are what PyBullet reports in double precision; a
        site is the centre of mass of a link of its own.
        """
        raw = self.raw
        xpos, xquat, site_xpos, site_xmat = (array.copy() for array in self.still)
        for tree in self.ghost.trees:
            bodies, sites = list(tree.links), list(tree.tips)
            with HiddenWorld.lock:
                self.ghost.put(qpos, self._still_joints)
                states = self.ghost.link_states(tree)
            where, turned = (np.array(part) for part in zip(*states, strict=True))
            turned = wxyz_from_xyzw(turned)
            n = len(bodies)
            xquat[bodies] = times(turned[:n], raw.body_iquat[bodies] * _INVERSE)
            turns = matrix_from_quat(xquat[bodies])
            xpos[bodies] = where[:n] - np.einsum("bij,bj->bi", turns, raw.body_ipos[bodies])
            site_xpos[sites], site_xmat[sites] = (
                where[n:],
                matrix_from_quat(turned[n:]).reshape(-1, 9),
            )
        for joint in np.flatnonzero(raw.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE)):
            body, start = int(raw.jnt_bodyid[joint]), int(raw.jnt_qposadr[joint])
            quat = qpos[start + 3 : start + 7]
            xpos[body], xquat[body] = qpos[start : start + 3], quat / math.hypot(*quat)
            turn = matrix_from_quat(xquat[body])
            for site in np.flatnonzero(raw.site_bodyid == body):
                site_xpos[site] = xpos[body] + dense.times(turn, raw.site_pos[site])
                own = matrix_from_quat(raw.site_quat[site])
                site_xmat[site] = dense.product(turn, own).ravel()
        return dict(zip(POSES, (xpos, xquat, site_xpos, site_xmat), strict=True))


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
