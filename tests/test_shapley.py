"""Shapley values of causes: exact of all sets, and with an error of drawn orders."""

from __future__ import annotations

import pytest

from statemachine.lab.why.shapley import shapley

NAMES = [f"cause {k}" for k in range(10)]


def value_of_many(equalized: frozenset[str]) -> float:
    """Return a gap that falls with the square of how many causes are equalized."""
    return max(0.0, 1.0 - (len(equalized) / 10) ** 2)


def test_drawn_orders_have_the_value_within_four_standard_errors() -> None:
    found = shapley(NAMES, value_of_many, 1.0, sets=400, seed=3)
    assert found.method == "drawn orders"
    for name in NAMES:
        share = found.share[name]
        assert share is not None
        assert abs(share - 1 / 10) <= 4 * found.error[name] + 1e-12


def test_the_same_seed_draws_the_same_orders() -> None:
    first, second = (shapley(NAMES, value_of_many, 1.0, sets=400, seed=3) for _ in range(2))
    assert first == second


def test_a_set_that_cannot_be_run_is_told_and_only_orders_without_it_count() -> None:
    found = shapley(["a", "b"], lambda s: None if s == {"a"} else 1.0 - 0.4 * len(s), 1.0)
    assert (found.failures, found.alone["a"]) == ((frozenset({"a"}),), None)
    assert found.share == pytest.approx({"a": 0.4, "b": 0.4})
