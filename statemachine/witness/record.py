"""A robot as Pinocchio has it, with the names and the order of the file that it comes from.

*Same reading*: `read_numbers` builds it from the numbers of a compiled model. They are the
compiler's, so a misreading of the file is shared. The chain of transforms, and the code that
computes it, are not.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..rotations import matrix_from_quat

OWN_READING, SAME_READING = "own reading", "same reading"
SIZES = {"free": (7, 6), "ball": (4, 3), "hinge": (1, 1), "slide": (1, 1), "unbounded": (1, 1)}


class Segment(NamedTuple):
    """One joint.

    Attributes:
        kind: "free", "ball", "hinge", "slide", or "unbounded": a hinge that Pinocchio
            keeps as cosine and sine.
        idx_q, idx_v: Where it starts in Pinocchio's vectors.
        ref: What qpos says where the file draws the joint [rad or m].
    """

    kind: str
    idx_q: int
    idx_v: int
    ref: float = 0.0

    @property
    def nq(self) -> int:
        """Its length in qpos, in MuJoCo's layout."""
        return SIZES[self.kind][0]

    @property
    def nv(self) -> int:
        """Its length in qvel."""
        return SIZES[self.kind][1]


@dataclass(frozen=True)
class WitnessModel:
    """A robot as Pinocchio has it.

    Attributes:
        model: Pinocchio's.
        joints: Of each joint its name, "" if it has none, and where it is; in MuJoCo's
            order, or of a URDF in Pinocchio's.
        bodies, sites: Ids of Pinocchio's frames, by name; those without a name are called
            "body 7" and "site 3", by their places in MuJoCo's order. 0 is the world.
        grade: `OWN_READING` or `SAME_READING`.
        prepared: What was done to the file's text before Pinocchio read it.
    """

    model: Any
    joints: tuple[tuple[str, Segment], ...]
    bodies: dict[str, int]
    sites: dict[str, int]
    grade: str
    prepared: tuple[str, ...] = ()


def labels(kind: str, names: Iterable[str]) -> list[str]:
    """What bodies or sites are called: their names, or "body 7" and "site 3" without one."""
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
) -> WitnessModel:
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
    segments: list[tuple[str, Segment]] = []
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
            segments.append((joints[joint], Segment(kind, added.idx_q, added.idx_v, ref)))
        own = model.addFrame(pin.Frame(f"body {body}", parent, frame, pose, types.BODY))
        carriers.append((parent, pose, own))
    placed: list[int] = []
    for site in range(len(sites)):
        parent, pose, frame = carriers[int(compiled.site_bodyid[site])]
        pose = pose * _pose(pin, compiled.site_pos[site], compiled.site_quat[site])
        added = pin.Frame(f"site {site}", parent, frame, pose, types.OP_FRAME)
        placed.append(model.addFrame(added))
    frames = [frame for *_, frame in carriers]
    return WitnessModel(
        model,
        tuple(segments),
        dict(zip(labels("body", bodies), frames, strict=True)),
        dict(zip(labels("site", sites), placed, strict=True)),
        SAME_READING,
    )


def _pose(pin: Any, pos: Any, quat: Any) -> Any:
    turn = np.array(quat, dtype=np.float64)
    return pin.SE3(matrix_from_quat(turn / np.linalg.norm(turn)), np.array(pos, dtype=np.float64))
