"""What MuJoCo makes of a file, and what an MJCF says, as a description.

Defaults, includes and units are settled in a compiled model: an MJCF is what MuJoCo makes of it, so
its own compiler reads it. A URDF that was given to MuJoCo can be described from here too, to see
what the import kept.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...backends import load
from ...errors import ModelError
from ...installed import require
from ...interface import JointType
from ...measures.text import few
from ...rotations import HERE
from ..description.records import (
    Actuator,
    CollisionShape,
    Follows,
    Link,
    Range,
    Robot,
    RobotFrame,
    RobotJoint,
    moved,
)
from . import _shapes as shapes
from ._gains import kind_of_gains
from ._sides import inertial_of, name_of, placed
from .differences import settings_of

_FORMATS = {".mjb": "MJB", ".urdf": "URDF"}
_ON_JOINT, _ON_JOINT_IN_PARENT, _SO3 = 0, 1, 6  # mjtTrn


def read_file(path: Path, name: str) -> Robot:
    """What an MJCF says itself; one some of whose meshes are missing is read without them.

    Args:
        path: The file.
        name: What the description goes by.

    Raises:
        MissingEngineError: It is not installed here.
        ModelError: It cannot read the file.
    """
    suffix = path.suffix.lower()
    try:
        return read(path, name, _FORMATS.get(suffix, "MJCF"))
    except ModelError:
        robot = _without_missing_meshes(path, name) if suffix not in _FORMATS else None
        if robot is None:
            raise
        return robot


def read(path: Path, name: str, form: str = "engine") -> Robot:
    """What its compiler makes of a file, with its own defaults; the rest as of `describe`."""
    return describe(load(path, backend="mujoco", defaults="engine").raw, name, form)


def _without_missing_meshes(path: Path, name: str) -> Robot | None:
    """An MJCF compiled without them; None where no mesh is missing, or nothing compiles."""
    mujoco = require("mujoco")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        folder = Path(spec.modelfiledir or path.parent) / spec.meshdir
        missing = {m.name: m for m in spec.meshes if m.file and not (folder / m.file).is_file()}
        if not missing:
            return None
        lost: dict[str, list[CollisionShape]] = {}
        for geom in list(spec.geoms):
            if geom.meshname in missing:
                if geom.contype or geom.conaffinity:
                    shape = CollisionShape(
                        kind="mesh",
                        place=placed(geom.pos, geom.quat),
                        name=geom.name,
                        contact={"friction": tuple(map(float, geom.friction))},
                    )
                    lost.setdefault(geom.parent.name, []).append(shape)
                spec.delete(geom)
        for mesh in missing.values():
            spec.delete(mesh)
        raw = spec.compile()
    except (ValueError, MemoryError, RuntimeError, mujoco.FatalError):
        return None
    robot = describe(raw, name)
    files = few(sorted(mesh.file for mesh in missing.values()), 5)
    note = (
        f"the meshes {files} are not there: their sizes are not known, and what they weigh is not "
        "counted where a body has no inertia of its own"
    )
    links = tuple(
        replace(link, shapes=(*link.shapes, *lost.get(link.name, ()))) for link in robot.links
    )
    return replace(robot, links=links, notes=(*robot.notes, note))


def describe(raw: Any, name: str, form: str = "MJCF") -> Robot:
    """The description in a compiled model.

    Args:
        raw: An mjModel.
        name: Of the file.
        form: The format of the file.
    """
    mujoco = require("mujoco")
    # What the engine takes where a file says nothing.
    empty = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom type='sphere' size='1'/></worldbody></mujoco>"
    )
    actuators = tuple(_actuator(raw, i) for i in range(raw.nactuator))
    links: list[Link] = []
    names: list[str] = []  # of the last link of each body
    for body in range(raw.nbody):
        above = names[raw.body_parentid[body]] if body else ""
        links += _links(raw, body, above, actuators)
        names.append(links[-1].name)
    robot = Robot(
        name=name,
        reader=f"mujoco {mujoco.__version__}",
        format=form,
        links=tuple(links),
        frames=tuple(_frame(raw, site, names) for site in range(raw.nsite)),
        actuators=actuators,
        settings=settings_of(raw),
        rooted=True,
        notes=tuple(_notes(raw, links, actuators)),
    )
    return replace(robot, defaults=settings_of(empty), touch=shapes.touch_of(empty, 0))


def _frame(raw: Any, site: int, links: list[str]) -> RobotFrame:
    """Return a site as a frame; `links` has the name of the last link of each body."""
    return RobotFrame(
        name=raw.site(site).name or f"site {site}",
        link=links[raw.site_bodyid[site]],
        place=placed(raw.site_pos[site], raw.site_quat[site]),
    )


def _links(raw: Any, body: int, above: str, actuators: tuple[Actuator, ...]) -> list[Link]:
    """A body as a link; one with several joints as a chain, of which it is the last."""
    place = placed(raw.body_pos[body], raw.body_quat[body])
    name, links = raw.body(body).name or f"body {body}", list[Link]()
    first, count = int(raw.body_jntadr[body]), int(raw.body_jntnum[body])
    for joint in range(first, first + count):
        moves = _joint(raw, joint, actuators)
        start = place @ moved(moves, -float(raw.qpos0[raw.jnt_qposadr[joint]]))
        last = joint == first + count - 1
        label = name if last else f"{name}, above {raw.joint(joint + 1).name or joint + 1}"
        links.append(Link(label, above, start, moves, None, body=body))
        above, place = label, HERE
    own = links.pop() if links else Link(name, above, place, None, None, body=body)
    inertial = inertial_of(raw, body) if body else None
    geoms = np.flatnonzero(
        (raw.geom_bodyid == body) & (raw.geom_contype | raw.geom_conaffinity > 0)
    )
    touching = tuple(shapes.of(raw, geom) for geom in geoms.tolist())
    return [*links, replace(own, inertial=inertial, shapes=touching)]


def _joint(raw: Any, joint: int, actuators: tuple[Actuator, ...]) -> RobotJoint:
    dof, kind = int(raw.jnt_dofadr[joint]), JointType(raw.jnt_type[joint])
    scalar = kind in (JointType.SLIDE, JointType.HINGE)
    plain = RobotJoint(
        name=name_of(raw, "joint", joint),
        kind=kind.name.lower(),
        axis=np.array(raw.jnt_axis[joint]),
        anchor=np.array(raw.jnt_pos[joint]),
        limits=_limited(raw.jnt_range[joint], raw.jnt_limited[joint]),
        number=joint,
    )
    told = replace(
        plain,
        armature=float(raw.dof_armature[dof]),
        damping=float(raw.dof_damping[dof]),
        friction=float(raw.dof_frictionloss[dof]),
        stiffness=float(raw.jnt_stiffness[joint]),
        follows=_follows(raw, joint),
    )
    if not scalar:
        return told
    rest = float(raw.qpos_spring[raw.jnt_qposadr[joint]])
    return replace(told, effort=_effort(raw, joint, actuators), rest=rest)


def _follows(raw: Any, joint: int) -> Follows | None:
    """Of an equality between two joints, if it is linear."""
    of_joints = (raw.eq_type == 2) & (raw.eq_obj2id >= 0) & (raw.eq_active0 != 0)  # mjEQ_JOINT
    for i in np.flatnonzero(of_joints & (raw.eq_obj1id == joint)).tolist():
        offset, factor, *rest = map(float, raw.eq_data[i, :5])
        if not any(rest):
            other = name_of(raw, "joint", int(raw.eq_obj2id[i]))
            return Follows(other, factor, offset, name_of(raw, "equality", i))
    return None


def _notes(raw: Any, links: list[Link], actuators: tuple[Actuator, ...]) -> list[str]:
    """What no other format has a word for."""
    linear = sum(link.joint is not None and link.joint.follows is not None for link in links)
    counted = {
        "further equality constraints": raw.neq - linear,
        "tendons": raw.ntendon,
        "contact pairs of its own": raw.npair,
        "pairs of bodies that never touch (exclude)": raw.nexclude,
        "bodies freed of weight (gravcomp)": np.count_nonzero(raw.body_gravcomp),
    }
    said = [f"{count} {what}" for what, count in counted.items() if count]
    notes = [f"it has {', '.join(said)}"] if said else []
    return notes + [text for i, drive in enumerate(actuators) if (text := _beyond(raw, i, drive))]


def _beyond(raw: Any, i: int, drive: Actuator) -> str:
    """A servo that may be commanded to where its joint cannot go."""
    ends = drive.ctrlrange
    kp, bias = raw.actuator_gainprm[i, 0], raw.actuator_biasprm[i, 1]
    if not kp or bias != -kp or drive.gear != 1 or ends is None:
        return ""
    # Of another transmission the target is a site, a tendon or a body, and no joint.
    if int(raw.actuator_trntype[i]) != _ON_JOINT:
        return ""
    joint = int(raw.actuator_trnid[i, 0])
    if not raw.jnt_limited[joint] or raw.jnt_type[joint] != JointType.HINGE:
        return ""
    low, high = raw.jnt_range[joint]
    passed = max(low - ends[0], ends[1] - high)
    if passed <= 1e-5 * (high - low):
        return ""
    return (
        f"the ctrlrange of {drive.name!r} goes beyond the range of its joint by "
        f"{math.degrees(passed):.3g}°"
    )


def _limited(values: Any, limited: Any) -> Range | None:
    return (float(values[0]), float(values[1])) if limited else None


def _effort(raw: Any, joint: int, actuators: tuple[Actuator, ...]) -> float | None:
    """The largest force of what drives a joint; None where nothing does."""
    drives = [
        _most(raw, i, drive) * abs(drive.gear)
        for i, drive in enumerate(actuators)
        if _drives_a_joint(raw, i) and raw.actuator_trnid[i, 0] == joint
    ]
    most = [sum(drives)] if drives else []
    if raw.jnt_actfrclimited[joint]:
        most.append(float(np.abs(raw.jnt_actfrcrange[joint]).max()))
    return min(most, default=None)


def _drives_a_joint(raw: Any, i: int) -> bool:
    """Tell whether the target of an actuator is a joint."""
    transmission = int(raw.actuator_trntype[i])
    if transmission == _SO3:  # of a ball joint, unless it turns a site in the frame of another
        return int(raw.actuator_trnid[i, 1]) < 0
    return transmission in (_ON_JOINT, _ON_JOINT_IN_PARENT)


def _most(raw: Any, i: int, drive: Actuator) -> float:
    """The largest force of an actuator itself."""
    if drive.forcerange:
        return max(map(abs, drive.forcerange))
    if drive.ctrlrange and not raw.actuator_biastype[i] and not raw.actuator_gaintype[i]:
        return abs(float(raw.actuator_gainprm[i, 0])) * max(map(abs, drive.ctrlrange))
    return math.inf


def _actuator(raw: Any, i: int) -> Actuator:
    """Return an actuator, with the gains of a position servo if it is one."""
    gain, bias = raw.actuator_gainprm[i], raw.actuator_biasprm[i]
    joint = name_of(raw, "joint", int(raw.actuator_trnid[i, 0])) if _drives_a_joint(raw, i) else ""
    control = raw.actuator_ctrladr[i]  # the first of several
    actuator = Actuator(
        name=raw.actuator(i).name or f"actuator {i}",
        joint=joint,
        kind=_actuator_kind(raw, i),
        kp=None,
        kv=None,
        gain=float(gain[0]),
        gear=float(raw.actuator_gear[raw.actuator_outadr[i], 0]),
        forcerange=_limited(raw.actuator_forcerange[i], raw.actuator_forcelimited[i]),
        ctrlrange=_limited(raw.actuator_ctrlrange[control], raw.actuator_ctrllimited[control]),
    )
    if actuator.kind != "position":
        return actuator
    return replace(actuator, kp=float(gain[0]), kv=float(-bias[2]), gain=None)


def _actuator_kind(raw: Any, i: int) -> str:
    """Return the kind of an actuator: position, velocity, motor, or general."""
    if raw.actuator_dyntype[i] or raw.actuator_gaintype[i]:
        return "general"
    return kind_of_gains(raw, i)
