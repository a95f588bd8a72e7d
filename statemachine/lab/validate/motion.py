"""Cases of falls, springs and damping: how well an engine integrates.

Sources: Goldstein, Poole, Safko: Classical Mechanics, 3rd ed. (2002); Landau, Lifshitz: Mechanics,
3rd ed. (1976); Hairer, Lubich, Wanner: Geometric Numerical Integration, 2nd ed. (2006).
"""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from .case import (
    FEW_TIMESTEPS,
    GRAVITY,
    NO_MOTION,
    Case,
    Discrete,
    Integrator,
    converges,
    exact,
    exact_steps,
    rounded,
    wrong,
)
from .run import Run, Samples, largest_deviation, simulated_time, zero, zero_crossings

_BEFORE_POSITION: tuple[Integrator, ...] = ("Euler", "implicit", "implicitfast", "discrete")

# A body in the air.

_FREE = (
    '<worldbody><body name="body"><freejoint/><inertial pos="0 0 0" mass="1" '
    'diaginertia="1 2 3"/></body></worldbody>'
)
_THROW = np.array([1.0, -2.0, 5.0])  # [m/s]


def _fallen_height(run: Run) -> float:
    run.advance(1.0)
    return float(run.data.qpos[2])


def _fall(time: float = 1.0) -> float:
    return -GRAVITY * time**2 / 2.0


def _stepwise_fall(timestep: float) -> float:
    """Return -g h² n (n + 1) / 2: each step updates the velocity first, then the position."""
    steps = round(1.0 / timestep)
    return -GRAVITY * timestep**2 * steps * (steps + 1) / 2.0


def _distance_from_parabola(run: Run) -> float:
    run.data.qvel[:3] = _THROW
    time = run.advance(1.0)
    parabola = _THROW * time + np.array([0.0, 0.0, -GRAVITY / 2.0]) * time**2
    return float(np.linalg.norm(run.data.qpos[:3] - parabola))


def _stepwise_distance(timestep: float) -> float:
    """Return g h t / 2: how much deeper it is after 1 s."""
    return GRAVITY * timestep * simulated_time(1.0, timestep) / 2.0


# A mass on a spring, 10 rad/s.

_SPRING = (
    '<worldbody><body name="body"><joint name="slide" type="slide" axis="1 0 0" stiffness="100"'
    '{damping}/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'
)
_FREE_SPRING = _SPRING.format(damping="")
_DAMPED_SPRING = _SPRING.format(damping=' damping="1"')
_RATE = 10.0  # [rad/s]


def _position(data: Data) -> float:
    return float(data.qpos[0])


def _position_and_velocity(data: Data) -> Array:
    return np.array([data.qpos[0], data.qvel[0]])


def _spring_energy(samples: Samples) -> Array:
    position, velocity = samples.values.T
    return (velocity**2 + _RATE**2 * position**2) / 2.0


def _energy_of_spring(run: Run) -> float:
    """Return the largest change of the energy in the last two of 10 s, as a ratio."""
    run.data.qpos[0] = 1.0
    run.advance(8.0)
    last = run.sample(2.0, _position_and_velocity)
    if not np.ptp(last.values, axis=0).all():
        return math.inf  # it does not move
    return largest_deviation(_spring_energy(last), _RATE**2 / 2.0)


def _period_of_spring(run: Run) -> float:
    run.data.qpos[0] = 1.0
    samples = run.sample(5.0, _position)
    times = zero_crossings(samples, rising=False)
    return float(times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else math.inf


def _spring_period() -> float:
    return 2.0 * math.pi / _RATE


def _position_after_half_second(run: Run) -> float:
    run.data.qpos[0] = 1.0
    run.advance(0.5)
    return float(run.data.qpos[0])


def _damped(time: float = 0.5) -> float:
    """Return e^(-d t) (cos w t + d / w sin w t) at a time [s], d = 0.5 and w² = 100 - d² [m]."""
    decay = 0.5
    rate = math.sqrt(_RATE**2 - decay**2)
    phase = rate * time
    return math.exp(-decay * time) * (math.cos(phase) + decay / rate * math.sin(phase))


# A weight that sinks against damping: 1 kg, 4 N s/m.

_SINKING = (
    '<worldbody><body name="body"><joint name="slide" type="slide" axis="0 0 1" damping="4"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'
)


def _sinking_speed(run: Run) -> float:
    run.advance(0.25)
    return float(run.data.qvel[0])


def _sinking(time: float = 0.25) -> float:
    return -GRAVITY / 4.0 * (1.0 - math.exp(-4.0 * time))


def _stepwise_sinking(timestep: float) -> float:
    """Return the speed of v' = (v - g h) / (1 + 4 h): damping is implicit."""
    steps = round(0.25 / timestep)
    return -GRAVITY / 4.0 * (1.0 - (1.0 + 4.0 * timestep) ** -steps)


def _last_speed(run: Run) -> float:
    run.advance(6.0)
    return float(run.data.qvel[0])


def _terminal() -> float:
    return -GRAVITY / 4.0


# Two robots that differ only in the order in which their branches are written.

_BRANCH = (
    '<body name="{name}" pos="{x} 0 0"><joint name="{name}" axis="0 1 0" damping="0.1"/>'
    '<inertial pos="0 0 {z}" mass="{mass}" diaginertia="0.01 0.02 0.03"/></body>'
)
_BASE = (
    '<body name="{name}" pos="0 {y} 0"><joint name="{name}" axis="1 0 0"/>'
    '<inertial pos="0 0 -0.2" mass="1" diaginertia="0.1 0.2 0.1"/>{branches}</body>'
)


def _robot(name: str, y: float, order: tuple[int, ...]) -> str:
    """Return a base with three branches.

    Args:
        name: Before the name of each body.
        y: Place of its base [m].
        order: Numbers of the branches, as they are written.
    """
    branches: list[str] = []
    for k in order:
        part = f"{name}{k}"
        branches.append(_BRANCH.format(name=part, x=0.2 * k, z=-0.3 - 0.1 * k, mass=1.0 + k))
    return _BASE.format(name=name, y=y, branches="".join(branches))


_ORDERS = ((0, 1, 2), (2, 0, 1), (1, 2, 0), (2, 1, 0))
_ROBOTS = "".join(_robot("abcd"[k], 3.0 * k, order) for k, order in enumerate(_ORDERS))
_SAME_ROBOTS = f"<worldbody>{_ROBOTS}</worldbody>"


def _spread_of_orders(run: Run) -> float:
    """Return the largest difference of a joint between robots after 1 s [rad]."""
    model, data = run.model, run.data
    places = np.zeros((len(_ORDERS), 4), dtype=int)
    for k, robot in enumerate("abcd"):
        for joint, part in enumerate((robot, f"{robot}0", f"{robot}1", f"{robot}2")):
            places[k, joint] = model.jnt_qposadr[model.joint_id(part)]
    data.qpos[places] = [0.4, 0.6, -0.5, 1.0]
    start = data.qpos[places]
    run.advance(1.0)
    if np.array_equal(start, data.qpos[places]):
        return math.inf  # nothing moves
    return float(np.ptp(data.qpos[places], axis=0).max())


_EACH_STEPWISE_FALL: Discrete = dict.fromkeys(_BEFORE_POSITION, _stepwise_fall)
_EACH_STEPWISE_DISTANCE: Discrete = dict.fromkeys(_BEFORE_POSITION, _stepwise_distance)
_EACH_STEPWISE_SINKING: Discrete = dict.fromkeys(_BEFORE_POSITION, _stepwise_sinking)

CASES: tuple[Case, ...] = (
    Case(
        name="free-fall",
        group="motion",
        description="A body falls from rest for 1 s; its height is measured.",
        mjcf=_FREE,
        measure=_fallen_height,
        truth=_fall,
        truth_after=_fall,
        unit="m",
        source="Goldstein, section 1.1",
        discrete=_EACH_STEPWISE_FALL,
        expected={
            "RK4": exact(),
            "motrix *": converges(1.0, 0.0246),
            "pybullet:engine own": wrong(0.325, "engine's own"),
            "*": exact_steps(0.0246),
        },
        rounding=1e-12,
    ),
    Case(
        name="thrown-body",
        group="motion",
        description="A body is thrown; its distance from the parabola after 1 s is measured.",
        mjcf=_FREE,
        measure=_distance_from_parabola,
        truth=zero,
        unit="m",
        source="Goldstein, section 1.1",
        discrete=_EACH_STEPWISE_DISTANCE,
        expected={
            "RK4": exact(),
            "motrix *": converges(1.0, 0.0246),
            "pybullet:engine own": wrong(0.27, "engine's own"),
            "*": exact_steps(0.0246),
        },
        rounding=1e-12,
    ),
    Case(
        name="spring-period",
        group="motion",
        description="A mass swings on a spring; its period is measured.",
        mjcf=_FREE_SPRING,
        measure=_period_of_spring,
        truth=_spring_period,
        unit="s",
        source="Landau and Lifshitz, section 21",
        relative=True,
        expected={
            "RK4": converges(4.0, 5.2e-8),
            "discrete": converges(2.0, 8.4e-4),
            "motrix *": converges(2.0, 1.05e-4),
            "pybullet:engine own": NO_MOTION,
            "*": converges(2.0, 1.05e-4),
        },
        rounding=1e-11,
    ),
    Case(
        name="spring-energy",
        group="motion",
        description="A mass swings on a spring for 10 s; the change of its energy is measured.",
        mjcf=_FREE_SPRING,
        measure=_energy_of_spring,
        truth=zero,
        unit="",
        source="Hairer, Lubich, Wanner, section I.1.4",
        expected={
            "discrete": wrong(0.994, "engine's own"),
            "RK4": converges(5.0, 4.4e-7),
            "motrix *": converges(1.0, 0.0256),
            "pybullet:engine own": NO_MOTION,
            "*": converges(1.0, 0.0256),
        },
        rounding=1e-11,
    ),
    Case(
        name="damped-spring",
        group="motion",
        description="A damped mass swings on a spring; its position after 0.5 s is measured.",
        mjcf=_DAMPED_SPRING,
        measure=_position_after_half_second,
        truth=_damped,
        truth_after=_damped,
        unit="m",
        source="Landau and Lifshitz, section 25",
        expected={
            "RK4": converges(4.0, 1.9e-7),
            "discrete": converges(1.0, 0.032),
            "motrix *": converges(1.0, 0.0147),
            "pybullet:engine own": wrong(0.83, "engine's own"),
            "*": converges(1.0, 0.0147),
        },
        rounding=1e-11,
    ),
    Case(
        name="sinking-speed",
        group="motion",
        description="A weight sinks against damping; its speed after 0.25 s is measured.",
        mjcf=_SINKING,
        measure=_sinking_speed,
        truth=_sinking,
        truth_after=_sinking,
        unit="m/s",
        source="Goldstein, chapter 1, derivation 11 (Rayleigh's dissipation)",
        discrete=_EACH_STEPWISE_SINKING,
        expected={
            "RK4": exact(2e-9),
            "motrix *": converges(1.0, 0.009),
            "pybullet:engine own": wrong(1.56, "engine's own"),
            "*": exact_steps(0.009),
        },
        rounding=2e-9,
    ),
    Case(
        name="terminal-speed",
        group="motion",
        description="A weight sinks against damping for 6 s; its speed is measured.",
        mjcf=_SINKING,
        measure=_last_speed,
        truth=_terminal,
        unit="m/s",
        source="Goldstein, section 1.5 (friction proportional to the velocity)",
        expected={
            "motrix *": rounded(2.5),
            "pybullet:engine own": wrong(2.46, "engine's own"),
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="order-of-branches",
        group="motion",
        description="Robots whose branches are written in other orders fall; their largest "
        "difference after 1 s is measured.",
        mjcf=_SAME_ROBOTS,
        measure=_spread_of_orders,
        truth=zero,
        unit="rad",
        source="Landau and Lifshitz, section 2 (the names of coordinates do not matter)",
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": NO_MOTION,
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
)
