"""Cases of bodies that turn: thrown, tumbling, linked in the air.

Sources: Landau, Lifshitz: Mechanics, 3rd ed. (1976); Goldstein, Poole, Safko: Classical Mechanics,
3rd ed. (2002).
"""

from __future__ import annotations

import math

import numpy as np

from ...interface import Data
from ...interface.records import Array
from ...rotations import matrix_from_quat, rotation
from .case import NO_MOTION, Case, bounded, converges, exact, wrong
from .known_causes import INSTABILITY, QUATERNION
from .run import Run, largest_deviation, zero, zero_crossings

# A body whose origin is 0.3 m off its centre of mass, thrown and spinning about the vertical.

_OFF_CENTRE = (
    '<worldbody><body name="body"><freejoint/><inertial pos="0.3 0 0" mass="2" '
    'diaginertia="0.1 0.1 0.1"/></body></worldbody>'
)
_OFFSET = np.array([0.3, 0.0, 0.0])  # [m]
_SPIN = np.array([0.0, 0.0, 10.0])  # [rad/s]
_THROW = np.array([1.0, 0.0, 5.0])  # [m/s]


def _drift_of_centre(run: Run) -> float:
    """Return how far the centre of mass is from its straight line, seen from above [m]."""
    data = run.data
    data.qvel[:3], data.qvel[3:] = _THROW, _SPIN
    time = run.advance(1.0)
    centre = data.qpos[:3] + matrix_from_quat(data.qpos[3:]) @ _OFFSET
    straight = _OFFSET + (_THROW + np.cross(_SPIN, _OFFSET)) * time
    return float(np.hypot(*(centre - straight)[:2]))


def _spun_angle(run: Run) -> float:
    """Return how far it turned in 1 s, of which a whole turn is known [rad]."""
    data = run.data
    data.qvel[:3], data.qvel[3:] = _THROW, _SPIN
    expected = _turned(run.advance(1.0))
    angle = 2.0 * math.atan2(data.qpos[6], data.qpos[3])
    return expected + math.remainder(angle - expected, 2.0 * math.pi)


def _turned(time: float = 1.0) -> float:
    return 10.0 * time


# A body that tumbles about its middle axis, without forces.

_TUMBLING = (
    '<worldbody><body name="body"><freejoint/><inertial pos="0 0 0" mass="1" '
    'diaginertia="1 2 3"/></body></worldbody>'
)
_INERTIA = np.array([1.0, 2.0, 3.0])  # [kg m²]
_TUMBLE = np.array([0.01, 5.0, 0.01])  # [rad/s]


def _tumble(run: Run) -> Array:
    """Return the angular velocity in body axes in the last 4 of 20 s, (n, 3) [rad/s]."""
    run.data.qvel[3:] = _TUMBLE
    run.advance(16.0)
    return run.sample(4.0, _angular_velocity).values


def _angular_velocity(data: Data) -> Array:
    return np.array(data.qvel[3:6])


def _energy_of_tumbling(run: Run) -> float:
    rates = _tumble(run)
    return largest_deviation(rates**2 @ _INERTIA, float(_TUMBLE**2 @ _INERTIA))


def _momentum_of_tumbling(run: Run) -> float:
    sizes = np.linalg.norm(_tumble(run) * _INERTIA, axis=1)
    return largest_deviation(sizes, float(np.linalg.norm(_TUMBLE * _INERTIA)))


def _middle_rate(data: Data) -> float:
    return float(data.qvel[4])


def _flip_time(run: Run) -> float:
    """Return the time between two flips of the body [s]."""
    run.data.qvel[3:] = _TUMBLE
    samples = run.sample(9.0, _middle_rate)
    times = np.sort(np.concatenate([zero_crossings(samples, True), zero_crossings(samples, False)]))
    return float(times[1] - times[0]) if len(times) > 1 else math.inf


def flip_truth() -> float:
    """Return 2 K(k²) / λ, half a period of Euler's equations [s] (Landau, Lifshitz, (37.12))."""
    squared = float((_INERTIA * _TUMBLE) @ (_INERTIA * _TUMBLE))
    doubled = float(_INERTIA @ _TUMBLE**2)
    low, middle, high = _INERTIA.tolist()
    if squared < doubled * middle:
        low, high = high, low
    rate = (high - middle) * (squared - doubled * low) / (low * middle * high)
    modulus = (middle - low) * (doubled * high - squared)
    modulus /= (high - middle) * (squared - doubled * low)
    return 2.0 * _complete_integral(modulus) / math.sqrt(rate)


def _complete_integral(parameter: float) -> float:
    """Return K of a parameter k², by the arithmetic-geometric mean."""
    arithmetic, geometric = 1.0, math.sqrt(1.0 - parameter)
    for _ in range(10):
        both = arithmetic * geometric
        arithmetic, geometric = (arithmetic + geometric) / 2.0, math.sqrt(both)
    return math.pi / (2.0 * arithmetic)


# A free body with an axis of symmetry: its angular velocity turns about that axis at (C/A - 1) s.

_SYMMETRIC = (
    '<worldbody><body name="body"><freejoint/><inertial pos="0 0 0" mass="1" '
    'diaginertia="1 1 1.5"/></body></worldbody>'
)


def _turned_rate(run: Run) -> float:
    """Return by which angle the angular velocity turned about the axis in 1 s [rad]."""
    run.data.qvel[3:] = [0.5, 0.0, 4.0]
    run.advance(1.0)
    first, second = run.data.qvel[3:5]
    return math.atan2(second, first)


def _symmetric_truth(time: float = 1.0) -> float:
    return (1.5 / 1.0 - 1.0) * 4.0 * time


# Two bodies on a hinge in the air, without gravity.

_CHAIN = (
    '<worldbody><body name="first"><freejoint/><inertial pos="0.1 0 0" mass="2" '
    'diaginertia="0.02 0.03 0.04"/><body name="second" pos="0.4 0 0">'
    '<joint name="hinge" axis="0 1 0"/><inertial pos="0.3 0 0.1" mass="1" '
    'diaginertia="0.01 0.02 0.02"/></body></body></worldbody>'
    '<actuator><motor name="hinge" joint="hinge"/></actuator>'
)
_PLACES = np.array([[0.1, 0.0, 0.0], [0.3, 0.0, 0.1]])  # of the centres, each in its body [m]
_JOINT = np.array([0.4, 0.0, 0.0])
_MASSES = np.array([2.0, 1.0])
_INERTIAS = (np.diag([0.02, 0.03, 0.04]), np.diag([0.01, 0.02, 0.02]))
_HINGE_AXIS = np.array([0.0, 1.0, 0.0])


def chain_momenta(qpos: Array, qvel: Array) -> tuple[Array, Array]:
    """Return the linear momentum (3,) [kg m/s], and the angular about the origin (3,) [kg m²/s].

    Args:
        qpos: (8,) Of the free body [m, wxyz] and the hinge [rad].
        qvel: (7,) In MuJoCo's conventions.
    """
    first = matrix_from_quat(qpos[3:7])
    second = first @ rotation(_HINGE_AXIS, float(qpos[7]))
    rates = (first @ qvel[3:6], first @ qvel[3:6] + first @ _HINGE_AXIS * qvel[6])
    hinge = qpos[:3] + first @ _JOINT
    hinge_velocity = qvel[:3] + np.cross(rates[0], first @ _JOINT)
    origins = ((qpos[:3], qvel[:3], first), (hinge, hinge_velocity, second))
    linear, angular = np.zeros(3), np.zeros(3)
    for k, (origin, velocity, turned) in enumerate(origins):
        arm = turned @ _PLACES[k]
        momentum = _MASSES[k] * (velocity + np.cross(rates[k], arm))
        linear += momentum
        angular += np.cross(origin + arm, momentum)
        angular += turned @ _INERTIAS[k] @ turned.T @ rates[k]
    return linear, angular


def _chain_change(run: Run) -> tuple[float, float]:
    """Return by how much both momenta change in 1 s while a motor bends the chain, as ratios."""
    data = run.data
    data.qvel[:] = [0.3, -0.2, 0.5, 0.4, -0.6, 1.0, 2.0]
    data.ctrl[0] = 0.1
    before = chain_momenta(data.qpos, data.qvel)
    run.advance(1.0)
    after = chain_momenta(data.qpos, data.qvel)
    changes: list[float] = []
    for old, new in zip(before, after, strict=True):
        changes.append(float(np.linalg.norm(new - old) / np.linalg.norm(old)))
    return changes[0], changes[1]


def _linear_change(run: Run) -> float:
    return _chain_change(run)[0]


def _angular_change(run: Run) -> float:
    return _chain_change(run)[1]


CASES: tuple[Case, ...] = (
    Case(
        name="thrown-off-centre",
        group="motion",
        description="A spinning body is thrown whose origin is 0.3 m off its centre of mass; how "
        "far that leaves its straight line, seen from above, is measured.",
        mjcf=_OFF_CENTRE,
        measure=_drift_of_centre,
        truth=zero,
        unit="m",
        source="Goldstein, section 1.2 (the centre of mass moves as a point)",
        expected={
            "RK4": converges(4.0, 6.6e-9),
            "pybullet *": exact(),
            "motrix *": converges(1.0, 0.0754, "engine's own"),
            "pybullet:engine own": wrong(0.298, "engine's own"),
            "*": converges(1.0, 0.0752, "engine's own"),
        },
        rounding=1e-11,
    ),
    Case(
        name="thrown-spin",
        group="motion",
        description="The same body spins about the vertical; its angle after 1 s is measured.",
        mjcf=_OFF_CENTRE,
        measure=_spun_angle,
        truth=_turned,
        truth_after=_turned,
        unit="rad",
        source="Goldstein, section 5.6",
        expected={
            "motrix *": converges(2.0, 0.0021, note=QUATERNION),
            "pybullet:engine own": wrong(1.75, "engine's own"),
            "*": exact(),
        },
    ),
    Case(
        name="tumbling-energy",
        group="motion",
        description="A body tumbles for 20 s without forces; the change of its energy is measured.",
        mjcf=_TUMBLING,
        measure=_energy_of_tumbling,
        truth=zero,
        unit="",
        source="Landau and Lifshitz, section 37",
        gravity=(0.0, 0.0, 0.0),
        expected={
            "RK4": exact(),
            "motrix *": converges(1.0, 0.126),
            "pybullet:engine own": wrong(0.99, "engine's own"),
            "*": converges(1.0, 0.126),
        },
    ),
    Case(
        name="tumbling-momentum",
        group="motion",
        description="A body tumbles for 20 s without forces; the change of the size of its "
        "angular momentum is measured.",
        mjcf=_TUMBLING,
        measure=_momentum_of_tumbling,
        truth=zero,
        unit="",
        source="Landau and Lifshitz, section 37",
        gravity=(0.0, 0.0, 0.0),
        expected={
            "RK4": exact(),
            "motrix *": converges(1.0, 0.0614),
            "pybullet:engine own": wrong(0.89, "engine's own"),
            "*": converges(1.0, 0.0615),
        },
    ),
    Case(
        name="tumbling-flip",
        group="motion",
        description="A body tumbles about its middle axis; the time between two flips is measured.",
        mjcf=_TUMBLING,
        measure=_flip_time,
        truth=flip_truth,
        unit="s",
        source="Landau and Lifshitz, section 37, equation 37.12",
        relative=True,
        gravity=(0.0, 0.0, 0.0),
        expected={
            "RK4": exact(),
            "motrix *": bounded(0.02, "single precision", INSTABILITY),
            "pybullet:engine own": NO_MOTION,
            "*": converges(1.0, 6.7e-4),
        },
    ),
    Case(
        name="symmetric-body",
        group="motion",
        description="A symmetric body turns without forces; by how much its angular velocity "
        "turns about its axis in 1 s is measured.",
        mjcf=_SYMMETRIC,
        measure=_turned_rate,
        truth=_symmetric_truth,
        truth_after=_symmetric_truth,
        unit="rad",
        source="Landau and Lifshitz, section 36",
        gravity=(0.0, 0.0, 0.0),
        expected={
            "RK4": exact(),
            "motrix *": converges(2.0, 6.7e-5),
            "pybullet:engine own": wrong(2.0, "engine's own"),
            "*": converges(2.0, 6.7e-5),
        },
    ),
    Case(
        name="chain-momentum",
        group="motion",
        description="A motor bends two bodies in the air; the change of their momentum in 1 s is "
        "measured.",
        mjcf=_CHAIN,
        measure=_linear_change,
        truth=zero,
        unit="",
        source="Landau and Lifshitz, section 7",
        gravity=(0.0, 0.0, 0.0),
        expected={
            "mujoco==3.3.7 RK4": converges(2.0, 4.9e-6, "engine's own"),
            "RK4": exact(2e-9),
            "implicit": converges(1.0, 0.0101),
            "motrix *": converges(1.0, 0.0075),
            "pybullet:engine own": wrong(0.065, "engine's own"),
            "*": converges(1.0, 0.0075),
        },
        rounding=2e-9,
    ),
    Case(
        name="chain-angular-momentum",
        group="motion",
        description="A motor bends two bodies in the air; the change of their angular momentum "
        "in 1 s is measured.",
        mjcf=_CHAIN,
        measure=_angular_change,
        truth=zero,
        unit="",
        source="Landau and Lifshitz, section 9",
        gravity=(0.0, 0.0, 0.0),
        expected={
            "mujoco==3.3.7 RK4": converges(2.0, 1.63e-5, "engine's own"),
            "RK4": exact(),
            "implicit": converges(1.0, 0.0254),
            "motrix *": converges(1.0, 0.0245),
            "pybullet:engine own": wrong(0.117, "engine's own"),
            "*": converges(1.0, 0.0245),
        },
    ),
)
