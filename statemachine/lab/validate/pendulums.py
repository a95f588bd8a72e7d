"""Cases of pendulums: how well an engine keeps time and energy.

Source: Landau, Lifshitz: Mechanics, 3rd ed. (1976).
"""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from .case import FEW_TIMESTEPS, GRAVITY, NO_MOTION, Case, bounded, converges, exact, rounded
from .run import Run, largest_deviation, zero, zero_crossings

# A pendulum: a point mass at 1 m.

_POINT = 'mass="1" diaginertia="1e-6 1e-6 1e-6"'
_PENDULUM = (
    '<worldbody><body name="body"><joint name="hinge" axis="0 1 0"/>'
    f'<inertial pos="0 0 -1" {_POINT}/></body></worldbody>'
)
_SMALL, _LARGE = math.radians(60.0), math.radians(120.0)


def _angle(data: Data) -> float:
    return float(data.qpos[0])


def elliptic_period(inertia: float, moment: float, amplitude: float) -> float:
    """Return the period [s] of a pendulum: 4 √(I / m g l) K(sin²(a / 2)).

    K is π/2 divided by an arithmetic-geometric mean.

    Args:
        inertia: About its axis [kg m²].
        moment: Of its weight, when it is level [N m].
        amplitude: [rad].
    """
    return 2.0 * math.pi * math.sqrt(inertia / moment) / _mean(math.cos(amplitude / 2.0))


def pendulum_period(amplitude: float) -> float:
    """Return the period [s] of the pendulum of these cases at an amplitude [rad]."""
    return elliptic_period(1.0 + 1e-6, GRAVITY, amplitude)


def _mean(other: float) -> float:
    """Return the arithmetic-geometric mean of 1 and a number."""
    arithmetic, geometric = 1.0, other
    for _ in range(8):  # the digits double each time
        both = arithmetic * geometric
        arithmetic, geometric = (arithmetic + geometric) / 2.0, math.sqrt(both)
    return arithmetic


def _period(run: Run, amplitude: float) -> float:
    """Return the time between two upward crossings of the lowest point [s]."""
    run.data.qpos[0] = amplitude
    samples = run.sample(1.9 * pendulum_period(amplitude), _angle)
    times = zero_crossings(samples, rising=True)
    return float(times[1] - times[0]) if len(times) > 1 else math.inf


def _small_period(run: Run) -> float:
    return _period(run, _SMALL)


def _large_period(run: Run) -> float:
    return _period(run, _LARGE)


def _small_truth() -> float:
    return pendulum_period(_SMALL)


def _large_truth() -> float:
    return pendulum_period(_LARGE)


def _quarter(run: Run) -> float:
    run.data.qpos[0] = _SMALL
    samples = run.sample(0.4 * pendulum_period(_SMALL), _angle)
    times = zero_crossings(samples, rising=False)
    return float(times[0]) if len(times) else math.inf


def _quarter_truth() -> float:
    return pendulum_period(_SMALL) / 4.0


def _rise(run: Run) -> float:
    """Return how far the pendulum swings beyond its start, by a parabola [rad]."""
    run.data.qpos[0] = _LARGE
    run.advance(2.8 * pendulum_period(_LARGE))
    angles = np.abs(run.sample(0.4 * pendulum_period(_LARGE), _angle).values)
    top = int(angles.argmax())
    if not 0 < top < len(angles) - 1:
        return math.inf  # it does not swing
    before, highest, after = angles[top - 1 : top + 2]
    curvature = before - 2.0 * highest + after
    return float(highest - (after - before) ** 2 / (8.0 * curvature)) - _LARGE


# Two pendulums, one at the end of the other.

_DOUBLE = (
    '<worldbody><body name="upper"><joint name="shoulder" axis="0 1 0"/>'
    f'<inertial pos="0 0 -1" {_POINT}/><body name="lower" pos="0 0 -1">'
    f'<joint name="elbow" axis="0 1 0"/><inertial pos="0 0 -1" {_POINT}/></body></body></worldbody>'
)


def double_pendulum_energy(state: Array) -> Array:
    """Return the energy [J] of two point masses on rods of 1 m, above that of hanging still.

    Args:
        state: (..., 4) Angle of the first from the vertical, of the second from the first [rad],
            and their rates [rad/s].
    """
    first, second, first_rate, second_rate = np.moveaxis(state, -1, 0)
    sum_rate = first_rate + second_rate
    kinetic = (
        first_rate**2
        + sum_rate**2 / 2.0
        + first_rate * sum_rate * np.cos(second)
        + 1e-6 * (first_rate**2 + sum_rate**2) / 2.0
    )
    potential = GRAVITY * (3.0 - 2.0 * np.cos(first) - np.cos(first + second))
    return kinetic + potential


def _both(data: Data) -> Array:
    return np.concatenate([data.qpos, data.qvel])


def _energy_of_double_pendulum(run: Run) -> float:
    """Return the largest change of the energy in the last two of 10 s, as a ratio."""
    run.data.qpos[0] = _LARGE
    start = float(double_pendulum_energy(_both(run.data)))
    run.advance(8.0)
    last = run.sample(2.0, _both)
    if np.ptp(last.values, axis=0).min() < 0.1:
        return math.inf  # it does not swing
    return largest_deviation(double_pendulum_energy(last.values), start)


CASES: tuple[Case, ...] = (
    Case(
        name="pendulum-60",
        group="motion",
        description="A pendulum swings by 60 degrees; its period is measured.",
        mjcf=_PENDULUM,
        measure=_small_period,
        truth=_small_truth,
        unit="s",
        source="Landau and Lifshitz, section 11, problem 1",
        relative=True,
        expected={
            "RK4": exact(),
            "motrix *": rounded(),
            "pybullet:engine own": NO_MOTION,
            "*": converges(2.0, 5.2e-6),
        },
    ),
    Case(
        name="pendulum-120",
        group="motion",
        description="A pendulum swings by 120 degrees; its period is measured.",
        mjcf=_PENDULUM,
        measure=_large_period,
        truth=_large_truth,
        unit="s",
        source="Landau and Lifshitz, section 11, problem 1",
        relative=True,
        expected={
            "RK4": exact(),
            "motrix *": rounded(),
            "pybullet:engine own": NO_MOTION,
            "*": converges(2.0, 5.2e-6),
        },
    ),
    Case(
        name="pendulum-quarter",
        group="motion",
        description="A pendulum falls from 60 degrees to its lowest point; the time is measured.",
        mjcf=_PENDULUM,
        measure=_quarter,
        truth=_quarter_truth,
        unit="s",
        source="Landau and Lifshitz, section 11, problem 1",
        relative=True,
        expected={
            "RK4": exact(),
            "motrix *": converges(1.0, 0.0047),
            "pybullet:engine own": NO_MOTION,
            "*": converges(1.0, 0.0047),
        },
    ),
    Case(
        name="pendulum-rise",
        group="motion",
        description="A pendulum swings thrice; how far it rises beyond its start is measured.",
        mjcf=_PENDULUM,
        measure=_rise,
        truth=zero,
        unit="rad",
        source="Landau and Lifshitz, section 6 (energy is conserved)",
        expected={
            "RK4": exact(),
            "motrix *": rounded(),
            "pybullet:engine own": NO_MOTION,
            "*": converges(2.0, 2.7e-5),
        },
    ),
    Case(
        name="double-pendulum-energy",
        group="motion",
        description="A double pendulum swings for 10 s; the change of its energy is measured.",
        mjcf=_DOUBLE,
        measure=_energy_of_double_pendulum,
        truth=zero,
        unit="",
        source="Landau and Lifshitz, section 5, problem 1",
        expected={
            "RK4": bounded(6e-7, "discretisation"),
            "motrix *": bounded(0.1, "discretisation"),
            "pybullet:engine own": NO_MOTION,
            "*": bounded(0.1, "discretisation"),
        },
        tolerance=0.2,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
)
