"""Cases of joints that are driven, held, braked and coupled.

Sources: Landau, Lifshitz: Mechanics, 3rd ed. (1976); Goldstein, Poole, Safko: Classical Mechanics,
3rd ed. (2002); Siciliano, Sciavicco, Villani, Oriolo: Robotics (2009); Spong, Hutchinson,
Vidyasagar: Robot Modeling and Control (2006).
"""

from __future__ import annotations

import math

from ...interface import Data
from .case import FEW_TIMESTEPS, GRAVITY, Case, bounded, converges, exact, refused, rounded, wrong
from .known_causes import DRY_FRICTION, INVERSE_INERTIA
from .run import Run, zero

_BODY = (
    '<worldbody><body name="body"><joint name="joint" {joint}/>'
    '<inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/></body></worldbody>'
)
_ALONG_X = 'type="slide" axis="1 0 0"'
_UPWARDS = 'type="slide" axis="0 0 1"'
_UNIT = "1 1 1"  # moments of inertia that do not count [kg m²]
_MOTOR = '<actuator><motor name="motor" joint="joint"/></actuator>'


def _position(data: Data) -> float:
    return float(data.qpos[0])


# A servo that carries 2 kg.

_SERVO = _BODY.format(joint=f'{_UPWARDS} damping="1"', mass=2, inertia=_UNIT) + (
    '<actuator><position name="servo" joint="joint" kp="500" kv="20"/></actuator>'
)


def _droop(run: Run) -> float:
    run.advance(5.0)
    return float(run.data.qpos[0])


def _droop_truth() -> float:
    return -2.0 * GRAVITY / 500.0


# A critically damped servo of 1 kg: kp = 100, kv = 20.

_CRITICAL = _BODY.format(joint=_ALONG_X, mass=1, inertia=_UNIT) + (
    '<actuator><position name="servo" joint="joint" kp="100" kv="20"/></actuator>'
)


def _step_response(run: Run) -> float:
    run.data.ctrl[0] = 1.0
    run.advance(0.2)
    return float(run.data.qpos[0])


def _critical(time: float = 0.2) -> float:
    """Return 1 - (1 + w t) e^(-w t) at a time [s], w = 10 [m]."""
    return 1.0 - (1.0 + 10.0 * time) * math.exp(-10.0 * time)


# A servo far from its target, whose force is limited to 3 N: it accelerates evenly.

_WEAK = _BODY.format(joint=_ALONG_X, mass=1.5, inertia=_UNIT) + (
    '<actuator><position name="servo" joint="joint" kp="1000" kv="1" forcerange="-3 3"/></actuator>'
)


def _speed_at_limit(run: Run) -> float:
    run.data.ctrl[0] = 100.0
    run.advance(1.0)
    return float(run.data.qvel[0])


def _even_speed(time: float = 1.0) -> float:
    return 3.0 / 1.5 * time


# A motor whose speed is limited by the damping of its joint: torque over damping.

_FAST = (
    _BODY.format(joint='axis="0 0 1" damping="0.5"', mass=1, inertia="0.01 0.01 0.01")
    + '<actuator><motor name="motor" joint="joint" ctrllimited="true" ctrlrange="-1 1"/></actuator>'
)


def _speed_of_motor(run: Run) -> float:
    """Return the speed under a command that is beyond the range [rad/s]."""
    run.data.ctrl[0] = 5.0
    run.advance(2.0)
    return float(run.data.qvel[0])


def _speed_limit() -> float:
    return 1.0 / 0.5


# Dry friction of 1 N on 1 kg.

_DRY = _BODY.format(joint=f'{_ALONG_X} frictionloss="1"', mass=1, inertia=_UNIT) + _MOTOR


def _creep(run: Run) -> float:
    """Return how far nine tenths of the friction push the body in the second of 2 s [m]."""
    run.data.ctrl[0] = 0.9
    run.advance(1.0)
    before = float(run.data.qpos[0])
    run.advance(1.0)
    return float(run.data.qpos[0]) - before


def _slip(run: Run) -> float:
    """Return the acceleration under eleven tenths of the friction, from the second s [m/s²]."""
    run.data.ctrl[0] = 1.1
    run.advance(1.0)
    before = float(run.data.qvel[0])
    time = run.advance(1.0)
    return (float(run.data.qvel[0]) - before) / time


def _slip_truth() -> float:
    return 1.1 - 1.0


def _braking(run: Run) -> float:
    """Return the distance to rest from 1 m/s [m]."""
    run.data.qvel[0] = 1.0
    run.advance(2.0)
    return float(run.data.qpos[0])


def _braking_truth() -> float:
    return 1.0**2 / (2.0 * 1.0)


# A rotor of 0.05 kg m² on the axis of a link of 0.15 kg m².

_ARMATURE = (
    _BODY.format(joint='axis="0 0 1" armature="0.05"', mass=1, inertia="0.15 0.15 0.15") + _MOTOR
)


def _speed_of_rotor(run: Run) -> float:
    run.data.ctrl[0] = 0.4
    run.advance(1.0)
    return float(run.data.qvel[0])


def _rotor_truth(time: float = 1.0) -> float:
    return 0.4 * time / (0.15 + 0.05)


# A joint that turns three times as far as another: its inertia counts nine times.

_TWO = (
    '<worldbody><body name="first"><joint name="joint" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>'
    '<body name="second" pos="1 0 0"><joint name="follower" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/></body></worldbody>'
    '<equality><joint joint1="follower" joint2="joint" polycoef="0 3 0 0 0"/></equality>'
)
_MIMIC = _TWO + _MOTOR


def _speed_of_geared(run: Run) -> float:
    """Return the speed of the first joint after 0.5 s of 0.2 N m [rad/s]."""
    run.data.ctrl[0] = 0.2
    run.advance(0.5)
    return float(run.data.qvel[0])


def _geared_truth(time: float = 0.5) -> float:
    return 0.2 * time / (0.1 + 3.0**2 * 0.02)


def _mimic_error(run: Run) -> float:
    """Return how far the follower is from three times the first, after 1 s of 0.2 N m [rad]."""
    run.data.ctrl[0] = 0.2
    run.advance(1.0)
    first, follower = run.data.qpos
    return float(follower - 3.0 * first)


CASES: tuple[Case, ...] = (
    Case(
        name="servo-droop",
        group="joints",
        description="A servo carries 2 kg; how far it sinks below its target is measured.",
        mjcf=_SERVO,
        measure=_droop,
        truth=_droop_truth,
        unit="m",
        source="Siciliano, section 8.5.1 (PD control without compensation of gravity)",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": exact(5e-9),
        },
        rounding=5e-9,
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="servo-step",
        group="joints",
        description="A critically damped servo gets a new target; its place after 0.2 s is "
        "measured.",
        mjcf=_CRITICAL,
        measure=_step_response,
        truth=_critical,
        truth_after=_critical,
        unit="m",
        source="Landau and Lifshitz, section 25",
        expected={
            "RK4": converges(4.0, 3.1e-8),
            "Euler": converges(1.0, 0.0112),
            "discrete": converges(1.0, 0.0067),
            "motrix *": converges(1.0, 0.0024),
            "pybullet:engine own": wrong(0.41, "engine's own"),
            "*": converges(1.0, 0.0024),
        },
        rounding=1e-11,
    ),
    Case(
        name="effort-limit",
        group="joints",
        description="A servo far from its target gives its largest force; the speed after 1 s is "
        "measured.",
        mjcf=_WEAK,
        measure=_speed_at_limit,
        truth=_even_speed,
        truth_after=_even_speed,
        unit="m/s",
        source="Goldstein, section 1.1",
        relative=True,
        expected={
            "mujoco==3.3.7 implicit": converges(1.0, 0.0034, "engine's own"),
            "mujoco==3.3.7 implicitfast": converges(1.0, 0.0034, "engine's own"),
            "motrix *": rounded(),
            "pybullet:engine own": wrong(18.5, "engine's own"),
            "*": exact(),
        },
    ),
    Case(
        name="speed-limit",
        group="joints",
        description="A motor gets a command beyond its range and turns against damping; its last "
        "speed is measured.",
        mjcf=_FAST,
        measure=_speed_of_motor,
        truth=_speed_limit,
        unit="rad/s",
        source="Spong, section 6.1 (the speed of a motor without load)",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="dry-friction-below",
        group="joints",
        description="Nine tenths of its dry friction push a joint; how far it creeps in 1 s is "
        "measured.",
        mjcf=_DRY,
        measure=_creep,
        truth=zero,
        unit="m",
        source="Coulomb's law; Popov: Contact Mechanics and Friction (2010), section 10.2",
        expected={
            "pybullet *": bounded(9.5e-4, "computed by our backend"),
            "motrix *": bounded(9e-4, "engine's own", DRY_FRICTION),
            "pybullet:engine own": exact(),
            "*": bounded(9.5e-4, "engine's own"),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="dry-friction-above",
        group="joints",
        description="Eleven tenths of its dry friction push a joint; its acceleration is measured.",
        mjcf=_DRY,
        measure=_slip,
        truth=_slip_truth,
        unit="m/s²",
        source="Coulomb's law; Popov: Contact Mechanics and Friction (2010), section 10.2",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="dry-friction-stop",
        group="joints",
        description="Dry friction stops a joint; the distance from 1 m/s to rest is measured.",
        mjcf=_DRY,
        measure=_braking,
        truth=_braking_truth,
        unit="m",
        source="Coulomb's law; Popov: Contact Mechanics and Friction (2010), section 10.2",
        relative=True,
        expected={
            "RK4": bounded(1.2e-4, "engine's own"),
            "motrix *": converges(1.0, 0.0049),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": converges(1.0, 0.005),
        },
    ),
    Case(
        name="armature",
        group="joints",
        description="A motor turns a link and its own rotor; the speed after 1 s is measured.",
        mjcf=_ARMATURE,
        measure=_speed_of_rotor,
        truth=_rotor_truth,
        truth_after=_rotor_truth,
        unit="rad/s",
        source="Siciliano, section 7.2.1 (inertia of the rotor)",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": wrong(1.0, "engine's own"),
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="reflected-inertia",
        group="joints",
        description="A joint turns another three times as far; its speed after 0.5 s is measured.",
        mjcf=_MIMIC,
        measure=_speed_of_geared,
        truth=_geared_truth,
        truth_after=_geared_truth,
        unit="rad/s",
        source="Siciliano, section 5.2.1 (gears multiply an inertia by the square)",
        relative=True,
        expected={
            "motrix *": rounded(),
            "pybullet:engine own": refused(),
            "*": exact(),
        },
        timesteps=FEW_TIMESTEPS,
    ),
    Case(
        name="mimic",
        group="joints",
        description="A joint turns another three times as far; how far that is off after 1 s is "
        "measured.",
        mjcf=_MIMIC,
        measure=_mimic_error,
        truth=zero,
        unit="rad",
        source="Goldstein, section 1.3 (holonomic constraints)",
        expected={
            "pybullet *": bounded(1.14e-4, "computed by our backend"),
            "motrix *": bounded(2.48e-4, "engine's own", INVERSE_INERTIA),
            "pybullet:engine own": refused(),
            "*": bounded(1.14e-4, "engine's own"),
        },
        timesteps=FEW_TIMESTEPS,
    ),
)
