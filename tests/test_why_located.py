"""What is left out on both sides, of runs whose gaps are written here: bounds and turns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from statemachine.lab.why.locate import Localisation, Remainder, locate
from statemachine.lab.why.settings import FEATURES
from statemachine.measures import Deviation

NAMES = [feature.name for feature in FEATURES]
CAUSES = frozenset({"a cause"})
Gaps = Callable[[frozenset[str], frozenset[str], str], float | None]


def trials_of(
    gaps: Gaps,
    features: tuple[str, ...] = (),
    integrators: tuple[str, ...] = (),
    selects: tuple[int, ...] = (0, 1),
    extent: Callable[[frozenset[str]], float] = lambda _without: 1.0,
) -> tuple[Any, list[tuple[frozenset[str], frozenset[str], str]]]:
    """Return runs with these gaps [rad], and what was asked of them."""
    asked: list[tuple[frozenset[str], frozenset[str], str]] = []

    def gaps_of(
        equalized: frozenset[str], without: frozenset[str] = frozenset(), integrator: str = ""
    ) -> dict[str, Deviation]:
        asked.append((equalized, without, integrator))
        size = gaps(equalized, without, integrator)
        if size is None:
            return {}
        return {"joints": Deviation.of(np.array([0.0, size]), np.array([0.0, 1.0]), "rad")}

    def extent_of(_quantity: str, without: frozenset[str] = frozenset()) -> float:
        return extent(without)

    setup = SimpleNamespace(
        integrators=integrators,
        selects=selects,
        integrator_of=lambda side: ("Euler", "own")[side],
        can_be_without=lambda feature: feature.name in features,
    )
    return SimpleNamespace(setup=setup, gaps=gaps_of, extent=extent_of), asked


def located(
    gaps: Gaps, left: float = 1.0, bound: float = 0.0, gap: float = 2.0, **how: Any
) -> list[Localisation]:
    trials, _ = trials_of(gaps, **how)
    return list(locate(Remainder(trials, CAUSES, "joints", "worst", gap, left, bound)))


FIRST, SECOND = NAMES[:2]


def left_without(sizes: Mapping[frozenset[str], float | None], usual: float = 1.0) -> Gaps:
    """Return the gaps without some features, whatever integrates."""
    return lambda _equalized, without, _integrator: sizes.get(without, usual)


@pytest.mark.parametrize(("rest", "counts"), [(0.49, True), (0.5, False), (0.51, False)])
def test_a_feature_counts_that_takes_more_than_half_of_what_was_left(
    rest: float, counts: bool
) -> None:
    found = located(left_without({frozenset({FIRST}): rest}), features=(FIRST,))
    assert [part.name for part in found] == ([FIRST] if counts else [])
    if counts:
        (part,) = found
        assert part.share == pytest.approx((1.0 - rest) / 2.0)  # of the whole gap
        assert (part.gap, part.alone, part.values, part.side) == (rest, None, None, "")
        assert part.without == FEATURES[0].without


def test_features_are_left_out_each_on_top_of_those_that_count() -> None:
    sizes = {frozenset({FIRST}): 0.4, frozenset({FIRST, SECOND}): 0.1, frozenset({SECOND}): 0.0}
    found = located(left_without(sizes), features=(FIRST, SECOND))
    assert [(part.name, part.gap) for part in found] == [(FIRST, 0.4), (SECOND, 0.1)]
    assert [part.share for part in found] == pytest.approx([0.3, 0.15])


def test_a_feature_that_does_not_count_is_put_back() -> None:
    sizes = {frozenset({FIRST}): 0.9, frozenset({SECOND}): 0.1}
    found = located(left_without(sizes), features=(FIRST, SECOND))
    assert [part.name for part in found] == [SECOND]


def test_a_feature_that_cannot_be_left_out_is_not_tried() -> None:
    trials, asked = trials_of(left_without({}), features=(SECOND,))
    list(locate(Remainder(trials, CAUSES, "joints", "worst", 2.0, 1.0, 0.0)))
    assert {without for _, without, _ in asked} == {frozenset({SECOND})}
    assert {equalized for equalized, _, _ in asked} == {CAUSES}


def test_what_could_not_be_run_does_not_count() -> None:
    assert located(left_without({frozenset({FIRST}): None}), features=(FIRST,)) == []


@pytest.mark.parametrize(
    ("left", "bound", "is_tried"),
    [(2e-6, 0.0, False), (2.1e-6, 0.0, True), (0.1, 0.1, False), (0.11, 0.1, True)],
)
def test_nothing_is_looked_for_in_what_is_rounding_or_chaos(
    left: float, bound: float, is_tried: bool
) -> None:
    """A millionth of a gap of 2."""
    trials, asked = trials_of(left_without({}, left), features=(FIRST,))
    list(locate(Remainder(trials, CAUSES, "joints", "worst", 2.0, left, bound)))
    assert bool(asked) is is_tried


@pytest.mark.parametrize(("moved", "is_still"), [(0.099, True), (0.1, False)])
def test_a_motion_is_still_of_which_less_than_a_tenth_is_left(moved: float, is_still: bool) -> None:
    (part,) = located(
        left_without({frozenset({FIRST}): 0.0}),
        features=(FIRST,),
        extent=lambda without: moved if without else 1.0,
    )
    assert part.is_still is is_still


# Integrators


def by_integrator(
    sizes: dict[str, float | None], alone: float | None = 0.5, usual: float = 1.0
) -> Gaps:
    """Return the gaps with an integrator; without causes equalized it is one number."""
    return lambda equalized, _without, integrator: (
        sizes.get(integrator, usual) if equalized else alone
    )


def test_the_integrator_is_chosen_that_leaves_least() -> None:
    gaps = by_integrator({"RK4": 0.4, "implicit": 0.2, "Euler": 0.9})
    (part,) = located(gaps, integrators=("RK4", "implicit", "Euler"))
    assert (part.name, part.without, part.gap) == ("integrator", "implicit", 0.2)
    assert part.share == pytest.approx(0.4)
    assert part.alone == pytest.approx(1.0 - 0.5 / 2.0)
    assert (part.values, part.side) == (("Euler", "own"), "")


def test_of_integrators_that_leave_nothing_the_first_by_name_is_taken() -> None:
    gaps = by_integrator({"RK4": 1e-9, "implicit": 2e-9})
    (part,) = located(gaps, integrators=("implicit", "RK4"))
    assert (part.without, part.gap) == ("RK4", 1e-9)
    (part,) = located(gaps, integrators=("implicit", "RK4"), bound=1e-9)
    assert part.without == "RK4"


def test_an_integrator_that_could_not_be_run_alone_has_no_part_alone() -> None:
    (part,) = located(by_integrator({"RK4": 0.1}, alone=None), integrators=("RK4",))
    assert part.alone is None


def test_an_integrator_that_could_not_be_run_is_none() -> None:
    (part,) = located(by_integrator({"RK4": None, "Euler": 0.1}), integrators=("RK4", "Euler"))
    assert part.without == "Euler"


@pytest.mark.parametrize(
    ("selects", "rest", "side"),
    [
        ((0, 1), 0.45, ""),
        ((0, 1), 0.6, None),
        # Of a setting of one side a twentieth is enough, where nothing takes half.
        ((0,), 0.94, "right"),
        ((1,), 0.94, "right"),
        ((0,), 0.96, None),
    ],
)
def test_a_setting_of_one_side_need_not_take_half(
    selects: tuple[int, ...], rest: float, side: str | None
) -> None:
    found = located(by_integrator({"RK4": rest}), integrators=("RK4",), selects=selects)
    assert bool(found) is (side is not None)
    if side is not None:
        expected = side if not side or selects[0] else "left"
        assert [part.side for part in found] == [expected]


def test_a_setting_of_little_is_no_answer_where_a_feature_takes_half() -> None:
    def gaps(equalized: frozenset[str], without: frozenset[str], integrator: str) -> float:
        return 0.1 if without else 0.9

    found = located(gaps, integrators=("RK4",), selects=(0,), features=(FIRST,))
    assert [part.name for part in found] == [FIRST]


def test_an_integrator_is_tried_again_once_a_feature_is_left_out() -> None:
    def gaps(_equalized: frozenset[str], without: frozenset[str], integrator: str) -> float:
        if not without:
            return 1.0
        return 0.1 if integrator else 0.4

    found = located(gaps, integrators=("RK4",), features=(FIRST,))
    assert [(part.name, part.gap) for part in found] == [(FIRST, 0.4), ("integrator", 0.1)]
    assert found[1].side == ""


def test_an_integrator_that_was_chosen_stays() -> None:
    trials, asked = trials_of(
        lambda _e, without, integrator: 0.1 if without else (0.3 if integrator else 1.0),
        features=(FIRST,),
        integrators=("RK4",),
    )
    found = list(locate(Remainder(trials, CAUSES, "joints", "worst", 2.0, 1.0, 0.0)))
    assert [part.name for part in found] == ["integrator", FIRST]
    assert (CAUSES, frozenset({FIRST}), "RK4") in asked
    assert (CAUSES, frozenset({FIRST}), "") not in asked
