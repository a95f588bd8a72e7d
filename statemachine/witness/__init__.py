"""What the witness computes places from, and how it came by it.

There are two ways. *Own reading*: Pinocchio's own parser reads the robot's file. *Same
reading*: a Pinocchio model is built from the numbers of a compiled model, so that the code
that computes is another, and the reading of the file is not.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from ..errors import ModelError
from ..rotations import matrix_from_quat
from .mjcf import PlainMjcf, WrittenBody, WrittenSite
from .mjcf_text import parse

if TYPE_CHECKING:
    import pinocchio

# A robot as Pinocchio has it, with the names and the order of the file that it comes from.
#
# *Same reading*: `read_numbers` builds it from the numbers of a compiled model. They are the
# compiler's, so a misreading of the file is shared. The chain of transforms, and the code that
# computes it, are not.

OWN_READING, SAME_READING = "own reading", "same reading"
SIZES = {"free": (7, 6), "ball": (4, 3), "hinge": (1, 1), "slide": (1, 1), "unbounded": (1, 1)}


class Segment(NamedTuple):
    """One joint.

    Attributes:
        name: "" if it has none.
        kind: "free", "ball", "hinge", "slide", or "unbounded": a hinge that Pinocchio
            keeps as cosine and sine.
        idx_q, idx_v: Where it starts in Pinocchio's vectors.
        ref: What qpos says where the file draws the joint [rad or m].
    """

    name: str
    kind: str
    idx_q: int
    idx_v: int
    ref: float = 0.0

    @property
    def nq(self) -> int:
        """Return the joint's length in qpos, in MuJoCo's layout."""
        return SIZES[self.kind][0]

    @property
    def nv(self) -> int:
        """Return the joint's length in qvel."""
        return SIZES[self.kind][1]


@dataclass(frozen=True, eq=False)
class RobotReading:
    """A robot as Pinocchio has it, and how it came by it.

    Attributes:
        model: Pinocchio's Model.
        joints: In MuJoCo's order, or of a URDF in Pinocchio's.
        bodies: Ids of Pinocchio's frames, by name; a body without a name is called "body 7", by
            its place in MuJoCo's order. "body 0" is the world.
        sites: The same of sites: "site 3".
        grade: `OWN_READING` or `SAME_READING`.
        prepared: What was done to the file's text before Pinocchio read it.
    """

    model: pinocchio.Model
    joints: tuple[Segment, ...]
    bodies: dict[str, int]
    sites: dict[str, int]
    grade: str
    prepared: tuple[str, ...]


def labels(kind: str, names: Iterable[str]) -> list[str]:
    """Return the labels of bodies or sites: their names, or "body 7" and "site 3" without one."""
    given = list(names)
    called = []
    for number, name in enumerate(given):
        own = name or f"{kind} {number}"
        while not name and own in given:  # somebody else's name
            own = f"unnamed {own}"
        called.append(own)
    return called


# MuJoCo's mjtJoint, in order, and what Pinocchio calls such a joint.
_KINDS = (
    ("free", "JointModelFreeFlyer"),
    ("ball", "JointModelSpherical"),
    ("slide", "JointModelPrismaticUnaligned"),
    ("hinge", "JointModelRevoluteUnaligned"),
)


def read_numbers(
    pin: Any, compiled: Any, bodies: Sequence[str], joints: Sequence[str], sites: Sequence[str]
) -> RobotReading:
    """Build Pinocchio's model of a compiled model.

    Args:
        pin: Pinocchio.
        compiled: Has body_parentid, body_pos, body_quat, jnt_type, jnt_bodyid, jnt_pos,
            jnt_axis, jnt_qposadr, qpos0, site_bodyid, site_pos and site_quat, as MuJoCo
            defines them.
        bodies: Names, "" for none; joints, sites: likewise.
        joints: See bodies.
        sites: See bodies.
    """
    model = pin.Model()
    types = pin.FrameType
    # Of each body: the joint that carries it, its pose in that joint, and its frame.
    carriers = [(0, pin.SE3.Identity(), 0)]
    segments: list[Segment] = []
    for body in range(1, len(bodies)):
        parent, pose, frame = carriers[int(compiled.body_parentid[body])]
        pose = pose * _pose(pin, compiled.body_pos[body], compiled.body_quat[body])
        for joint in np.flatnonzero(np.asarray(compiled.jnt_bodyid) == body).tolist():
            kind, name = _KINDS[int(compiled.jnt_type[joint])]
            anchor = pin.SE3(np.eye(3), np.array(compiled.jnt_pos[joint], dtype=np.float64))
            if kind == "free":  # its qpos is a pose in the world
                pose = anchor = pin.SE3.Identity()
            axis, ref = [], 0.0
            if kind in ("slide", "hinge"):
                axis = [np.array(compiled.jnt_axis[joint], dtype=np.float64)]
                ref = float(compiled.qpos0[compiled.jnt_qposadr[joint]])
            moving = getattr(pin, name)(*axis)
            parent = model.addJoint(parent, moving, pose * anchor, f"joint {joint}")
            pose = anchor.inverse()
            added = model.joints[parent]
            segments.append(Segment(joints[joint], kind, added.idx_q, added.idx_v, ref))
        own = model.addFrame(pin.Frame(f"body {body}", parent, frame, pose, types.BODY))
        carriers.append((parent, pose, own))
    placed: list[int] = []
    for site in range(len(sites)):
        parent, pose, frame = carriers[int(compiled.site_bodyid[site])]
        pose = pose * _pose(pin, compiled.site_pos[site], compiled.site_quat[site])
        added = pin.Frame(f"site {site}", parent, frame, pose, types.OP_FRAME)
        placed.append(model.addFrame(added))
    frames = [frame for *_, frame in carriers]
    return RobotReading(
        model=model,
        joints=tuple(segments),
        bodies=dict(zip(labels("body", bodies), frames, strict=True)),
        sites=dict(zip(labels("site", sites), placed, strict=True)),
        grade=SAME_READING,
        prepared=(),
    )


def _pose(pin: Any, pos: Any, quat: Any) -> Any:
    turn = np.array(quat, dtype=np.float64)
    return pin.SE3(matrix_from_quat(turn / np.linalg.norm(turn)), np.array(pos, dtype=np.float64))


# Own reading: a robot's file, read by Pinocchio's own parser with no misreading unnoticed.


def read_file(pin: Any, path: Path) -> RobotReading:
    """Read Pinocchio's model of an MJCF or URDF file.

    Args:
        pin: Pinocchio.
        path: The file.

    Raises:
        ModelError: It cannot be read, or would be misread.
    """
    root = parse(path)
    try:
        if root.tag == "robot":
            return _read_urdf(pin, path)
        if root.tag == "mujoco":
            return _read_mjcf(pin, PlainMjcf(root, path), path)
    except ModelError:
        raise
    except Exception as error:  # the bindings raise RuntimeError, ValueError and others
        raise ModelError(f"Pinocchio cannot read {path}: {_reason(error)}") from error
    raise ModelError(f"{path} is neither MJCF nor URDF: its root element is <{root.tag}>")


def _read_mjcf(pin: Any, file: PlainMjcf, path: Path) -> RobotReading:
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "robot.xml"
        ElementTree.ElementTree(file.root).write(copy, encoding="utf-8")
        model = pin.buildModelFromMJCF(str(copy))
    types = pin.FrameType
    frames = {
        frame.name: number
        for number, frame in enumerate(model.frames)
        if frame.type in (types.BODY, types.OP_FRAME)
    }
    joints: list[Segment] = []
    for body in file.bodies:
        joints += _segments(pin, model, body, frames[body.written], path)
    if sum(segment.nq for segment in joints) != model.nq:
        raise ModelError(f"Pinocchio finds other joints in {path.name} than there are")
    sites = [site for body in file.bodies for site in body.sites]
    return RobotReading(
        model=model,
        joints=tuple(joints),
        bodies=_labelled_frames("body", file.bodies, frames),
        sites=_labelled_frames("site", sites, frames),
        grade=OWN_READING,
        prepared=file.changes,
    )


def _labelled_frames(
    kind: str, elements: Sequence[WrittenBody | WrittenSite], frames: Mapping[str, int]
) -> dict[str, int]:
    """Return the ids of Pinocchio's frames by what bodies or sites are called.

    Args:
        kind: "body" or "site".
        elements: In MuJoCo's order.
        frames: The ids by the names in what Pinocchio read.
    """
    called = labels(kind, [element.name for element in elements])
    numbers = [frames[element.written] for element in elements]
    return dict(zip(called, numbers, strict=True))


def _segments(pin: Any, model: Any, body: WrittenBody, frame: int, path: Path) -> list[Segment]:
    """Return the joints of one body, which Pinocchio may have put into one."""
    if not body.joints:
        return []
    number = model.frames[frame].parentJoint
    joint = model.joints[number]
    idx_q, idx_v = joint.idx_q, joint.idx_v
    segments: list[Segment] = []
    for name, kind, ref in body.joints:
        if kind not in SIZES:
            raise ModelError(f"{path.name} has a joint of the kind {kind!r}, which is unknown")
        segments.append(Segment(name, kind, idx_q, idx_v, ref))
        idx_q, idx_v = idx_q + SIZES[kind][0], idx_v + SIZES[kind][1]
        if kind == "free":
            # MuJoCo's qpos of a free body is its pose in the world, whatever pose the file
            # gives the body; Pinocchio would put the one on top of the other.
            model.jointPlacements[number] = pin.SE3.Identity()
    if (idx_q, idx_v) != (joint.idx_q + joint.nq, joint.idx_v + joint.nv):
        raise ModelError(f"Pinocchio makes other joints of body {body.written!r} in {path.name}")
    return segments


# By how many numbers it has in q and v; a hinge or a slide is one number.
_KINDS_BY_SIZE = {(2, 1): "unbounded", (1, 1): "hinge"}
_SLIDING = ("JointModelPX", "JointModelPY", "JointModelPZ", "JointModelPrismaticUnaligned")


def _kind_of(joint: Any) -> str:
    """Return what a joint of Pinocchio's URDF reader is called here; "" for another."""
    name = joint.shortname()
    if name.endswith("FreeFlyer"):
        return "free"
    if name in _SLIDING:
        return "slide"
    return _KINDS_BY_SIZE.get((joint.nq, joint.nv), "")


def _read_urdf(pin: Any, path: Path) -> RobotReading:
    model = pin.buildModelFromUrdf(str(path))
    joints: list[Segment] = []
    changed = 0
    for number, name in list(enumerate(model.names))[1:]:
        joint = model.joints[number]
        kind = _kind_of(joint)
        if not kind:
            raise ModelError(
                f"{path.name}: a joint of Pinocchio's kind {joint.shortname()} is not handled"
            )
        if kind == "free":
            changed += not model.jointPlacements[number].isIdentity()
            model.jointPlacements[number] = pin.SE3.Identity()  # as of an MJCF
        joints.append(Segment(name, kind, joint.idx_q, joint.idx_v))
    links = [k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
    bodies = {model.frames[k].name: k for k in links}
    prepared: tuple[str, ...] = ()
    if changed:
        prepared = (f"places of floating joints left out, for qpos has them: {changed}",)
    return RobotReading(
        model=model,
        joints=tuple(joints),
        bodies=bodies,
        sites={},
        grade=OWN_READING,
        prepared=prepared,
    )


def _reason(error: Exception) -> str:
    """Return one line of an error of Pinocchio's: the C++ location lines are left out."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    plain = [line for line in lines if not line.startswith(("From file:", "in function:"))]
    return (plain or lines or [type(error).__name__])[0]
