"""What the way of a floating base comes to: its mean speeds, and how far it went to one side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ...interface import Array
from ...rotations import matrix_from_quat

START: Final = 0.2  # of a run: until then it gets going, and no speed is measured


@dataclass(frozen=True)
class MeanSpeeds:
    """Mean speeds of a base in the axes of its heading: where its x axis points, level.

    Attributes:
        forward: [m/s].
        left: [m/s].
        turn: To the left [rad/s].
    """

    forward: float
    left: float
    turn: float


def headings(quats: Array) -> Array:
    """Return the headings (n,) [rad] of orientations (n, 4) wxyz, turns counted."""
    ahead = matrix_from_quat(quats)[:, :2, 0]
    return np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))


def mean_speeds(poses: Array, seconds: float) -> MeanSpeeds | None:
    """Return the mean speeds of a base after the start of a run; None of too short a run.

    Args:
        poses: (n, 7) of the base, at equal distances in time: position [m], quaternion wxyz.
        seconds: From the first to the last [s].
    """
    first = int(START * len(poses))
    measured = poses[first:]
    if len(measured) < 2:
        return None
    duration = seconds * (len(measured) - 1) / (len(poses) - 1)
    angles = headings(measured[:, 3:])
    middle = 0.5 * (angles[:-1] + angles[1:])
    steps = np.diff(measured[:, :2], axis=0)
    forward = np.cos(middle) * steps[:, 0] + np.sin(middle) * steps[:, 1]
    left = np.cos(middle) * steps[:, 1] - np.sin(middle) * steps[:, 0]
    return MeanSpeeds(
        forward=float(forward.sum() / duration),
        left=float(left.sum() / duration),
        turn=float((angles[-1] - angles[0]) / duration),
    )


def lateral_way(poses: Array) -> float:
    """Return how far to the left of the straight line ahead a base ended [m].

    Args:
        poses: (n, 7) of the base: position [m], quaternion wxyz.
    """
    way = poses[-1, :2] - poses[0, :2]
    ahead = headings(poses[:1, 3:])[0]
    return float(np.cos(ahead) * way[1] - np.sin(ahead) * way[0])
