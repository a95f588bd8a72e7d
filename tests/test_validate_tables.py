"""What the page of the battery counts, ranks and suggests, of results that are written here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from statemachine.backends import parse_backend
from statemachine.errors import BadInputError
from statemachine.interface import Model, make_data
from statemachine.lab.validate.battery import CaseResult, ValidateRequest, ValidateResult
from statemachine.lab.validate.case import Case, Verdict, bounded, converges, exact, wrong
from statemachine.lab.validate.cases import CASES
from statemachine.lab.validate.page import (
    ValidatePage,
    badness,
    junit_of,
    order_text,
    page,
)
from statemachine.lab.validate.run import (
    MAX_STEPS,
    Run,
    Samples,
    TimestepError,
    largest_deviation,
    simulated_time,
    zero_crossings,
)
from statemachine.lab.validate.shown_error import error_text
from statemachine.lab.validate.variants import Variant
from statemachine.lab.validate.verdict import (
    LEAST_ORDER,
    CaseMeasurement,
    failure_judgement,
    judgement_of,
    observed_order,
)
from statemachine.show.blocks import Code, Table
from statemachine.show.pictures import Traces

from .support.pages import blocks, shown

STEPS = (0.004, 0.002, 0.001)  # [s]
CASE = Case(
    name="fall",
    group="motion",
    description="A weight falls.",
    mjcf="<worldbody/>",
    measure=lambda run: run.advance(0.1),
    truth=lambda: 2.0,
    unit="m",
    source="any",
    expected={"*": bounded(0.5, "contact model")},
    tolerance=0.02,
    timesteps=STEPS,
)


def measured(*errors: float | None, seconds: float | None = 2.5e-4) -> list[CaseMeasurement]:
    """Return what was measured at ever shorter timesteps; a run has 10, 20, ... steps."""
    measurements: list[CaseMeasurement] = []
    for k, error in enumerate(errors):
        value = None if error is None else 2.0 + error
        step = STEPS[k % 3]
        measurements.append(CaseMeasurement(step, value, error, None, 10 * (k + 1), seconds))
    return measurements


def of(
    verdict: Verdict,
    *errors: float | None,
    name: str = "fall",
    backend: str = "mujoco",
    integrator: Any = "Euler",
    **more: Any,
) -> CaseResult:
    usual: dict[str, Any] = {
        "order": None,
        "status": "as expected",
        "expectation": CASE.expected["*"],
        "measurements": tuple(measured(*errors)),
    }
    return CaseResult(
        case=replace(CASE, name=name),
        backend=backend,
        integrator=integrator,
        truth=2.0,
        verdict=verdict,
        **usual | more,
    )


def result_of(*results: CaseResult, **request: Any) -> ValidateResult:
    return ValidateResult(ValidateRequest(**request), {"mujoco": "4.0"}, results)


def tables(*results: CaseResult, details: bool = False) -> list[Table]:
    return blocks(page(result_of(*results), details), Table)


# Counts


def test_each_engine_and_integrator_is_counted_by_its_verdicts() -> None:
    verdicts: tuple[Verdict, ...] = (
        "exact",
        "exact discrete form",
        "converges",
        "bounded",
        "bounded",
        "bounded",
        "wrong",
        "diverges",
        "wrong",
        "wrong",
        "refused",
        "failed",
        "failed",
        "failed",
        "failed",
    )
    rows = [of(verdict, 0.1, name=f"case {k}") for k, verdict in enumerate(verdicts)]
    other = of("exact", 0.0, backend="pybullet", integrator="own")
    engines, *_ = tables(*rows, other)
    assert [list(row) for row in engines.rows] == [
        ["mujoco Euler", "2", "1", "3", "4", "5"],
        ["pybullet", "1", "0", "0", "0", "0"],
    ]


def test_at_most_eight_engines_have_a_row() -> None:
    rows = [of("exact", 0.0, backend=f"engine{k}") for k in range(9)]
    engines, worst = tables(*rows)
    assert [row[0] for row in engines.rows] == [f"engine{k} Euler" for k in range(8)]
    assert len(worst.rows) == 2


@pytest.mark.parametrize(("engines", "shown"), [(1, 8), (4, 5), (7, 2), (8, 2)])
def test_both_tables_share_nine_lines_and_the_second_has_two_at_least(
    engines: int, shown: int
) -> None:
    rows = [of("exact", 0.0, name=f"case {k}") for k in range(10)]
    rows += [of("exact", 0.0, backend=f"engine{k}") for k in range(engines - 1)]
    first, second = tables(*rows)
    assert (len(first.rows), len(second.rows)) == (engines, shown)


def test_of_a_case_and_a_backend_the_worst_integrator_stands_for_all() -> None:
    _, worst = tables(
        of("bounded", 0.01, integrator="RK4"),
        of("bounded", -0.03, integrator="Euler"),
        of("bounded", 0.02, backend="pybullet"),
        of("bounded", 0.015, name="roll", integrator="RK4"),
    )
    assert [list(row) for row in worst.rows] == [
        ["fall", "mujoco Euler", "-30.0 mm", "bounded"],
        ["fall", "pybullet Euler", "20.0 mm", "bounded"],
        ["roll", "mujoco RK4", "15.0 mm", "bounded"],
    ]


def test_the_largest_error_ranks_and_the_one_at_the_longest_timestep_is_shown() -> None:
    _, worst = tables(of("bounded", 0.01, 0.05), of("bounded", 0.02, 0.02, name="roll"))
    assert [row[2] for row in worst.rows] == ["10.0 mm", "20.0 mm"]


def test_what_is_refused_comes_last_and_what_diverges_first() -> None:
    rows = [
        of("refused", name="a"),
        of("bounded", 0.01, name="b"),
        of("diverges", None, name="c"),
    ]
    _, worst = tables(*rows)
    assert [(row[0], row[2]) for row in worst.rows] == [("c", "–"), ("b", "10.0 mm"), ("a", "–")]


@pytest.mark.parametrize(
    ("row", "rank"),
    [
        (of("refused"), (False, 0.0)),
        (of("diverges", None), (False, math.inf)),
        (of("bounded", 0.01, -0.03), (False, 1.5)),  # of 20 mm that the case tolerates
        (of("bounded", 0.01, status="worse"), (True, 0.5)),
        (of("failed"), (True, math.inf)),
    ],
)
def test_how_bad_a_result_is(row: CaseResult, rank: tuple[bool, float]) -> None:
    assert badness(row) == (rank[0], pytest.approx(rank[1]))


def test_what_does_not_hold_is_marked_and_exact_steps_have_a_short_name() -> None:
    _, worst = tables(
        of("exact discrete form", 0.02), of("bounded", 0.03, name="roll", status="worse")
    )
    assert [row[3] for row in worst.rows] == ["bounded (!)", "exact steps"]


# Who is nearest


def nearest_of(*results: CaseResult) -> str:
    """Return which way of stepping the page names as the nearest to the truth."""
    headline = page(result_of(*results)).blocks[0]
    text = getattr(headline, "text", "")
    return text.partition("Nearest to the truth is ")[2].partition(",")[0].strip("`")


def test_the_nearest_is_wrong_least_often_then_exact_most_often_then_errs_least() -> None:
    one, two = {"integrator": "Euler"}, {"integrator": "RK4"}
    right = [of("bounded", 0.01, name=name, **two) for name in "ab"]
    for verdict in ("wrong", "diverges", "refused", "failed"):
        rows = [of("exact", 0.0, name="a", **one), of(verdict, 0.0, name="b", **one)]
        assert nearest_of(*rows, *right) == "mujoco RK4"
    more_exact = [of("exact", 0.0, name="a", **one), of("bounded", 9.0, name="b", **one)]
    assert nearest_of(*more_exact, *right) == "mujoco Euler"
    nearer = [of("bounded", 0.009, name=name, **one) for name in "ab"]
    assert nearest_of(*nearer, *right) == "mujoco Euler"
    farther = [of("bounded", 0.011, name=name, **one) for name in "ab"]
    assert nearest_of(*farther, *right) == "mujoco RK4"


def test_without_an_error_nobody_is_nearest() -> None:
    assert nearest_of(of("diverges", None), of("refused")) == ""


# What is named above the tables


def lists_of(*results: CaseResult) -> ValidatePage:
    empty = Table((), ())
    return ValidatePage(result_of(*results), None, empty, empty, (), "")


def test_results_are_named_by_what_became_of_their_record() -> None:
    content = lists_of(
        of("wrong", 1.0, name="a", status="worse"),
        of("wrong", 1.0, name="b", status="not on record", expectation=None),
        of("bounded", 0.01, name="c", status="not on record", expectation=None),
        of("failed", name="d", status="worse", refusal="gave up."),
        of("failed", name="e", status="not on record", refusal="again"),
        of("bounded", 0.01, name="f", status="better"),
        of("diverges", None, name="g"),
    )
    assert content.worse == ["a on mujoco Euler"]
    assert content.wrong_without_record == ["b on mujoco Euler"]
    assert content.failed == ["d on mujoco Euler", "e on mujoco Euler"]
    assert content.first_failure == "gave up"
    assert content.better == ["f on mujoco Euler"]
    assert (content.wrong, content.total) == (3, 7)
    assert not content.is_as_recorded


def test_without_a_failure_none_is_told() -> None:
    content = lists_of(of("exact", 0.0))
    assert (content.failed, content.first_failure) == ([], "")


def test_all_is_as_on_record_only_where_all_was_compared() -> None:
    compared, other = of("exact", 0.0), of("exact", 0.0, status="other timestep")
    assert lists_of(compared).is_as_recorded
    assert lists_of(compared, other).at_other_timesteps == 1
    assert not lists_of(compared, other).is_as_recorded
    assert not lists_of(of("wrong", 1.0, status="worse")).is_as_recorded


@pytest.mark.parametrize(
    ("verdict", "status", "holds"),
    [
        ("failed", "as expected", False),
        ("wrong", "as expected", True),
        ("wrong", "better", True),
        ("exact", "worse", False),
        ("wrong", "not on record", False),
        ("diverges", "not on record", False),
        ("bounded", "not on record", True),
        ("refused", "not on record", True),
        ("exact", "other timestep", True),
    ],
)
def test_a_result_holds_that_is_right_or_as_wrong_as_its_record(
    verdict: Verdict, status: str, holds: bool
) -> None:
    assert of(verdict, 0.1, status=status).holds is holds


def test_the_worst_of_a_result_is_its_largest_error_of_either_sign() -> None:
    assert of("bounded", 0.1, -0.3, 0.2).worst == 0.3
    assert of("diverges", 0.1, None).worst is None
    assert of("refused").worst is None


# The text of figures


@pytest.mark.parametrize(
    ("error", "unit", "text"),
    [
        (None, "m", "–"),
        (math.inf, "m", "no event"),
        (0.0015, "m", "1.50 mm"),
        (1e-4, "", "0.0100 %"),
        (-1e-4, "", "-0.0100 %"),
        (9e-5, "", "9e-5"),
        (0.25, "", "25.0 %"),
        (0.25, "J", "0.250 J"),
    ],
)
def test_an_error_is_read_in_its_unit_and_a_larger_ratio_in_per_cent(
    error: float | None, unit: str, text: str
) -> None:
    assert error_text(error, unit) == text


@pytest.mark.parametrize(("order", "text"), [(None, "–"), (1.04, "1.0"), (-0.04, "0.0")])
def test_an_order_is_read_to_a_tenth(order: float | None, text: str) -> None:
    assert order_text(of("bounded", 0.1, order=order)) == text


# The tables of a case


def test_the_tables_of_a_case_have_a_row_for_each_way_that_takes_it() -> None:
    rows = (
        of("bounded", 0.03, 0.02, 0.01, order=1.0),
        of("refused", integrator="RK4", refusal="it takes no ball"),
        of("wrong", 1.0, 1.0, 1.0, backend="pybullet", expectation=None, status="not on record"),
    )
    _, _, errors, verdicts, work = tables(*rows, details=True)
    assert list(errors.headers) == ["engine", "4 ms", "2 ms", "1 ms", "order"]
    assert [list(row) for row in errors.rows] == [
        ["mujoco Euler", "30.0 mm", "20.0 mm", "10.0 mm", "1.0"],
        ["pybullet Euler", "1000 mm", "1000 mm", "1000 mm", "–"],
    ]
    assert [list(row) for row in verdicts.rows] == [
        ["mujoco Euler", "bounded", "contact model", "as expected"],
        ["pybullet Euler", "wrong", "–", "not on record"],
    ]
    # Ten steps of a quarter of a millisecond, then twenty, then thirty.
    assert list(work.rows[0]) == ["mujoco Euler", "2.5 ms", "5 ms", "7.5 ms", "4000"]


def test_a_run_without_a_time_has_no_cost_and_no_curve() -> None:
    mute = of("diverges", None, None)
    mute = replace(mute, measurements=tuple(measured(None, None, seconds=None)))
    asked = page(result_of(mute), details=True)
    assert list(blocks(asked, Table)[-1].rows[0]) == ["mujoco Euler", "–", "–", "–"]
    assert blocks(asked, Traces) == []


def test_the_curves_are_of_finite_errors_over_steps_times_their_cost() -> None:
    (picture,) = blocks(page(result_of(of("wrong", -0.3, math.inf, 0.1)), details=True), Traces)
    costs, sizes = picture.curves["mujoco: Euler"]
    assert list(sizes) == [0.3, 0.1]
    assert list(costs) == pytest.approx([2.5e-3, 7.5e-3])


@pytest.mark.parametrize(
    ("truth_after", "timesteps", "is_told"),
    [
        (None, (0.004, 0.003), False),
        (lambda time: time, (0.004, 0.002, 0.001), False),
        (lambda time: time, (0.004,), False),
        (lambda time: time, (0.004, 0.003), True),
    ],
)
def test_the_time_of_the_truth_is_told_at_a_timestep_that_is_none_of_the_cases(
    truth_after: Any, timesteps: Sequence[float], is_told: bool
) -> None:
    case = replace(CASE, truth_after=truth_after)
    measurements = [replace(measured(0.1)[0], timestep=timestep) for timestep in timesteps]
    row = replace(of("bounded"), case=case, measurements=tuple(measurements))
    said = [getattr(block, "text", "") for block in page(result_of(row), details=True).blocks]
    assert any("does not divide the duration" in text for text in said) is is_told


def test_a_note_on_a_cause_is_told_once_for_a_backend() -> None:
    record = wrong(1.0, "engine's own", note="it has a note")
    rows = [of("wrong", 1.0, integrator=way, expectation=record) for way in ("Euler", "RK4")]
    assert shown(page(result_of(*rows), details=True)).count("mujoco: it has a note") == 1


# What to type next, and tests of JUnit


def typed(result: ValidateResult, details: bool = False) -> list[str]:
    (code,) = blocks(page(result, details), Code)
    return code.lines[0].split()


def test_the_next_command_names_the_worst_case_and_the_backends_that_are_not_usual() -> None:
    rows = of("bounded", 0.01), of("bounded", 0.02, name="roll")
    assert typed(result_of(*rows))[1:] == ["validate", "--case", "roll", "--details"]
    request = {"backends": ("pybullet", "mujoco"), "cases": ("free-fall",)}
    asked = ["--backend", "pybullet", "--backend", "mujoco", "--case", "free-fall"]
    assert typed(result_of(*rows, **request))[1:] == ["validate", *asked, "--details"]


def test_a_failed_test_tells_its_errors_its_order_and_its_record() -> None:
    rows = (
        of("exact", 0.0, name="a"),
        of("wrong", 0.5, 0.25, name="b", status="worse", order=1.0),
        of("wrong", 0.5, name="c", status="not on record", expectation=None),
        of("failed", name="d", refusal="gave up"),
        of("exact", 0.0, backend="pybullet"),
    )
    root = ElementTree.fromstring(junit_of(result_of(*rows)).split("\n", 1)[1])
    assert [suite.get("failures") for suite in root] == ["3", "0"]
    messages = {
        test.get("name"): failure.get("message")
        for test in root.findall(".//testcase")
        for failure in test
    }
    assert messages == {
        "b": "wrong (errors 500 mm, 250 mm, order 1.0); on record: bounded, within 625 mm",
        "c": "wrong (errors 500 mm, order –); on record: nothing",
        "d": "failed: gave up",
    }


# Records and requests


@pytest.mark.parametrize("name", CASES)
def test_an_order_on_record_is_one(name: str) -> None:
    for record in CASES[name].expected.values():
        assert record.within > 0.0
        if record.verdict == "converges":
            assert record.order is not None
            assert LEAST_ORDER <= record.order <= 5.0
            assert record.within < 0.6


@pytest.mark.parametrize("timestep", [0.1, 1e-9])
def test_a_timestep_is_at_most_a_tenth_of_a_second(timestep: float) -> None:
    assert ValidateRequest(timesteps=(timestep,)).timesteps == (timestep,)
    with pytest.raises(BadInputError):
        ValidateRequest(timesteps=(0.1 * (1 + 1e-9),))


def test_timesteps_of_a_case_become_shorter_and_a_case_has_a_record() -> None:
    with pytest.raises(BadInputError):
        replace(CASE, timesteps=(0.001, 0.002))
    with pytest.raises(BadInputError):
        replace(CASE, expected={})


def test_an_error_is_a_difference_or_a_ratio_less_1() -> None:
    assert CASE.error_of(2.5, 2.0) == 0.5
    relative = replace(CASE, relative=True)
    assert relative.error_of(2.5, 2.0) == 0.25
    assert (CASE.error_unit, relative.error_unit) == ("m", "")


def test_a_truth_that_depends_on_the_time_is_asked_for_it() -> None:
    assert CASE.truth_of(0.5) == 2.0
    assert replace(CASE, truth_after=lambda time: 3.0 * time).truth_of(0.5) == 1.5


def test_an_engine_that_reads_no_integrator_is_given_one_in_the_file() -> None:
    text = replace(CASE, option='cone="elliptic"').model_text(0.005, "own")
    option = ElementTree.fromstring(text).find("option")
    assert dict(option.attrib) == {
        "timestep": "0.005",
        "integrator": "Euler",
        "gravity": "0.0 0.0 -9.81",
        "cone": "elliptic",
    }
    option = ElementTree.fromstring(CASE.model_text(0.002, "RK4")).find("option")
    assert (option.get("timestep"), option.get("integrator")) == ("0.002", "RK4")


def test_a_variant_is_called_by_its_integrator_where_it_has_one() -> None:
    assert of("exact", 0.0, integrator="RK4").way == "mujoco RK4"
    assert of("exact", 0.0, integrator="own", backend="pybullet:engine").way == "pybullet:engine"


# Verdicts at their bounds


@pytest.mark.parametrize(
    ("errors", "verdict"),
    [
        ((1e-9, -1e-9), "exact"),
        ((1.1e-9, 1e-9), "bounded"),
        ((0.02, -0.02), "bounded"),
        ((0.02, 0.0201), "wrong"),
        ((0.08, 0.04, 0.02), "converges"),
        ((0.08, 0.042, 0.0201), "wrong"),
        ((0.020, 0.0142, 0.0101), "bounded"),  # of order 0.49
        ((0.030, 0.0212, 0.0149), "converges"),  # of order 0.505
    ],
)
def test_verdict_at_the_bounds_of_a_case(errors: tuple[float, ...], verdict: Verdict) -> None:
    assert judgement_of(CASE, measured(*errors), None).verdict == verdict


def test_an_order_is_of_the_first_errors_that_are_above_rounding() -> None:
    errors = measured(0.4, 0.1, 1e-10)
    assert observed_order(CASE, errors) == pytest.approx(2.0)
    assert observed_order(CASE, measured(0.4, 1e-10, 0.1)) is None
    assert observed_order(CASE, measured(0.4, None, 0.1)) is None
    assert observed_order(CASE, measured(math.inf, 0.2, 0.1)) is None
    assert observed_order(replace(CASE, rounding=0.0), measured(4e-11, 2e-11)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("order", "errors", "status"),
    [
        (1.39, (0.04, 0.02, 0.01), "as expected"),
        (1.41, (0.04, 0.02, 0.01), "worse"),
    ],
)
def test_an_order_may_be_four_tenths_below_its_record(
    order: float, errors: tuple[float, ...], status: str
) -> None:
    record = converges(order, 0.04)
    assert judgement_of(CASE, measured(*errors), record).status == status


@pytest.mark.parametrize(
    ("largest", "status"), [(0.0125 * 1.01 / 4, "as expected"), (0.0125 * 0.99 / 4, "better")]
)
def test_an_error_of_less_than_a_quarter_is_better_than_its_record(
    largest: float, status: str
) -> None:
    record = bounded(0.01, "contact model")  # with its slack 0.0125
    assert judgement_of(CASE, measured(largest, largest), record).status == status


def test_an_error_may_be_as_large_as_on_record_and_a_quarter_of_that_larger() -> None:
    record = bounded(0.01, "contact model")
    assert judgement_of(CASE, measured(0.0125, 0.012), record).status == "as expected"
    assert judgement_of(CASE, measured(0.01251, 0.012), record).status == "worse"


def test_a_run_that_failed_is_worse_than_a_record_and_without_one_not_on_record() -> None:
    assert failure_judgement(exact()).status == "worse"
    assert failure_judgement(None).status == "not on record"


# A run


@pytest.fixture(scope="module")
def slide() -> Model:
    text = '<worldbody><body><joint type="slide"/><geom size="0.1" mass="1"/></body></worldbody>'
    with Variant(parse_backend("mujoco"), "Euler").loaded(
        replace(CASE, mjcf=text).model_text(0.004, "Euler"), 0.004
    ) as model:
        return model


@pytest.fixture
def run(slide: Model) -> Run:
    return Run(slide, make_data(slide))


def test_a_run_counts_its_steps_and_its_time(run: Run) -> None:
    assert run.advance(0.1) == 0.1
    assert run.advance(0.009) == pytest.approx(0.008)
    assert run.steps == 27
    assert run.time == pytest.approx(0.108)
    assert run.data.time == pytest.approx(0.108)


def test_a_run_of_less_than_half_a_step_is_refused(run: Run) -> None:
    assert run.advance(0.0021) == pytest.approx(0.004)
    with pytest.raises(TimestepError):
        run.advance(0.0019)


def test_a_run_has_at_most_ten_million_steps(run: Run) -> None:
    run.steps = MAX_STEPS - 2
    with pytest.raises(TimestepError):
        run.advance(0.012)
    run.advance(0.008)
    assert run.steps == MAX_STEPS


def test_a_sample_is_taken_before_the_first_step_and_after_each(run: Run) -> None:
    run.data.qvel[0] = 1.0
    times, values = run.sample(0.012, lambda data: data.qpos[:1])
    assert times == pytest.approx([0.0, 0.004, 0.008, 0.012])
    assert values[:, 0] == pytest.approx([0.0, 0.004, 0.008, 0.012], abs=1e-3)
    assert (run.steps, run.time) == (3, pytest.approx(0.012))


@pytest.mark.parametrize(
    ("duration", "timestep", "time"),
    [(1.0, 0.1, 1.0), (1.0, 0.3, 0.9), (1.0, 0.4, 0.8), (0.3, 0.1, 0.3)],
)
def test_the_simulated_time_is_that_of_whole_steps(
    duration: float, timestep: float, time: float
) -> None:
    assert simulated_time(duration, timestep) == pytest.approx(time, rel=1e-15)


def test_a_number_that_is_zero_at_a_sample_crosses_there() -> None:
    times = np.arange(8.0)
    for shift in (0.0, 0.25):
        samples = Samples(times, (times - 3.0 - shift) ** 3 + (times - 3.0 - shift))
        assert zero_crossings(samples, rising=True) == pytest.approx([3.0 + shift])
        assert zero_crossings(samples, rising=False).tolist() == []
        falling = Samples(times, -samples.values)
        assert zero_crossings(falling, rising=False) == pytest.approx([3.0 + shift])


def test_the_largest_deviation_is_a_ratio_with_its_sign() -> None:
    assert largest_deviation(np.array([2.0, 1.4, 2.2]), 2.0) == pytest.approx(-0.3)


def test_an_order_on_record_is_one_that_a_scheme_can_have() -> None:
    records = [record for case in CASES.values() for record in case.expected.values()]
    orders = [record.order for record in records if record.order is not None]
    assert len(orders) > 30
    assert min(orders) >= 0.5
    assert max(orders) <= 5.0  # the energy of RK4
