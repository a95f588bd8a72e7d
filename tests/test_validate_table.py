"""The table of `docs/validate.md` shows what the engines do, and the causes on record."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest

from statemachine.backends import parse_backend
from statemachine.lab.validate.battery import CaseResult, ValidateRequest, answer, run_case
from statemachine.lab.validate.case import Expectation
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.variants import Variant, variants_of
from tools.validate_table import (
    BACKENDS,
    TARGET,
    TableRow,
    document,
    measurement_shown,
    rows_in,
    rows_of,
)

from .support.requirements import need_engine

ROWS = rows_in(TARGET.read_text("utf-8"))
QUICK = ("free-fall", "spring-energy", "pendulum-60", "bounce", "torque-moving")


@cache
def ways_of(backend: str) -> list[Variant]:
    """Return the ways in which a backend steps; each is tried once."""
    return variants_of(parse_backend(backend))


def row_of(case: str, backend: str, integrator: str) -> TableRow:
    rows = [row for row in ROWS if row.case == case and row.is_of(backend, integrator)]
    assert len(rows) == 1
    return rows[0]


def is_rounded(record: Expectation | None) -> bool:
    """Whether rounding is all that is seen, whose digits and size are of the processor."""
    return record is not None and record.rounded is not None


def is_rough(result: CaseResult) -> bool:
    """Whether another make of processor may give other digits."""
    return result.group == "contact" or result.case.is_chaotic


def faults_of(result: CaseResult) -> list[str]:
    """Return in what a result and its row of the table differ."""
    row = row_of(result.name, result.backend, result.integrator)
    faults: list[str] = []
    verdicts = {row.verdict, result.verdict}
    if is_rounded(result.expectation):
        return [] if verdicts <= {"exact", "bounded"} else [f"verdict {result.verdict}"]
    is_near = is_rough(result) and verdicts <= {
        "bounded",
        "converges",
    }
    if len(verdicts) > 1 and not is_near:
        faults.append(f"verdict {result.verdict}")
    shown, measurement = row.error_in(result.error_unit), measurement_shown(result)
    if shown is None or measurement is None or measurement.error is None:
        return faults
    ratio = measurement.error / shown if shown else math.inf
    if is_rough(result):
        if not 0.3 < abs(ratio) < 3.0:
            faults.append(f"error {measurement.error}")
    elif ratio != pytest.approx(1.0, abs=0.5 if "e" in row.error else 0.02):  # one digit, or three
        faults.append(f"error {measurement.error}")
    has_order = not is_rough(result) and row.order != "–"
    if has_order and float(row.order) != pytest.approx(result.order, abs=0.15):
        faults.append(f"order {result.order}")
    return faults


@pytest.mark.parametrize("name", CASES)
def test_each_engine_and_integrator_has_one_row_of_a_case_with_its_cause(name: str) -> None:
    for word in BACKENDS:
        need_engine(word.partition(":")[0])
        for variant in ways_of(word):
            row = row_of(name, word, variant.integrator)
            expectation = CASES[name].expectation(word, variant.integrator)
            cause = "none" if expectation is None else expectation.cause
            assert row.cause == ("–" if cause == "none" else cause)
            if expectation is not None and not is_rounded(expectation):
                assert row.verdict == expectation.verdict


def test_the_table_has_no_row_of_another_case() -> None:
    assert {row.case for row in ROWS} == set(CASES)


@pytest.mark.parametrize("name", QUICK)
def test_mujoco_does_in_a_case_what_the_table_says(name: str) -> None:
    need_engine("mujoco")
    for variant in variants_of(parse_backend("mujoco")):
        assert faults_of(run_case(CASES[name], variant)) == []


# Of these the verdict, or the order, is that of the shortest timestep too.
ALL_TIMESTEPS = {
    *("bounce", "collision-restitution", "reaction-moving", "sliding-time"),
    *("symmetric-body", "top-ball", "tumbling-energy"),
}


def results_of(backend: str) -> Iterator[CaseResult]:
    """Yield what comes of each case, without its shortest timestep: half of all steps are its."""
    for name, case in CASES.items():
        timesteps = case.timesteps
        if len(timesteps) > 2 and name not in ALL_TIMESTEPS:
            timesteps = timesteps[:-1]
        for variant in ways_of(backend):
            yield run_case(case, variant, timesteps)


@pytest.mark.slow
@pytest.mark.parametrize("backend", BACKENDS)
def test_an_engine_does_in_each_case_what_the_table_says(backend: str) -> None:
    need_engine(backend.partition(":")[0])
    faults = {f"{row.name} on {row.way}": faults_of(row) for row in results_of(backend)}
    assert {name: fault for name, fault in faults.items() if fault} == {}


@pytest.fixture(scope="module")
def fall() -> CaseResult:
    need_engine("mujoco")
    return run_case(CASES["spring-energy"], Variant(parse_backend("mujoco"), "Euler"))


def test_a_result_that_differs_from_the_table_is_told(fall: CaseResult) -> None:
    assert faults_of(fall) == []
    larger = [replace(each, error=1.05 * (each.error or 0.0)) for each in fall.measurements]
    assert len(faults_of(replace(fall, measurements=tuple(larger)))) == 1
    assert len(faults_of(replace(fall, verdict="bounded"))) == 1
    assert len(faults_of(replace(fall, order=2.0))) == 1


def test_what_is_wrong_at_another_timestep_alone_is_shown_with_it(fall: CaseResult) -> None:
    errors = {0.005: 3.0, 0.002: 0.0, 0.001: 0.0, 0.0005: 0.0}
    measurements = [replace(each, error=errors[each.timestep]) for each in fall.measurements]
    (row,) = rows_of([replace(fall, verdict="wrong", measurements=tuple(measurements))])
    assert row.error.endswith("at 5 ms")
    assert row.error_in(fall.error_unit) == 3.0


def test_engines_that_do_the_same_share_a_row(fall: CaseResult) -> None:
    other = replace(fall, integrator="RK4")
    worse = replace(fall, integrator="implicit", verdict="wrong")
    rows = rows_of([fall, other, worse])
    assert [row.ways for row in rows] == ["mujoco Euler, RK4", "mujoco implicit"]
    assert [row.ways for row in rows_of([fall, other])] == ["mujoco"]
    assert rows[0].is_of("mujoco", "RK4")
    assert not rows[0].is_of("mujoco", "implicit")


def test_what_is_written_is_read_again() -> None:
    need_engine("mujoco")
    result = answer(ValidateRequest(cases=("pendulum-quarter", "damped-spring")))
    page = document(result, TARGET.read_text("utf-8"))
    rows = rows_in(page)
    names = dict.fromkeys(row.name for row in result.results)
    expected = [
        row for name in names for row in rows_of([r for r in result.results if r.name == name])
    ]
    assert sorted(rows, key=repr) == sorted(expected, key=repr)
    head = TARGET.read_text("utf-8").partition("<!--")[0]
    assert page.startswith(head)
