"""Exact discrete truths of soft contacts: the steps that MuJoCo's constraint model prescribes.

A contact of one point has a constraint for its normal and, with friction, two for its tangents. For
a body that cannot turn, each feels the same inverse mass A, and its regularization is
R = (1 - d) / d · A; see MuJoCo's manual, chapter Computation, section Constraint model. The
forces that solve the step are then a closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from .case import Discrete, Integrator
from .soft_contact import SoftContact, Spring

_EULER: tuple[Integrator, ...] = ("Euler", "implicit", "implicitfast")  # alike without damping

# Acceleration [m/s²] of a place [m] and a speed [m/s].
Acceleration = Callable[[float, float], float]
# Place [m] and speed [m/s] after a step, of those before it and of its length [s].
Step = Callable[[Acceleration, float, float, float], tuple[float, float]]


def euler_step(of: Acceleration, place: float, speed: float, h: float) -> tuple[float, float]:
    """Return place and speed after a step [s] of semi-implicit Euler."""
    speed += h * of(place, speed)
    return place + h * speed, speed


def rk4_step(of: Acceleration, place: float, speed: float, h: float) -> tuple[float, float]:
    """Return place and speed after a step [s] of Runge and Kutta's method of order 4."""
    speeds, slopes = [speed], [of(place, speed)]
    for share in (0.5, 0.5, 1.0):
        stage = place + share * h * speeds[-1], speed + share * h * slopes[-1]
        speeds.append(stage[1])
        slopes.append(of(*stage))
    mean_speed = (speeds[0] + 2.0 * speeds[1] + 2.0 * speeds[2] + speeds[3]) / 6.0
    mean_slope = (slopes[0] + 2.0 * slopes[1] + 2.0 * slopes[2] + slopes[3]) / 6.0
    return place + h * mean_speed, speed + h * mean_slope


def on_spring(spring: Spring, gravity: float) -> Acceleration:
    """Return the acceleration of a body above a spring that cannot pull.

    Args:
        spring: What the contact is.
        gravity: Downwards [m/s²].
    """

    def acceleration(place: float, speed: float) -> float:
        if place >= 0.0:
            return -gravity
        rest = (1.0 - spring.impedance) * gravity
        in_contact = -rest - spring.damping * speed - spring.stiffness * place
        return max(in_contact, -gravity)

    return acceleration


def each_step(measure: Callable[[Step, float], float]) -> Discrete:
    """Return the discrete truths by integrator.

    Args:
        measure: Returns the number that is measured, given the step and its length [s].
    """
    truths: dict[Integrator, Callable[[float], float]] = {}
    for integrator in _EULER:
        truths[integrator] = lambda h: measure(euler_step, h)
    truths["RK4"] = lambda h: measure(rk4_step, h)
    return truths


def skid(
    contact: SoftContact, friction: float, pulls: tuple[float, float], time: float
) -> Discrete:
    """Return by integrator how far a body skids that cannot turn, from rest at the surface [m].

    Args:
        contact: Which is soft.
        friction: Of the elliptic cone.
        pulls: Accelerations towards the plane and along it [m/s²].
        time: Of the motion [s].
    """

    def way(h: float) -> float:
        depth = sinking = way = speed = 0.0
        for _ in range(round(time / h)):
            normal, tangential = cone_forces(contact, friction, (depth, sinking, speed), pulls)
            sinking += h * (pulls[0] - normal)
            speed += h * (pulls[1] - tangential)
            depth += h * sinking
            way += h * speed
        return way

    return dict.fromkeys(_EULER, way)


def cone_forces(
    contact: SoftContact,
    friction: float,
    state: tuple[float, float, float],
    pulls: tuple[float, float],
) -> tuple[float, float]:
    """Return the normal force, and the friction against the pull, per mass [m/s²].

    They minimize (A + R) (n² + t²) / 2 less what the reference accelerations ask for, within the
    cone t <= friction · n.

    Args:
        contact: Which is soft.
        friction: Of the cone.
        state: Depth [m], its rate [m/s], and the speed along the plane [m/s].
        pulls: Towards the plane and along it [m/s²].
    """
    depth, sinking, speed = state
    load, pull = pulls
    if depth <= 0.0:
        return 0.0, 0.0
    d = contact.impedance(depth)
    # 1 / (A + R) is d per mass; the reference acceleration is -b v - k d r.
    normal = d * (load + contact.damping * sinking + contact.stiffness * d * depth)
    tangential = d * (pull + contact.damping * speed)
    if normal > 0.0 and abs(tangential) <= friction * normal:
        return normal, tangential
    sign = math.copysign(1.0, tangential)
    on_cone = max((normal + friction * sign * tangential) / (1.0 + friction**2), 0.0)
    return on_cone, friction * sign * on_cone
