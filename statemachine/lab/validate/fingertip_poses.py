"""Poses at which places are compared, and where an engine and a witness put them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import BadInputError
from ...interface import Array, JointType, Model, make_data
from ...interface.checks import as_count
from ...rotations import Placement, matrix_from_quat
from ...show.drawing.scene import posed
from ..runs.drive import Progress
from ..runs.readings import Tip

_MAX_POSES = 1_000_000
_UNLIMITED_RANGE = 100.0  # a range beyond this [m or rad] is not a limit


def checked_poses(poses: int, seed: int) -> int:
    """Return the number of poses, once it and the seed of those that are drawn are checked.

    Raises:
        BadInputError: One of them is not a whole number in range.
    """
    wanted = as_count(poses, "poses")
    if not 2 <= wanted <= _MAX_POSES:
        raise BadInputError(
            f"poses must be from 2, as one cannot tell a frame from a joint, to {_MAX_POSES:,}; "
            f"got {wanted:,}"
        )
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    return wanted


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
    if model.jnt_limited[joint] and high - low <= _UNLIMITED_RANGE:
        return low, high
    return (-np.pi, np.pi) if kind == JointType.HINGE else (-1.0, 1.0)


def engine_poses(
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


def relative(reference: Placement, places: Placement) -> Placement:
    """Return places as they are seen from a body.

    Args:
        reference: Of the body: (N, 3) [m], (N, 3, 3).
        places: In the same axes: (N, 3) [m], (N, 3, 3).
    """
    inverse = np.swapaxes(reference.mat, 1, 2)
    pos = np.einsum("nij,nj->ni", inverse, places.pos - reference.pos)
    return Placement(pos, inverse @ places.mat)
