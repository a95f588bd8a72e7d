"""The rigid parts of a compiled model: bodies that no joint parts, with frames and inertia in one.

What moves as one is compared in one frame: fixed bodies are no difference.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ...rotations import HERE, Placement, matrix_from_quat
from ..description.records import Inertial
from ..description.tree import composite


def placed(pos: Array, quat: Array) -> Placement:
    """Return a pose of the compiled model as a Placement."""
    return Placement(np.array(pos), matrix_from_quat(np.asarray(quat)))


def apart(left: Placement, right: Placement) -> tuple[float, float]:
    """Return how far two poses are from each other: [m], and the largest entry of the matrices."""
    return left.distance(right), float(np.abs(left.mat - right.mat).max())


def quat_of(mat: Array) -> Array:
    """Return the quaternion (4,), wxyz, of a rotation matrix."""
    quat = np.empty(4)
    require("mujoco").mju_mat2Quat(quat, np.ascontiguousarray(mat).reshape(9))
    return quat


def inertial_of(raw: Any, body: int) -> Inertial:
    """Return the mass properties of a body, in its own frame."""
    axes = matrix_from_quat(raw.body_iquat[body])
    tensor = axes @ np.diag(raw.body_inertia[body]) @ axes.T
    return Inertial(float(raw.body_mass[body]), np.array(raw.body_ipos[body]), tensor)


class Solids:
    """The rigid parts of a compiled model, each by the body that is its head.

    Args:
        raw: An mjModel.
        led: Bodies that have a counterpart in another model. A mocap body that has none is
            taken for a part of the world, if a body fixed to it would stand for it.
    """

    def __init__(self, raw: Any, led: set[int]) -> None:
        self.raw = raw
        self._heads = np.array(raw.body_weldid)
        still = [
            body for body in np.flatnonzero(raw.body_mocapid >= 0).tolist() if self._stays(body)
        ]
        self._heads[np.isin(self._heads, [body for body in still if body not in led])] = 0
        self._hung = cache(self.hangs)

    def _stays(self, body: int) -> bool:
        """Tell whether no keyframe has a mocap body elsewhere, and nothing moves on it."""
        raw, number = self.raw, self.raw.body_mocapid[body]
        # Of a file without a keyframe these are empty, and reshape could not tell -1 from them.
        places = raw.key_mpos.reshape(raw.nkey, raw.nmocap, 3)[:, number]
        turns = raw.key_mquat.reshape(raw.nkey, raw.nmocap, 4)[:, number]
        stays = (places == raw.body_pos[body]).all() and (turns == raw.body_quat[body]).all()
        return bool(stays and not raw.body_dofnum[raw.body_rootid == body].any())

    def head(self, body: int) -> int:
        """Return the first body of the rigid part that a body is in."""
        return int(self._heads[body])

    def members(self, head: int) -> list[int]:
        """Return all bodies of a rigid part."""
        return np.flatnonzero(self._heads == head).tolist()

    def place(self, body: int) -> Placement:
        """Return the frame of a body in that of its rigid part."""
        return HERE if body == self.head(body) else self._hung(body)

    def hangs(self, body: int) -> Placement:
        """Return the frame of a body in that of the part that carries it, joints at qpos0."""
        own = placed(self.raw.body_pos[body], self.raw.body_quat[body])
        return self.place(int(self.raw.body_parentid[body])) @ own

    def on(self, kind: str, index: int) -> Placement:
        """Return the frame of a geom or a site in that of its rigid part."""
        body, pos, quat = (
            getattr(self.raw, f"{kind}_{part}")[index] for part in ("bodyid", "pos", "quat")
        )
        return self.place(int(body)) @ placed(pos, quat)

    def massive(self, head: int) -> list[int]:
        """Return the bodies of a rigid part that have a mass or an inertia."""
        mass, inertia = self.raw.body_mass, self.raw.body_inertia
        return [body for body in self.members(head) if mass[body] or inertia[body].any()]

    def inertial(self, *bodies: int) -> Inertial:
        """Return the mass properties of the bodies of a rigid part together, in its frame."""
        return composite([inertial_of(self.raw, b).in_frame(self.place(b)) for b in bodies])
