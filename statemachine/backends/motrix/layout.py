"""Where MotrixSim has what MuJoCo counts: elements of one file in two readings.

Ids, names and the order of coordinates are MuJoCo's. Both walk the tree of a file in its order; a
URDF's links behind fixed joints stay links in MotrixSim, and are sites here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...interface import Array, Ints, JointType
from ...interface.checks import unsupported_by
from .links import geoms_of, links_of

if TYPE_CHECKING:
    from ..compiled.types import MjModel


@dataclass(init=False, eq=False)
class MotrixLayout:
    """Where MotrixSim has the elements of a compiled model.

    Attributes:
        qpos: (nq,) where each number of qpos stands in its positions.
        qvel: (nv,) where each number of qvel stands in its velocities.
        quaternions: Where a quaternion begins in qpos.
        links: (nbody,) its link of each body, -1 of the world.
        sites: (nsite,) its site of each site, -1 of one that it does not read: that is where the
            file puts it in its body.
        site_bodies: (nsite,) the body that carries each site.
        site_pos, site_quat: (nsite, 3) [m] and (nsite, 4) wxyz, in that body's frame.
        geoms: (number of its geoms,) the geom of each, -1 of one that is not known; empty where
            its geoms cannot be told apart.
        mocaps: (nmocap,) its body of each body that is led.
        parents: (nbody,) the body that carries each body.
        turns: (nbody, 4) wxyz, how each body is turned in that body where its joints are at 0.
        floating: Of each body that has a free joint, where its quaternion begins in qpos.
        same_links: Whether its links are the bodies, in their order.
    """

    qpos: Ints
    qvel: Ints
    quaternions: tuple[int, ...]
    links: Ints
    sites: Ints
    site_bodies: Ints
    site_pos: Array
    site_quat: Array
    geoms: Ints
    mocaps: Ints
    parents: Ints
    turns: Array
    floating: Mapping[int, int]
    same_links: bool


def layout_of(world: Any, scene: Any, raw: MjModel) -> MotrixLayout:
    """Find the elements of a compiled model in what MotrixSim reads of the same file.

    Args:
        world: The world of the file.
        scene: What is built of it.
        raw: The compiled model.

    Raises:
        UnsupportedError: MotrixSim reads other elements.
    """
    found = list(links_of(world))
    names = [each.link.name or "" for each in found]
    links = _links(names, raw)
    same_links = links.tolist() == list(range(-1, raw.nbody - 1)) and len(names) == raw.nbody - 1
    if scene.num_actuators != raw.nactuator:
        counts = f"{raw.nactuator} in MuJoCo, {scene.num_actuators} in its reading"
        raise _other("actuators", counts)
    led = [
        raw.body(body).name for body in np.argsort(raw.body_mocapid) if raw.body_mocapid[body] >= 0
    ]
    bodies = {name: number for number, name in enumerate(scene.body_names)}
    if any(name not in bodies for name in led):
        raise _other("mocap", "a body that is led has no name that it knows")
    layout = MotrixLayout()
    layout.links, layout.same_links = links, same_links
    layout.qpos, layout.qvel, layout.quaternions = _coordinates(scene, raw)
    layout.sites, layout.site_bodies = _sites(scene, raw), raw.site_bodyid.astype(np.int64)
    layout.site_pos, layout.site_quat = np.array(raw.site_pos), np.array(raw.site_quat)
    layout.geoms = _geoms(world, scene, raw)
    layout.mocaps = np.array([bodies[name] for name in led], dtype=np.int64)
    layout.parents, layout.turns = raw.body_parentid.astype(np.int64), np.array(raw.body_quat)
    layout.floating = _floating(raw)
    return layout


def _floating(raw: MjModel) -> dict[int, int]:
    """Return of each body that has a free joint where its quaternion begins in qpos."""
    joints = np.flatnonzero(raw.jnt_type == JointType.FREE)
    return {int(raw.jnt_bodyid[joint]): int(raw.jnt_qposadr[joint]) + 3 for joint in joints}


def _other(feature: str, difference: str) -> Exception:
    return unsupported_by("motrix", feature, f"it reads others in this file: {difference}")


def _links(names: Sequence[str], raw: MjModel) -> Ints:
    """Return the link of each body (nbody,), -1 of the world.

    Raises:
        UnsupportedError: A body is not there.
    """
    bodies = [raw.body(body).name for body in range(1, raw.nbody)]
    in_order = len(names) == len(bodies)
    known = {name: number for number, name in enumerate(names) if name}
    links = [-1]
    for number, name in enumerate(bodies):
        if in_order and names[number] in ("", name):
            links.append(number)
        elif name in known:
            links.append(known[name])
        else:
            raise _other("bodies", f"no {name or f'body {number + 1}'}")
    return np.array(links, dtype=np.int64)


def _coordinates(scene: Any, raw: MjModel) -> tuple[Ints, Ints, tuple[int, ...]]:
    """Return where each number of qpos and of qvel stands, and where quaternions begin in qpos.

    Raises:
        UnsupportedError: It has other joints.
    """
    if (scene.num_dof_pos, scene.num_dof_vel) != (raw.nq, raw.nv):
        counts = f"nq, nv are {raw.nq}, {raw.nv}, and {scene.num_dof_pos}, {scene.num_dof_vel}"
        raise _other("joints", counts)
    joints = list(zip(scene.joints, scene.joint_names, strict=True))
    qpos, qvel = np.zeros(raw.nq, np.int64), np.zeros(raw.nv, np.int64)
    bases, quaternions = list(scene.floating_bases), list[int]()
    for joint in range(raw.njnt):
        kind, name = JointType(int(raw.jnt_type[joint])), raw.joint(joint).name
        place, dof = int(raw.jnt_qposadr[joint]), int(raw.jnt_dofadr[joint])
        if kind == JointType.FREE:
            if not bases:
                raise _other("joints", f"no free joint {name}")
            base = bases.pop(0)
            start, speed, size = base.dof_pos_start, base.dof_vel_start, kind.nv
        else:
            if not joints or (joints[0][1] or name) != name or joints[0][0].num_dof_pos != kind.nq:
                raise _other("joints", f"no joint {name or joint} where MuJoCo has it")
            own, _ = joints.pop(0)
            start, speed, size = own.dof_pos_index, own.dof_vel_index, kind.nv
        qpos[place : place + kind.nq] = np.arange(start, start + kind.nq)
        qvel[dof : dof + size] = np.arange(speed, speed + size)
        if kind in (JointType.FREE, JointType.BALL):
            first = place + kind.nq - 4
            quaternions.append(first)
            qpos[first : first + 4] = qpos[first : first + 4][[3, 0, 1, 2]]  # x y z w there
    return qpos, qvel, tuple(quaternions)


def _sites(scene: Any, raw: MjModel) -> Ints:
    """Return its site of each site (nsite,), -1 of one that it does not read."""
    theirs = list(scene.site_names)
    known = {name: number for number, name in enumerate(theirs) if name}
    sites = list[int]()
    for number in range(raw.nsite):
        name = raw.site(number).name
        if len(theirs) == raw.nsite and (theirs[number] or name) == name:
            sites.append(number)
        else:
            sites.append(known.get(name, -1))
    return np.array(sites, dtype=np.int64)


def _geoms(world: Any, scene: Any, raw: MjModel) -> Ints:
    """Return the geom of each of its geoms; empty where they cannot be told apart.

    Shapes that are drawn only may be missing in one of the readings, as MuJoCo's of a URDF.
    """
    unknown = np.empty(0, np.int64)
    if len(geoms_of(world)) != scene.num_geoms:
        return unknown
    every = list(range(scene.num_geoms))
    solid = [number for number in every if not scene.geoms[number].visual_only]
    for chosen in (every, solid):
        if len(chosen) != raw.ngeom:
            continue
        pairs = [(scene.geom_names[own], raw.geom(k).name) for k, own in enumerate(chosen)]
        if all(theirs in (None, "", ours) for theirs, ours in pairs):
            geoms = np.full(scene.num_geoms, -1, dtype=np.int64)
            geoms[chosen] = np.arange(raw.ngeom)
            return geoms
    return unknown
