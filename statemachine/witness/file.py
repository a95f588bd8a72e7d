"""Own reading: a robot's file, read by Pinocchio's own parser with no misreading unnoticed."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ..errors import ModelError
from .mjcf import FileBody, PlainMjcf
from .mjcf_text import parse
from .record import OWN_READING, SIZES, Segment, WitnessModel, labels


def read_file(pin: Any, path: Path) -> WitnessModel:
    """Pinocchio's model of an MJCF or URDF file.

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


def _read_mjcf(pin: Any, file: PlainMjcf, path: Path) -> WitnessModel:
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
    bodies = [frames[body.written] for body in file.bodies]
    joints: list[tuple[str, Segment]] = []
    for body, frame in zip(file.bodies, bodies, strict=True):
        joints += _segments(pin, model, body, frame, path)
    sites = [site for body in file.bodies for site in body.sites]
    if sum(segment.nq for _, segment in joints) != model.nq:
        raise ModelError(f"Pinocchio finds other joints in {path.name} than there are")
    return WitnessModel(
        model,
        tuple(joints),
        dict(zip(labels("body", (body.name for body in file.bodies)), bodies, strict=True)),
        dict(
            zip(
                labels("site", (name for name, _ in sites)),
                (frames[written] for _, written in sites),
                strict=True,
            )
        ),
        OWN_READING,
        file.changes,
    )


def _segments(
    pin: Any, model: Any, body: FileBody, frame: int, path: Path
) -> list[tuple[str, Segment]]:
    """The joints of one body, which Pinocchio may have put into one."""
    if not body.joints:
        return []
    number = model.frames[frame].parentJoint
    joint = model.joints[number]
    idx_q, idx_v = joint.idx_q, joint.idx_v
    segments: list[tuple[str, Segment]] = []
    for name, kind, ref in body.joints:
        if kind not in SIZES:
            raise ModelError(f"{path.name} has a joint of the kind {kind!r}, which is unknown")
        segments.append((name, Segment(kind, idx_q, idx_v, ref)))
        idx_q, idx_v = idx_q + SIZES[kind][0], idx_v + SIZES[kind][1]
        if kind == "free":
            # MuJoCo's qpos of a free body is its pose in the world, whatever pose the file
            # gives the body; Pinocchio would put the one on top of the other.
            model.jointPlacements[number] = pin.SE3.Identity()
    if (idx_q, idx_v) != (joint.idx_q + joint.nq, joint.idx_v + joint.nv):
        raise ModelError(f"Pinocchio makes other joints of body {body.written!r} in {path.name}")
    return segments


# By how many numbers it has in q and v; a hinge or a slide: to these vectors it is one number.
_KINDS = {(2, 1): "unbounded", (1, 1): "hinge"}


def _read_urdf(pin: Any, path: Path) -> WitnessModel:
    model = pin.buildModelFromUrdf(str(path))
    joints: list[tuple[str, Segment]] = []
    changed = 0
    for number, name in list(enumerate(model.names))[1:]:
        joint, theirs = model.joints[number], model.joints[number].shortname()
        free = theirs.endswith("FreeFlyer")
        kind = "free" if free else _KINDS.get((joint.nq, joint.nv))
        if kind is None:
            raise ModelError(f"{path.name}: a joint of Pinocchio's kind {theirs} is not handled")
        if free:
            changed += not model.jointPlacements[number].isIdentity()
            model.jointPlacements[number] = pin.SE3.Identity()  # as of an MJCF
        joints.append((name, Segment(kind, joint.idx_q, joint.idx_v)))
    links = [k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
    bodies = {model.frames[k].name: k for k in links}
    said = (f"places of floating joints left out, for qpos has them: {changed}",) * bool(changed)
    return WitnessModel(model, tuple(joints), bodies, {}, OWN_READING, said)


def _reason(error: Exception) -> str:
    """One line of an error of Pinocchio's: the C++ location lines are left out."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    plain = [line for line in lines if not line.startswith(("From file:", "in function:"))]
    return (plain or lines or [type(error).__name__])[0]
