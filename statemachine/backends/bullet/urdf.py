"""Write URDF from a compiled MJCF, one file for each tree of bodies.

URDF knows one joint between two links, no armature, no servo and no site. A site
becomes a link of its own without mass, fixed to its body, so that an engine that
reports centres of mass to full precision reports the site to full precision too.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ...interface import Array, JointType
from ...rotations import matrix_from_quat
from .. import dense
from ..compiled.actuators import TransmissionKind
from ..compiled.kinds import GeomKind
from .urdf_elements import bare_link, element, inertia_element, joint_element, origin_element
from .urdf_names import Names

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_PRIMITIVES: dict[int, str] = {
    GeomKind.BOX: "box",
    GeomKind.SPHERE: "sphere",
    GeomKind.CAPSULE: "capsule",
    GeomKind.CYLINDER: "cylinder",
}
# [kg] mass, and a thousandth of it [kg m²] inertia, of what only carries a tree; and the largest
# part of the tree's own.
LIGHT, LIGHTEST = 1e-9, 1e-8
UNLIMITED = 1e9  # a range or a force where there is none: PyBullet wants a number


@dataclass(frozen=True, eq=False)
class Dialect:
    """What the reader of a URDF wants of it.

    Attributes:
        capsules: Write <capsule>, which PyBullet reads and the format does not know;
            else a cylinder and two spheres, which are the same solid.
        looks: Write <visual> elements.
        folder: Write the names of meshes relative to it; absolute without it.
        solids: Write <collision> elements.
        dynamics: Write the ranges, damping and dry friction of the joints.
        anchored: Fix the root to a massless link "world", at its place. PyBullet's
            inverse dynamics takes gravity in the principal axes of a fixed base, which
            is gravity in another direction unless the base has no mass. A tree that floats
            is fixed to a link of next to no mass at the origin of its root, which is then
            what the engine moves; of another it moves the centre of mass.
        tips: Write a link for each site.
        hulls: Geoms that are read from a file of their own, see `hull_file`.
        parts: Of a geom that touches, in which link of its body it is: 0 is the body's own,
            others have a link without mass each, fixed to it.
        padding: (nv,) J of each degree of freedom. The link that a hinge carries gets
            J times `padding_shape` [kg m²] more inertia about its centre of mass, the
            link that a slide carries J [kg] more mass.
        beside: Roots of other trees that stand on the same link "world", as the fingers of a
            gripper whose palm is the world: one robot of a URDF.
    """

    capsules: bool = False
    looks: bool = True
    folder: Path | None = None
    solids: bool = True
    dynamics: bool = True
    anchored: bool = False
    padding: Array | None = None
    tips: bool = True
    hulls: frozenset[int] = frozenset()
    parts: Mapping[int, int] = field(default_factory=dict)
    beside: tuple[int, ...] = ()


def roots(raw: MjModel) -> list[int]:
    """Return the bodies that hang directly in the world, each the root of a tree."""
    return [b for b in range(1, raw.nbody) if raw.body_parentid[b] == 0]


def tree(raw: MjModel, root: int) -> list[int]:
    """Return the bodies of a tree, parents first; the world is a tree of its own."""
    return [b for b in range(raw.nbody) if raw.body_rootid[b] == root]


def axes(raw: MjModel, body: int) -> list[int]:
    """Return the joints of a body that URDF writes, its hinges and slides, in order."""
    start = int(raw.body_jntadr[body])
    joints = range(start, start + int(raw.body_jntnum[body]))
    return [j for j in joints if raw.jnt_type[j] in (int(JointType.HINGE), int(JointType.SLIDE))]


def floats(raw: MjModel, root: int) -> bool:
    """Tell whether the root of a tree has a free joint."""
    return bool(raw.body_jntnum[root]) and not axes(raw, root)


def write(raw: MjModel, root: int, dialect: Dialect = Dialect(), names: Names | None = None) -> str:
    """Return the URDF of one tree of bodies, and of those that stand beside it.

    Args:
        raw: The compiled model.
        root: The body at the root of the tree; a joint of its own is left out if it
            is free, and stands between a massless link "world" and it otherwise. 0 for
            the geoms of the world itself; planes, which URDF does not know, are left out.
        dialect: What the reader wants.
        names: Those of the model, where they are known already.
    """
    names = names or Names(raw)
    robot = Element("robot", name=raw.names[: raw.names.index(b"\0")].decode() or "robot")
    on_world = bool(axes(raw, root)) or dialect.anchored
    if on_world:
        light = floats(raw, root) * min(LIGHT, LIGHTEST * float(raw.body_subtreemass[root]))
        robot.append(bare_link("world", light, 1e-3 * light * np.eye(3)))
    bodies = [body for trunk in (root, *dialect.beside) for body in tree(raw, trunk)]
    for body in bodies:
        robot.append(_link(raw, body, dialect, names))
        if body != root or on_world:
            robot.extend(_joints(raw, body, dialect, names))
        geoms = range(raw.body_geomadr[body], raw.body_geomadr[body] + raw.body_geomnum[body])
        for part in sorted({dialect.parts.get(geom, 0) for geom in geoms} - {0}):
            name, fixed = names.part(body, part)
            link = bare_link(name, 0.0, np.zeros((3, 3)))
            link.extend(_geoms(raw, body, part, dialect))
            where = origin_element(np.zeros(3), np.eye(3))
            robot.extend([link, joint_element(fixed, "fixed", names.links[body], name, where)])
    for site in range(raw.nsite if dialect.tips else 0):
        if root and int(raw.site_bodyid[site]) in bodies:
            robot.extend(_tip(raw, site, names))
    ElementTree.indent(robot)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(robot, "unicode")}\n'


def anchor(raw: MjModel, body: int) -> Array:
    """Return where a body's last joint is, in the body's frame: the origin of its link."""
    joints = axes(raw, body)
    return raw.jnt_pos[joints[-1]] if joints else np.zeros(3)


def padding_shape(axis: Array) -> Array:
    """Return the inertia (3, 3) of a unit of padding about an axis: ½·1.0001·1 + ½·a·aᵀ.

    Turning about the axis alone would be enough, and is refused as no body's inertia.
    """
    return 0.50005 * np.eye(3) + 0.5 * np.outer(axis, axis)


def _padding(raw: MjModel, joint: int, dialect: Dialect) -> tuple[float, Array]:
    """Return the mass and inertia (3, 3), in the body's axes, on top of what the joint carries."""
    if dialect.padding is None:
        return 0.0, np.zeros((3, 3))
    size, axis = float(dialect.padding[raw.jnt_dofadr[joint]]), raw.jnt_axis[joint]
    if raw.jnt_type[joint] == int(JointType.SLIDE):
        return size, np.zeros((3, 3))
    return 0.0, size * padding_shape(axis)


def _link(raw: MjModel, body: int, dialect: Dialect, names: Names) -> Element:
    origin, joints = anchor(raw, body), axes(raw, body)
    frame = matrix_from_quat(raw.body_iquat[body])
    mass, inertia = float(raw.body_mass[body]), np.diag(raw.body_inertia[body])
    if joints:
        extra, around = _padding(raw, joints[-1], dialect)
        mass, inertia = mass + extra, inertia + dense.product(dense.product(frame.T, around), frame)
    link = element(
        "link",
        element(
            "inertial",
            origin_element(raw.body_ipos[body] - origin, frame),
            element("mass", value=mass),
            inertia_element(inertia),
        ),
        name=names.links[body],
    )
    link.extend(_geoms(raw, body, 0, dialect))
    return link


def _geoms(raw: MjModel, body: int, part: int, dialect: Dialect) -> Iterator[Element]:
    """Yield the elements for a body's geoms in one of its links."""
    for geom in range(raw.body_geomadr[body], raw.body_geomadr[body] + raw.body_geomnum[body]):
        touches = raw.geom_contype[geom] or raw.geom_conaffinity[geom] or geom in dialect.parts
        wanted = dialect.solids if touches else dialect.looks
        if wanted and dialect.parts.get(geom, 0) == part:
            tag = "collision" if touches else "visual"
            yield from _geom(raw, geom, anchor(raw, body), tag, dialect)


def _geom(raw: MjModel, geom: int, anchor: Array, tag: str, dialect: Dialect) -> Iterator[Element]:
    pos, mat = raw.geom_pos[geom] - anchor, matrix_from_quat(raw.geom_quat[geom])
    size, kind = raw.geom_size[geom], int(raw.geom_type[geom])
    shape = _PRIMITIVES.get(kind, "")
    solids: list[tuple[Array, Element]] = []
    if geom in dialect.hulls:
        solids.append((pos, element("mesh", filename=hull_file(geom))))
    elif kind == GeomKind.BOX:
        solids.append((pos, element(shape, size=2 * size)))
    elif kind == GeomKind.SPHERE:
        solids.append((pos, element(shape, radius=size[0])))
    elif shape:
        ends = kind == GeomKind.CAPSULE and not dialect.capsules
        shape = "cylinder" if ends else shape
        solids.append((pos, element(shape, radius=size[0], length=2 * size[1])))
        for side in (-1, 1) if ends else ():
            ball = element("sphere", radius=size[0])
            solids.append((pos + side * size[1] * mat[:, 2], ball))
    elif kind == GeomKind.MESH:
        mesh = int(raw.geom_dataid[geom])
        # MuJoCo moved the mesh to its centre and axes; the file has it where it was.
        # Rounded, so that a look that was never moved is at 0 0 0 and not at 1e-17.
        mat = np.round(dense.product(mat, matrix_from_quat(raw.mesh_quat[mesh]).T), 12)
        pos = np.round(pos - dense.times(mat, raw.mesh_pos[mesh]), 12)
        file = _mesh_file(raw, mesh, dialect.folder)
        solids.append((pos, element("mesh", filename=file, scale=raw.mesh_scale[mesh])))
    elif kind != GeomKind.PLANE:  # which URDF does not know
        raise ValueError(f"geom {geom} has no counterpart in URDF")
    name = raw.geom(geom).name
    for k, (where, solid) in enumerate(solids):
        label = {"name": name} if name and not k else {}  # each name once
        yield element(tag, origin_element(where, mat), element("geometry", solid), **label)


def hull_file(geom: int) -> str:
    """Return the name of the file with the hull of a geom, beside the URDF."""
    return f"hull_{geom}.obj"


def _mesh_file(raw: MjModel, mesh: int, folder: Path | None) -> str:
    start = int(raw.mesh_pathadr[mesh])
    name = raw.paths[start : raw.paths.index(b"\0", start)].decode() if start >= 0 else ""
    return os.path.relpath(name, folder) if folder and os.path.isabs(name) else name


def _joints(raw: MjModel, body: int, dialect: Dialect, names: Names) -> Iterator[Element]:
    """Yield the joints between a body and its parent, with massless links between them."""
    upper = int(raw.body_parentid[body])
    parent = names.links[upper] if upper else "world"
    turn = matrix_from_quat(raw.body_quat[body])
    place = raw.body_pos[body] - anchor(raw, upper)  # of the world that is where it is
    if not upper and floats(raw, body):
        turn, place = np.eye(3), np.zeros(3)
    joints = axes(raw, body)
    if not joints:
        where, name = origin_element(place, turn), names.fixed[body]
        yield joint_element(name, "fixed", parent, names.links[body], where)
        return
    place = place + dense.times(turn, raw.jnt_pos[joints[0]])
    for joint in joints:
        child = names.links[body]
        if joint != joints[-1]:
            child = names.between[joint]
            yield bare_link(child, *_padding(raw, joint, dialect))
        kind = _kind(raw, joint, dialect)
        bounds: dict[str, float] = {}
        if kind != "continuous":
            bounds["lower"], bounds["upper"] = _bounds(raw, joint, dialect)
        dof = int(raw.jnt_dofadr[joint])
        extra = [
            element("axis", xyz=raw.jnt_axis[joint]),
            element("limit", **bounds, effort=_effort(raw, joint), velocity=100.0),
        ]
        if dialect.dynamics:
            damping, friction = raw.dof_damping[dof], raw.dof_frictionloss[dof]
            extra.append(element("dynamics", damping=damping, friction=friction))
        where = origin_element(*_at_zero(raw, joint, place, turn))
        yield joint_element(names.joints[joint], kind, parent, child, where, *extra)
        if joint != joints[-1]:
            parent, turn = child, np.eye(3)
            place = raw.jnt_pos[joint + 1] - raw.jnt_pos[joint]


def _is_limited(raw: MjModel, joint: int, dialect: Dialect) -> bool:
    return bool(raw.jnt_limited[joint]) and dialect.dynamics


def _kind(raw: MjModel, joint: int, dialect: Dialect) -> str:
    """Return the type of a joint in a URDF."""
    if raw.jnt_type[joint] == int(JointType.SLIDE):
        return "prismatic"
    return "revolute" if _is_limited(raw, joint, dialect) else "continuous"


def _bounds(raw: MjModel, joint: int, dialect: Dialect) -> tuple[float, float]:
    """Return the range of a joint that must have one in a URDF, as a slide must."""
    if _is_limited(raw, joint, dialect):
        low, high = raw.jnt_range[joint]
        return low, high
    if dialect.dynamics:
        return -UNLIMITED, UNLIMITED
    return 1, -1  # the wrong way round, which PyBullet takes for none


def _at_zero(raw: MjModel, joint: int, place: Array, turn: Array) -> tuple[Array, Array]:
    """Return where a joint's frame is when its position is 0, from where it is in the file's pose.

    There the position is the joint's `ref`.
    """
    ref, axis = float(raw.qpos0[raw.jnt_qposadr[joint]]), raw.jnt_axis[joint]
    if not ref:
        return place, turn
    if raw.jnt_type[joint] == int(JointType.SLIDE):
        return place - ref * dense.times(turn, axis), turn
    half = -ref / 2
    back = matrix_from_quat(np.array([np.cos(half), *(np.sin(half) * axis)]))
    return place, dense.product(turn, back)


def _effort(raw: MjModel, joint: int) -> float:
    """Return the largest force of the actuators on a joint; UNLIMITED where nothing limits it."""
    on_joint = raw.actuator_trntype == TransmissionKind.JOINT
    drives = on_joint & (raw.actuator_trnid[:, 0] == joint)
    limited = drives & raw.actuator_forcelimited.astype(bool)
    if not limited.any():
        return UNLIMITED
    return float(np.abs(raw.actuator_forcerange[limited]).max())


def _tip(raw: MjModel, site: int, names: Names) -> Iterator[Element]:
    body, name = int(raw.site_bodyid[site]), names.tips[site]
    mat = matrix_from_quat(raw.site_quat[site])
    yield bare_link(name, 0.0, np.zeros((3, 3)))
    where = origin_element(raw.site_pos[site] - anchor(raw, body), mat)
    yield joint_element(names.tips_fixed[site], "fixed", names.links[body], name, where)
