"""The certificate: places on an engine against Pinocchio's, over many poses.

Frame definitions come first. Two files may give one name to two frames, and then
every pose differs by the same offset; that is not a disagreement about kinematics, and
it is refused instead of being measured.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..drawing.scene import posed
from ..errors import BadInputError, ModelError, UnknownNameError, refuse
from ..installed import WITNESS
from ..interface import Array, JointType, Model, make_data
from ..interface.options import as_count
from ..kinematics import Kind, Kinematics, shared_joints
from ..measures import largest_or_inf
from ..models import AnyPath
from ..page import Figures
from ..rotations import Placement, angle_between, matrix_from_quat
from ..runs.drive import Progress, silent
from ..runs.header import provenance
from ..runs.robot import carried_by
from ..witness import labels
from ._readings import Tip, tips_of

_MOST = 1_000_000
_WIDE = 100.0  # a range beyond this [m or rad] is not a limit
_TOLERANCE = 1e-12  # metres, and entries of the rotation matrix
_SAME_FRAME = 1e-9  # metres and radians; files write frames with fewer digits than poses


def _offset(distance: float, angle: float) -> Figures:
    """From the engine's frame to the witness's [m, rad], and whether the two are one frame."""
    return Figures(
        distance=distance, angle=angle, same=distance <= _SAME_FRAME and angle <= _SAME_FRAME
    )


def certify(
    model: Model,
    poses: int = 200,
    seed: int = 0,
    site: str | None = None,
    witness: AnyPath | None = None,
    witness_frame: str | None = None,
    progress: Progress = silent,
) -> Figures:
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

    Returns:
        What `_gap` gives of the worst tip, and:
        poses: How many were compared.
        tolerance: What both worst differences must not exceed.
        agrees: Whether those of all tips do not.
        grade: "own reading" if Pinocchio's parser read the file, "same reading" if it
            computed from the numbers of the engine's model.
        reason: Why it is not an own reading; "" if it is.
        prepared: What was done to the file's text before Pinocchio read it.
        tips: All that were compared, the worst first.
        left_out: Tips that the witness's file does not have.

    Raises:
        MissingEngineError: Pinocchio is not installed here.
        ModelError: Pinocchio cannot read `witness`.
        UnknownNameError: No such frame.
        BadInputError: `poses` or `seed` is not a whole number in range, `witness` has joints
            that the model has not, or nothing moves.
    """
    wanted = as_count(poses, "poses")
    refuse(
        (
            not 2 <= wanted <= _MOST,
            f"poses must be from 2, as one cannot tell a frame from a joint, to {_MOST:,}; "
            f"got {wanted:,}",
        ),
        (seed < 0, f"seed must not be negative; got {seed}"),
    )
    tips = tips_of(model, site)
    refuse(
        (
            witness_frame is not None and len(tips) > 1,
            "--witness-frame names one frame: say which with --site",
        )
    )
    known, asked, reason = _asked(model, tips, witness, witness_frame)
    joints = shared_joints(known, model.joint_names)
    configurations = random_qpos(model, joints, wanted, seed)
    ours = _engine_poses(model, configurations, asked, progress)
    theirs = configurations[:, slots(model, joints)]
    gaps = [
        _gap(
            model,
            tip,
            known,
            witness_frame or tip.name,
            Placement(ours.pos[:, k], ours.mat[:, k]),
            theirs,
        )
        for k, tip in enumerate(asked)
    ]
    gaps.sort(key=lambda gap: -gap.worst)
    return Figures(
        **{name: figure for name, figure in vars(gaps[0]).items() if name != "worst"}
        | {"agrees": all(gap.agrees for gap in gaps)},
        witness_file="/".join(known.path.parts[-2:]),
        poses=len(configurations),
        tolerance=_TOLERANCE,
        provenance=provenance(model, seed, **{WITNESS: known.version}),
        grade=known.grade,
        reason=reason,
        prepared=known.prepared,
        tips=tuple(gaps),
        left_out=tuple(tip.name for tip in tips if tip not in asked),
    )


def _asked(
    model: Model,
    tips: list[Tip],
    witness: AnyPath | None,
    witness_frame: str | None,
) -> tuple[Kinematics, list[Tip], str]:
    """The witness to ask, what it is asked for, and why it has not read the file itself."""
    if witness is not None:
        known = Kinematics(witness)
        if len(tips) > 1:  # another file need not have all of them
            known_bodies = set(known.body_names)
            tips = [tip for tip in tips if tip.name in known_bodies and tip.named] or tips
        return _matched(model, tips, known, witness_frame), tips, ""
    try:
        return _matched(model, tips, Kinematics(model.path), witness_frame), tips, ""
    except (ModelError, BadInputError, UnknownNameError) as error:
        if witness_frame is not None or model.compiled is None:
            raise
        reason = str(error)
    return _matched(model, tips, Kinematics.same_reading(model), None), tips, reason


def _matched(
    model: Model, tips: list[Tip], known: Kinematics, witness_frame: str | None
) -> Kinematics:
    """A witness with its joints in the model's order; raises if it lacks what a tip needs."""
    joints = shared_joints(known, model.joint_names)
    bodies_agree = known.body_names == tuple(labels("body", model.body_names))
    for tip in tips:
        for joint, name in enumerate(model.joint_names):
            carrier = int(model.jnt_bodyid[joint])
            if joint not in joints and tip.body in carried_by(model, [carrier]):
                raise BadInputError(
                    f"{known.path.name} lacks the joint {name!r}, which moves {tip.name!r}"
                )
        if not (tip.named or bodies_agree or witness_frame):
            raise BadInputError(f"{tip.name} has no name to find it by in {known.path.name}")
        _frame(known, witness_frame or tip.name, tip.kind)
    names = [model.joint_names[joint] for joint in joints]
    return known if tuple(names) == known.joint_names else Kinematics(known.path, joint_names=names)


def _frame(kinematics: Kinematics, name: str, kind: Kind) -> Kind:
    """What a name is to the witness: a site of an MJCF, or a body; of a URDF, a link."""
    if name in kinematics.body_names and not (kind == "site" and name in kinematics.site_names):
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
) -> Figures:
    """How far one site or body is from where the witness puts it.

    Returns:
        site: The site or body on the engine; witness_frame: its name for the witness.
        body: The body that it is, or that carries it, on the engine.
        frames: Offset between the two frame definitions; None where the files name
            no common body and the offset between the poses is not steady.
        position_worst, position_median: Difference in position [m]; None if refused.
        rotation_worst, rotation_median: Largest entry of the difference of the
            rotation matrices; None if refused.
        worst: The larger of the two worst differences; infinite if refused or no number.
        agrees: Whether that is within the tolerance.
        default_pose: Where it is (3,) at the model's default qpos on the engine [m].
    """
    kind = _frame(kinematics, name, tip.kind)
    theirs = kinematics.poses(qpos, name, kind)
    offset = _declared_offset(model, tip, kinematics, name, kind) or _steady_offset(ours, theirs)
    moved = np.linalg.norm(ours.pos - theirs.pos, axis=1)
    rotated = np.abs(ours.mat - theirs.mat).max(axis=(1, 2))
    compared = offset is None or offset.same
    worst = largest_or_inf(np.array([moved.max(), rotated.max()])) if compared else math.inf
    return Figures(
        site=tip.name,
        witness_frame=name,
        body=labels("body", model.body_names)[tip.body],
        frames=offset,
        position_worst=float(moved.max()) if compared else None,
        position_median=float(np.median(moved)) if compared else None,
        rotation_worst=float(rotated.max()) if compared else None,
        rotation_median=float(np.median(rotated)) if compared else None,
        worst=worst,
        agrees=worst <= _TOLERANCE,
        default_pose=tuple(ours.pos[0].tolist()),
    )


def _engine_poses(
    model: Model, configurations: Array, tips: Sequence[Tip], progress: Progress
) -> Placement:
    """Positions (N, tips, 3) and rotation matrices (N, tips, 3, 3), by the engine's forward."""
    sites = [k for k, tip in enumerate(tips) if tip.kind == "site"]
    bodies = [k for k, tip in enumerate(tips) if tip.kind == "body"]
    site_ids, body_ids = ([tips[k].number for k in chosen] for chosen in (sites, bodies))
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
) -> Figures | None:
    """Offset between the two files' definitions, if both fix the frame to one body."""
    if kind != "site" or tip.kind != "site":
        return None
    theirs = kinematics.definition(name, "site")
    if theirs.body != model.body_names[tip.body]:
        return None
    distance = float(np.linalg.norm(theirs.pos - model.site_pos[tip.number]))
    angle = float(angle_between(matrix_from_quat(model.site_quat[tip.number]), theirs.mat))
    return _offset(distance, angle)


def _steady_offset(ours: Placement, theirs: Placement) -> Figures | None:
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
    return _offset(float(np.linalg.norm(shift[0])), float(angle_between(np.eye(3), turn[0])))


def random_qpos(model: Model, joints: Sequence[int], count: int, seed: int) -> Array:
    """(count, nq): the default pose, then uniform within limits; without, ±π rad and ±1 m.

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
            low, high = model.jnt_range[joint]
            if not model.jnt_limited[joint] or high - low > _WIDE:
                high = np.pi if kind == JointType.HINGE else 1.0
                low = -high
            entries[:] = random.uniform(low, high, entries.shape)
            continue
        if kind == JointType.FREE:
            entries[:, :3] = random.uniform(-1, 1, (count - 1, 3))
        quat = random.normal(size=(count - 1, 4))
        entries[:, -4:] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    return drawn


def slots(model: Model, joints: Sequence[int]) -> list[int]:
    """Slots of qpos that belong to these joints, in their order."""
    starts, kinds = model.jnt_qposadr.tolist(), model.jnt_type.tolist()
    return [starts[j] + k for j in joints for k in range(JointType(kinds[j]).nq)]
