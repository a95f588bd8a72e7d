"""What the cases of contact share: leaning gravity, net forces, and the keys of an engine."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...interface import Data
from ...interface.records import Array
from .case import GRAVITY, Expectation

ROUND = 'cone="elliptic"'  # attributes of <option>
PYRAMIDAL = 'cone="pyramidal"'


def on_engines(
    mujoco: Expectation,
    pybullet: Expectation,
    own: Expectation,
    rk4: Expectation | None = None,
    discrete: Expectation | None = None,
    motrix: Expectation | None = None,
) -> dict[str, Expectation]:
    """Return what is expected of the engines; nothing is of others, whose contacts are unknown.

    Args:
        mujoco: With each of its integrators.
        pybullet: With each integrator that our backend emulates.
        own: Of PyBullet as its own users meet it.
        rk4: Of MuJoCo with RK4, where that differs.
        discrete: Of MuJoCo with its integrator discrete, where that differs.
        motrix: Of MotrixSim, which has one integrator.
    """
    expected = {"mujoco *": mujoco, "pybullet *": pybullet, "pybullet:engine own": own}
    if rk4 is not None:
        expected["mujoco RK4"] = rk4
    if discrete is not None:
        expected["mujoco discrete"] = discrete
    if motrix is not None:
        expected["motrix *"] = motrix
    return expected


def one() -> float:
    """Return 1: the truth of what is measured over its closed form."""
    return 1.0


def tilted_gravity(angle: float, direction: float = 0.0) -> tuple[float, float, float]:
    """Return gravity in the axes of an incline [m/s²].

    Args:
        angle: Of the incline [rad].
        direction: Of its slope in the plane, from x to y [rad].
    """
    along = GRAVITY * math.sin(angle)
    return (
        along * math.cos(direction),
        along * math.sin(direction),
        -GRAVITY * math.cos(angle),
    )


def forces_on(data: Data, geoms: Sequence[int]) -> Array:
    """Return the forces that contacts with some geoms exert on the others, (n, 3) [N].

    Args:
        data: Whose contacts are of the state before the last step.
        geoms: Ids; each contact with one of them counts.
    """
    contacts = data.contacts
    forces: list[Array] = []
    for pair, force, frame in zip(contacts.geom, contacts.force, contacts.frame, strict=True):
        if pair[0] in geoms:
            forces.append(force @ frame)
        elif pair[1] in geoms:
            forces.append(-force @ frame)
    return np.array(forces).reshape(-1, 3)


def net_force(data: Data) -> Array:
    """Return the force of the first geom on what touches it, (3,) in world axes [N]."""
    return forces_on(data, (0,)).sum(axis=0)


def turned_about(samples: Array, axis: int) -> float:
    """Return the angle by which a body turned about one axis, beyond whole turns too [rad].

    Args:
        samples: (n, 4) quaternions wxyz, less than half a turn apart.
        axis: 1 for x, 2 for y, 3 for z.
    """
    half = np.arctan2(samples[:, axis], samples[:, 0])
    angles = np.unwrap(2.0 * half)
    return float(angles[-1] - angles[0])
