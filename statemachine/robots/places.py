"""The witness of a model: where it places the ends of the robot, against the engine."""

from __future__ import annotations

import numpy as np

from ..errors import StateMachineError
from ..interface import Array, JointType, Model, forward, make_data
from ..kinematics import Kinematics
from .records import WitnessRow

_POSES = 20


def witness_row(model: Model, seed: int) -> WitnessRow:
    """Compare every leaf body that both know by name, at random poses."""
    try:
        known = Kinematics(model.path, joint_names=model.joint_names)
    except StateMachineError as error:
        return WitnessRow(refusal=" ".join(str(error).split()))
    leaves = sorted(set(range(1, model.nbody)) - set(model.body_parentid.tolist()))
    poses = _poses(model, seed)
    ours = np.empty((len(poses), model.nbody, 3))
    with make_data(model) as data:
        for k, qpos in enumerate(poses):
            data.qpos[:] = qpos
            forward(model, data)
            ours[k] = data.xpos
    worst, frames = 0.0, 0
    refusal = ""
    for body in leaves:
        try:
            theirs = known.poses(poses, model.body_names[body], "body").pos
        except StateMachineError as error:
            refusal = " ".join(str(error).split())
            continue
        frames += 1
        worst = max(worst, float(np.linalg.norm(ours[:, body] - theirs, axis=1).max()))
    if not frames:
        return WitnessRow(refusal=refusal or "the model has no bodies")
    return WitnessRow("own reading", "", frames, worst)


def _poses(model: Model, seed: int) -> Array:
    """(n, nq): the default pose, then random ones within the limits."""
    draw = np.random.default_rng(seed)
    with make_data(model) as data:
        poses = np.tile(data.qpos, (_POSES, 1))
    kinds = zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True)
    for joint, (number, start) in enumerate(kinds):
        kind = JointType(number)
        if kind in (JointType.HINGE, JointType.SLIDE):
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-1.0, 1.0)
            poses[1:, start] = draw.uniform(low, high, _POSES - 1)
            continue
        turn = start
        if kind is JointType.FREE:
            poses[1:, start : start + 3] = draw.uniform(-1, 1, (_POSES - 1, 3))
            turn = start + 3
        quats = draw.normal(size=(_POSES - 1, 4))
        poses[1:, turn : turn + 4] = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    return poses
