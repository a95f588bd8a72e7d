"""Which of several sides is odd, from how far each two are apart: a table, and a count."""

from __future__ import annotations

from itertools import combinations
from math import inf

import numpy as np
import pytest

from statemachine.lab.compare.odd_side import ODD, OddSide, SideDistance, groups_of, odd_side

Gaps = dict[tuple[int, int], float]


def distances(gaps: Gaps, alike: tuple[tuple[int, int], ...] = ()) -> list[SideDistance]:
    """Return the distances of sides; those of `alike` are not told apart."""
    return [SideDistance(*pair, gap, pair not in alike) for pair, gap in gaps.items()]


FOUR: Gaps = {(0, 1): 0.1, (0, 2): 0.2, (1, 2): 0.1, (0, 3): 3.0, (1, 3): 2.9, (2, 3): 2.8}


@pytest.mark.parametrize(
    ("gaps", "alike", "odd"),
    [
        ({(0, 1): 1.0, (0, 2): 1.05, (1, 2): 0.05}, (), OddSide(0, 1, 1.0, 0.05)),
        ({(0, 1): 1.05, (0, 2): 0.05, (1, 2): 1.0}, (), OddSide(1, 2, 1.0, 0.05)),
        ({(0, 1): 0.0, (0, 2): 1.0, (1, 2): 1.0}, ((0, 1),), OddSide(2, 0, 1.0, 0.0)),
        ({(0, 1): ODD, (0, 2): ODD, (1, 2): 1.0}, (), OddSide(0, 1, ODD, 1.0)),
        ({(0, 1): 0.99 * ODD, (0, 2): ODD, (1, 2): 1.0}, (), None),
        ({(0, 1): 1.0, (0, 2): 1.05, (1, 2): 0.05}, ((0, 1),), None),  # it may be chance
        ({(0, 1): 0.0, (0, 2): 0.0, (1, 2): 0.0}, ((0, 1), (0, 2), (1, 2)), None),
        ({(0, 1): inf, (0, 2): inf, (1, 2): 0.1}, (), OddSide(0, 1, inf, 0.1)),
        ({(0, 1): inf, (0, 2): inf, (1, 2): inf}, (), None),
        (FOUR, (), OddSide(3, 2, 2.8, 0.2)),
        ({**FOUR, (0, 1): 2.9, (1, 2): 2.9}, (), None),  # two that are far away are not odd
        ({(0, 1): 1.0}, (), None),
    ],
)
def test_the_odd_side(gaps: Gaps, alike: tuple[tuple[int, int], ...], odd: OddSide | None) -> None:
    assert odd_side(distances(gaps, alike)) == odd


@pytest.mark.parametrize(("spread", "ratio"), [(0.05, 20.0), (0.0, inf)])
def test_a_ratio_is_of_the_others(spread: float, ratio: float) -> None:
    assert OddSide(0, 1, 1.0, spread).ratio == pytest.approx(ratio)


@pytest.mark.parametrize(
    ("alike", "groups"),
    [
        ((), ((0,), (1,), (2,))),
        (((1, 2),), ((0,), (1, 2))),
        (((0, 1), (1, 2)), ((0, 1), (2,))),  # agreement is not transitive
        (((0, 1), (0, 2), (1, 2)), ((0, 1, 2),)),
    ],
)
def test_groups_have_no_two_sides_that_are_told_apart(
    alike: tuple[tuple[int, int], ...], groups: tuple[tuple[int, ...], ...]
) -> None:
    gaps = dict.fromkeys(combinations(range(3), 2), 1.0)
    assert groups_of(distances(gaps, alike)) == groups


def test_chance_makes_a_side_odd_as_often_as_the_threshold_says() -> None:
    """Of three places on a line: in 2 of N + 1 cases, as two gaps between neighbours have it."""
    places = np.random.default_rng(0).uniform(size=(20_000, 3))
    count = 0
    for row in places.tolist():
        gaps = {pair: abs(row[pair[0]] - row[pair[1]]) for pair in combinations(range(3), 2)}
        count += odd_side(distances(gaps)) is not None
    assert count / len(places) == pytest.approx(2 / (ODD + 1), abs=0.01)
