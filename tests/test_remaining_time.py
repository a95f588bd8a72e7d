"""How long work still takes: said only where measured runs tell it, within a factor of two."""

from __future__ import annotations

import heapq
import math
import random
from collections.abc import Callable

import pytest

from statemachine.show import waiting
from statemachine.show.progress import progress
from statemachine.show.remaining import LONG, RemainingTime, in_words

from .support.processes import without_estimates


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def _estimates(lengths: list[float], at_once: int, loading: float = 0.0) -> list[float]:
    """Return each estimate of what remains, as a multiple of what then does, as runs end.

    Args:
        lengths: Of each run [s].
        at_once: How many workers make them.
        loading: What each worker takes before its first run [s].
    """
    clock = Clock()
    remaining = RemainingTime(at_once, clock)
    coming = iter(lengths)
    ends = [loading + next(coming) for _ in range(min(at_once, len(lengths)))]
    heapq.heapify(ends)
    said: list[tuple[float, float]] = []
    done = 0
    while ends:
        clock.now = heapq.heappop(ends)
        done += 1
        remaining.ended(done / len(lengths))
        if remaining.seconds is not None and remaining.seconds > LONG:
            said.append((clock.now, remaining.seconds))
        length = next(coming, None)
        if length is not None:
            heapq.heappush(ends, clock.now + length)
    return [seconds / (clock.now - now) for now, seconds in said]


def _alike(number: int, _draw: random.Random) -> list[float]:
    return [5.0] * number


def _varying(number: int, draw: random.Random) -> list[float]:
    """Return lengths of which two thirds lie within a third of the mean."""
    return [5.0 * math.exp(draw.gauss(-0.045, 0.3)) for _ in range(number)]


def _by_turns(number: int, _draw: random.Random) -> list[float]:
    """Return two sides in turn, of which one takes four times as long."""
    return [(2.0, 8.0)[k % 2] for k in range(number)]


@pytest.mark.parametrize("lengths", [_alike, _varying, _by_turns])
@pytest.mark.parametrize("at_once", [1, 2, 4])
@pytest.mark.parametrize("loading", [0.0, 5.0, 60.0])
def test_what_is_said_to_remain_is_within_a_factor_of_two(
    lengths: Callable[[int, random.Random], list[float]], at_once: int, loading: float
) -> None:
    draw = random.Random(1)
    ratios: list[float] = []
    for number in (30, 60, 100):
        found = _estimates(lengths(number * at_once, draw), at_once, loading)
        assert found, "nothing was ever said"
        ratios += found
    assert 0.5 <= min(ratios) <= max(ratios) <= 2.0


def test_runs_whose_lengths_say_nothing_of_the_next_give_no_estimate() -> None:
    lengths = [1.0, 1.0, 30.0, 2.0, 60.0, 1.0, 90.0, 3.0]
    assert _estimates(lengths, 1) == []


def test_nothing_is_said_before_two_runs_were_measured_beside_the_first() -> None:
    clock = Clock()
    remaining = RemainingTime(1, clock)
    known: list[float | None] = []
    for done in range(1, 5):
        clock.now += 10.0
        remaining.ended(done / 10)
        known.append(remaining.seconds)
    assert known == [None, None, pytest.approx(70.0), pytest.approx(60.0)]


def test_what_remains_grows_less_while_nothing_ends() -> None:
    clock = Clock()
    remaining = RemainingTime(1, clock)
    for done in range(1, 4):
        clock.now = 10.0 * done
        remaining.ended(done / 10)
    clock.now += 4.0
    assert remaining.seconds == pytest.approx(66.0)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(45.2, "about 45 s more"), (99.0, "about 99 s more"), (150.0, "about 2.5 min more")],
)
def test_a_time_is_said_to_two_digits(seconds: float, words: str) -> None:
    assert in_words(seconds) == words
    assert without_estimates(f"a\nwhy: shares: {words}\nb\n") == "a\nb\n"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(waiting.time, "monotonic", clock)
    return clock


def _told(clock: Clock, seconds: float, runs: int, **how: int) -> None:
    with progress("why: shares", **how) as report:
        for done in range(1, runs + 1):
            clock.now += seconds
            report(done / runs)


def test_a_long_wait_is_said_once_where_nobody_sees_a_bar(
    clock: Clock, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("statemachine.show.remaining.RemainingTime", _with(clock))
    _told(clock, 5.0, 10, runs_at_once=1)
    assert capsys.readouterr().err == "why: shares: about 35 s more\n"


def test_of_a_short_wait_nothing_is_said(
    clock: Clock, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("statemachine.show.remaining.RemainingTime", _with(clock))
    _told(clock, 2.0, 10, runs_at_once=1)
    assert capsys.readouterr().err == ""


def test_nothing_is_said_of_what_is_not_made_of_runs(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    _told(clock, 50.0, 10)
    assert capsys.readouterr().err == ""


def test_what_was_measured_before_is_said_at_once(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress("converge, steps 4 times finer", expected_seconds=40.0):
        assert capsys.readouterr().err == "converge, steps 4 times finer: about 40 s more\n"


def _with(clock: Clock) -> Callable[[int], RemainingTime]:
    return lambda at_once: RemainingTime(at_once, clock)
