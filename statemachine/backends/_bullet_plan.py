"""A compiled model as PyBullet's worlds want it: texts, surfaces, and how much padding."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from ..interface import Array
from . import _bullet_urdf as urdf
from ._bullet_hulls import HULLS, Hull
from ._bullet_surfaces import Surfaces

_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
# Of the armature, as inertia of the stepped arm: 0.003 of the SO-101's 0.028 kg m², with
# which it grips soon and the eigenvalue of `_padding` is 0.97 at most.
_SHARE, _BEARABLE, _SAMPLE = 3 / 28, 1.5, 20
_YIELDS = 0.02
# PyBullet has room for 128 numbers of a tree, and goes on without a word beyond it.
MOST_PARTS = 120


class Plan:
    """A compiled model, and what follows from it for every world.

    Attributes:
        raw: The compiled model.
        surfaces: What can touch what; nothing where contacts are off.
        names: What everything is called in a URDF.
    """

    def __init__(self, raw: mujoco.MjModel) -> None:
        self.raw = raw
        self.surfaces = Surfaces(raw)
        self.names = urdf.Names(raw)
        self._described: dict[tuple[int, str], tuple[str, dict[str, str]]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Plan, (self.raw,)

    @cached_property
    def padding(self) -> Array:
        """(nv,) what each degree of freedom gives of its armature to the stepped arm.

        As inertia of the links; see `Dialect` and `_bullet_law`.
        """
        return _padding(self.raw)

    @cached_property
    def softness(self) -> float:
        """By how much contacts yield to their own force: the engine's CFM [s/kg].

        Where a contact pushes along what no joint can move, a hard one gets a force without
        bound. MuJoCo's yield by (1 - d)/d of the inverse weight, about 5 % [manual, chapter
        Computation, Constraint model]; these by 2 % of the median of the links that touch,
        times the timestep. The inverse weight is that of the whole tree at least: that of a link
        that turns about its own centre is none. Free bodies can always yield.
        """
        raw = self.raw
        solids = (solid.body for solid in self.surfaces.solids)
        moving = [b for b in solids if raw.body_weldid[b] and not floats(raw, raw.body_rootid[b])]
        whole = 1 / raw.body_subtreemass[raw.body_rootid[moving]]
        weights = np.maximum(raw.body_invweight0[moving, 0], whole)
        return float(_YIELDS * raw.opt.timestep * np.median(weights)) if moving else 0.0

    def described(self, root: int, kind: str) -> tuple[str, dict[str, str]]:
        """URDF of a tree of bodies as a world of that kind reads it.

        And the files that it names, by their names: the hulls of its geoms.
        """
        if (root, kind) not in self._described:
            self._described[root, kind] = self._describe(root, kind)
        return self._described[root, kind]

    @cached_property
    def hulls(self) -> dict[int, Hull]:
        """Hulls of the geoms that touch and are meshes or ellipsoids."""
        geoms = (geom for solid in self.surfaces.solids for geom in solid.geoms)
        return {g: Hull(self.raw, g) for g in geoms if int(self.raw.geom_type[g]) in HULLS}

    def _room_for_tips(self, root: int) -> bool:
        raw = self.raw
        sites = int(np.count_nonzero(raw.body_rootid[raw.site_bodyid] == root))
        return urdf.parts(raw, root) + sites <= MOST_PARTS

    def _hull_geoms(self, kind: str) -> frozenset[int]:
        """Geoms that are read as hulls; as it comes, meshes come from their files."""
        if kind != "engine":
            return frozenset(self.hulls if kind == "stepped" else ())
        raw = self.raw
        meshes = {geom: int(raw.geom_dataid[geom]) for geom in self.hulls}
        return frozenset(
            geom for geom, mesh in meshes.items() if mesh < 0 or raw.mesh_pathadr[mesh] < 0
        )

    def _describe(self, root: int, kind: str) -> tuple[str, dict[str, str]]:
        raw, hulls = self.raw, self._hull_geoms(kind)
        dialect = urdf.Dialect(
            capsules=True,
            looks=False,
            solids=kind != "ghost" and bool(self.surfaces.solids),
            dynamics=kind == "engine",
            anchored=bool(root) and not floats(raw, root),
            padding=self.padding if kind == "stepped" else None,
            tips=kind != "stepped" and self._room_for_tips(root),
            hulls=hulls,
        )
        files = {
            urdf.hull_file(geom): self.hulls[geom].obj(smaller=kind == "stepped")
            for geom in hulls
            if raw.body_rootid[raw.geom_bodyid[geom]] == root
        }
        return urdf.write(raw, root, dialect, self.names), files


def _padding(raw: mujoco.MjModel) -> Array:
    """As much of the armature as the observer of contacts bears.

    It converges while what contact meets, the padded arm, is less than twice what the
    law reckons with, M + A: the largest eigenvalue of (M + A)⁻¹·(M + padding) is kept
    below `_BEARABLE` in a sample of poses.
    """
    share, data = _SHARE * raw.dof_armature, mujoco.MjData(raw)
    random = np.random.default_rng(0)
    with np.errstate(over="ignore"):
        limited = raw.jnt_limited.astype(bool) & np.isfinite(np.ptp(raw.jnt_range, axis=1))
    low, high = np.where(limited[:, None], raw.jnt_range, [-np.pi, np.pi]).T
    poses = [raw.qpos0, *raw.key_qpos]
    scalar = np.isin(raw.jnt_type, [int(mujoco.mjtJoint.mjJNT_HINGE), _SLIDE])
    for _ in range(_SAMPLE):
        qpos = raw.qpos0.copy()
        qpos[raw.jnt_qposadr[scalar]] = random.uniform(low, high)[scalar]
        poses.append(qpos)
    worst = 0.0
    for qpos in poses if share.any() else []:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(raw, data)
        mujoco.mj_comPos(raw, data)
        mujoco.mj_crb(raw, data)
        whole = np.zeros((raw.nv, raw.nv))
        mujoco.mj_fullM(raw, data, whole)
        padded = whole - np.diag(raw.dof_armature) + _padding_at(raw, data, share)
        worst = max(worst, float(np.linalg.eigvals(np.linalg.solve(whole, padded)).real.max()))
        while worst > _BEARABLE:  # in halves, until this pose bears it too
            share, worst = share / 2, 0.0
            padded = whole - np.diag(raw.dof_armature) + _padding_at(raw, data, share)
            worst = float(np.linalg.eigvals(np.linalg.solve(whole, padded)).real.max())
    return share


def _padding_at(raw: mujoco.MjModel, data: mujoco.MjData, share: Array) -> Array:
    """What the padding adds to the mass matrix (nv, nv) in a pose."""
    total = np.zeros((raw.nv, raw.nv))
    for j in np.flatnonzero(raw.jnt_type == int(mujoco.mjtJoint.mjJNT_HINGE)):
        dof, body = int(raw.jnt_dofadr[j]), int(raw.jnt_bodyid[j])
        turning = np.zeros((3, raw.nv))
        mujoco.mj_jac(raw, data, None, turning, data.xipos[body], body)
        total += share[dof] * turning.T @ urdf.padding_shape(data.xaxis[j]) @ turning
    for j in np.flatnonzero(raw.jnt_type == _SLIDE):
        dof, body = int(raw.jnt_dofadr[j]), int(raw.jnt_bodyid[j])
        moving = np.zeros((3, raw.nv))
        mujoco.mj_jac(raw, data, moving, None, data.xipos[body], body)
        total += share[dof] * moving.T @ moving
    return total


def floats(raw: mujoco.MjModel, root: int) -> bool:
    """Whether a tree is a free body."""
    return bool(raw.body_jntnum[root]) and not urdf.axes(raw, root)
