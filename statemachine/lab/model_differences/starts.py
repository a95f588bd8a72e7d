"""Where free bodies start, on the list of two files: a run begins there unless it is told."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...engines.description.reading import ModelReading
from ...engines.records import TURNED
from ...interface import Array, JointType, Model
from ...rotations import HERE, Placement, matrix_from_quat
from ..compare.matching import Matched
from .effects import Meaning
from .listing import CompiledCause, Listing
from .locating import Locator

_SAME_POSE_TOLERANCE = 1e-9  # [m] and [rad]: as a file with ten digits leaves it
_EFFECT = "a run starts there"


def enter_starts(
    listing: Listing,
    readings: Sequence[ModelReading],
    matched: Matched,
    locator: Locator,
    reach: float,
) -> None:
    """Enter free bodies that start elsewhere.

    Args:
        listing: Where it is entered.
        readings: Both sides; of a base that was made to float the file says nothing.
        matched: What of one is what of the other.
        locator: Where elements stand in the files.
        reach: How far the robot reaches [m], which a distance is set against.
    """
    if any(reading.floats for reading in readings):
        return
    aligns = {pair.left: pair.align for pair in matched.solids}
    world = aligns.get(0, HERE)
    for a, b in matched.joints:
        if matched.left.jnt_type[a] != JointType.FREE:
            continue
        body = int(matched.left.compiled.jnt_bodyid[a])
        align = aligns.get(body, HERE)
        wanted = world @ _start(matched.left, a) @ align.inverse
        theirs = _start(matched.right, b)
        element = locator.find("body", locator.name(0, "body", body))
        cause = CompiledCause("start")
        far, angle = wanted.distance(theirs), wanted.angle(theirs)
        if far > _SAME_POSE_TOLERANCE:
            places = _numbers(wanted.pos), _numbers(theirs.pos)
            meaning = Meaning(far / reach, _EFFECT, scale=reach)
            listing.enter("places", element, "place", places, meaning, "m", cause)
        if angle > _SAME_POSE_TOLERANCE:
            meaning = Meaning(angle / math.pi, _EFFECT, scale=math.pi)
            listing.enter("places", element, TURNED, (0.0, angle), meaning, "rad", cause)


def _start(model: Model, joint: int) -> Placement:
    """Return the pose in the world that a free joint starts in."""
    start = int(model.jnt_qposadr[joint])
    qpos = model.compiled.qpos0[start : start + 7]
    return Placement(qpos[:3].copy(), matrix_from_quat(qpos[3:]))


def _numbers(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())
