"""The certificate: places on an engine against Pinocchio's, over many poses.

Frame definitions come first. Two files may give one name to two frames, and then
every pose differs by the same offset; that is not a disagreement about kinematics, and
it is refused instead of being measured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...errors import BadInputError, ModelError, UnknownNameError
from ...installed import WITNESS
from ...interface import Array, JointType, Model, make_data
from ...interface.checks import as_count
from ...kinematics import Kind, Kinematics, shared_joints
from ...measures import largest_or_inf
from ...models import AnyPath
from ...rotations import Placement, angle_between, matrix_from_quat
from ...show.blocks import only_on_pages
from ...show.drawing.scene import posed
from ...witness import OWN_READING, labels
from ..runs.drive import Progress, silent
from ..runs.provenance import Provenance, provenance
from ..runs.readings import Tip, tips_of
from ..runs.robot import carried_by

_MOST = 1_000_000
_WIDE = 100.0  # a range beyond this [m or rad] is not a limit
_TOLERANCE = 1e-12  # metres, and entries of the rotation matrix
_SAME_FRAME = 1e-9  # metres and radians; files write frames with fewer digits than poses

CertificateVerdict = Literal["different frames", "disagrees", "agrees", "same place"]


@dataclass(frozen=True)
class FrameOffset:
    """Offset from the engine's frame of a name to the witness's.

    Attributes:
        distance: Between the two origins [m].
        angle: Between the two orientations [rad].
    """

    distance: float
    angle: float

    @property
    def same(self) -> bool:
        """Tell whether the two are one frame."""
        return self.distance <= _SAME_FRAME and self.angle <= _SAME_FRAME


@dataclass(frozen=True)
class TipGap:
    """Gap between where an engine puts a site or body, and where the witness puts it.

    The differences are None where the two frames are not the same: they would say nothing about
    the engine then.

    Attributes:
        site: The site or body on the engine.
        witness_frame: Its name for the witness.
        body: The body that it is, or that carries it, on the engine.
        frames: Offset between the two frame definitions; None where the files name no common
            body and the offset between the poses is not steady.
        default_pose: (3,) Where it is at the model's default qpos on the engine [m].
        position_worst: Largest difference in position over all poses [m].
        position_median: Median difference in position [m].
        rotation_worst: Largest entry of the difference of the rotation matrices, over all poses.
        rotation_median: Median over the poses of the largest entry.
    """

    site: str
    witness_frame: str
    body: str
    frames: FrameOffset | None
    default_pose: tuple[float, ...]
    position_worst: float | None = None
    position_median: float | None = None
    rotation_worst: float | None = None
    rotation_median: float | None = None

    @property
    def worst(self) -> float:
        """Return the larger worst difference; infinite without one, or if it is no number."""
        if self.position_worst is None or self.rotation_worst is None:
            return math.inf
        return largest_or_inf(np.array([self.position_worst, self.rotation_worst]))

    @property
    def agrees(self) -> bool:
        """Tell whether both worst differences are within the tolerance."""
        return self.worst <= _TOLERANCE


@dataclass(frozen=True)
class FingertipResult:
    """Certificate of an engine: its poses of sites or bodies against those of a witness.

    Attributes:
        tips: The gap of each site or body that was compared, the worst first.
        left_out: Sites or bodies that the witness's file does not have.
        poses: Number of poses that were compared.
        tolerance: What the worst differences must not exceed [m, and entries of a matrix].
        witness_file: The file that the witness read, with its folder.
        grade: `OWN_READING` if Pinocchio's parser read the file, `SAME_READING` if it computed
            from the numbers of the engine's model.
        reason: Why it is not an own reading; "" if it is.
        prepared: What was done to the file's text before Pinocchio read it.
        provenance: What it was computed with, the seed of the poses included.
    """

    tips: tuple[TipGap, ...]
    left_out: tuple[str, ...]
    poses: int
    tolerance: float
    witness_file: str
    grade: str
    reason: str
    prepared: tuple[str, ...]
    provenance: Provenance

    @property
    @only_on_pages
    def worst_tip(self) -> TipGap:
        """Return the worst gap, which JSON shows beside the list of all."""
        return self.tips[0]

    @property
    def site(self) -> str:
        """Return the site or body of the worst gap."""
        return self.worst_tip.site

    @property
    def witness_frame(self) -> str:
        """Return the witness's name for it."""
        return self.worst_tip.witness_frame

    @property
    def body(self) -> str:
        """Return the body that it is, or that carries it."""
        return self.worst_tip.body

    @property
    def frames(self) -> FrameOffset | None:
        """Return the offset between its two frame definitions."""
        return self.worst_tip.frames

    @property
    def default_pose(self) -> tuple[float, ...]:
        """Return where it is (3,) at the model's default qpos on the engine [m]."""
        return self.worst_tip.default_pose

    @property
    def position_worst(self) -> float | None:
        """Return its largest difference in position [m]."""
        return self.worst_tip.position_worst

    @property
    def position_median(self) -> float | None:
        """Return its median difference in position [m]."""
        return self.worst_tip.position_median

    @property
    def rotation_worst(self) -> float | None:
        """Return the largest entry of its difference of the rotation matrices."""
        return self.worst_tip.rotation_worst

    @property
    def rotation_median(self) -> float | None:
        """Return the median over the poses of the largest entry."""
        return self.worst_tip.rotation_median

    @property
    def agrees(self) -> bool:
        """Tell whether all gaps are within the tolerance."""
        return all(gap.agrees for gap in self.tips)

    @property
    @only_on_pages
    def has_one_tip(self) -> bool:
        """Tell whether one site or body was compared, and not several."""
        return len(self.tips) == 1

    @property
    @only_on_pages
    def is_own_reading(self) -> bool:
        """Tell whether the witness read the file with its own parser."""
        return self.grade == OWN_READING

    @property
    @only_on_pages
    def verdict(self) -> CertificateVerdict:
        """Return what the certificate says.

        Returns:
            "different frames": The files give one name to two frames; nothing was compared.
            "disagrees": A difference exceeds the tolerance.
            "agrees": None does, and the witness read the file itself.
            "same place": None does, from the same numbers; the reading was not checked.
        """
        if self.frames is not None and not self.frames.same:
            return "different frames"
        if not self.agrees:
            return "disagrees"
        return "agrees" if self.is_own_reading else "same place"


def checked_poses(poses: int, seed: int) -> int:
    """Return the number of poses, once it and the seed of those that are drawn are checked.

    Raises:
        BadInputError: One of them is not a whole number in range.
    """
    wanted = as_count(poses, "poses")
    if not 2 <= wanted <= _MOST:
        raise BadInputError(
            f"poses must be from 2, as one cannot tell a frame from a joint, to {_MOST:,}; "
            f"got {wanted:,}"
        )
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    return wanted


def certify(
    model: Model,
    poses: int = 200,
    seed: int = 0,
    site: str | None = None,
    witness: AnyPath | None = None,
    witness_frame: str | None = None,
    progress: Progress = silent,
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
        witness_frame: The frame's name there; by default `site`.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
        ModelError: Pinocchio cannot read `witness`.
        UnknownNameError: No such frame.
        BadInputError: `poses` or `seed` is not a whole number in range, `witness` has joints
            that the model has not, or nothing moves.
    """
    wanted = checked_poses(poses, seed)
    tips = tips_of(model, site)
    if witness_frame is not None and len(tips) > 1:
        raise BadInputError("--witness-frame names one frame: say which with --site")
    asked = _ask(model, tips, witness, witness_frame)
    known = asked.kinematics
    joints = shared_joints(known, model.joint_names)
    configurations = random_qpos(model, joints, wanted, seed)
    ours = _engine_poses(model, configurations, asked.tips, progress)
    theirs = configurations[:, slots(model, joints)]
    gaps = []
    for k, tip in enumerate(asked.tips):
        places = Placement(ours.pos[:, k], ours.mat[:, k])
        name = witness_frame or tip.name
        gaps.append(_gap(model, tip, known, name, places, theirs))
    gaps.sort(key=lambda gap: -gap.worst)
    left_out = tuple(tip.name for tip in tips if tip not in asked.tips)
    return FingertipResult(
        tips=tuple(gaps),
        left_out=left_out,
        poses=len(configurations),
        tolerance=_TOLERANCE,
        witness_file=asked.file,
        grade=known.grade,
        reason=asked.reason,
        prepared=known.prepared,
        provenance=provenance(model, seed, **{WITNESS: known.version}),
    )


@dataclass(frozen=True)
class _Witness:
    """Witness, and what it is asked for.

    Attributes:
        kinematics: What it computes places with, its joints in the model's order.
        tips: Sites and bodies that it is asked for.
        reason: Why it has not read the file itself; "" if it has.
    """

    kinematics: Kinematics
    tips: list[Tip]
    reason: str = ""

    @property
    def file(self) -> str:
        """Return the file that it read, with its folder."""
        return "/".join(self.kinematics.path.parts[-2:])


def _ask(
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
        witness_frame: The frame's name there; None for that of the tip.
    """
    if file is not None:
        known = Kinematics(file)
        if len(tips) > 1:
            tips = _common(tips, known)
        return _Witness(_matched(model, tips, known, witness_frame), tips)
    try:
        return _Witness(_matched(model, tips, Kinematics(model.path), witness_frame), tips)
    except (ModelError, BadInputError, UnknownNameError) as error:
        if witness_frame is not None or model.compiled is None:
            raise
        reason = str(error)
    known = _matched(model, tips, Kinematics.same_reading(model), None)
    return _Witness(known, tips, reason)


def _common(tips: list[Tip], known: Kinematics) -> list[Tip]:
    """Return the tips that another file has, too; all of them if it has none."""
    bodies = set(known.body_names)
    common = [tip for tip in tips if tip.named and tip.name in bodies]
    return common if common else tips


def _matched(
    model: Model, tips: list[Tip], known: Kinematics, witness_frame: str | None
) -> Kinematics:
    """Return a witness with its joints in the model's order.

    Raises:
        BadInputError: It lacks a joint that moves a tip, or a tip has no name to find it by.
        UnknownNameError: It has no such frame.
    """
    joints = shared_joints(known, model.joint_names)
    bodies_agree = known.body_names == tuple(labels("body", model.body_names))
    for tip in tips:
        missing = _missing_joint(model, tip, joints)
        if missing is not None:
            raise BadInputError(
                f"{known.path.name} lacks the joint {missing!r}, which moves {tip.name!r}"
            )
        if not (tip.named or bodies_agree or witness_frame):
            raise BadInputError(f"{tip.name} has no name to find it by in {known.path.name}")
        _frame(known, witness_frame or tip.name, tip.kind)
    names = [model.joint_names[joint] for joint in joints]
    if tuple(names) == known.joint_names:
        return known
    return Kinematics(known.path, joint_names=names)


def _missing_joint(model: Model, tip: Tip, joints: Sequence[int]) -> str | None:
    """Return the name of a joint that moves a tip and is not among `joints`; None without one."""
    for joint, name in enumerate(model.joint_names):
        carrier = int(model.jnt_bodyid[joint])
        if joint not in joints and tip.body in carried_by(model, [carrier]):
            return name
    return None


def _frame(kinematics: Kinematics, name: str, kind: Kind) -> Kind:
    """Return what a name is to the witness: a site of an MJCF, or a body; of a URDF, a link."""
    is_site = kind == "site" and name in kinematics.site_names
    if name in kinematics.body_names and not is_site:
        return "body"
    kinematics.definition(name, "site")  # raises if there is none
    return "site"


def _gap(
    model: Model,
    tip: Tip,
    kinematics: Kinematics,
    name: str,
    ours: Placement,
    qpos: Array,
) -> TipGap:
    """Measure how far one site or body is from where the witness puts it.

    Args:
        model: On the engine.
        tip: The site or body.
        kinematics: Of the witness.
        name: Of the frame there.
        ours: Where the engine puts it: (N, 3) [m], (N, 3, 3).
        qpos: (N, nq) The same poses for the witness.
    """
    kind = _frame(kinematics, name, tip.kind)
    theirs = kinematics.poses(qpos, name, kind)
    offset = _declared_offset(model, tip, kinematics, name, kind) or _steady_offset(ours, theirs)
    gap = TipGap(
        site=tip.name,
        witness_frame=name,
        body=labels("body", model.body_names)[tip.body],
        frames=offset,
        default_pose=tuple(ours.pos[0].tolist()),
    )
    if offset is not None and not offset.same:
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


def _engine_poses(
    model: Model, configurations: Array, tips: Sequence[Tip], progress: Progress
) -> Placement:
    """Compute places by the engine's forward.

    Args:
        model: On the engine.
        configurations: (N, nq) Poses.
        tips: Sites and bodies to be placed.
        progress: Told the fraction that is done.

    Returns:
        Positions (N, tips, 3) [m] and rotation matrices (N, tips, 3, 3).
    """
    sites = [k for k, tip in enumerate(tips) if tip.kind == "site"]
    bodies = [k for k, tip in enumerate(tips) if tip.kind == "body"]
    site_ids = [tips[k].number for k in sites]
    body_ids = [tips[k].number for k in bodies]
    pos = np.empty((len(configurations), len(tips), 3))
    mat = np.empty((len(configurations), len(tips), 3, 3))
    if "contacts" in model.capabilities.options:
        model = model.replace(contacts=False)  # places do not depend on them, and they cost
    for k, data in enumerate(posed(model, configurations)):
        pos[k, sites] = data.site_xpos[site_ids]
        mat[k, sites] = data.site_xmat[site_ids].reshape(-1, 3, 3)
        pos[k, bodies] = data.xpos[body_ids]
        mat[k, bodies] = matrix_from_quat(data.xquat[body_ids])
        if k % 100 == 0:
            progress(k / len(configurations))
    return Placement(pos, mat)


def _declared_offset(
    model: Model, tip: Tip, kinematics: Kinematics, name: str, kind: str
) -> FrameOffset | None:
    """Return the offset between the two files' definitions, if both fix the frame to one body."""
    if kind != "site" or tip.kind != "site":
        return None
    theirs = kinematics.definition(name, "site")
    if theirs.body != model.body_names[tip.body]:
        return None
    distance = float(np.linalg.norm(theirs.pos - model.site_pos[tip.number]))
    angle = float(angle_between(matrix_from_quat(model.site_quat[tip.number]), theirs.mat))
    return FrameOffset(distance, angle)


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
    if spread > _SAME_FRAME:
        return None
    distance = float(np.linalg.norm(shift[0]))
    return FrameOffset(distance, float(angle_between(np.eye(3), turn[0])))


def random_qpos(model: Model, joints: Sequence[int], count: int, seed: int) -> Array:
    """Draw poses (count, nq): the default one, then random ones.

    A hinge or a slide is drawn uniformly within its limits; without, within ±π rad or ±1 m.

    Args:
        model: The robot.
        joints: Ids of those that move; the others stay where they are.
        count: How many.
        seed: Of the random poses.
    """
    random = np.random.default_rng(seed)
    with make_data(model) as data:
        drawn = np.tile(data.qpos, (count, 1))
    for joint in joints:
        place, kind = int(model.jnt_qposadr[joint]), JointType(int(model.jnt_type[joint]))
        entries = drawn[1:, place : place + kind.nq]
        if kind in (JointType.HINGE, JointType.SLIDE):
            low, high = _drawn_range(model, joint, kind)
            entries[:] = random.uniform(low, high, entries.shape)
            continue
        if kind == JointType.FREE:
            entries[:, :3] = random.uniform(-1, 1, (count - 1, 3))
        quat = random.normal(size=(count - 1, 4))
        entries[:, -4:] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    return drawn


def _drawn_range(model: Model, joint: int, kind: JointType) -> tuple[float, float]:
    """Return the range in which a hinge [rad] or a slide [m] is drawn."""
    low, high = model.jnt_range[joint]
    if model.jnt_limited[joint] and high - low <= _WIDE:
        return low, high
    return (-np.pi, np.pi) if kind == JointType.HINGE else (-1.0, 1.0)


def slots(model: Model, joints: Sequence[int]) -> list[int]:
    """Return the slots of qpos that belong to these joints, in their order."""
    entries = []
    for joint in joints:
        start = int(model.jnt_qposadr[joint])
        entries += range(start, start + JointType(int(model.jnt_type[joint])).nq)
    return entries
