"""The certificate: places on an engine against Pinocchio's, over many poses.

Frame definitions come first. Two files may give one name to two frames, and then
every pose differs by the same offset; that is not a disagreement about kinematics, and
it is refused instead of being measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...backends.repair_record import Repair
from ...errors import BadInputError, ModelError, UnknownNameError
from ...installed import WITNESS
from ...interface import Array, Model
from ...interface.records import AS_WRITTEN
from ...kinematics import Kinematics
from ...models import AnyPath
from ...rotations import Placement, angle_between
from ...witness import labels
from ..runs.drive import Progress, no_progress
from ..runs.provenance import provenance
from ..runs.readings import Tip, tips_of
from .fingertip_poses import checked_poses, engine_poses, random_qpos, relative
from .fingertip_result import SAME_FRAME, FingertipResult, FrameOffset, TipGap
from .witness_parts import WitnessFrame, WitnessParts
from .witness_places import witness_parts

__all__ = [
    "FingertipResult",
    "FrameOffset",
    "Placement",
    "TipGap",
    "certify",
    "checked_poses",
    "random_qpos",
]


def certify(
    model: Model,
    poses: int = 200,
    seed: int = 0,
    site: str | None = None,
    witness: AnyPath | None = None,
    witness_frame: str | None = None,
    progress: Progress = no_progress,
) -> FingertipResult:
    """Compare poses on an engine with Pinocchio's, at random poses within the limits.

    Pinocchio reads the model's file itself where it can. Else it computes from the numbers
    of the engine's model, and the certificate says so and why.

    Args:
        model: On the engine to be certified.
        poses: How many, at least 2: the default pose, then random ones.
        seed: Of the random poses.
        site: The site or body on the engine; by default gripperframe where there is one,
            else every body that joints move and that carries no other.
        witness: The file that Pinocchio reads; by default the engine's own.
        witness_frame: The frame's name there; by default `site`, else what is in its place.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
        ModelError: Pinocchio cannot read `witness`.
        UnknownNameError: No such frame.
        BadInputError: `poses` or `seed` is not a whole number in range, only one of the two files
            has a joint that moves what is asked for, or nothing moves.
    """
    wanted = checked_poses(poses, seed)
    tips = tips_of(model, site)
    if witness_frame is not None and len(tips) > 1:
        raise BadInputError("--witness-frame names one frame: say which with --site")
    asked = _choose_witness(model, tips, witness, witness_frame)
    parts, known = asked.parts, asked.parts.kinematics
    joints = [pair.joint for pair in parts.joints]
    configurations = random_qpos(model, joints, wanted, seed)
    gaps = _gaps(asked, configurations, progress)
    gaps.sort(key=lambda gap: -gap.worst)
    left_out = tuple(tip.name for tip in tips if tip not in asked.tips)
    renamed_joints = tuple(parts.renamed_joints())
    versions, tolerance = {WITNESS: known.version}, model.capabilities.rounding
    result = FingertipResult(
        tips=tuple(gaps),
        left_out=left_out,
        relative_to=parts.relative_to,
        renamed_joints=renamed_joints,
        poses=wanted,
        tolerance=tolerance,
        witness_file=asked.file,
        grade=known.grade,
        reason=asked.reason,
        prepared=known.prepared,
        provenance=provenance(model, seed, **versions),
    )
    return replace(result, site_asked=site, repairs=_repairs(model))


def _repairs(model: Model) -> tuple[Repair, ...]:
    """Return what was changed of a model's file so that the engine reads it."""
    if model.compiled is None or model.read_options == AS_WRITTEN:
        return ()
    from ...backends.compiled.reading import compile_with  # it imports an engine

    _, repairs = compile_with(model.path, model.read_options)
    return tuple(repairs)


@dataclass(frozen=True)
class _Witness:
    """Witness, and what it is asked for.

    Attributes:
        parts: What of the engine's model is what of the witness's.
        tips: Sites and bodies of the engine that it is asked for.
        frames: What each of them is for the witness.
        reason: Why it has not read the file itself; "" if it has.
    """

    parts: WitnessParts
    tips: list[Tip]
    frames: list[WitnessFrame]
    reason: str = ""

    @property
    def file(self) -> str:
        """Return the file that it read, with its folder."""
        return "/".join(self.parts.kinematics.path.parts[-2:])


def _choose_witness(
    model: Model,
    tips: list[Tip],
    file: AnyPath | None,
    witness_frame: str | None,
) -> _Witness:
    """Choose the witness, and what it is asked for.

    Args:
        model: On the engine to be certified.
        tips: Its sites and bodies that are asked for.
        file: What the witness reads; None for the engine's own file.
        witness_frame: The frame's name there; None for what the tip is there.
    """
    if file is not None:
        parts = witness_parts(model, Kinematics(file))
        return _with_frames(parts, _common_tips(parts, tips), witness_frame)
    try:
        return _with_frames(witness_parts(model, Kinematics(model.path)), tips, witness_frame)
    except (ModelError, BadInputError, UnknownNameError) as error:
        if witness_frame is not None or model.compiled is None:
            raise
        reason = str(error)
    parts = witness_parts(model, Kinematics.same_reading(model))
    return replace(_with_frames(parts, tips, None), reason=reason)


def _common_tips(parts: WitnessParts, tips: list[Tip]) -> list[Tip]:
    """Return those of several tips that another file has, too; all of them if it has none."""
    if len(tips) == 1:
        return tips
    common = []
    for tip in tips:
        try:
            parts.frame(tip, None)
        except (BadInputError, UnknownNameError):
            continue
        common.append(tip)
    return common if common else tips


def _with_frames(parts: WitnessParts, tips: list[Tip], witness_frame: str | None) -> _Witness:
    """Return a witness with what each tip is for it.

    Raises:
        BadInputError: One file lacks a joint that moves a tip, or a tip has no name to find it by.
        UnknownNameError: The witness has no such frame.
    """
    frames = []
    for tip in tips:
        frame = parts.frame(tip, witness_frame)
        parts.check_moved(tip, frame)
        frames.append(frame)
    return _Witness(parts, tips, frames)


def _gaps(asked: _Witness, configurations: Array, progress: Progress) -> list[TipGap]:
    """Measure how far each tip is from where the witness puts it.

    Args:
        asked: The witness, and what it is asked for.
        configurations: (N, nq) Poses of the engine.
        progress: Told the fraction that is done.
    """
    parts = asked.parts
    bodies = labels("body", parts.model.body_names)
    qpos = parts.witness_qpos(configurations)
    read = list(asked.tips)
    if parts.relative_to is not None:
        number = bodies.index(parts.relative_to.body)
        read.append(Tip(parts.relative_to.body, "body", number, number, named=True))
    ours = engine_poses(parts.model, configurations, read, progress)
    gaps = []
    for k, (tip, frame) in enumerate(zip(asked.tips, asked.frames, strict=True)):
        places = Placement(ours.pos[:, k], ours.mat[:, k])
        default_pose = tuple(places.pos[0].tolist())
        theirs = parts.kinematics.poses(qpos, frame.name, frame.kind)
        if parts.relative_to is not None:
            places = relative(Placement(ours.pos[:, -1], ours.mat[:, -1]), places)
            base = parts.kinematics.poses(qpos, parts.relative_to.witness_body, "body")
            theirs = relative(base, theirs)
        gap = TipGap(
            site=tip.name,
            kind=tip.kind,
            witness_frame=frame.name,
            body=bodies[tip.body],
            frames=frame.offset,
            default_pose=default_pose,
            tolerance=parts.model.capabilities.rounding,
        )
        gaps.append(_with_differences(gap, places, theirs))
    return gaps


def _with_differences(gap: TipGap, ours: Placement, theirs: Placement) -> TipGap:
    """Return a gap with its differences, if both put the same frame somewhere.

    Args:
        gap: With the offset between the two definitions, if the files tell it.
        ours: Where the engine puts it: (N, 3) [m], (N, 3, 3).
        theirs: Where the witness puts it.
    """
    offset = gap.frames
    if offset is None:
        offset = _steady_offset(ours, theirs)
        gap = replace(gap, frames=offset)
    if offset is None or not offset.same:
        return gap
    moved = np.linalg.norm(ours.pos - theirs.pos, axis=1)
    rotated = np.abs(ours.mat - theirs.mat).max(axis=(1, 2))
    return replace(
        gap,
        position_worst=float(moved.max()),
        position_median=float(np.median(moved)),
        rotation_worst=float(rotated.max()),
        rotation_median=float(np.median(rotated)),
    )


def _steady_offset(ours: Placement, theirs: Placement) -> FrameOffset | None:
    """Return the offset that all poses share; None if it changes with the pose.

    Where the files call their bodies differently, definitions cannot be compared
    word by word. But a frame that is merely another one stays put in the engine's
    frame whatever the joints do, and a kinematic difference does not.
    """
    inverse = np.swapaxes(ours.mat, 1, 2)
    shift = np.einsum("nij,nj->ni", inverse, theirs.pos - ours.pos)
    turn = inverse @ theirs.mat
    spread = max(float(np.ptp(shift, axis=0).max()), float(np.ptp(turn, axis=0).max()))
    if spread > SAME_FRAME:
        return None
    distance = float(np.linalg.norm(shift[0]))
    return FrameOffset(distance, float(angle_between(np.eye(3), turn[0])))
