"""Cases of spheres that roll, slide, and spin on a plane."""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from .case import FEW_TIMESTEPS, GRAVITY, Case, bounded, converges, exact, rounded, wrong
from .contact_tools import ROUND, on_engines, one, tilted_gravity, turned_about
from .run import Run, Samples

RADIUS = 0.1  # [m]
ANGLE = math.radians(10.0)  # of the incline
SLIDING = 0.3  # friction of the sphere that is pushed
PUSH = 2.0  # [m/s]
SPIN = 10.0  # [rad/s] of the sphere that spins upright
SPINNING = 0.01  # its torsional friction [m]
ROLLING = 0.005  # rolling friction of the sphere that rolls out [m]
ROLL = 1.0  # [m/s] at which it does
GRID = tuple((mu, deg) for mu in (0.1, 0.2, 0.4, 0.8) for deg in (5.0, 15.0, 30.0, 45.0))
_GRID_TIME = 0.5  # [s]
_SETTLING = 0.5  # [s]
_ROLLING_BODY = "Meriam, Kraige: Engineering Mechanics, Dynamics, 7th ed., article 6/5"
_BILLIARD = "Meriam, Kraige: Engineering Mechanics, Dynamics, 7th ed., articles 6/5 and 6/8"
_RESISTANCE = "Meriam, Kraige: Engineering Mechanics, Statics, 7th ed., article 6/9"


def _sphere(friction: str, condim: int, solimp: str = "0.9 0.95 0.001") -> str:
    """Return a sphere on a plane.

    Args:
        friction: Sliding, torsional and rolling.
        condim: How many of them act: 3, 4 or 6.
        solimp: Of the contact.
    """
    return (
        f'<worldbody><geom type="plane" size="0 0 1" friction="{friction}" condim="{condim}" '
        f'solimp="{solimp}"/>'
        f'<body name="sphere" pos="0 0 {RADIUS!r}"><freejoint/>'
        f'<geom type="sphere" size="{RADIUS!r}" mass="1" friction="{friction}" '
        f'condim="{condim}" solimp="{solimp}"/></body></worldbody>'
    )


def _spheres() -> str:
    """Return planes through one another, each with a sphere that touches only this one."""
    parts: list[str] = []
    for k, (friction, degrees) in enumerate(GRID):
        angle = math.radians(degrees)
        quat = f"{math.cos(angle / 2.0)!r} 0 {math.sin(angle / 2.0)!r} 0"
        x, z = RADIUS * math.sin(angle), RADIUS * math.cos(angle)
        only = f'friction="{friction!r} 0 0" contype="{1 << k}" conaffinity="{1 << k}"'
        parts.append(
            f'<geom type="plane" size="0 0 1" quat="{quat}" {only}/>'
            f'<body pos="{x!r} {0.4 * k:g} {z!r}"><freejoint/>'
            f'<geom type="sphere" size="{RADIUS!r}" mass="1" {only}/></body>'
        )
    return f"<worldbody>{''.join(parts)}</worldbody>"


def grid_acceleration(friction: float, angle: float) -> float:
    """Return that of a sphere from rest: it rolls where 2/7 of the slope is within friction.

    Args:
        friction: Of the plane.
        angle: Of the plane [rad].
    """
    if friction >= 2.0 / 7.0 * math.tan(angle):
        return 5.0 / 7.0 * GRAVITY * math.sin(angle)
    return GRAVITY * (math.sin(angle) - friction * math.cos(angle))


def _worst_of_grid(run: Run) -> float:
    """Return the speed over that of the closed form which is farthest from 1."""
    time = run.advance(_GRID_TIME)
    velocities = run.data.qvel.reshape(-1, 6)
    ratios: list[float] = []
    for (friction, degrees), velocity in zip(GRID, velocities, strict=True):
        angle = math.radians(degrees)
        speed = math.cos(angle) * velocity[0] - math.sin(angle) * velocity[2]
        ratios.append(float(speed) / (grid_acceleration(friction, angle) * time))
    return max(ratios, key=lambda ratio: abs(ratio - 1.0))


def _speed_of_roll(run: Run) -> float:
    run.advance(2.0)
    return float(run.data.qvel[0])


def speed_of_roll(time: float = 2.0) -> float:
    """Return the speed after a time [s] of an acceleration of 5/7 g sin [m/s]."""
    return time * 5.0 / 7.0 * GRAVITY * math.sin(ANGLE)


def sliding_time() -> float:
    """Return how long the sphere slides that is pushed without spin, 2 v / (7 μ g) [s]."""
    return 2.0 * PUSH / (7.0 * SLIDING * GRAVITY)


def _pushed(run: Run) -> Samples:
    """Push the sphere once it lies, and return its place and quaternion, (n, 7)."""
    run.advance(_SETTLING)
    run.data.qvel[0] = PUSH
    return run.sample(1.2 * sliding_time(), _pose)


def _pose(data: Data) -> Array:
    return np.array(data.qpos)


def _speed_after_sliding(run: Run) -> float:
    _pushed(run)
    return float(run.data.qvel[0])


def speed_after_sliding() -> float:
    """Return 5/7 of the speed of the push [m/s]."""
    return 5.0 / 7.0 * PUSH


def _sliding_time(run: Run) -> float:
    """Return the time of a slip that falls evenly from the speed of the push: 2 s / v [s]."""
    poses = _pushed(run).values
    slip = poses[-1, 0] - poses[0, 0] - RADIUS * turned_about(poses[:, 3:], 2)
    return 2.0 * float(slip) / PUSH


def _spun(run: Run) -> float:
    """Return the angle that the sphere turns until it stops [rad]."""
    run.advance(_SETTLING)
    run.data.qvel[5] = SPIN
    poses = run.sample(1.3 * SPIN / spin_deceleration(), _pose).values
    return turned_about(poses[:, 3:], 3)


def spin_deceleration() -> float:
    """Return that of torsional friction, μ g / (2/5 r²) [rad/s²]."""
    return SPINNING * GRAVITY / (0.4 * RADIUS**2)


def spin_angle() -> float:
    return SPIN**2 / (2.0 * spin_deceleration())


def _rolled_out(run: Run) -> float:
    """Return how far the sphere rolls until it stops [m]."""
    run.advance(_SETTLING)
    data = run.data
    start = float(data.qpos[0])
    data.qvel[0] = ROLL
    data.qvel[4] = ROLL / RADIUS
    run.advance(1.2 * ROLL / roll_deceleration())
    return float(data.qpos[0]) - start


def roll_deceleration() -> float:
    """Return that of a sphere on which rolling friction acts, 5/7 μ g / r [m/s²]."""
    return 5.0 / 7.0 * ROLLING * GRAVITY / RADIUS


def rolling_distance() -> float:
    return ROLL**2 / (2.0 * roll_deceleration())


_ROLLS = _sphere("0.8 0 0", 3)
_PUSHED = _sphere(f"{SLIDING!r} 0 0", 3)
_SPINS = _sphere(f"0.5 {SPINNING!r} 0", 4)
_ROLLS_OUT = _sphere(f"0.5 0.001 {ROLLING!r}", 6, solimp="0.99 0.999 0.001")

CASES: tuple[Case, ...] = (
    Case(
        name="sphere-rolls",
        group="contact",
        description=(
            "A sphere rolls down an incline of 10 degrees; its speed after 2 s is measured."
        ),
        mjcf=_ROLLS,
        measure=_speed_of_roll,
        truth=speed_of_roll,
        truth_after=speed_of_roll,
        unit="m/s",
        source=_ROLLING_BODY,
        expected=on_engines(
            mujoco=bounded(0.001, "contact model"),
            pybullet=exact(),
            own=wrong(0.21, "engine's own"),
            motrix=rounded(),
        ),
        gravity=tilted_gravity(ANGLE),
        option=ROUND,
        relative=True,
        tolerance=0.002,
    ),
    Case(
        name="sphere-grid",
        group="contact",
        description=(
            "Spheres roll or slide down planes of four frictions and four angles; the "
            "speed over that of the closed form is measured, where it is farthest off."
        ),
        mjcf=_spheres(),
        measure=_worst_of_grid,
        truth=one,
        unit="",
        source=_ROLLING_BODY,
        expected=on_engines(
            mujoco=bounded(0.0046, "contact model"),
            pybullet=exact(),
            own=wrong(1.0, "engine's own"),
            motrix=rounded(),
        ),
        option=ROUND,
        tolerance=0.006,
        is_chaotic=True,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="sphere-slides-then-rolls",
        group="contact",
        description=(
            "A sphere is pushed at 2 m/s without spin; its speed once it rolls is measured."
        ),
        mjcf=_PUSHED,
        measure=_speed_after_sliding,
        truth=speed_after_sliding,
        unit="m/s",
        source=_BILLIARD,
        expected=on_engines(
            mujoco=bounded(0.001, "contact model"),
            pybullet=exact(),
            own=wrong(0.034, "engine's own"),
            motrix=rounded(),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.002,
    ),
    Case(
        name="sliding-time",
        group="contact",
        description=(
            "A sphere is pushed at 2 m/s without spin; the time until it rolls is "
            "measured, by how far it slips."
        ),
        mjcf=_PUSHED,
        measure=_sliding_time,
        truth=sliding_time,
        unit="s",
        source=_BILLIARD,
        expected=on_engines(
            mujoco=converges(0.9, 0.024),
            pybullet=converges(0.9, 0.026),
            own=wrong(0.167, "engine's own"),
            rk4=bounded(0.0026, "contact model"),
            motrix=converges(1.0, 0.0255),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.004,
    ),
    Case(
        name="torsional-friction",
        group="contact",
        description=(
            "A sphere spins upright at 10 rad/s; the angle until torsional friction stops"
            " it is measured."
        ),
        mjcf=_SPINS,
        measure=_spun,
        truth=spin_angle,
        unit="rad",
        source=_BILLIARD,
        expected=on_engines(
            mujoco=converges(0.9, 0.011),
            pybullet=converges(0.9, 0.0123),
            own=wrong(1.34, "engine's own"),
            rk4=bounded(0.0022, "contact model"),
            motrix=converges(1.0, 0.0124),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.003,
    ),
    Case(
        name="rolling-friction",
        group="contact",
        description=(
            "A sphere rolls at 1 m/s; its way until rolling friction stops it is measured."
        ),
        mjcf=_ROLLS_OUT,
        measure=_rolled_out,
        truth=rolling_distance,
        unit="m",
        source=_RESISTANCE,
        expected=on_engines(
            mujoco=bounded(0.0047, "contact model"),
            pybullet=converges(0.9, 0.0099),
            own=wrong(0.85, "engine's own"),
            motrix=converges(1.1, 0.00176),
        ),
        option=ROUND,
        relative=True,
        tolerance=0.0052,
    ),
)
