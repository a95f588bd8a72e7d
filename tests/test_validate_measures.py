"""What each case measures of a run, at its longest timestep, with each integrator of MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache

import pytest

from statemachine.lab.runs.reporter import QuietReporter
from statemachine.lab.validate.battery import CaseResult, ValidateRequest, answer
from statemachine.lab.validate.case import SLACK, Expectation
from statemachine.lab.validate.cases import CASES

# Of the error on record the largest that is measured is at least so much: other digits of another
# compiler are less, and a record that is too generous is none.
TIGHT = 0.93
GROWING = {"reaction-moving"}  # its error is the larger, the shorter the timestep


@cache
def at_longest(name: str, backend: str = "mujoco") -> tuple[CaseResult, ...]:
    """Return what the integrators of a backend give in a case at its longest timestep."""
    request = ValidateRequest((backend,), (name,), (CASES[name].timesteps[0],))
    return answer(request).results


@pytest.mark.parametrize("name", CASES)
def test_a_case_is_within_its_record_with_each_integrator(name: str) -> None:
    results = at_longest(name)
    assert len(results) >= 4
    assert [result.integrator for result in results if not result.holds] == []


@pytest.mark.parametrize("name", CASES)
def test_what_is_measured_is_the_truth_where_that_is_on_record(name: str) -> None:
    case = CASES[name]
    for result in at_longest(name):
        expected = result.expectation
        [measurement] = result.measurements
        if expected is None or expected.verdict not in ("exact", "converges", "bounded"):
            continue
        scale = abs(case.truth()) if case.relative else 1.0
        gap = abs(measurement.measured - case.truth())
        assert gap <= expected.within * scale * (1 + 1e-9)


def largest_errors(results: Sequence[CaseResult]) -> dict[str, float]:
    """Return the largest error of each record, in parts of what the record says without its slack.

    Left out are records that have no size, and those whose last digits another make of processor
    may change: of rounding, of chaos, and of contacts whose error is small.
    """
    largest: dict[str, float] = {}
    for result in results:
        record = result.expectation
        [measurement] = result.measurements or [None]
        if record is None or measurement is None or measurement.error is None:
            continue
        if result.case.is_chaotic or not math.isfinite(record.within) or _is_rough(result, record):
            continue
        [key] = [name for name, each in result.case.expected.items() if each is record]
        part = abs(measurement.error) / (record.within / SLACK)
        largest[key] = max(part, largest.get(key, 0.0))
    return largest


def _is_rough(result: CaseResult, record: Expectation) -> bool:
    return record.verdict == "exact" or (result.group == "contact" and record.verdict != "wrong")


@pytest.mark.parametrize("name", [name for name in CASES if name not in GROWING])
def test_a_record_says_no_more_than_the_worst_integrator_of_mujoco_gives(name: str) -> None:
    largest = largest_errors(at_longest(name))
    assert {key: part for key, part in largest.items() if part < TIGHT} == {}


class Listening(QuietReporter):
    """A reporter that remembers what it was told.

    Attributes:
        fractions: What was done of each stage, as it was told.
    """

    def __init__(self) -> None:
        self.fractions: list[float] = []

    @contextmanager
    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> Iterator[Callable[[float], None]]:
        yield self.fractions.append


def test_a_reporter_is_told_how_many_runs_are_done() -> None:
    listening = Listening()
    request = ValidateRequest(("mujoco",), ("free-fall", "pendulum-60"), (0.005,))
    count = len(answer(request, listening).results)
    expected = [done / count for done in range(1, count + 1)]
    assert listening.fractions == pytest.approx(expected)
