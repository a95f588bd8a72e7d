"""The core of the battery: a case as a record, how it is run, and the one function of verdicts."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from statemachine.backends import BACKENDS, backend_names, load, parse_backend
from statemachine.errors import (
    BadInputError,
    DivergedError,
    EngineError,
    UnknownNameError,
    UnsupportedError,
)
from statemachine.interface import Model, make_data
from statemachine.interface.records import Defaults
from statemachine.lab.runs.drive import Progress
from statemachine.lab.runs.reporter import QuietReporter
from statemachine.lab.validate.battery import ValidateRequest, answer, run_case
from statemachine.lab.validate.case import (
    Case,
    Expectation,
    Verdict,
    bounded,
    converges,
    diverges,
    exact,
    exact_steps,
    wrong,
)
from statemachine.lab.validate.case_runs import CaseRun, outcomes_of
from statemachine.lab.validate.cases import CASES, cases_of
from statemachine.lab.validate.run import Run, Samples, zero_crossings
from statemachine.lab.validate.variants import Variant, variants_of
from statemachine.lab.validate.verdict import CaseMeasurement, Status, judgement_of

from .support.requirements import need_engine

STEPS = (0.004, 0.002, 0.001)  # [s]
_SLIDE = (
    '<worldbody><body><joint type="slide" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'
)


def height_after_a_tenth(run: Run) -> float:
    run.advance(0.1)
    return float(run.data.qpos[0])


class Fractions(QuietReporter):
    """A reporter that keeps what it is told."""

    def __init__(self) -> None:
        self.fractions: list[float] = []

    @contextmanager
    def stage(
        self, what: str, runs_at_once: int = 0, expected_seconds: float | None = None
    ) -> Iterator[Progress]:
        yield self.fractions.append


def fall(**changes: Any) -> Case:
    """A case of our own: a weight on a slide falls for 0.1 s."""
    case = Case(
        name="fall",
        group="motion",
        description="A weight falls.",
        mjcf=_SLIDE,
        measure=height_after_a_tenth,
        truth=lambda: -9.81 * 0.01 / 2.0,
        unit="m",
        source="any",
        expected={"*": converges(1.0, 0.002)},
        timesteps=STEPS,
    )
    return replace(case, **changes)


def measured(*errors: float | None, discrete: float | None = None) -> list[CaseMeasurement]:
    pairs = zip(STEPS, errors, strict=False)
    return [CaseMeasurement(step, error, error, discrete, 10, 1e-6) for step, error in pairs]


@pytest.mark.parametrize(
    ("errors", "discrete", "verdict"),
    [
        ((1e-13, -1e-12, 0.0), None, "exact"),
        ((0.004, 0.002, 0.001), 1e-14, "exact discrete form"),
        ((0.004, 0.002, 0.001), 0.001, "converges"),
        ((4.0, 2.0, 1.0), None, "wrong"),
        ((0.01, 0.011, 0.01), None, "bounded"),
        ((0.3, 0.3, 0.31), None, "wrong"),
        ((0.3, None, 0.31), None, "diverges"),
        ((0.3, math.nan, 0.31), None, "diverges"),
        ((), None, "refused"),
    ],
)
def test_verdict_follows_the_errors(
    errors: tuple[float | None, ...], discrete: float | None, verdict: Verdict
) -> None:
    assert judgement_of(fall(), measured(*errors, discrete=discrete), None).verdict == verdict


def order_of(case: Case, *errors: float) -> float | None:
    return judgement_of(case, measured(*errors), None).order


@pytest.mark.parametrize("power", [1, 2, 4])
def test_order_is_the_power_of_the_timestep(power: int) -> None:
    errors = [300.0 * step**power for step in STEPS]
    assert order_of(fall(rounding=0.0), *errors) == pytest.approx(power)


def test_no_order_is_observed_of_rounding() -> None:
    assert order_of(fall(rounding=0.0), 4e-12, 2e-12, 1e-12) is None


def test_no_order_is_observed_of_a_chaotic_end() -> None:
    assert order_of(fall(is_chaotic=True), 0.4, 0.2, 0.1) is None


@pytest.mark.parametrize(
    ("expectation", "errors", "status"),
    [
        (converges(1.0, 0.004), (0.004, 0.002, 0.001), "as expected"),
        (converges(1.0, 0.003), (0.004, 0.002, 0.001), "worse"),
        (converges(2.0, 0.004), (0.004, 0.002, 0.001), "worse"),
        (converges(1.0, 0.004), (0.004, 0.001, 0.00025), "as expected"),
        (converges(1.0, 0.004), (1e-12, 1e-12, 1e-12), "better"),
        (exact(), (0.004, 0.002, 0.001), "worse"),
        (exact_steps(0.004), (0.004, 0.002, 0.001), "worse"),
        (bounded(0.01, "contact model"), (0.01, 0.01, 0.01), "as expected"),
        (bounded(0.01, "contact model"), (0.001, 0.001, 0.001), "better"),
        (bounded(0.01, "contact model"), (0.001, 0.005, 0.001), "as expected"),
        (converges(1.0, 0.1), (0.004, 0.002, 0.001), "better"),
        (exact(), (1e-15, 0.0, 0.0), "as expected"),
        (wrong(0.5, "engine's own"), (0.01, 0.01, 0.01), "better"),
        (diverges("engine's own"), (None, None, None), "as expected"),
        (None, (0.01, 0.01, 0.01), "not on record"),
    ],
)
def test_status_compares_with_the_record(
    expectation: Expectation | None, errors: tuple[float | None, ...], status: Status
) -> None:
    assert status_of(fall(), errors, expectation) == status


def status_of(
    case: Case, errors: Sequence[float | None], expectation: Expectation | None
) -> Status:
    return judgement_of(case, measured(*errors), expectation).status


def test_one_timestep_shows_no_order_and_is_held_by_the_size_of_its_error() -> None:
    assert status_of(fall(), [0.004], converges(1.0, 0.004)) == "as expected"
    assert status_of(fall(), [0.006], converges(1.0, 0.004)) == "worse"


def test_no_error_is_much_smaller_than_on_record_by_chaos_or_a_shorter_timestep() -> None:
    record = bounded(0.01, "contact model")
    longer = fall(timesteps=(0.008, *STEPS))
    assert status_of(fall(), [0.001, 0.001, 0.001], record) == "better"
    assert status_of(fall(is_chaotic=True), [0.001, 0.001, 0.001], record) == "as expected"
    assert status_of(longer, [0.001, 0.001, 0.001], record) == "as expected"


def test_a_record_is_not_compared_at_other_timesteps_than_its_own() -> None:
    assert status_of(fall(timesteps=(0.008,)), [5.0], exact()) == "other timestep"


def test_a_record_is_compared_at_those_of_its_timesteps_that_are_asked_for() -> None:
    case = fall(timesteps=STEPS[1:])
    assert status_of(case, [5.0, 0.002, 0.001], converges(1.0, 0.002)) == "as expected"
    assert status_of(case, [0.001, 5.0, 5.0], converges(1.0, 0.002)) == "worse"


def test_a_record_is_found_by_engine_and_integrator_before_integrator_alone() -> None:
    records = {"mujoco Euler": exact(), "Euler": converges(1.0, 1.0), "*": exact(1.0)}
    case = fall(expected=records | {"mujoco==3.3.7 *": exact(2.0)})
    assert case.expectation("mujoco", "Euler") == exact()
    assert case.expectation("mujoco==3.4.0", "Euler") == exact()
    assert case.expectation("mujoco==3.3.7", "Euler") == exact(2.0)
    assert case.expectation("pybullet", "Euler") == converges(1.0, 1.0)
    assert case.expectation("pybullet", "RK4") == exact(1.0)
    assert fall(expected={"RK4": exact()}).expectation("mujoco", "Euler") is None


def test_an_engine_that_reads_no_integrator_has_records_of_its_own_alone() -> None:
    case = fall(expected={"own *": exact(3.0), "*": exact()})
    assert case.expectation("own", "own") == exact(3.0)
    assert case.expectation("other", "own") is None


def test_an_engine_as_it_comes_has_the_record_of_its_name_where_it_has_no_other() -> None:
    records = {"first *": exact(1.0), "first:engine own": exact(2.0), "second *": exact(3.0)}
    case = fall(expected=records)
    assert case.expectation("first:engine", "own") == exact(2.0)
    assert case.expectation("second:engine", "own") == exact(3.0)


def test_zero_crossings_are_those_of_a_sine() -> None:
    times = np.arange(0.0, 7.0, 0.01)
    samples = Samples(times, np.sin(times - 1.0))
    np.testing.assert_allclose(zero_crossings(samples, rising=False), [1 + math.pi], atol=1e-9)
    np.testing.assert_allclose(zero_crossings(samples, rising=True), [1.0], atol=1e-9)


def test_a_release_lacks_an_integrator_that_came_later() -> None:
    need_engine("mujoco")
    names = [variant.integrator for variant in variants_of(parse_backend("mujoco"))]
    assert {"Euler", "implicit", "implicitfast", "RK4"} <= set(names)


def test_an_integrator_that_acts_as_another_is_left_out() -> None:
    need_engine("pybullet")
    names = [variant.integrator for variant in variants_of(parse_backend("pybullet"))]
    assert names == ["Euler", "implicitfast"]


def test_an_engine_as_it_comes_steps_in_one_way() -> None:
    assert [str(v) for v in variants_of(parse_backend("pybullet:engine"))] == ["pybullet:engine"]


def test_a_fall_is_measured_at_each_timestep() -> None:
    need_engine("mujoco")
    result = run_case(fall(), Variant(parse_backend("mujoco"), "Euler"))
    # Semi-implicit: the velocity first, so each step falls g h² k, and n of them g h² n (n+1) / 2.
    for measurement in result.measurements:
        steps = round(0.1 / measurement.timestep)
        height = -9.81 * measurement.timestep**2 * steps * (steps + 1) / 2.0
        assert measurement.measured == pytest.approx(height, rel=1e-12)
        assert measurement.steps == steps
    assert result.verdict == "converges"
    assert result.status == "as expected"
    assert result.order == pytest.approx(1.0, abs=0.01)


def test_a_refused_model_is_a_verdict_and_no_error() -> None:
    need_engine("mujoco")
    broken = fall(mjcf="<worldbody><nothing/></worldbody>")
    result = run_case(broken, Variant(parse_backend("mujoco"), "Euler"))
    assert result.verdict == "refused"
    assert result.refusal
    assert not result.holds


def test_the_battery_holds_where_all_is_as_recorded() -> None:
    need_engine("mujoco")
    result = answer(ValidateRequest(cases=("free-fall",), timesteps=(0.01, 0.005)))
    assert result.holds
    assert {row.name for row in result.results} == {"free-fall"}
    assert list(result.versions) == ["mujoco"]


def test_a_group_stands_for_its_cases() -> None:
    assert {case.group for case in cases_of(("motion",))} == {"motion"}
    assert cases_of(()) == list(CASES.values())


def test_a_pattern_stands_for_the_cases_whose_names_fit() -> None:
    names = [case.name for case in cases_of(("pendulum-*", "free-fall"))]
    expected = [name for name in CASES if name.startswith("pendulum-") or name == "free-fall"]
    assert names == expected
    assert len(names) > 2


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ({"backends": ()}, BadInputError),
        ({"backends": ("mujcoo",)}, UnknownNameError),
        ({"cases": ("fre-fall",)}, UnknownNameError),
        ({"timesteps": (0.0,)}, BadInputError),
        ({"timesteps": (math.nan,)}, BadInputError),
        ({"timesteps": (1.0,)}, BadInputError),
        ({"cases": ("shpere-*",)}, UnknownNameError),
        ({"jobs": 0}, BadInputError),
    ],
)
def test_bad_requests_are_refused(words: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        ValidateRequest(**words)


def test_errors_do_not_depend_on_the_number_of_processes() -> None:
    need_engine("mujoco")
    names = ("bounce", "pendulum-quarter", "collision-restitution")
    alone, shared = (answer(ValidateRequest(cases=names, jobs=jobs)) for jobs in (1, 3))
    assert [row.verdict for row in alone.results] == [row.verdict for row in shared.results]
    for one, other in zip(alone.results, shared.results, strict=True):
        assert (one.name, one.way) == (other.name, other.way)
        assert [each.measured for each in one.measurements] == [
            each.measured for each in other.measurements
        ]


def test_progress_comes_to_its_end_once_for_each_run() -> None:
    need_engine("mujoco")
    reporter = Fractions()
    result = answer(ValidateRequest(cases=("pendulum-quarter",), jobs=2), reporter)
    count = sum(len(row.measurements) for row in result.results)
    assert reporter.fractions == pytest.approx([(k + 1) / count for k in range(count)])


def test_a_process_that_ends_in_a_run_is_a_run_that_failed() -> None:
    need_engine("mujoco")
    parent = os.getpid()

    def measure(run: Run) -> float:
        if os.getpid() != parent:
            os.abort()
        return 0.0

    variant = Variant(parse_backend("mujoco"), "Euler")
    runs = [CaseRun(fall(measure=measure), variant, step) for step in STEPS]
    outcomes = outcomes_of(runs, 2, lambda _fraction: None)
    assert [outcome.failed for outcome in outcomes] == [True] * len(runs)


def test_no_temporary_file_is_left_by_a_process_that_ends_in_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    need_engine("mujoco")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    parent = os.getpid()

    def measure(run: Run) -> float:
        if os.getpid() != parent:
            os.abort()
        return 0.0

    variant = Variant(parse_backend("mujoco"), "Euler")
    runs = [CaseRun(fall(measure=measure), variant, step) for step in STEPS]
    outcomes_of(runs, 2, lambda _fraction: None)
    assert list(tmp_path.iterdir()) == []


# Those whose truth depends on how long is simulated, and that nothing but the timestep is wrong of.
TIMED = (
    "free-fall",
    "thrown-body",
    "thrown-spin",
    "symmetric-body",
    "top-hinges",
    "gyroscope",
    "effort-limit",
    "dry-friction-above",
    "armature",
    "reflected-inertia",
)


@pytest.mark.parametrize("name", TIMED)
@pytest.mark.parametrize("timestep", [0.003, 0.007, 0.03])
def test_a_case_is_exact_at_a_timestep_that_does_not_divide_its_duration(
    name: str, timestep: float
) -> None:
    need_engine("mujoco")
    result = run_case(CASES[name], Variant(parse_backend("mujoco"), "RK4"), [timestep])
    assert result.worst == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("name", ["free-fall", "thrown-body", "sinking-speed"])
def test_the_exact_discrete_form_holds_at_a_timestep_that_does_not_divide_the_duration(
    name: str,
) -> None:
    need_engine("mujoco")
    result = run_case(CASES[name], Variant(parse_backend("mujoco"), "Euler"), [0.007, 0.003])
    assert result.verdict == "exact discrete form"


@pytest.mark.parametrize(("name", "within"), [("damped-spring", 3e-7), ("servo-step", 5e-8)])
def test_a_place_is_held_against_the_truth_of_the_time_that_was_simulated(
    name: str, within: float
) -> None:
    need_engine("mujoco")
    result = run_case(CASES[name], Variant(parse_backend("mujoco"), "RK4"), [0.003])
    assert result.worst is not None
    assert result.worst < within


@pytest.mark.parametrize("case", [each for each in CASES.values() if each.truth_after is not None])
def test_the_truth_at_the_duration_of_a_case_is_that_of_its_record(case: Case) -> None:
    need_engine("mujoco")
    variant = Variant(parse_backend("mujoco"), "Euler")
    text = case.model_text(case.timesteps[0], "Euler")
    with variant.loaded(text, case.timesteps[0]) as model, make_data(model) as data:
        run = Run(model, data)
        with suppress(DivergedError):
            case.measure(run)
            assert case.truth_of(run.time) == case.truth()


@pytest.mark.parametrize("timestep", [1e-320, 1e-300, 1e-9])
def test_a_timestep_of_too_many_steps_is_refused_and_named(timestep: float) -> None:
    need_engine("mujoco")
    with pytest.raises(BadInputError, match=f"free-fall.*{timestep!r}"):
        answer(ValidateRequest(cases=("free-fall",), timesteps=(timestep,)))


# Backends of another package, by their names.


def raises_in_its_loader(path: Path, defaults: Defaults) -> Model:
    raise RuntimeError("out of order")


def returns_nothing(path: Path, defaults: Defaults) -> Model:
    return cast("Model", None)


def gives_up_in_a_fall(path: Path, defaults: Defaults) -> Model:
    text = path.read_text("utf-8")
    if 'model="free-fall"' in text:
        raise EngineError("gave up")
    return load(path, "mujoco", defaults=defaults)


def takes_named_models(path: Path, defaults: Defaults) -> Model:
    if "<mujoco model=" not in path.read_text("utf-8"):
        raise UnsupportedError("no name")
    return load(path, "mujoco", defaults=defaults)


@pytest.fixture(autouse=True)
def other_backends(monkeypatch: pytest.MonkeyPatch) -> None:
    backend_names()
    for loader in (
        raises_in_its_loader,
        returns_nothing,
        gives_up_in_a_fall,
        takes_named_models,
    ):
        monkeypatch.setitem(BACKENDS, loader.__name__, f"{__name__}:{loader.__name__}")


@pytest.mark.parametrize("backend", ["raises_in_its_loader", "returns_nothing"])
def test_a_backend_whose_loader_fails_is_told_with_its_loader(backend: str) -> None:
    result = answer(ValidateRequest(backends=(backend,), cases=("free-fall",), jobs=1))
    assert {row.verdict for row in result.results} == {"failed"}
    assert all(f"{__name__}:{backend}" in row.refusal for row in result.results)
    assert not result.holds


def test_what_other_backends_and_cases_do_is_not_lost_by_a_run_that_fails() -> None:
    need_engine("mujoco")
    backends = ("gives_up_in_a_fall", "mujoco")
    result = answer(ValidateRequest(backends=backends, cases=("free-fall", "thrown-body"), jobs=1))
    assert {(row.backend, row.name) for row in result.results if row.verdict == "failed"} == {
        ("gives_up_in_a_fall", "free-fall")
    }
    assert {(row.backend, row.name) for row in result.results if row.holds} == {
        ("gives_up_in_a_fall", "thrown-body"),
        ("mujoco", "free-fall"),
        ("mujoco", "thrown-body"),
    }


def test_a_version_that_cannot_be_read_is_unknown() -> None:
    need_engine("mujoco")
    request = ValidateRequest(backends=("takes_named_models",), cases=("thrown-body",))
    assert answer(request).versions == {"takes_named_models": "unknown"}


def test_a_measure_that_is_no_number_is_a_run_that_diverged() -> None:
    need_engine("mujoco")
    case = fall(measure=lambda run: math.nan * run.advance(0.1))
    result = run_case(case, Variant(parse_backend("mujoco"), "Euler"))
    assert result.verdict == "diverges"
    assert [each.error for each in result.measurements] == [None] * len(STEPS)
