"""The law of the pendulum in all the cells: what its state must be, without an engine."""

from __future__ import annotations

import math

from ..conventions._pendulum import INERTIA, MASS, RATE, REACH
from . import ANGLE, TORQUE


def acceleration(angle: float, torque: float) -> float:
    """Of the joint, without friction [rad/s²]."""
    return RATE * math.cos(angle) + torque / (MASS * REACH**2 + INERTIA)


def accelerated(timestep: float) -> tuple[float, float]:
    """Angle and speed after one semi-implicit step from rest, under the cells' torque."""
    speed = timestep * acceleration(ANGLE, TORQUE)
    return ANGLE + timestep * speed, speed
