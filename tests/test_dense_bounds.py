"""Forces between bounds: what `backends.dense.pivoted` returns, by what its result must satisfy."""

from __future__ import annotations

import numpy as np
import pytest

from statemachine.backends.dense import pivoted

NO_BOUND = np.full(2, 1e30)


def test_without_bounds_it_is_the_solution() -> None:
    matrix, right = np.array([[4.0, 1], [1, 3]]), np.array([1.0, 2])
    force = pivoted(matrix, right, -NO_BOUND, NO_BOUND, np.zeros(2))
    np.testing.assert_allclose(force, [1 / 11, 7 / 11], rtol=1e-12)


@pytest.mark.parametrize(
    ("right", "least", "most", "expected"),
    [
        ([-2.0, 4.0], [0.0, 0.0], [9.0, 9.0], [0.0, 2.0]),  # the first would pull
        ([4.0, -2.0], [0.0, 0.0], [9.0, 9.0], [2.0, 0.0]),
        ([40.0, 4.0], [0.0, 0.0], [9.0, 9.0], [9.0, -5 / 2 + 0.0]),
        ([9.0, 9.0], [-1.0, -1.0], [1.0, 1.0], [1.0, 1.0]),
        ([-9.0, -9.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, -1.0]),
        ([9.0, 9.0], [2.0, 2.0], [2.0, 2.0], [2.0, 2.0]),
    ],
)
def test_a_row_at_a_bound_misses_to_its_side_alone(
    right: list[float], least: list[float], most: list[float], expected: list[float]
) -> None:
    matrix = np.array([[2.0, 1], [1, 2]])
    bounds = np.array(least), np.array(most)
    force = pivoted(matrix, np.array(right), *bounds, np.zeros(2))
    if expected[1] < least[1]:
        expected = [expected[0], least[1]]
    np.testing.assert_allclose(force, expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("start", [-1.0, 0.0, 5.0])
def test_what_is_free_solves_its_row_and_what_is_not_cannot_get_better(
    seed: int, start: float
) -> None:
    random = np.random.default_rng(seed)
    root = random.normal(size=(7, 7))
    matrix, right = root @ root.T + np.eye(7), 4 * random.normal(size=7)
    least, most = -random.uniform(0, 1, 7), random.uniform(0, 1, 7)
    least[:2] = 0.0
    force = pivoted(matrix, right, least, most, np.full(7, start))
    miss = matrix @ force - right
    assert ((least <= force) & (force <= most)).all()
    free = (force > least) & (force < most)
    np.testing.assert_allclose(miss[free], 0.0, atol=1e-9)
    assert (miss[force <= least] >= -1e-9).all()
    assert (miss[force >= most] <= 1e-9).all()


@pytest.mark.parametrize(("size", "seed"), [(3, 1007), (5, 441), (8, 63)])
def test_where_pivots_go_in_circles_sweeps_end_it(size: int, seed: int) -> None:
    # Of some thousand such matrices, those on which changing all rows at once goes round.
    random = np.random.default_rng(seed)
    root = random.integers(-4, 5, (size, size)).astype(float)
    matrix, right = root @ root.T + np.eye(size), random.integers(-9, 10, size).astype(float)
    force = pivoted(matrix, right, np.zeros(size), np.full(size, 1e9), np.zeros(size))
    assert np.abs(np.minimum(force, matrix @ force - right)).max() < 1e-6
