"""A base that does not stand level: gravity pulls from elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...interface import Array
from .linear_refit import LinearRefit, RefitEnd

_STEP = 0.01  # of finite differences [rad]
_PRIOR = math.radians(3.0)  # standard deviation of a desk, a clamp


@dataclass(frozen=True, eq=False)
class Tilt:
    """A tilt, and where a fit ends with it.

    Attributes:
        angles: (2,) about the x and the y axis of the base, together one rotation vector [rad].
        end: Of the refit.
    """

    angles: Array
    end: RefitEnd


def tilted_gravity(gravity: Array, tilt: Array) -> Array:
    """Return gravity (3,) in the axes of a base that is tilted.

    Args:
        gravity: (3,) of a base that stands as the model's [m/s²].
        tilt: (2,) as of `Tilt.angles` [rad].
    """
    angle = float(np.linalg.norm(tilt))
    if angle == 0.0:
        return gravity.copy()
    axis = np.array([*tilt, 0.0]) / angle
    across, along = np.cross(gravity, axis), axis * (axis @ gravity)
    return along + math.cos(angle) * (gravity - along) + math.sin(angle) * across


def likeliest_tilt(refit: LinearRefit) -> Tilt:
    """Return the tilt that fits best, to first order."""
    simulation = refit.fit.objective.simulation
    level = np.array(simulation.parameters.model.gravity)
    slopes: list[Array] = []
    for tilt in _STEP * np.eye(2):
        tilted = replace(simulation, gravity=tilted_gravity(level, tilt))
        slopes.append(refit.change_with(tilted) / _STEP)
    left = np.stack([refit.left(refit.by_noise(slope)) for slope in slopes], axis=1)
    normal = left.T @ left + np.eye(2) / _PRIOR**2
    angles = -np.asarray(np.linalg.solve(normal, left.T @ refit.residuals), np.float64)
    return Tilt(angles, refit.end(np.tensordot(angles, np.array(slopes), axes=1)))
