"""Write URDF from a compiled MJCF, one file for each tree of bodies.

URDF knows one joint between two links, no armature, no servo and no site. A site
becomes a link of its own without mass, fixed to its body, so that an engine that
reports centres of mass to full precision reports the site to full precision too.
Numbers are written so that reading them back gives the same float64.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

from ..errors import UnsupportedError
from ..records import Array, JointType
from ..rotations import matrix_from_quat

_BOX, _SPHERE = int(mujoco.mjtGeom.mjGEOM_BOX), int(mujoco.mjtGeom.mjGEOM_SPHERE)
_CAPSULE, _CYLINDER = int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER)
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)


@dataclass(frozen=True)
class Dialect:
    """What the reader of a URDF wants of it.

    Attributes:
        capsules: Write <capsule>, which PyBullet reads and the format does not know;
            else a cylinder and two spheres, which are the same solid.
        looks: Write <visual> elements, with meshes relative to `folder`.
        upright_root: Write the root's inertia in axes parallel to its frame. PyBullet's
            inverse dynamics takes gravity in the principal axes of a fixed root, which
            is gravity in another direction.
        padding: J [kg m²]; J·(½·1.0001·1 + ½·a·aᵀ) is added to the inertia of every
            jointed link with joint axis a.
    """

    capsules: bool = False
    looks: bool = True
    folder: Path | None = None
    upright_root: bool = False
    padding: float = 0.0


def roots(raw: mujoco.MjModel) -> list[int]:
    """Bodies that hang directly in the world, each the root of a tree."""
    return [b for b in range(1, raw.nbody) if raw.body_parentid[b] == 0]


def tree(raw: mujoco.MjModel, root: int) -> list[int]:
    """The bodies of a tree, parents first."""
    return [b for b in range(1, raw.nbody) if raw.body_rootid[b] == root]


def check(raw: mujoco.MjModel, backend: str) -> None:
    """Raise UnsupportedError for what URDF cannot say of a robot."""

    def refuse(feature: str, reason: str) -> None:
        raise UnsupportedError(
            f"backend {backend!r} does not support {feature!r}: {reason}",
            backend=backend,
            feature=feature,
            reason=reason,
        )

    for j in range(raw.njnt):
        name = raw.joint(j).name or f"number {j}"
        if raw.jnt_type[j] == int(JointType.BALL):
            refuse("ball joint", f"joint {name} has no counterpart in URDF")
        if raw.qpos0[raw.jnt_qposadr[j]] and raw.jnt_type[j] != int(JointType.FREE):
            refuse("joint ref", f"the zero of joint {name} is not that of the file's pose")
    for b in range(1, raw.nbody):
        if raw.body_jntnum[b] > 1:
            refuse("several joints in one body", f"body {raw.body(b).name} has several")
        if raw.body_mocapid[b] >= 0:
            refuse("mocap body", f"body {raw.body(b).name} is one")


def write(raw: mujoco.MjModel, root: int, dialect: Dialect = Dialect()) -> str:
    """URDF of one tree of bodies.

    Args:
        raw: The compiled model.
        root: The body at the root of the tree; a joint of its own is left out if it
            is free, and stands between a massless link "world" and it otherwise.
        dialect: What the reader wants.
    """
    name = raw.names[: raw.names.index(b"\0")].decode() or "robot"
    lines = ['<?xml version="1.0"?>', f"<robot name={quoteattr(name)}>"]
    jointed_root = _has_axis(raw, root)
    if jointed_root:
        lines.append('  <link name="world"/>')
    for body in tree(raw, root):
        lines += _link(raw, body, dialect, upright=body == root and dialect.upright_root)
        if body != root or jointed_root:
            lines += _joint(raw, body, root)
    for site in range(raw.nsite):
        if raw.body_rootid[raw.site_bodyid[site]] == root and raw.site_bodyid[site]:
            lines += _tip(raw, site)
    return "\n".join([*lines, "</robot>", ""])


def link_name(raw: mujoco.MjModel, body: int) -> str:
    """Name of a body's link."""
    return raw.body(body).name or f"body_{body}"


def tip_name(raw: mujoco.MjModel, site: int) -> str:
    """Name of a site's link: the site's own unless a body has it."""
    name = raw.site(site).name or f"site_{site}"
    taken = {link_name(raw, body) for body in range(raw.nbody)}
    return f"{name}_site" if name in taken else name


def joint_name(raw: mujoco.MjModel, body: int) -> str:
    """Name of the joint that carries a body."""
    if raw.body_jntnum[body]:
        joint = int(raw.body_jntadr[body])
        return raw.joint(joint).name or f"joint_{joint}"
    return f"{link_name(raw, body)}_fixed"


def _anchor(raw: mujoco.MjModel, body: int) -> Array:
    """Where a body's joint is, in the body's frame: the origin of its link."""
    return raw.jnt_pos[raw.body_jntadr[body]] if _has_axis(raw, body) else np.zeros(3)


def _has_axis(raw: mujoco.MjModel, body: int) -> bool:
    """Whether a body has a joint that URDF writes: a hinge or a slide."""
    return bool(raw.body_jntnum[body]) and raw.jnt_type[raw.body_jntadr[body]] in (
        int(JointType.HINGE),
        int(JointType.SLIDE),
    )


def _link(raw: mujoco.MjModel, body: int, dialect: Dialect, upright: bool) -> Iterator[str]:
    anchor = _anchor(raw, body)
    axes = matrix_from_quat(raw.body_iquat[body])
    inertia = np.diag(raw.body_inertia[body])
    if dialect.padding and _has_axis(raw, body):
        axis = axes.T @ raw.jnt_axis[raw.body_jntadr[body]]
        inertia = inertia + dialect.padding * (0.50005 * np.eye(3) + 0.5 * np.outer(axis, axis))
    if upright:
        inertia, axes = axes @ inertia @ axes.T, np.eye(3)
    yield f"  <link name={quoteattr(link_name(raw, body))}>"
    yield "    <inertial>"
    yield f"      {_origin(raw.body_ipos[body] - anchor, axes)}"
    yield f'      <mass value="{_number(raw.body_mass[body])}"/>'
    yield f"      {_inertia(inertia)}"
    yield "    </inertial>"
    for geom in range(raw.body_geomadr[body], raw.body_geomadr[body] + raw.body_geomnum[body]):
        touches = raw.geom_contype[geom] or raw.geom_conaffinity[geom]
        if touches or dialect.looks:
            yield from _geom(raw, geom, anchor, "collision" if touches else "visual", dialect)
    yield "  </link>"


def _geom(
    raw: mujoco.MjModel, geom: int, anchor: Array, element: str, dialect: Dialect
) -> Iterator[str]:
    pos, mat = raw.geom_pos[geom] - anchor, matrix_from_quat(raw.geom_quat[geom])
    size, kind = raw.geom_size[geom], int(raw.geom_type[geom])
    solids: list[tuple[Array, str]] = []
    if kind == _BOX:
        solids.append((pos, f'<box size="{_numbers(2 * size)}"/>'))
    elif kind == _SPHERE:
        solids.append((pos, f'<sphere radius="{_number(size[0])}"/>'))
    elif kind == _CYLINDER or (kind == _CAPSULE and dialect.capsules):
        tag = "cylinder" if kind == _CYLINDER else "capsule"
        length = _number(2 * size[1])
        solids.append((pos, f'<{tag} radius="{_number(size[0])}" length="{length}"/>'))
    elif kind == _CAPSULE:
        length = _number(2 * size[1])
        solids.append((pos, f'<cylinder radius="{_number(size[0])}" length="{length}"/>'))
        for sign in (-1, 1):
            end = pos + sign * size[1] * mat[:, 2]
            solids.append((end, f'<sphere radius="{_number(size[0])}"/>'))
    elif kind == _MESH:
        mesh = int(raw.geom_dataid[geom])
        # MuJoCo moved the mesh to its centre and axes; the file has it where it was.
        # Rounded, so that a look that was never moved is at 0 0 0 and not at 1e-17.
        mat = np.round(mat @ matrix_from_quat(raw.mesh_quat[mesh]).T, 12)
        pos = np.round(pos - mat @ raw.mesh_pos[mesh], 12)
        scale = _numbers(raw.mesh_scale[mesh])
        file = quoteattr(_mesh_file(raw, mesh, dialect.folder))
        solids.append((pos, f'<mesh filename={file} scale="{scale}"/>'))
    name = raw.geom(geom).name
    label = f" name={quoteattr(name)}" if name else ""
    for where, solid in solids:
        yield f"    <{element}{label}>"
        yield f"      {_origin(where, mat)}"
        yield f"      <geometry>{solid}</geometry>"
        yield f"    </{element}>"


def _mesh_file(raw: mujoco.MjModel, mesh: int, folder: Path | None) -> str:
    start = int(raw.mesh_pathadr[mesh])
    name = raw.paths[start : raw.paths.index(b"\0", start)].decode() if start >= 0 else ""
    return os.path.relpath(name, folder) if folder and os.path.isabs(name) else name


def _joint(raw: mujoco.MjModel, body: int, root: int) -> Iterator[str]:
    parent = int(raw.body_parentid[body])
    parent_name = "world" if body == root else link_name(raw, parent)
    parent_anchor = np.zeros(3) if body == root else _anchor(raw, parent)
    mat = matrix_from_quat(raw.body_quat[body])
    pos = raw.body_pos[body] + mat @ _anchor(raw, body) - parent_anchor
    kind, extra = "fixed", []
    if raw.body_jntnum[body]:
        joint = int(raw.body_jntadr[body])
        slide, limited = raw.jnt_type[joint] == int(JointType.SLIDE), raw.jnt_limited[joint]
        kind = "prismatic" if slide else "revolute" if limited else "continuous"
        low, high = raw.jnt_range[joint] if limited else (-1e9, 1e9)
        bounds = "" if kind == "continuous" else f'lower="{_number(low)}" upper="{_number(high)}" '
        dof = int(raw.jnt_dofadr[joint])
        damping, friction = raw.dof_damping[dof], raw.dof_frictionloss[dof]
        extra = [
            f'    <axis xyz="{_numbers(raw.jnt_axis[joint])}"/>',
            f'    <limit {bounds}effort="{_number(_effort(raw, joint))}" velocity="100.0"/>',
            f'    <dynamics damping="{_number(damping)}" friction="{_number(friction)}"/>',
        ]
    yield f'  <joint name={quoteattr(joint_name(raw, body))} type="{kind}">'
    yield f"    {_origin(pos, mat)}"
    yield f"    <parent link={quoteattr(parent_name)}/>"
    yield f"    <child link={quoteattr(link_name(raw, body))}/>"
    yield from extra
    yield "  </joint>"


def _effort(raw: mujoco.MjModel, joint: int) -> float:
    """The largest force of the actuators on a joint; 1e9 where nothing limits it."""
    forces = [
        np.abs(raw.actuator_forcerange[a]).max()
        for a in range(raw.nu)
        if raw.actuator_trnid[a, 0] == joint and raw.actuator_forcelimited[a]
    ]
    return float(max(forces, default=1e9))


def _tip(raw: mujoco.MjModel, site: int) -> Iterator[str]:
    body, name = int(raw.site_bodyid[site]), tip_name(raw, site)
    mat = matrix_from_quat(raw.site_quat[site])
    yield f"  <link name={quoteattr(name)}>"
    yield f'    <inertial><mass value="0.0"/>{_inertia(np.zeros((3, 3)))}</inertial>'
    yield "  </link>"
    yield f'  <joint name={quoteattr(name + "_fixed")} type="fixed">'
    yield f"    {_origin(raw.site_pos[site] - _anchor(raw, body), mat)}"
    yield f"    <parent link={quoteattr(link_name(raw, body))}/>"
    yield f"    <child link={quoteattr(name)}/>"
    yield "  </joint>"


def _inertia(tensor: Array) -> str:
    entries = (("xx", 0, 0), ("xy", 0, 1), ("xz", 0, 2), ("yy", 1, 1), ("yz", 1, 2), ("zz", 2, 2))
    words = (f'i{name}="{_number(tensor[i, j])}"' for name, i, j in entries)
    return f"<inertia {' '.join(words)}/>"


def _origin(pos: Array, mat: Array) -> str:
    return f'<origin xyz="{_numbers(pos)}" rpy="{_numbers(_rpy(mat))}"/>'


def _rpy(mat: Array) -> Array:
    """Angles (3,) with mat = Rz(yaw)·Ry(pitch)·Rx(roll), to full precision everywhere.

    At a pitch of ±90° roll is arbitrary; yaw is computed from the roll that was
    chosen, so that the product is right whatever it is.
    """
    pitch = np.arctan2(-mat[2, 0], np.hypot(mat[0, 0], mat[1, 0]))
    roll = np.arctan2(mat[2, 1], mat[2, 2])
    s, c = np.sin(roll), np.cos(roll)
    yaw = np.arctan2(s * mat[0, 2] - c * mat[0, 1], c * mat[1, 1] - s * mat[1, 2])
    return np.array([roll, pitch, yaw])


def _numbers(values: Array) -> str:
    return " ".join(map(_number, values))


def _number(value: float) -> str:
    """Shortest text that reads back as the same float64; no negative zero."""
    return repr(float(value) + 0.0)
