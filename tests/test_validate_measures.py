"""What each case measures of a run, at its longest timestep, with each integrator of MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from statemachine.lab.runs.reporter import QuietReporter
from statemachine.lab.validate.battery import CaseResult, ValidateRequest, answer
from statemachine.lab.validate.cases import CASES


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
