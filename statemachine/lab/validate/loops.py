"""Cases of constraints between bodies: loops, welds, and the forces that hold them.

Sources: Landau, Lifshitz: Mechanics, 3rd ed. (1976); Goldstein, Poole, Safko: Classical Mechanics,
3rd ed. (2002).
"""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from ...rotations import matrix_from_quat
from .case import GRAVITY, Case, bounded, converges, exact, refused, rounded
from .known_causes import IMPLICIT_SERVO, INVERSE_INERTIA
from .pendulums import elliptic_period
from .run import Run, largest_deviation, zero, zero_crossings

# The steps of loops are costly where a backend computes their forces itself.
_TIMESTEPS = (0.01, 0.005, 0.002, 0.001)  # [s]
_FEW_TIMESTEPS = _TIMESTEPS[:3]  # [s] of an error that does not depend on the timestep

# A parallelogram: two cranks of 1 m, and a coupler that stays level. It swings as a pendulum.

_CRANK = '<inertial pos="0 0 -0.5" mass="0.5" diaginertia="0.01 0.01 0.01"/>'
_FOUR_BAR = (
    f'<worldbody><body name="crank"><joint name="crank" axis="0 1 0"/>{_CRANK}'
    '<body name="coupler" pos="0 0 -1"><joint name="coupler" axis="0 1 0"/>'
    '<inertial pos="0.3 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>'
    '<body name="rocker" pos="0.6 0 1"><joint name="rocker" axis="0 1 0" pos="0 0 -1"/>'
    f"{_CRANK}</body></body></body></worldbody>"
    '<equality><connect name="pin" body1="rocker" anchor="0 0 0"/></equality>'
)
_AMPLITUDE = math.radians(60.0)
_LINKAGE_INERTIA = 2.0 * (0.5 * 0.5**2 + 0.01) + 1.0  # about the pins [kg m²]
_LINKAGE_MOMENT = (2.0 * 0.5 * 0.5 + 1.0) * GRAVITY  # of the weights, at a right angle [N m]


def linkage_period() -> float:
    """Return the period of the parallelogram [s]."""
    return elliptic_period(_LINKAGE_INERTIA, _LINKAGE_MOMENT, _AMPLITUDE)


def _bend(run: Run) -> None:
    run.data.qpos[:] = [_AMPLITUDE, -_AMPLITUDE, _AMPLITUDE]


def _crank_angle(data: Data) -> float:
    return float(data.qpos[0])


def _swing(run: Run) -> float:
    """Return twice the time between two crossings of the lowest point [s]."""
    _bend(run)
    samples = run.sample(0.85 * linkage_period(), _crank_angle)
    down, back = zero_crossings(samples, rising=False), zero_crossings(samples, rising=True)
    return 2.0 * float(back[0] - down[0]) if len(down) and len(back) else math.inf


def _all_angles(data: Data) -> Array:
    return np.array(data.qpos)


def _pin_error(run: Run) -> float:
    """Return the largest distance of the pin from its place in a period [m]."""
    _bend(run)
    angles = run.sample(linkage_period(), _all_angles).values
    if not np.ptp(angles):
        return math.inf  # it does not swing
    crank, level, last = np.cumsum(angles, axis=1).T
    forwards = -np.sin(crank) + 0.6 * np.cos(level) + np.sin(last) - 0.6
    upwards = -np.cos(crank) - 0.6 * np.sin(level) + np.cos(last)
    return float(np.hypot(forwards, upwards).max())


# A body of 2 kg that hangs on a pin, 0.5 m above its centre.

_PINNED = (
    '<worldbody><body name="body"><freejoint/><inertial pos="0 0 -0.5" mass="2" '
    'diaginertia="0.05 0.05 0.05"/></body></worldbody>'
    '<equality><connect name="pin" body1="body" anchor="0 0 0"/></equality>'
)
_START = math.radians(60.0)


def _force_upwards(data: Data) -> float:
    return float(data.qfrc_equality[2])


def _reaction_at_rest(run: Run) -> float:
    """Return the force of the pin upwards, after 0.6 s at rest [N]."""
    run.advance(0.6)
    run.forward()
    return _force_upwards(run.data)


def _weight() -> float:
    return 2.0 * GRAVITY


def _reaction_moving(run: Run) -> float:
    """Return the largest force of the pin upwards in the first swing from 60 degrees [N]."""
    half = _START / 2.0
    run.data.qpos[3:] = [math.cos(half), 0.0, math.sin(half), 0.0]
    run.advance(0.1)  # the constraint begins
    forces = run.sample(0.6, _force_upwards).values
    return float(forces[1:].max())


def moving_truth() -> float:
    """Return m g + m r w², with w² = 2 m g r (1 - cos a) / (I + m r²) [N]."""
    squared = 2.0 * 2.0 * GRAVITY * 0.5 * (1.0 - math.cos(_START)) / (0.05 + 2.0 * 0.5**2)
    return 2.0 * (GRAVITY + 0.5 * squared)


# 90 kg that are welded to a carriage of 10 kg, which a servo holds.

_PAYLOAD = (
    '<worldbody><body name="carriage"><joint name="lift" type="slide" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="10" diaginertia="0.1 0.1 0.1"/></body>'
    '<body name="payload" pos="0 0 -0.2"><joint name="load" type="slide" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="90" diaginertia="1 1 1"/></body></worldbody>'
    '<equality><weld name="weld" body1="carriage" body2="payload"/></equality>'
    '<actuator><position name="lift" joint="lift" kp="10000" kv="2000"/></actuator>'
)


def _weld_error(run: Run) -> float:
    """Return how far the payload is from its place below the carriage after 1 s [m]."""
    run.advance(1.0)
    lift, load = run.data.qpos
    return float(lift - load)


def _payload_droop(run: Run) -> float:
    run.advance(2.0)
    return float(run.data.qpos[0])


def _payload_truth() -> float:
    return -100.0 * GRAVITY / 10000.0


# Two links that lean on each other, their tips welded: nothing can move.

_LEANING = (
    '<worldbody><body name="left"><joint name="left" axis="0 1 0"/>'
    '<inertial pos="0.3 0 0.4" mass="1" diaginertia="0.05 0.05 0.05"/></body>'
    '<body name="right" pos="1.2 0 0"><joint name="right" axis="0 1 0"/>'
    '<inertial pos="-0.3 0 0.4" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody>'
    '<equality><weld name="weld" body1="left" body2="right"/></equality>'
)


def _leaning_error(run: Run) -> float:
    """Return the larger angle by which a link sinks in 0.6 s [rad]."""
    run.advance(0.6)
    return float(np.abs(run.data.qpos).max())


# The same body swings: its energy stays.


def _energy(data: Data) -> float:
    """Return the energy of the body above that of hanging still [J]."""
    turned = matrix_from_quat(data.qpos[3:])
    rate = turned @ data.qvel[3:]
    velocity = data.qvel[:3] + np.cross(rate, turned @ np.array([0.0, 0.0, -0.5]))
    height = float(data.qpos[2] - 0.5 * turned[2, 2]) + 0.5
    return float(velocity @ velocity) + 0.05 / 2.0 * float(rate @ rate) + 2.0 * GRAVITY * height


def _pinned_energy(run: Run) -> float:
    """Return by how much the energy changes at most in 1 s, of what the body falls from."""
    half = _START / 2.0
    run.data.qpos[3:] = [math.cos(half), 0.0, math.sin(half), 0.0]
    energies = run.sample(1.0, _energy).values
    return largest_deviation(energies, 2.0 * GRAVITY * 0.5 * (1.0 - math.cos(_START)))


CASES: tuple[Case, ...] = (
    Case(
        name="four-bar-period",
        group="joints",
        description="A parallelogram of four bars swings by 60 degrees; its period is measured.",
        mjcf=_FOUR_BAR,
        measure=_swing,
        truth=linkage_period,
        unit="s",
        source="Landau and Lifshitz, section 11, problem 1",
        relative=True,
        expected={
            "pybullet *": bounded(1.6e-4, "computed by our backend"),
            "motrix *": bounded(2.65e-4, "engine's own", INVERSE_INERTIA),
            "pybullet:engine own": refused(),
            "*": bounded(1.6e-4, "engine's own"),
        },
        timesteps=_TIMESTEPS,
    ),
    Case(
        name="four-bar-closure",
        group="joints",
        description="A parallelogram of four bars swings; how far its last pin leaves its place "
        "is measured.",
        mjcf=_FOUR_BAR,
        measure=_pin_error,
        truth=zero,
        unit="m",
        source="Goldstein, section 1.3 (holonomic constraints)",
        expected={
            "pybullet *": bounded(5.9e-4, "computed by our backend"),
            "motrix *": bounded(0.00123, "engine's own", INVERSE_INERTIA),
            "pybullet:engine own": refused(),
            "*": bounded(5.9e-4, "engine's own"),
        },
        timesteps=_TIMESTEPS,
    ),
    Case(
        name="reaction-at-rest",
        group="joints",
        description="A body hangs on a pin; the force of the pin is measured.",
        mjcf=_PINNED,
        measure=_reaction_at_rest,
        truth=_weight,
        unit="N",
        source="Goldstein, section 1.4 (forces of constraint)",
        relative=True,
        expected={
            "motrix *": refused(),
            "pybullet:engine own": refused(),
            "*": exact(1e-8),
        },
        timesteps=_FEW_TIMESTEPS,
        rounding=1e-8,
    ),
    Case(
        name="reaction-moving",
        group="joints",
        description="A body swings on a pin; the largest force of the pin is measured.",
        mjcf=_PINNED,
        measure=_reaction_moving,
        truth=moving_truth,
        unit="N",
        source="Goldstein, section 2.4 (forces of constraint from the motion)",
        relative=True,
        expected={
            "mujoco RK4": bounded(1.5e-4, "engine's own"),
            "mujoco implicit": bounded(1.2e-4, "engine's own"),
            "mujoco implicitfast": bounded(1.2e-4, "engine's own"),
            "pybullet implicitfast": bounded(1.2e-4, "computed by our backend"),
            "pybullet *": bounded(4.3e-4, "computed by our backend"),
            "motrix *": refused(),
            "pybullet:engine own": refused(),
            "*": bounded(4.3e-4, "engine's own"),
        },
        timesteps=_TIMESTEPS,
    ),
    Case(
        name="pinned-energy",
        group="joints",
        description="A body swings on a pin for 1 s; the largest change of its energy is measured.",
        mjcf=_PINNED,
        measure=_pinned_energy,
        truth=zero,
        unit="",
        source="Landau and Lifshitz, section 6 (energy is conserved)",
        expected={
            "mujoco RK4": bounded(0.0025, "engine's own"),
            "pybullet *": converges(0.7, 0.0217, "computed by our backend"),
            "motrix *": converges(0.55, 0.0246, "engine's own", INVERSE_INERTIA),
            "pybullet:engine own": refused(),
            "*": converges(0.7, 0.0217, "engine's own"),
        },
        timesteps=_TIMESTEPS,
    ),
    Case(
        name="weld-payload",
        group="joints",
        description="90 kg are welded to a carriage of 10 kg; how far they are from their place "
        "is measured.",
        mjcf=_PAYLOAD,
        measure=_weld_error,
        truth=zero,
        unit="m",
        source="Goldstein, section 1.3 (holonomic constraints)",
        expected={
            "pybullet *": bounded(0.00197, "computed by our backend"),
            "motrix *": bounded(8.4e-4, "engine's own", IMPLICIT_SERVO),
            "pybullet:engine own": refused(),
            "*": bounded(0.00197, "engine's own"),
        },
        timesteps=_FEW_TIMESTEPS,
    ),
    Case(
        name="weld-droop",
        group="joints",
        description="90 kg are welded to a carriage that a servo holds; how far the carriage "
        "sinks is measured.",
        mjcf=_PAYLOAD,
        measure=_payload_droop,
        truth=_payload_truth,
        unit="m",
        source="Siciliano, section 8.5.1 (PD control without compensation of gravity)",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": refused(),
            "*": exact(1e-6),
        },
        timesteps=_FEW_TIMESTEPS,
        rounding=1e-6,
    ),
    Case(
        name="weld-loop",
        group="joints",
        description="Two links lean on each other, their tips welded; how far they sink is "
        "measured.",
        mjcf=_LEANING,
        measure=_leaning_error,
        truth=zero,
        unit="rad",
        source="Goldstein, section 1.3 (holonomic constraints)",
        expected={
            "pybullet *": bounded(9e-4, "computed by our backend"),
            "motrix *": bounded(7.4e-4, "engine's own", INVERSE_INERTIA),
            "pybullet:engine own": refused(),
            "*": bounded(9e-4, "engine's own"),
        },
        timesteps=_FEW_TIMESTEPS,
    ),
)
