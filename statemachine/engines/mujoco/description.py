"""The rigid parts, joints and frames of a compiled model, by which two models are matched."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ...installed import require
from ...interface import JointType
from ...rotations import HERE
from ..description.records import (
    Actuator,
    Link,
    Range,
    Robot,
    RobotFrame,
    RobotJoint,
    joint_transform,
)
from . import _shapes as shapes
from ._gains import kind_of_gains
from ._rigid_parts import inertial_of, placed
from ._sides import name_of

# How many elements of each kind a compiled model has.
_COUNTS = {
    "body": "nbody",
    "joint": "njnt",
    "geom": "ngeom",
    "site": "nsite",
    "actuator": "nactuator",
    "tendon": "ntendon",
    "equality": "neq",
    "sensor": "nsensor",
    "pair": "npair",
    "exclude": "nexclude",
    "camera": "ncam",
}
_EQUALITY_OF_JOINTS = 2  # mjtEq
_ON_JOINT, _ON_JOINT_IN_PARENT, _SO3 = 0, 1, 6  # mjtTrn


def describe(raw: Any, name: str) -> Robot:
    """Return the rigid parts, joints and frames of a compiled model.

    Args:
        raw: An mjModel.
        name: Of the file.
    """
    actuators = tuple(_actuator(raw, i) for i in range(raw.nactuator))
    links: list[Link] = []
    names: list[str] = []  # of the last link of each body
    for body in range(raw.nbody):
        above = names[raw.body_parentid[body]] if body else ""
        links += _links(raw, body, above, actuators)
        names.append(links[-1].name)
    return Robot(
        name=name,
        reader=f"mujoco {require('mujoco').__version__}",
        links=tuple(links),
        frames=tuple(_frame(raw, site, names) for site in range(raw.nsite)),
        actuators=actuators,
        settings=None,
        notes=tuple(_notes(raw, actuators)),
    )


def _frame(raw: Any, site: int, links: list[str]) -> RobotFrame:
    """Return a site as a frame; `links` has the name of the last link of each body."""
    return RobotFrame(
        name=raw.site(site).name or f"site {site}",
        link=links[raw.site_bodyid[site]],
        place=placed(raw.site_pos[site], raw.site_quat[site]),
    )


def _links(raw: Any, body: int, above: str, actuators: tuple[Actuator, ...]) -> list[Link]:
    """Return a body as a link; one with several joints as a chain, of which it is the last."""
    place = placed(raw.body_pos[body], raw.body_quat[body])
    name, links = raw.body(body).name or f"body {body}", list[Link]()
    first, count = int(raw.body_jntadr[body]), int(raw.body_jntnum[body])
    for joint in range(first, first + count):
        moves = _joint(raw, joint, actuators)
        start = place @ joint_transform(moves, -float(raw.qpos0[raw.jnt_qposadr[joint]]))
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
    described = replace(
        plain,
        armature=float(raw.dof_armature[dof]),
        damping=float(raw.dof_damping[dof]),
        friction=float(raw.dof_frictionloss[dof]),
        stiffness=float(raw.jnt_stiffness[joint]),
    )
    if not scalar:
        return described
    return replace(described, effort=_effort(raw, joint, actuators))


def _notes(raw: Any, actuators: tuple[Actuator, ...]) -> list[str]:
    """Return what no other format has a word for."""
    of_joints = (raw.eq_type == _EQUALITY_OF_JOINTS) & (raw.eq_obj2id >= 0)
    linear = of_joints & ~raw.eq_data[:, 2:5].any(axis=1)
    freed = np.count_nonzero(raw.body_gravcomp)
    counted = (  # how many, what one is, and what several are
        (
            raw.neq - np.count_nonzero(linear),
            "further equality constraint",
            "further equality constraints",
        ),
        (raw.ntendon, "tendon", "tendons"),
        (raw.npair, "contact pair of its own", "contact pairs of its own"),
        (
            raw.nexclude,
            "pair of bodies that never touch (exclude)",
            "pairs of bodies that never touch (exclude)",
        ),
        (freed, "body freed of weight (gravcomp)", "bodies freed of weight (gravcomp)"),
    )
    words = [f"{count} {one if count == 1 else plural}" for count, one, plural in counted if count]
    notes = [f"it has {', '.join(words)}"] if words else []
    return notes + [text for i, drive in enumerate(actuators) if (text := _beyond(raw, i, drive))]


def _beyond(raw: Any, i: int, drive: Actuator) -> str:
    """Return the servos that may be commanded to where their joints cannot go."""
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
    """Return the largest force of what drives a joint; None where nothing does."""
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
    """Return the largest force of an actuator itself."""
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
        gear=float(raw.actuator_gear[raw.actuator_outadr[i], 0]),
        forcerange=_limited(raw.actuator_forcerange[i], raw.actuator_forcelimited[i]),
        ctrlrange=_limited(raw.actuator_ctrlrange[control], raw.actuator_ctrllimited[control]),
    )
    if actuator.kind != "position":
        return actuator
    return replace(actuator, kp=float(gain[0]), kv=float(-bias[2]))


def _actuator_kind(raw: Any, i: int) -> str:
    """Return the kind of an actuator: position, velocity, motor, or general."""
    if raw.actuator_dyntype[i] or raw.actuator_gaintype[i]:
        return "general"
    return kind_of_gains(raw, i)


def element_names(raw: Any) -> dict[str, list[str]]:
    """Return the names of all elements of a compiled model by their kind, in their order.

    An element without a name goes by its kind, its number and what it is on.

    Args:
        raw: An mjModel.
    """
    names: dict[str, list[str]] = {}
    for kind, count in _COUNTS.items():
        names[kind] = [name_of(raw, kind, k) for k in range(int(getattr(raw, count)))]
    return names
