"""The certificate: an engine's fingertip against Pinocchio's, over many poses.

Frame definitions come first. Two files may give one name to two frames, and then
every pose differs by the same offset; that is no disagreement about kinematics, and
it is refused instead of being measured.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..comparison.text import degrees, millimetres, vector
from ..errors import BadInputError, UnknownNameError
from ..installed import WITNESS
from ..interface import Array, JointType, Model, forward, make_data
from ..interface.checks import as_count
from ..kinematics import Kind, Kinematics, Pose
from ..page import Page, Table, Text, Verdict
from ..rotations import angle_between, matrix_from_quat
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import carried_by
from ..scenarios.runs import Progress, silent
from ._words import differences, page_of, where

_MOST = 1_000_000
_TOLERANCE = 1e-12  # metres, and entries of the rotation matrix
_SAME_FRAME = 1e-9  # metres and radians; files write frames with fewer digits than poses


@dataclass(frozen=True)
class Offset:
    """From the engine's frame to the witness's: a distance [m] and an angle [rad]."""

    distance: float
    angle: float

    @property
    def same(self) -> bool:
        """Whether the two are one frame."""
        return self.distance <= _SAME_FRAME and self.angle <= _SAME_FRAME


@dataclass(frozen=True)
class Certificate:
    """What came out.

    Attributes:
        site: The frame on the engine; witness_frame: its name for the witness.
        body: The body that carries it, on the engine.
        poses: How many were compared.
        frames: Offset between the two frame definitions; None where the files name
            no common body and the offset between the poses is not steady.
        position_worst, position_median: Difference in position [m]; None if refused.
        rotation_worst, rotation_median: Largest entry of the difference of the
            rotation matrices; None if refused.
        default_pose: Fingertip (3,) at the model's default qpos on the engine [m].
        tolerance: What both worst differences must not exceed.
    """

    site: str
    witness_frame: str
    body: str
    witness_file: str
    poses: int
    frames: Offset | None
    position_worst: float | None
    position_median: float | None
    rotation_worst: float | None
    rotation_median: float | None
    default_pose: tuple[float, float, float]
    tolerance: float
    provenance: Provenance

    @property
    def agrees(self) -> bool:
        """Whether frames are the same and every pose is within the tolerance."""
        return (
            self.position_worst is not None
            and self.rotation_worst is not None
            and self.position_worst <= self.tolerance
            and self.rotation_worst <= self.tolerance
        )


def certify(
    model: Model,
    poses: int = 200,
    seed: int = 0,
    site: str = "gripperframe",
    witness: str | os.PathLike[str] | None = None,
    witness_frame: str | None = None,
    progress: Progress = silent,
) -> Certificate:
    """Compare a site's pose on an engine with Pinocchio's, at random poses within the limits.

    Args:
        model: On the engine to be certified.
        poses: How many, at least 2: the default pose, then random ones.
        seed: Of the random poses.
        site: The frame on the engine.
        witness: The file that Pinocchio reads; by default the engine's own.
        witness_frame: The frame's name there; by default `site`.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
        ModelError: Pinocchio cannot read the file.
        UnknownNameError: No such frame.
        BadInputError: `poses` or `seed` is no whole number in range, or the model
            has joints that the witness's file has not.
    """
    count = as_count(poses, "poses")
    if count > _MOST:
        raise BadInputError(f"poses must be at most {_MOST:,}; got {count:,}")
    if count < 2:
        raise BadInputError("poses must be at least 2: one cannot tell a frame from a joint")
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    tip = model.site_id(site)
    known = Kinematics(model.path if witness is None else witness)
    if not all(known.joint_names):
        raise BadInputError(f"{known.path.name} has joints without a name: they cannot be matched")
    # Joints that only the engine's scene has (a free box) stay where they are.
    shared = [name for name in model.joint_names if name in known.joint_names]
    if sorted(shared) != sorted(known.joint_names):
        lacking = sorted(set(known.joint_names) - set(shared))
        raise BadInputError(f"{model.path.name} lacks joints of the witness: {', '.join(lacking)}")
    body = int(model.site_bodyid[tip])
    for joint, other in enumerate(model.joint_names):
        if other not in shared and body in carried_by(model, [int(model.jnt_bodyid[joint])]):
            raise BadInputError(
                f"{known.path.name} lacks the joint {other!r}, which moves {site!r}"
            )
    kinematics = Kinematics(known.path, joint_names=shared)
    name, kind = _find_frame(kinematics, witness_frame or site)
    configurations = _random_qpos(model, shared, count, seed)
    ours = _engine_poses(model, configurations, tip, progress)
    theirs = kinematics.poses(configurations[:, _slots(model, shared)], name, kind)
    offset = _declared_offset(model, tip, kinematics, name, kind) or _steady_offset(ours, theirs)
    moved = rotated = None
    if offset is None or offset.same:
        moved = np.linalg.norm(ours.pos - theirs.pos, axis=1)
        rotated = np.abs(ours.mat - theirs.mat).max(axis=(1, 2))
    first = ours.pos[0]
    return Certificate(
        site=site,
        witness_frame=name,
        body=model.body_names[int(model.site_bodyid[tip])],
        witness_file="/".join(kinematics.path.parts[-2:]),
        poses=len(configurations),
        frames=offset,
        position_worst=None if moved is None else float(moved.max()),
        position_median=None if moved is None else float(np.median(moved)),
        rotation_worst=None if rotated is None else float(rotated.max()),
        rotation_median=None if rotated is None else float(np.median(rotated)),
        default_pose=(float(first[0]), float(first[1]), float(first[2])),
        tolerance=_TOLERANCE,
        provenance=provenance(model, seed, **{WITNESS: kinematics.version}),
    )


def _find_frame(kinematics: Kinematics, name: str) -> tuple[str, Kind]:
    """A site of an MJCF, or a link of a URDF."""
    try:
        kinematics.definition(name, "site")
    except UnknownNameError as no_site:
        try:
            kinematics.definition(name, "body")
        except UnknownNameError:
            raise no_site from None
        return name, "body"
    return name, "site"


def _random_qpos(model: Model, joints: list[str], count: int, seed: int) -> Array:
    """(count, nq): the default pose, then uniform within limits (±π without)."""
    random = np.random.default_rng(seed)
    with make_data(model) as data:
        start = data.qpos.copy()
    drawn = np.tile(start, (count, 1))
    count -= 1
    for name in joints:
        joint = model.joint_id(name)
        place, kind = int(model.jnt_qposadr[joint]), JointType(int(model.jnt_type[joint]))
        if kind in (JointType.HINGE, JointType.SLIDE):
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.pi, np.pi)
            drawn[1:, place] = random.uniform(low, high, count)
            continue
        if kind == JointType.FREE:
            drawn[1:, place : place + 3] = random.uniform(-1, 1, (count, 3))
            place += 3
        quat = random.normal(size=(count, 4))
        drawn[1:, place : place + 4] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    return drawn


def _slots(model: Model, joints: list[str]) -> list[int]:
    """Slots of qpos that belong to the named joints, in their order."""
    slots: list[int] = []
    for name in joints:
        joint = model.joint_id(name)
        start = int(model.jnt_qposadr[joint])
        slots += range(start, start + JointType(int(model.jnt_type[joint])).nq)
    return slots


def _engine_poses(model: Model, configurations: Array, tip: int, progress: Progress) -> Pose:
    pos = np.empty((len(configurations), 3))
    mat = np.empty((len(configurations), 3, 3))
    with make_data(model) as data:
        for k, qpos in enumerate(configurations):
            data.qpos = qpos
            forward(model, data)
            pos[k] = data.site_xpos[tip]
            mat[k] = data.site_xmat[tip].reshape(3, 3)
            if k % 100 == 0:
                progress(k / len(configurations))
    return Pose(pos, mat)


def _declared_offset(
    model: Model, tip: int, kinematics: Kinematics, name: str, kind: str
) -> Offset | None:
    """Offset between the two files' definitions, if both fix the frame to one body."""
    if kind != "site":
        return None
    theirs = kinematics.definition(name, "site")
    if theirs.body != model.body_names[int(model.site_bodyid[tip])]:
        return None
    distance = float(np.linalg.norm(theirs.pos - model.site_pos[tip]))
    angle = float(angle_between(matrix_from_quat(model.site_quat[tip]), theirs.mat))
    return Offset(distance, angle)


def _steady_offset(ours: Pose, theirs: Pose) -> Offset | None:
    """The offset that all poses share; None if it changes with the pose.

    Where the files call their bodies differently, definitions cannot be compared
    word by word. But a frame that is merely another one stays put in the engine's
    frame whatever the joints do, and a kinematic difference does not.
    """
    inverse = np.swapaxes(ours.mat, 1, 2)
    shift = np.einsum("nij,nj->ni", inverse, theirs.pos - ours.pos)
    turn = inverse @ theirs.mat
    spread = max(float(np.ptp(shift, axis=0).max()), float(np.ptp(turn, axis=0).max()))
    if spread > _SAME_FRAME:
        return None
    return Offset(float(np.linalg.norm(shift[0])), float(angle_between(np.eye(3), turn[0])))


def page(results: Mapping[str, Certificate]) -> Page:
    """Frames first, then the differences."""
    first = next(iter(results.values()))
    seed = first.provenance.seed
    pinocchio = first.provenance.versions[WITNESS]
    blocks: list[Any] = [
        Text(
            f"The engine computes where the fingertip ({first.site}) is, by forward; Pinocchio "
            f"{pinocchio} computes it from {first.witness_file}, with its own parser and its own "
            f"code. {first.poses} poses within the joint limits, the default one first, seed "
            f"{seed}."
        ),
        Table(
            ("", *results),
            [
                ("frames apart", *(_offset(r.frames) for r in results.values())),
                ("default pose [m]", *(vector(r.default_pose) for r in results.values())),
                ("position, worst [m]", *(_figure(r.position_worst) for r in results.values())),
                ("position, median [m]", *(_figure(r.position_median) for r in results.values())),
                ("rotation matrix, worst", *(_figure(r.rotation_worst) for r in results.values())),
                (
                    "rotation matrix, median",
                    *(_figure(r.rotation_median) for r in results.values()),
                ),
            ],
            title="Engine against witness",
        ),
    ]
    for name, result in results.items():
        blocks.append(Verdict(f"{where(results, name)}{_said(result)}", result.agrees))
    blocks += differences(
        results,
        [("default pose", lambda a, b: f"{math.dist(a.default_pose, b.default_pose):.1e} m")],
    )
    return page_of("The fingertip, and an independent witness", results, blocks)


def _offset(offset: Offset | None) -> str:
    if offset is None:
        return "no common body: not comparable"
    if offset.same:
        return "0 mm, 0°"
    return f"{millimetres(offset.distance)}, {degrees(offset.angle)}"


def _figure(value: float | None) -> str:
    return "refused" if value is None else f"{value:.1e}"


def _said(result: Certificate) -> str:
    if result.frames is not None and not result.frames.same:
        return (
            f"refused: {result.site!r} and the witness's {result.witness_frame!r} are different "
            f"frames, {_offset(result.frames)} apart, so comparing their poses says nothing "
            "about the engine"
        )
    verdict = "agrees with" if result.agrees else "DISAGREES with"
    return f"{verdict} the witness, within {result.tolerance:g} m and {result.tolerance:g}"
