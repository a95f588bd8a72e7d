"""Where the camera stands: one that looks at everything that moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..interface import Array

FOVY = 30.0  # [°] a long lens: near and far parts of an arm are drawn alike in size
_MARGIN = 0.90  # of half the picture that what is framed may take


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a point; MuJoCo's angles.

    Attributes:
        target: (3,) what it looks at [m].
        distance: From there to the camera [m].
        azimuth: Direction of view about z [°]: 0 looks along +x, 90 along +y.
        elevation: Of the direction of view [°]: -90 looks straight down.
        fovy: Angle of view, from top to bottom [°].
    """

    target: tuple[float, float, float]
    distance: float
    azimuth: float
    elevation: float
    fovy: float = FOVY

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Unit vectors (3,): right, up and forward in the picture."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        right = np.array([math.sin(a), -math.cos(a), 0.0])
        forward = np.array([math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)])
        return right, np.cross(right, forward), forward

    @property
    def eye(self) -> Array:
        """(3,) where it stands [m]."""
        return np.asarray(self.target) - self.distance * self.axes[2]

    @property
    def near(self) -> float:
        """Nearest that is drawn [m]."""
        return 0.05 * self.distance

    @property
    def far(self) -> float:
        """Farthest that is drawn [m]."""
        return 20.0 * self.distance

    def seen(self, points: ArrayLike, aspect: float) -> Array:
        """Where points (n, 3) are in the picture: (n, 2), -1 to 1 from edge to edge."""
        right, up, forward = self.axes
        offset = np.asarray(points) - self.eye
        depth = np.maximum(offset @ forward, 1e-3)  # what is behind it is far outside
        half = math.tan(math.radians(self.fovy) / 2)
        return (
            np.stack([offset @ right / (half * aspect), offset @ up / half], axis=1)
            / depth[:, None]
        )


def framed(points: ArrayLike, aspect: float, azimuth: float, elevation: float) -> Camera:
    """The nearest camera in a direction that has all points in its picture.

    A point at p from the target is seen within the picture if |p·right| ≤ tan(half the
    angle of view)·(distance + p·forward), and so for up: of these distances the largest.

    Args:
        points: (n, 3) [m].
        aspect: Width of the picture by its height.
        azimuth: As in `Camera`; so elevation.
        elevation: See azimuth.
    """
    cloud = np.asarray(points, dtype=float).reshape(-1, 3)
    right, up, forward = Camera((0, 0, 0), 1, azimuth, elevation).axes
    tangent = math.tan(math.radians(FOVY) / 2) * _MARGIN
    target = (cloud.min(axis=0) + cloud.max(axis=0)) / 2
    distance = 0.0
    for k in range(9):
        offset = cloud - target
        x, y, depth = offset @ right, offset @ up, offset @ forward
        needed = np.maximum(np.abs(x) / (tangent * aspect), np.abs(y) / tangent)
        distance = max(float((needed - depth).max()), 1e-3)
        if k < 8:  # the middle of a box is not the middle of its picture: centre that
            for axis, along in ((right, x / (distance + depth)), (up, y / (distance + depth))):
                target = target + distance * ((along.min() + along.max()) / 2 * axis)
    x, y, z = target.tolist()
    return Camera((x, y, z), distance, azimuth, elevation)
