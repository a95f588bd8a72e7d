"""Least squares within bounds: it ends at minima that are known, and asks for few Jacobians."""

from __future__ import annotations

import numpy as np
import pytest

from statemachine.interface import Array
from statemachine.lab.identification.trust_region import BoundedLeastSquares, Effort, minimum

optimize = pytest.importorskip("scipy.optimize")
FREE = np.full(2, np.inf)


def rosenbrock(values: Array) -> Array:
    return np.array([10.0 * (values[1] - values[0] ** 2), 1.0 - values[0]])


def slopes(values: Array) -> Array:
    return np.array([[-20.0 * values[0], 10.0], [-1.0, 0.0]])


def valley(low: Array = -FREE, high: Array = FREE) -> BoundedLeastSquares:
    """Return Rosenbrock's function, whose minimum is 0 at (1, 1)."""
    return BoundedLeastSquares(rosenbrock, slopes, low, high, np.ones(2))


@pytest.mark.parametrize("steps", [1, 3])
def test_a_curved_valley_is_followed_to_its_end(steps):
    end = minimum(valley(), np.array([-1.2, 1.0]), Effort(200, 1e-8, steps))
    assert end.values == pytest.approx([1.0, 1.0], abs=1e-3)
    assert end.residuals == pytest.approx(rosenbrock(end.values))


def test_within_bounds_it_ends_where_scipy_does():
    low, high = np.array([-2.0, -2.0]), np.array([0.5, 2.0])
    start = np.array([-1.2, 1.0])
    expected = optimize.least_squares(rosenbrock, start, slopes, bounds=(low, high)).x
    end = minimum(valley(low, high), start, Effort(200, 1e-10, 1))
    assert end.values == pytest.approx(expected, abs=1e-3)
    assert end.values[0] == pytest.approx(0.5)


def test_no_point_is_asked_for_beyond_the_bounds():
    low, high = np.array([-1.5, 0.2]), np.array([0.5, 1.1])
    asked: list[Array] = []

    def residuals(values: Array) -> Array:
        asked.append(values)
        return rosenbrock(values)

    problem = BoundedLeastSquares(residuals, slopes, low, high, np.ones(2))
    minimum(problem, np.array([-9.0, 1.0]), Effort(50, 1e-8, 2))
    points = np.array(asked)
    assert len(points) > 3
    assert (points >= low).all()
    assert (points <= high).all()


def test_of_a_linear_problem_one_jacobian_is_enough():
    random = np.random.default_rng(0)
    matrix, target = random.normal(size=(40, 6)), random.normal(size=40)
    bound = np.full(6, np.inf)
    problem = BoundedLeastSquares(
        lambda values: matrix @ values - target, lambda _: matrix, -bound, bound, np.ones(6)
    )
    end = minimum(problem, np.full(6, 0.1), Effort(20, 1e-6, 3))
    assert end.values == pytest.approx(np.linalg.lstsq(matrix, target, rcond=None)[0])
    assert end.jacobians == 1


def test_a_jacobian_that_is_carried_on_saves_others():
    efforts = [
        minimum(valley(), np.array([-1.2, 1.0]), Effort(200, 1e-8, steps)) for steps in (1, 3)
    ]
    assert efforts[1].jacobians < efforts[0].jacobians


def test_it_ends_after_the_runs_that_it_is_given():
    end = minimum(valley(), np.array([-1.2, 1.0]), Effort(5, 1e-12, 1))
    assert end.runs == 5


def test_a_residual_that_jumps_is_left_again():
    # As where a simulation diverges: the step there is not taken, and shorter ones are.
    def residuals(values: Array) -> Array:
        return rosenbrock(values) if values[1] < 1.3 else np.full(2, 1e4)

    problem = BoundedLeastSquares(residuals, slopes, -FREE, FREE, np.ones(2))
    end = minimum(problem, np.array([-1.1, 1.2]), Effort(200, 1e-8, 1))
    assert end.values == pytest.approx([1.0, 1.0], abs=1e-3)
