"""Exact discrete truths of contact, a second way: by optimization, and by series."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import minimize, nnls

from statemachine.lab.validate import contact_impact
from statemachine.lab.validate.case import GRAVITY
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.contact_incline import FRICTION
from statemachine.lab.validate.contact_steps import (
    cone_forces,
    euler_step,
    on_spring,
    rk4_step,
    skid,
)
from statemachine.lab.validate.soft_contact import SoftContact

SOFT = SoftContact()
# Depth [m], its rate and the speed along the plane [m/s]: within the cone, on it, and leaving.
STATES = (
    (0.0004, 0.0, 0.0),
    (0.0004, 0.0, 0.5),
    (0.0002, 0.03, -0.2),
    (0.0008, -0.05, 0.01),
    (0.00001, -0.3, 0.4),
)
PULLS = (8.4, 5.0)  # towards the plane and along it [m/s²]


def forces_by_optimization(
    state: tuple[float, float, float], pulls: tuple[float, float]
) -> tuple[float, float]:
    """Return the forces per mass that minimize f (A + R) f / 2 - f (aref - a0) in the cone."""
    depth, sinking, speed = state
    if depth <= 0.0:
        return 0.0, 0.0
    d = SOFT.impedance(depth)
    regularized = 1.0 + (1.0 - d) / d
    asked = np.array(
        [
            SOFT.damping * sinking + SOFT.stiffness * d * depth + pulls[0],
            SOFT.damping * speed + pulls[1],
        ]
    )
    # In the directions of the two edges of the cone each force is not negative.
    edges = np.array([[1.0, 1.0], [FRICTION, -FRICTION]])
    shares, _ = nnls(math.sqrt(regularized) * edges, asked / math.sqrt(regularized))
    normal, tangential = edges @ shares
    return float(normal), float(tangential)


@pytest.mark.parametrize("state", STATES)
def test_forces_in_the_cone_are_those_of_least_squares(state: tuple[float, float, float]) -> None:
    expected = forces_by_optimization(state, PULLS)
    assert cone_forces(SOFT, FRICTION, state, PULLS) == pytest.approx(expected, abs=1e-9)


def test_forces_in_the_cone_are_those_of_a_general_optimizer() -> None:
    depth, sinking, speed = state = (0.0004, 0.01, 0.5)
    d = SOFT.impedance(depth)
    asked = (
        SOFT.damping * sinking + SOFT.stiffness * d * depth + PULLS[0],
        SOFT.damping * speed + PULLS[1],
    )

    def cost(forces: np.ndarray) -> float:
        return float(forces @ forces / d / 2.0 - forces @ np.array(asked))

    limits = [
        {"type": "ineq", "fun": lambda f: FRICTION * f[0] - f[1]},
        {"type": "ineq", "fun": lambda f: FRICTION * f[0] + f[1]},
    ]
    best = minimize(cost, [10.0, 0.0], constraints=limits, method="SLSQP", tol=1e-14)
    assert cone_forces(SOFT, FRICTION, state, PULLS) == pytest.approx(tuple(best.x), abs=1e-5)


@pytest.mark.parametrize("h", [0.005, 0.001])
def test_a_skid_is_the_sum_of_its_steps(h: float) -> None:
    depth = sinking = way = speed = 0.0
    for _ in range(round(0.1 / h)):
        normal, tangential = forces_by_optimization((depth, sinking, speed), PULLS)
        sinking += h * (PULLS[0] - normal)
        speed += h * (PULLS[1] - tangential)
        depth += h * sinking
        way += h * speed
    assert skid(SOFT, FRICTION, PULLS, 0.1)["Euler"](h) == pytest.approx(way, rel=1e-9)


@pytest.mark.parametrize("state", [(-0.01, -2.0), (-0.01, 2.0), (-0.001, 0.5), (-1e-6, 0.1)])
def test_push_of_a_spring_is_that_of_its_complementarity(state: tuple[float, float]) -> None:
    spring = contact_impact.SPRING
    d = spring.impedance
    place, speed = state
    # A negative solref is divided by d and d²; the force is no pull.
    asked = -spring.damping / d * speed - spring.stiffness / d**2 * d * place + GRAVITY
    (force,), _ = nnls(np.array([[1.0 / d]]), np.array([asked]))
    acceleration = on_spring(spring, GRAVITY)(place, speed)
    assert acceleration == pytest.approx(force - GRAVITY, rel=1e-12)


def test_steps_on_a_linear_spring_are_powers_of_their_matrices() -> None:
    stiffness, damping, h = 40.0, 0.7, 0.01
    place, speed = 0.3, -0.2
    start = np.array([place, speed])

    def of(at: float, rate: float) -> float:
        return -stiffness * at - damping * rate

    rates = np.array([[0.0, 1.0], [-stiffness, -damping]])
    series = np.eye(2)
    term = np.eye(2)
    for k in range(1, 5):
        term = term @ rates * h / k
        series = series + term
    assert rk4_step(of, place, speed, h) == pytest.approx(tuple(series @ start), rel=1e-12)
    assert series == pytest.approx(expm(rates * h), abs=1e-6)
    velocity_first = np.array([[1.0, h], [0.0, 1.0]]) @ (np.eye(2) + h * rates * [[0], [1]])
    assert euler_step(of, place, speed, h) == pytest.approx(
        tuple(velocity_first @ start), rel=1e-12
    )


@pytest.mark.parametrize("name", ["bounce", "collision-restitution", "sphere-skids"])
def test_an_exact_discrete_truth_of_contact_tends_to_the_truth(name: str) -> None:
    case = CASES[name]
    for discrete in case.discrete.values():
        coarse, fine = discrete(1e-3) - case.truth(), discrete(2e-5) - case.truth()
        assert abs(fine) < 0.1 * abs(coarse)
