"""Cases of tops and gyroscopes: fast wheels on joints.

Source: Goldstein, Poole, Safko: Classical Mechanics, 3rd ed. (2002).
"""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from .case import GRAVITY, Case, converges, diverges, exact, refused, rounded, wrong
from .run import Run

# A heavy top, 0.1 m above its point of support, in regular precession at 30 degrees.

_TOP_INERTIAL = '<inertial pos="0 0 0.1" mass="1" diaginertia="0.002 0.002 0.001"/>'
_BALL_TOP = (
    f'<worldbody><body name="top"><joint name="ball" type="ball"/>{_TOP_INERTIAL}</body>'
    "</worldbody>"
)
_LIGHT = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
_HINGED_TOP = (
    f'<worldbody><body name="turn"><joint name="turn" axis="0 0 1"/>{_LIGHT}'
    f'<body name="tilt"><joint name="tilt" axis="0 1 0"/>{_LIGHT}'
    f'<body name="top"><joint name="spin" axis="0 0 1"/>{_TOP_INERTIAL}</body></body></body>'
    "</worldbody>"
)
_TILT = math.radians(30.0)
_TOP_SPIN = 300.0  # [rad/s] about its axis
_ACROSS, _ALONG = 0.002 + 0.1**2, 0.001  # moments of inertia at the point of support [kg m²]


def precession() -> float:
    """Return the slow rate [rad/s] at which A Ω² cos a - C s Ω + m g l = 0."""
    squared = _ACROSS * math.cos(_TILT)
    linear = _ALONG * _TOP_SPIN
    root = math.sqrt(linear**2 - 4.0 * squared * GRAVITY * 0.1)
    return (linear - root) / (2.0 * squared)


def _precessed(time: float = 1.0) -> float:
    """Return by how much it precesses in a time [s] [rad]."""
    return precession() * time


def _axis(data: Data) -> Array:
    """Return where the axis of the top points, seen from above."""
    w, x, y, z = data.qpos
    return np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x)])


def _turn_of_ball(run: Run) -> float:
    """Return by how much the top precesses in 1 s [rad]."""
    half = _TILT / 2.0
    run.data.qpos[:] = [math.cos(half), 0.0, math.sin(half), 0.0]
    run.data.qvel[:] = [-precession() * math.sin(_TILT), 0.0, _TOP_SPIN]
    across, along = run.sample(1.0, _axis).values.T
    turned = np.unwrap(np.arctan2(along, across))
    return float(turned[-1])


def _turn_of_hinges(run: Run) -> float:
    turning = precession()
    run.data.qpos[1] = _TILT
    run.data.qvel[:] = [turning, 0.0, _TOP_SPIN - turning * math.cos(_TILT)]
    run.advance(1.0)
    return float(run.data.qpos[0])


# A wheel in two gimbals, on whose inner one a motor pulls: the outer one turns, at M / (C s).

_GYROSCOPE = (
    '<worldbody><body name="outer"><joint name="outer" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="0.1" diaginertia="0.002 0.002 0.003"/>'
    '<body name="inner"><joint name="inner" axis="0 1 0"/>'
    '<inertial pos="0 0 0" mass="0.1" diaginertia="0.001 0.002 0.002"/>'
    '<body name="wheel"><joint name="wheel" axis="1 0 0"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="0.01 0.006 0.006"/></body></body></body>'
    '</worldbody><actuator><motor name="inner" joint="inner"/></actuator>'
)


def _gimbal_turn(run: Run) -> float:
    """Return how far the outer gimbal turns in 1 s, from the steady motion [rad]."""
    run.data.qvel[:] = [_gimbal_truth(1.0), 0.0, 50.0]
    run.data.ctrl[0] = 0.25
    run.advance(1.0)
    return float(run.data.qpos[0])


def _gimbal_truth(time: float = 1.0) -> float:
    """Return M t / (C s): a torque of 0.25 N m across a wheel of 0.01 kg m² at 50 rad/s."""
    return 0.25 * time / (0.01 * 50.0)


CASES: tuple[Case, ...] = (
    Case(
        name="top-ball",
        group="joints",
        description="A heavy top stands on a ball joint; by how much it precesses in 1 s is "
        "measured.",
        mjcf=_BALL_TOP,
        measure=_turn_of_ball,
        truth=_precessed,
        truth_after=_precessed,
        unit="rad",
        source="Goldstein, section 5.7",
        relative=True,
        expected={
            "mujoco==3.3.7 RK4": converges(2.0, 0.43, "engine's own"),
            "pybullet *": refused(),
            "motrix *": diverges("engine's own"),
            "pybullet:engine own": refused(),
            "implicit": wrong(0.97, "engine's own"),
            "RK4": converges(3.6, 0.32),
            "*": diverges("engine's own"),
        },
    ),
    Case(
        name="top-hinges",
        group="joints",
        description="The same top hangs in three hinges; by how much it precesses in 1 s is "
        "measured.",
        mjcf=_HINGED_TOP,
        measure=_turn_of_hinges,
        truth=_precessed,
        truth_after=_precessed,
        unit="rad",
        source="Goldstein, section 5.7",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": exact(),
        },
        rounding=1e-9,
    ),
    Case(
        name="gyroscope",
        group="joints",
        description="A motor pulls at the inner gimbal of a wheel; how far the outer one turns "
        "in 1 s is measured.",
        mjcf=_GYROSCOPE,
        measure=_gimbal_turn,
        truth=_gimbal_truth,
        truth_after=_gimbal_truth,
        unit="rad",
        source="Goldstein, section 5.7 (the gyroscope)",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": exact(),
        },
    ),
)
