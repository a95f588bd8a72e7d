"""The arithmetic of causes: games whose shares are known by hand, and verdicts at their bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import permutations
from typing import Any

import numpy as np
import pytest

from statemachine.lab.why.deadline import Deadline, TimeIsUp
from statemachine.lab.why.game import Game, Subset, runnable
from statemachine.lab.why.gap import first_touch, size_of, touched_at_start
from statemachine.lab.why.shapley import Attribution, shapley
from statemachine.lab.why.shares import (
    active_causes,
    adds_up,
    all_sets,
    exact_shares,
    none_for_nan,
    pair_mean,
    range_of,
    scaled,
    sets_of,
    standard_errors,
)
from statemachine.lab.why.verdict import CausePart, Facts, LocatedPart, gap_state, verdict_of
from statemachine.measures import Deviation

from .support.traces import changed, traced

Parts = Mapping[str, float]


def left_of(parts: Parts) -> Callable[[Subset], float | None]:
    """Return the gap of a table; a set is written by its letters, and what is not there fails."""
    return lambda subset: parts.get("".join(sorted(subset)))


def game_of(parts: Parts, gap: float = 1.0, **needs: str) -> Game:
    return Game(left_of(parts), gap, lambda _sets: None, needs)


def sets(*words: str) -> list[Subset]:
    return [frozenset(word) for word in words]


# Three causes that interact, whose shares are the means over the six orders.
PARTS = {"": 1.0, "a": 0.9, "b": 0.5, "c": 1.0, "ab": 0.2, "ac": 0.7, "bc": 0.5, "abc": 0.0}


def by_hand(parts: Parts, causes: str) -> dict[str, float]:
    """Return the mean over all orders of what each cause takes away when its turn comes."""
    shares = dict.fromkeys(causes, 0.0)
    orders = list(permutations(causes))
    for order in orders:
        for number, cause in enumerate(order):
            before, after = (parts["".join(sorted(order[:k]))] for k in (number, number + 1))
            shares[cause] += (before - after) / len(orders)
    return shares


# A game


def test_a_game_has_parts_of_the_first_gap_and_asks_for_each_set_once() -> None:
    asked: list[Subset] = []

    def value(subset: Subset) -> float | None:
        asked.append(subset)
        return None if subset == {"b"} else 3.0

    game = Game(value, 4.0, lambda _sets: None, {})
    assert game(frozenset()) == 1.0
    assert game(frozenset("a")) == game(frozenset("a")) == 0.75
    assert math.isnan(game(frozenset("b")))
    assert asked == sets("a", "b")
    assert (game.failed(frozenset("a")), game.failed(frozenset("b"))) == (False, True)
    assert not game.failed(frozenset("c"))  # it was not evaluated


def test_what_a_cause_takes_away_is_before_less_after() -> None:
    game = game_of({"a": 0.9, "b": 0.5, "ab": 0.2})
    assert game.effect("b", frozenset()) == 0.5
    assert game.effect("b", frozenset("a")) == pytest.approx(0.7)
    assert game.effect("a", frozenset("b")) == pytest.approx(0.3)


def test_an_effect_of_sets_that_were_not_evaluated_is_not_known_and_evaluates_none() -> None:
    game = game_of({"a": 0.9})
    assert math.isnan(game.evaluated_effect("a", frozenset()))
    assert game.parts.keys() == {frozenset()}
    game(frozenset("a"))
    assert game.evaluated_effect("a", frozenset()) == pytest.approx(0.1)


def test_a_cause_comes_after_what_it_needs() -> None:
    game = game_of({"a": 0.9, "ab": 0.2}, b="a")
    assert [game.can_be(subset) for subset in sets("", "a", "b", "ab", "bc")] == [
        True,
        True,
        False,
        True,
        False,
    ]
    assert math.isnan(game.effect("b", frozenset()))
    assert math.isnan(game.effect("a", frozenset("b")))
    assert game.effect("b", frozenset("a")) == pytest.approx(0.7)
    assert frozenset("b") not in game.parts


def test_sets_that_are_expected_are_told_once_and_only_those_that_can_be() -> None:
    told: list[list[Subset]] = []
    game = Game(lambda _: 0.5, 1.0, lambda found: told.append(list(found)), {"b": "a"})
    game(frozenset("c"))
    game.expect(sets("a", "b", "a", "c", "ab"))
    assert told == [sets("a", "ab")]
    game.collect(lambda subset: len(subset) == 1)
    assert game.parts.keys() == {frozenset(), *sets("a", "c")}


def test_failures_are_in_the_order_of_their_size_and_names() -> None:
    game = game_of({})
    for subset in sets("bc", "b", "ab", "a"):
        game(subset)
    assert game.failures() == tuple(sets("a", "b", "ab", "bc"))


@pytest.mark.parametrize(
    ("parts", "core"),
    [
        ({"a": 0.5, "b": 0.5, "ab": 0.0}, "ab"),
        ({"a": 0.4, "b": 0.5}, "a"),  # of two that cannot be together that which leaves least
        ({"a": 0.5, "b": 0.4}, "b"),
        ({"a": 0.5}, "a"),
        ({}, ""),
    ],
)
def test_as_many_causes_as_can_be_are_equalized_together(parts: Parts, core: str) -> None:
    game = game_of(parts)
    for subset in sets("ab", "a", "b"):
        game(subset)
    found = runnable(game, ["a", "b"])
    assert "".join(sorted(found)) == core


def test_of_three_that_cannot_be_together_the_pair_is_taken_that_leaves_least() -> None:
    game = game_of({"b": 0.5, "c": 0.6, "bc": 0.2, "ab": 0.1})
    for subset in sets("abc", "a", "b", "c", "bc", "ac", "ab"):
        game(subset)
    assert runnable(game, ["a", "b", "c"]) == frozenset("ab")


def test_a_cause_is_tried_again_with_those_that_can_be_together() -> None:
    """Nothing that was evaluated could be run: each is tried with those that can."""
    game = game_of({"b": 0.5, "ab": 0.1, "c": 0.6})
    for subset in sets("abc", "a"):
        game(subset)
    assert runnable(game, ["b", "a", "c"]) == frozenset("ab")


# Shares


def test_all_sets_come_the_smaller_ones_first_and_none_where_there_are_too_many() -> None:
    game = game_of({}, b="a")
    assert all_sets(game, "ab", 3) == sets("", "a", "ab")
    assert all_sets(game, "ab", 2) == []
    assert len(all_sets(game_of({}), "abc", 8)) == 8
    assert all_sets(game_of({}), "abc", 7) == []


def test_exact_shares_are_the_mean_over_all_orders() -> None:
    game = game_of(PARTS)
    found = exact_shares(game, "abc", all_sets(game, "abc", 8))
    assert found == pytest.approx(by_hand(PARTS, "abc"))
    assert sum(found.values()) == pytest.approx(1.0)


def test_an_order_by_a_set_that_cannot_be_run_does_not_count() -> None:
    """Without {a} only b, a counts."""
    game = game_of({"b": 0.5, "ab": 0.2})
    every = all_sets(game, "ab", 4)
    for subset in every:
        game(subset)
    assert exact_shares(game, "ab", every) == pytest.approx({"a": 0.3, "b": 0.5})


def test_where_no_order_can_be_run_no_share_is_known() -> None:
    game = game_of({"ab": 0.2})
    every = all_sets(game, "ab", 4)
    for subset in every:
        game(subset)
    assert all(math.isnan(share) for share in exact_shares(game, "ab", every).values())


def test_the_mean_of_a_pair_of_orders_is_of_evaluated_sets_alone() -> None:
    game = game_of(PARTS)
    assert all(math.isnan(share) for share in pair_mean(game, "ab", ("ab", "ba")))
    for subset in sets("a", "b", "ab"):
        game(subset)
    # First a takes 0.1 and b 0.7; then b takes 0.5 and a 0.3.
    assert pair_mean(game, "ab", ("ab", "ba")) == pytest.approx([0.2, 0.6])
    assert sets_of(("ab", "ba")) == sets("", "a", "ab", "", "b", "ab")


@pytest.mark.parametrize(
    ("total", "alone", "last", "is_so"),
    [
        (0.9, [0.5, 0.4], [0.5, 0.4], True),
        (0.9, [0.5, 0.4], [0.5, 0.409], True),
        (0.9, [0.5, 0.4], [0.5, 0.411], False),
        (0.909, [0.5, 0.4], [0.5, 0.4], True),
        (0.911, [0.5, 0.4], [0.5, 0.4], False),
        (0.0, [0.0, 0.0], [0.0, 0.0], False),
    ],
)
def test_causes_add_up_that_take_as_much_first_as_last(
    total: float, alone: Sequence[float], last: Sequence[float], is_so: bool
) -> None:
    assert adds_up(total, alone, last) is is_so


def test_what_shares_lack_is_spread_by_their_size() -> None:
    assert scaled({"a": 0.6, "b": -0.2}, 0.8) == pytest.approx({"a": 0.9, "b": -0.1})


def test_a_cause_that_takes_nothing_first_and_last_is_left_out() -> None:
    game = game_of({"ab": 0.0, "a": 0.0, "b": 1.0, "abc": 0.0})
    both = {"a": 1.0, "b": 1e-7}
    assert active_causes(game, "ab", both, {"a": 1.0, "b": -1e-7}) == ["a"]
    assert active_causes(game, "ab", both, {"a": 1.0, "b": -1.1e-7}) == ["a", "b"]
    assert active_causes(game, "ab", {"a": 1.0, "b": 1.1e-7}, both) == ["a", "b"]
    assert active_causes(game, "ab", {"a": 1.0, "b": math.nan}, both) == ["a", "b"]


def test_causes_that_take_nothing_each_and_something_together_stay() -> None:
    game = game_of({"ab": 0.5})
    nothing = {"a": 0.0, "b": 0.0}
    assert active_causes(game, "ab", nothing, nothing) == ["a", "b"]
    assert active_causes(game_of({"ab": 1.0}), "ab", nothing, nothing) == []


def test_a_cause_that_another_needs_stays() -> None:
    game = game_of({"ab": 0.0, "a": 1.0, "b": 0.0}, b="a")
    alone, last = {"a": 0.0, "b": math.nan}, {"a": 0.0, "b": 1.0}
    assert active_causes(game, "ab", alone, last) == ["a", "b"]


@pytest.mark.parametrize(
    ("share", "error", "effects", "expected"),
    [
        (0.5, 0.0, [0.1], (0.5, 0.5)),
        (0.5, 0.125, [0.1], (0.25, 0.75)),
        (0.5, math.inf, [0.1, 0.9], (0.1, 0.9)),
        (0.5, math.inf, [math.nan], (0.5, 0.5)),
        (math.nan, 0.0, [0.3, math.nan, 0.2], (0.2, 0.3)),
        (math.nan, 0.0, [math.nan], None),
    ],
)
def test_between_what_a_share_lies(
    share: float, error: float, effects: list[float], expected: tuple[float, float] | None
) -> None:
    assert range_of(share, error, effects) == expected


def test_a_standard_error_is_that_of_the_mean_and_of_one_row_unknown() -> None:
    rows = np.array([[1.0, 0.0], [3.0, 0.0], [2.0, 6.0]])
    assert standard_errors(rows) == pytest.approx([1 / math.sqrt(3), 2.0])
    assert standard_errors(rows[:1]).tolist() == [math.inf, math.inf]
    assert none_for_nan({"a": math.nan, "b": 0.5}) == {"a": None, "b": 0.5}


# A division


def test_causes_that_interact_are_divided_over_all_sets() -> None:
    found = shapley("abc", left_of({word: 4 * part for word, part in PARTS.items()}), 4.0)
    assert found.method == "all sets"
    assert found.share == pytest.approx(by_hand(PARTS, "abc"))
    assert found.alone == pytest.approx({"a": 0.1, "b": 0.5, "c": 0.0})
    assert found.last == pytest.approx({"a": 0.5, "b": 0.7, "c": 0.2})
    assert found.error == {"a": 0.0, "b": 0.0, "c": 0.0}
    assert (found.orders, found.unavailable, found.failures) == (0, (), ())


def test_causes_that_add_up_need_no_further_set() -> None:
    parts = {"a": 0.5, "b": 0.7, "c": 0.8, "ab": 0.2, "ac": 0.3, "bc": 0.5, "abc": 0.0}
    asked: list[Subset] = []

    def value(subset: Subset) -> float | None:
        asked.append(subset)
        return left_of(parts)(subset)

    found = shapley("abc", value, 1.0)
    assert found.method == "one at a time"
    assert found.share == pytest.approx({"a": 0.5, "b": 0.3, "c": 0.2})
    assert set(asked) == {*sets("abc", "a", "b", "c", "ab", "ac", "bc")}


def test_causes_that_nearly_add_up_are_scaled_to_what_they_take_together() -> None:
    parts = {"a": 0.5, "b": 0.5, "ab": 0.004}
    found = shapley("ab", left_of(parts), 1.0)
    assert found.method == "one at a time"
    assert found.share == pytest.approx({"a": 0.498, "b": 0.498})


def test_causes_that_take_nothing_away_have_no_share() -> None:
    found = shapley("ab", lambda _: 1.0, 1.0)
    assert (found.method, found.share) == ("nothing", {"a": 0.0, "b": 0.0})


def test_a_cause_that_takes_nothing_has_the_share_0_beside_others() -> None:
    found = shapley("abd", lambda subset: PARTS["".join(sorted(subset - {"d"}))], 1.0)
    assert found.method == "all sets"
    assert found.share == pytest.approx({**by_hand(PARTS, "ab"), "d": 0.0})


def test_orders_are_drawn_where_all_sets_are_too_many() -> None:
    found = shapley("abc", left_of(PARTS), 1.0, sets=7)
    assert found.method == "drawn orders"
    assert found.orders >= 8
    assert sum(share or 0.0 for share in found.share.values()) == pytest.approx(1.0)
    for cause, share in by_hand(PARTS, "abc").items():
        low, high = found.range[cause] or (0.0, 0.0)
        assert high - low == pytest.approx(4 * found.error[cause])
        assert abs((found.share[cause] or 0.0) - share) < 4 * found.error[cause] + 0.2


def test_a_cause_that_cannot_be_run_is_unavailable_and_the_others_are_divided() -> None:
    parts = {"a": 0.5, "b": 0.6, "ab": 0.0}
    found = shapley("abx", left_of(parts), 1.0)
    assert found.unavailable == ("x",)
    assert (found.share["x"], found.range["x"], found.alone["x"]) == (None, None, None)
    assert found.share["a"] == pytest.approx((0.5 + 0.6) / 2)
    assert found.last["a"] == pytest.approx(0.6)  # without the one that fails
    assert found.is_over("x")
    assert found.failures[0] == frozenset("x")


def test_before_shares_are_known_a_range_is_what_was_seen() -> None:
    attribution = Attribution("ab", game_of({"a": 0.9, "b": 0.5, "ab": 0.2}), 0)
    first = attribution.division()
    assert (first.method, first.range) == ("not ranked", {"a": None, "b": None})
    assert not first.is_over("a")
    attribution.rank()
    ranked = attribution.division()
    assert ranked.method == "alone and last"
    assert ranked.share == {"a": None, "b": None}
    assert ranked.range == {
        "a": (pytest.approx(0.1), pytest.approx(0.3)),
        "b": (pytest.approx(0.5), pytest.approx(0.7)),
    }
    assert not ranked.is_over("a")


def test_the_sets_that_rank_are_all_each_alone_and_all_but_each() -> None:
    told: list[Subset] = []

    def ahead(found: Iterable[Subset]) -> None:
        told.extend(found)

    attribution = Attribution("abc", Game(left_of(PARTS), 1.0, ahead, {}), 0)
    assert attribution.first_sets() == sets("abc", "a", "b", "c", "bc", "ac", "ab")
    attribution.rank()
    assert told == attribution.first_sets()
    assert attribution.core == frozenset("abc")
    assert attribution.choose(8) == "all sets"
    assert attribution.count_of_all_sets() == 0
    assert Attribution("", game_of({}), 0).first_sets() == []


def test_how_many_sets_are_missing_is_counted_before_they_are_evaluated() -> None:
    causes = "abcde"
    game = Game(lambda subset: 1.0 - (len(subset) / 5) ** 2, 1.0, lambda _sets: None, {})
    attribution = Attribution(causes, game, 0)
    attribution.rank()
    assert attribution.choose(32) == "all sets"
    assert attribution.count_of_all_sets() == 32 - 12  # none, all, and five of one and of four
    assert attribution.count_of_first_orders() == 2 * 4 * 2
    assert attribution.choose(31) == "drawn orders"
    attribution.draw_first_orders()
    assert attribution.division().orders == 8
    assert attribution.count_of_more_orders(None) >= attribution.count_of_more_orders(20)


# Verdicts at their bounds


@pytest.mark.parametrize(
    ("gap", "floor", "state"),
    [
        (1e-9, 0.0, "rounding"),
        (1.1e-9, 0.0, "beyond"),
        (1.0, 1.0, "within"),
        (1.001, 1.0, "cannot be told"),
        (1.0, 1.1, "within"),
        (1.05, 1.1, "inside"),
    ],
)
def test_the_state_of_a_gap_at_its_bounds(gap: float, floor: float, state: str) -> None:
    assert gap_state(gap, negligible=1e-9, tolerance=1.0, floor=floor) == state


FACTS = Facts("beyond", differs=True, refused=False, one_engine=False)


def answered(**facts: Any) -> tuple[str, bool, bool]:
    verdict = verdict_of(replace(FACTS, **facts))
    return verdict.answer, verdict.holds, verdict.divides


@pytest.mark.parametrize(("unexplained", "holds"), [(0.05, True), (0.051, False), (-0.051, False)])
def test_a_twentieth_of_the_gap_may_stay(unexplained: float, holds: bool) -> None:
    explained = 1.0 - unexplained
    found = answered(
        explained=explained, unexplained=unexplained, cause=CausePart(explained, None, None)
    )
    assert found == ("cause", holds, True)


@pytest.mark.parametrize(("explained", "answer"), [(-0.05, "masked"), (-0.051, "hidden")])
def test_all_causes_hide_that_widen_the_gap_by_more_than_a_twentieth(
    explained: float, answer: str
) -> None:
    cause = CausePart(2.5, None, None)
    assert answered(explained=explained, unexplained=1 - explained, cause=cause)[0] == answer


@pytest.mark.parametrize(
    ("cause", "answer"),
    [
        (CausePart(2.0, 2.0, 2.0), "cause"),
        (CausePart(2.01, 1.0, 1.0), "masked"),
        (CausePart(1.0, 2.01, 1.0), "masked"),
        (CausePart(1.0, 1.0, 2.01), "masked"),
        (CausePart(1.0, -0.05, 1.0), "cause"),
        (CausePart(1.0, 1.0, -0.051), "masked"),
    ],
)
def test_a_cause_that_takes_more_than_twice_the_gap_has_others_against_it(
    cause: CausePart, answer: str
) -> None:
    assert answered(explained=1.0, unexplained=0.0, cause=cause)[0] == answer


def test_a_cause_that_is_less_than_what_was_located_masks_nothing() -> None:
    cause = CausePart(0.3, 2.5, 0.3)
    place = LocatedPart(0.7)
    found = answered(explained=0.3, located=0.7, unexplained=0.0, cause=cause, places=(place,))
    assert found == ("located", True, True)
    more = CausePart(0.71, 2.5, 0.3)
    assert answered(explained=0.3, located=0.7, cause=more, places=(place,))[0] == "masked"


@pytest.mark.parametrize(
    ("share", "place", "unexplained", "explained", "answer"),
    [
        (0.4, 0.4, 0.2, 0.4, "cause"),
        (0.39, 0.4, 0.2, 0.39, "located"),
        (0.4, 0.2, 0.4, 0.4, "cause"),
        (0.3, 0.3, 0.35, 0.36, "together"),
        (0.3, 0.35, 0.35, 0.3, "located"),
        (0.3, 0.34, 0.35, 0.31, "unexplained"),
        (0.0, 0.0, 0.0, 0.0, "located"),
    ],
)
def test_most_of_a_gap_is_what_is_named(
    share: float, place: float, unexplained: float, explained: float, answer: str
) -> None:
    found = answered(
        explained=explained,
        located=place,
        unexplained=unexplained,
        cause=CausePart(share, None, None),
        places=(LocatedPart(place / 2, is_still=False), LocatedPart(place)),
    )
    assert found[0] == answer


@pytest.mark.parametrize(
    ("place", "facts", "answer"),
    [
        (LocatedPart(1.0, is_still=True, is_switch=True), {}, "switched"),
        (LocatedPart(1.0, is_still=True), {"refused": True}, "still"),
        (LocatedPart(1.0), {"refused": True, "one_engine": True}, "refused"),
        (LocatedPart(1.0), {"one_engine": True}, "one engine"),
    ],
)
def test_what_was_left_out_is_told_by_the_first_that_holds(
    place: LocatedPart, facts: dict[str, Any], answer: str
) -> None:
    found = answered(located=1.0, unexplained=0.0, places=(place,), **facts)
    # A feature of one side counts as found, unless the motion went with it.
    assert found == (answer, False, True)


@pytest.mark.parametrize(
    ("facts", "answer"),
    [
        ({"state": "rounding", "moved": False}, ("nothing moved", False, False)),
        ({"state": "rounding"}, ("alike", True, False)),
        ({"state": "rounding", "differs": False}, ("rounding", True, False)),
        ({"method": "not ranked"}, ("stopped", False, True)),
        ({"method": "alone and last"}, ("ranked", False, True)),
        (
            {"explained": 1.0, "unexplained": 0.0, "cause": CausePart(1.0, None, None)},
            ("cause", True, True),
        ),
    ],
)
def test_what_a_search_may_answer(facts: dict[str, Any], answer: tuple[str, bool, bool]) -> None:
    assert answered(**facts) == answer
    name, _, divides = answer
    assert answered(**facts, is_complete=False) == (name, False, divides)


# Touches and time


def test_the_first_touch_is_before_its_moment_and_the_moment_too() -> None:
    trace = traced("gravity", seconds=1.0)
    rows = {pair: np.flatnonzero(row) for pair, row in trace.touches().items() if row.any()}
    assert rows
    pair = min(rows, key=lambda name: rows[name][0])
    row = int(rows[pair][0])
    time = trace.time - trace.time[0]
    gap = np.arange(len(time), dtype=float)
    found = first_touch([trace], time, gap)
    assert found is not None
    assert (found.time, found.before) == (pytest.approx(time[row]), float(row if row else 0))
    assert found.what in rows
    assert found.moments == row + 1
    late = changed(trace, contact_row=np.minimum(trace["contact_row"] + 1, len(trace) - 1))
    after = first_touch([late], time, gap)
    assert after is not None
    assert after.time == pytest.approx(found.time + trace.timestep)
    assert first_touch([late, trace], time, gap) == found


def test_the_size_of_a_gap_is_the_figure_that_is_asked_for() -> None:
    gap = Deviation.of(np.array([0.0, 3.0, 1.0]), np.array([0.0, 0.1, 0.2]), "rad")
    assert size_of(gap, "worst") == gap.worst == 3.0
    assert size_of(gap, "rms") == gap.rms == pytest.approx(math.sqrt(10 / 3))


def test_bodies_that_are_touched_at_the_start_are_those_of_no_robot() -> None:
    trace = traced("box", seconds=0.05)
    pairs = [set(name.split(" on ")) for name, rows in trace.touches().items() if rows[0]]
    every = frozenset().union(*pairs)
    assert every
    one = sorted(every)[0]
    with_it = frozenset().union(*[pair for pair in pairs if one in pair]) - {one}
    assert touched_at_start(trace, frozenset({one})) == with_it
    assert touched_at_start(trace, frozenset()) == frozenset()


def test_a_deadline_is_over_when_no_time_is_left() -> None:
    now = [10.0]
    deadline = Deadline(5.0, clock=lambda: now[0])
    now[0] = 14.9
    deadline.check()
    assert (deadline.elapsed, deadline.left) == (pytest.approx(4.9), pytest.approx(0.1))
    now[0] = 15.1
    with pytest.raises(TimeIsUp):
        deadline.check()
    endless = Deadline(None, began=3.0, clock=lambda: 1e9)
    endless.check()
    assert (endless.left, endless.elapsed) == (math.inf, 1e9 - 3.0)
