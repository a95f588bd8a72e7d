"""Cases of limits of joints, and of the torques that hold and move an arm.

Sources: Landau, Lifshitz: Mechanics, 3rd ed. (1976); Goldstein, Poole, Safko: Classical Mechanics,
3rd ed. (2002); Spong, Hutchinson, Vidyasagar: Robot Modeling and Control (2006).
"""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from .case import FEW_TIMESTEPS, GRAVITY, NO_MOTION, Case, bounded, exact, refused, wrong
from .run import Run, zero


def _position(data: Data) -> float:
    return float(data.qpos[0])


# A weight that falls 0.5 m onto the limit of its joint.

_LIMIT = (
    '<worldbody><body name="body"><joint name="joint" type="slide" axis="0 0 1" limited="true" '
    'range="-0.5 1"/><inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/></body></worldbody>'
)


def _beyond_limit(run: Run) -> float:
    """Return how far the weight rests beyond the limit after 1.5 s [m]."""
    run.advance(1.5)
    return -0.5 - float(run.data.qpos[0])


def _force_of_limit(run: Run) -> float:
    """Return the force of the limit at rest [N]."""
    run.advance(1.5)
    run.forward()
    return float(run.data.qfrc_limit[0])


def _limit_force() -> float:
    return 2.0 * GRAVITY


def _rebound(run: Run) -> float:
    """Return how much faster than it came the weight leaves the limit [m/s]; less than 0 is well.

    No limit pushes more than was stored: the speed at the place of the hit is compared.
    """
    samples = run.sample(1.2, _position)
    speeds = np.diff(samples.values) / np.diff(samples.times)
    if not speeds.any() or samples.values.min() < -0.6:
        return math.inf  # it does not fall, or falls through
    return max(0.0, float(speeds.max() + speeds.min()))


# An arm of two links that is held: what its motors must give, at rest and moving.

_ARM = (
    '<worldbody><body name="upper"><joint name="shoulder" axis="0 1 0"/>'
    '<inertial pos="0.25 0 0" mass="2" diaginertia="0.01 0.04 0.04"/>'
    '<body name="lower" pos="0.5 0 0"><joint name="elbow" axis="0 1 0"/>'
    '<inertial pos="0.2 0 0" mass="1" diaginertia="0.01 0.02 0.02"/></body></body></worldbody>'
)
_BEND = math.radians(40.0)


def _torque_at_rest(run: Run) -> float:
    """Return the torque that the shoulder needs at rest, bent by 40 degrees [N m]."""
    run.data.qpos[:] = [0.0, _BEND]
    run.forward()
    return float(run.data.qfrc_bias[0])


def _rest_truth() -> float:
    """Return the moment of both weights about the shoulder; a positive angle lowers the arm."""
    arm = 0.5 + 0.2 * math.cos(_BEND)
    return -GRAVITY * (2.0 * 0.25 + 1.0 * arm)


def _torque_moving(run: Run) -> float:
    """Return the torque that the shoulder needs while both joints turn evenly [N m]."""
    run.data.qpos[:] = [0.0, _BEND]
    run.data.qvel[:] = [2.0, -3.0]
    run.forward()
    return float(run.data.qfrc_bias[0])


def _moving_truth() -> float:
    """Return weights and Coriolis: -m l r sin b (2 a' b' + b'²) (Spong, equation 6.91)."""
    coriolis = -1.0 * 0.5 * 0.2 * math.sin(_BEND) * (2.0 * 2.0 * -3.0 + 3.0**2)
    return _rest_truth() + coriolis


CASES: tuple[Case, ...] = (
    Case(
        name="limit-rest",
        group="joints",
        description="A weight falls onto the limit of its joint; how far beyond it rests is "
        "measured.",
        mjcf=_LIMIT,
        measure=_beyond_limit,
        truth=zero,
        unit="m",
        source="Goldstein, section 1.3 (constraints by inequality)",
        expected={
            "pybullet *": bounded(3.7e-4, "computed by our backend"),
            "motrix *": bounded(3.7e-4, "engine's own"),
            "pybullet:engine own": wrong(0.5, "engine's own"),
            "*": bounded(3.7e-4, "engine's own"),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="limit-force",
        group="joints",
        description="A weight rests on the limit of its joint; the force of the limit is measured.",
        mjcf=_LIMIT,
        measure=_force_of_limit,
        truth=_limit_force,
        unit="N",
        source="Goldstein, section 1.4 (forces of constraint)",
        relative=True,
        expected={
            "motrix *": refused(),
            "pybullet:engine own": refused(),
            "*": exact(5e-9),
        },
        rounding=5e-9,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="limit-rebound",
        group="joints",
        description="A weight bounces off the limit of its joint; how much faster than it came "
        "it leaves is measured.",
        mjcf=_LIMIT,
        measure=_rebound,
        truth=zero,
        unit="m/s",
        source="Landau and Lifshitz, section 17 (no collision adds energy)",
        expected={
            "motrix *": exact(),
            "pybullet:engine own": NO_MOTION,
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="torque-at-rest",
        group="joints",
        description="An arm of two links is held; the torque that its shoulder needs is measured.",
        mjcf=_ARM,
        measure=_torque_at_rest,
        truth=_rest_truth,
        unit="N m",
        source="Spong, section 6.4 (two-link arm)",
        relative=True,
        expected={
            "motrix *": refused(),
            "pybullet:engine own": exact(),
            "*": exact(),
        },
        timesteps=(0.005, 0.002),
    ),
    Case(
        name="torque-moving",
        group="joints",
        description="An arm of two links turns evenly; the torque that its shoulder needs is "
        "measured.",
        mjcf=_ARM,
        measure=_torque_moving,
        truth=_moving_truth,
        unit="N m",
        source="Spong, section 6.4 (two-link arm)",
        relative=True,
        expected={
            "motrix *": refused(),
            "pybullet:engine own": exact(),
            "*": exact(),
        },
        timesteps=(0.005, 0.002),
    ),
)
