"""Rigid parts of a compiled model: what moves as one, and what it weighs, in one frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...description.records import Inertial
from ...installed import require
from ...interface import Array
from ...rotations import HERE, Placement, matrix_from_quat
from ..records import BodyPair, Counterparts

SLIDE, HINGE = 2, 3  # mjtJoint
NEAR = 1e-10  # [m], and of entries of matrices: less is rounding


class Solids:
    """The rigid parts of a compiled model, each by the body that is its head.

    Args:
        raw: An mjModel.
        still: Mocap bodies that are taken for a part of the world.
    """

    def __init__(self, raw: Any, still: Sequence[int] = ()) -> None:
        self.raw = raw
        self._heads = np.array(raw.body_weldid)
        self._heads[np.isin(self._heads, still)] = 0
        self._places: dict[int, Placement] = {}

    def head(self, body: int) -> int:
        """The first body of the rigid part that a body is in."""
        return int(self._heads[body])

    def members(self, head: int) -> list[int]:
        """All bodies of a rigid part."""
        return np.flatnonzero(self._heads == head).tolist()

    def place(self, body: int) -> Placement:
        """The frame of a body in that of its rigid part."""
        if body == self.head(body):
            return HERE
        if body not in self._places:
            above = self.place(int(self.raw.body_parentid[body]))
            self._places[body] = above @ placed(self.raw.body_pos[body], self.raw.body_quat[body])
        return self._places[body]

    def hangs(self, head: int) -> Placement:
        """The frame of a rigid part in that of the part that carries it, joints at qpos0."""
        own = placed(self.raw.body_pos[head], self.raw.body_quat[head])
        return self.place(int(self.raw.body_parentid[head])) @ own

    def massive(self, head: int) -> list[int]:
        """The bodies of a rigid part that have a mass or an inertia."""
        raw = self.raw
        return [
            body
            for body in self.members(head)
            if raw.body_mass[body] or raw.body_inertia[body].any()
        ]

    def inertial(self, head: int) -> Inertial:
        """All bodies of a rigid part together, in its frame."""
        parts = [self.inertial_of(body) for body in self.massive(head)]
        if len(parts) == 1:
            return parts[0]
        mass = sum(part.mass for part in parts)
        if not mass:
            return Inertial(0.0, np.zeros(3), np.zeros((3, 3)))
        com = sum((part.mass * part.com for part in parts), np.zeros(3)) / mass
        tensor = np.zeros((3, 3))
        for part in parts:
            away = part.com - com
            tensor += part.tensor + part.mass * (away @ away * np.eye(3) - np.outer(away, away))
        return Inertial(mass, com, tensor)

    def inertial_of(self, body: int) -> Inertial:
        """One body, in the frame of its rigid part."""
        raw, place = self.raw, self.place(body)
        axes = place.mat @ matrix_from_quat(raw.body_iquat[body])
        tensor = axes @ np.diag(raw.body_inertia[body]) @ axes.T
        return Inertial(float(raw.body_mass[body]), place.of(raw.body_ipos[body]), tensor)

    def geom(self, geom: int) -> Placement:
        """The frame of a geom in that of its rigid part."""
        raw = self.raw
        return self.place(int(raw.geom_bodyid[geom])) @ placed(
            raw.geom_pos[geom], raw.geom_quat[geom]
        )

    def site(self, site: int) -> Placement:
        """The frame of a site in that of its rigid part."""
        raw = self.raw
        return self.place(int(raw.site_bodyid[site])) @ placed(
            raw.site_pos[site], raw.site_quat[site]
        )

    def vertices(self, geom: int) -> Array:
        """Those (n, 3) of a mesh geom [m], in the frame of its rigid part."""
        raw, place = self.raw, self.geom(geom)
        mesh = int(raw.geom_dataid[geom])
        start = int(raw.mesh_vertadr[mesh])
        points = raw.mesh_vert[start : start + int(raw.mesh_vertnum[mesh])]
        return place.pos + np.asarray(points, dtype=np.float64) @ place.mat.T


def placed(pos: Array, quat: Array) -> Placement:
    """A pose of the compiled model as a Placement."""
    return Placement(np.array(pos), matrix_from_quat(np.asarray(quat)))


def apart(one: Placement, two: Placement) -> tuple[float, float]:
    """How far two poses are from each other: [m], and the largest entry of the matrices."""
    return one.distance(two), float(np.abs(one.mat - two.mat).max())


def quat_of(mat: Array) -> Array:
    """The quaternion (4,), wxyz, of a rotation matrix."""
    quat = np.empty(4)
    require("mujoco").mju_mat2Quat(quat, np.ascontiguousarray(mat).reshape(9))
    return quat


def name_of(raw: Any, kind: str, index: int) -> str:
    """The name of an element; without one, its kind, number and owner."""
    name = getattr(raw, {"equality": "eq"}.get(kind, kind))(index).name
    if name:
        return name
    owner = {"geom": "geom_bodyid", "site": "site_bodyid", "joint": "jnt_bodyid"}.get(kind)
    on = raw.body(int(getattr(raw, owner)[index])).name if owner else ""
    return f"{kind} {index}" + (f" on {on}" if on else "")


def solids_of(one: Any, two: Any, pairs: Counterparts) -> tuple[Solids, Solids]:
    """The rigid parts of two models; a mocap body that only one has is a part of the world."""
    led = {pair.one for pair in pairs.solids}, {pair.two for pair in pairs.solids}
    return Solids(one, _still(one, led[0])), Solids(two, _still(two, led[1]))


def _still(raw: Any, led: set[int]) -> list[int]:
    """Mocap bodies without a counterpart that a body fixed to the world would stand for.

    A part that moves on one is not: it never touches a mocap body that carries it.
    """
    found = []
    for body in np.flatnonzero(raw.body_mocapid >= 0).tolist():
        tree = np.flatnonzero(raw.body_rootid == body)
        places = raw.key_mpos.reshape(raw.nkey, -1, 3)[:, raw.body_mocapid[body]]
        turns = raw.key_mquat.reshape(raw.nkey, -1, 4)[:, raw.body_mocapid[body]]
        stays = (places == raw.body_pos[body]).all() and (turns == raw.body_quat[body]).all()
        if body not in led and stays and not raw.body_dofnum[tree].any():
            found.append(body)
    return found


class SolidPairs:
    """What of two compiled models is compared in the frames of their rigid parts."""

    def __init__(self, one: Any, two: Any, pairs: Counterparts) -> None:
        self._one, self._two, self._pairs = one, two, pairs
        self._solids = solids_of(one, two, pairs)
        self._by_one = {pair.one: pair for pair in pairs.solids}

    def _pair_of(self, body: int) -> BodyPair | None:
        return self._by_one.get(self._solids[0].head(body))
