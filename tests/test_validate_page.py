"""`statemachine validate`: its page, JSON, JUnit and exit codes."""

from __future__ import annotations

import json
import math
import os
import shlex
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from statemachine.backends import parse_backend
from statemachine.cli import main
from statemachine.lab.validate.battery import (
    CaseResult,
    ValidateRequest,
    ValidateResult,
    answer,
    run_case,
)
from statemachine.lab.validate.case import exact
from statemachine.lab.validate.cases import CASES, GROUPS
from statemachine.lab.validate.page import badness, junit_of, page
from statemachine.lab.validate.variants import Variant
from statemachine.show.pictures import Traces

from .support.pages import shown
from .support.processes import lives, soon, without_estimates
from .support.requirements import ROOT, need_engine

SPRING = "spring-energy"


@pytest.fixture(scope="module")
def spring() -> ValidateResult:
    need_engine("mujoco")
    return answer(ValidateRequest(cases=(SPRING, "free-fall")))


def of(result: ValidateResult, name: str, integrator: str) -> CaseResult:
    rows = [row for row in result.results if (row.name, row.integrator) == (name, integrator)]
    assert len(rows) == 1
    return rows[0]


def unexpected(result: ValidateResult) -> ValidateResult:
    """The same result with a record that nothing on Euler keeps."""
    results: list[CaseResult] = []
    for row in result.results:
        is_worse = row.name == SPRING and row.integrator == "Euler"
        changed = replace(row, status="worse", expectation=exact()) if is_worse else row
        results.append(changed)
    return replace(result, results=tuple(results))


def test_a_spring_loses_its_energy_with_discrete_at_every_timestep(spring: ValidateResult) -> None:
    row = of(spring, SPRING, "discrete")
    errors = [measurement.error for measurement in row.measurements]
    assert errors == pytest.approx([-0.993, -0.865, -0.632, -0.393], abs=0.001)
    assert row.verdict == "wrong"
    assert row.holds  # it is on record


def test_a_spring_keeps_its_energy_with_euler_to_the_first_order(spring: ValidateResult) -> None:
    row = of(spring, SPRING, "Euler")
    assert row.verdict == "converges"
    assert row.order == pytest.approx(1.0, abs=0.05)
    assert row.worst == pytest.approx(0.0256, abs=0.0003)


@pytest.mark.slow
@pytest.mark.network
@pytest.mark.usefixtures("old_releases")
def test_a_release_turns_bodies_to_the_second_order_with_rk4() -> None:
    row = run_case(CASES["chain-momentum"], Variant(parse_backend("mujoco==3.3.7"), "RK4"))
    assert row.order == pytest.approx(2.0, abs=0.05)
    now = run_case(CASES["chain-momentum"], Variant(parse_backend("mujoco"), "RK4"))
    assert now.verdict == "exact"


def test_the_page_fits_a_terminal(spring: ValidateResult) -> None:
    text = shown(page(spring)).strip("\n")
    assert len(text.splitlines()) <= 24
    assert max(map(len, text.splitlines())) <= 80


def test_the_page_of_all_cases_fits_a_terminal(spring: ValidateResult) -> None:
    rows: list[CaseResult] = []
    for case in CASES.values():
        for row in spring.results:
            if row.name == SPRING:
                rows += [replace(row, case=case), replace(row, case=case, backend="pybullet")]
    text = shown(page(replace(spring, results=tuple(rows)))).strip("\n")
    assert len(text.splitlines()) <= 24
    assert max(map(len, text.splitlines())) <= 80


def test_the_worst_row_is_the_first_on_the_page(spring: ValidateResult) -> None:
    worst = max(spring.results, key=badness)
    assert (worst.name, worst.integrator) == (SPRING, "discrete")


def test_details_show_every_case_that_the_page_leaves_out(spring: ValidateResult) -> None:
    source = CASES["free-fall"].source
    assert source in " ".join(shown(page(spring, details=True)).split())
    assert source not in " ".join(shown(page(spring)).split())


def test_what_is_worse_than_on_record_comes_before_larger_errors(spring: ValidateResult) -> None:
    worst = max(unexpected(spring).results, key=badness)
    assert worst.integrator == "Euler"


def test_a_result_that_is_worse_than_on_record_does_not_hold(spring: ValidateResult) -> None:
    assert spring.holds
    assert page(spring).holds
    assert not unexpected(spring).holds
    assert not page(unexpected(spring)).holds


def test_junit_has_a_suite_for_each_way_of_stepping(spring: ValidateResult) -> None:
    root = ElementTree.fromstring(junit_of(spring).split("\n", 1)[1])
    names = [suite.get("name") for suite in root]
    assert names == [f"validate {way}" for way in dict.fromkeys(r.way for r in spring.results)]
    assert root.findall(".//failure") == []


def test_a_failed_test_says_what_was_measured_and_what_is_on_record(
    spring: ValidateResult,
) -> None:
    root = ElementTree.fromstring(junit_of(unexpected(spring)).split("\n", 1)[1])
    failures = root.findall(".//testcase/failure")
    assert len(failures) == 1
    message = failures[0].get("message") or ""
    assert "2.56 %" in message
    assert "exact, within" in message


def test_the_command_writes_tests_and_prints_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    need_engine("mujoco")
    file = tmp_path / "tests.xml"
    words = ["validate", "--case", "free-fall", "--timestep", "0.01", "--timestep", "0.005"]
    assert main([*words, "--json", "--junit", str(file)]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["schema"] == 1
    assert {row["name"] for row in result["results"]} == {"free-fall"}
    timesteps = [entry["timestep"] for entry in result["results"][0]["measurements"]]
    assert timesteps == [0.01, 0.005]
    assert len(ElementTree.parse(file).getroot()) == len(result["results"])


@pytest.mark.parametrize(("word", "nearest"), [("fre-fall", "free-fall"), ("motoin", "motion")])
def test_an_unknown_case_is_bad_input_and_the_nearest_name_is_said(
    word: str, nearest: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", "--case", word]) == 2
    error = capsys.readouterr().err
    assert nearest in error
    assert all(group in error for group in GROUPS)
    assert len(error) < 200


@pytest.mark.parametrize("suffix", ["svg", "png"])
def test_the_command_draws_work_against_precision(tmp_path: Path, suffix: str) -> None:
    need_engine("mujoco")
    pytest.importorskip("matplotlib")
    file = tmp_path / f"work.{suffix}"
    assert main(["validate", "--case", "pendulum-quarter", "--plot", str(file)]) == 0
    content = file.read_bytes()
    assert content
    if suffix == "svg":
        assert b"mujoco: RK4" in content


def test_a_plot_with_another_suffix_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    assert main(["validate", "--backend", "all", "--plot", str(tmp_path / "work.txt")]) == 2


def test_the_curves_are_the_errors_over_what_their_runs_took(spring: ValidateResult) -> None:
    pictures = [each for each in page(spring, details=True).blocks if isinstance(each, Traces)]
    (picture,) = [each for each in pictures if each.title.startswith(SPRING)]
    costs, sizes = picture.curves["mujoco: Euler"]
    row = of(spring, SPRING, "Euler")
    assert list(sizes) == [abs(each.error or 0.0) for each in row.measurements]
    assert list(costs) == [each.steps * (each.seconds_per_step or 0) for each in row.measurements]


def test_what_is_better_than_on_record_is_told_and_holds(spring: ValidateResult) -> None:
    better = [replace(row, status="better") for row in spring.results]
    result = replace(spring, results=tuple(better))
    assert result.holds
    assert "Better than on record" in shown(page(result))
    assert "Better than on record" not in shown(page(spring))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="children are read from /proc")
def test_no_process_stays_after_ctrl_c() -> None:
    need_engine("pybullet")
    words = ("validate", "--backend", "pybullet", "--case", "weld-*", "--jobs", "2")
    run = subprocess.Popen(
        [sys.executable, "-m", "statemachine", *words],
        cwd=ROOT,
        start_new_session=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    place = Path(f"/proc/{run.pid}/task/{run.pid}/children")
    assert soon(lambda: len(place.read_text().split()) == 2)
    children = [int(word) for word in place.read_text().split()]
    os.killpg(run.pid, signal.SIGINT)
    out, err = run.communicate(timeout=300)
    assert run.returncode == 130
    assert out == b""
    assert without_estimates(err.decode()).strip() == ""
    assert soon(lambda: not any(map(lives, children)))


def test_the_nearest_of_one_case_has_the_smallest_error() -> None:
    need_engine("mujoco")
    result = answer(ValidateRequest(cases=("bounce",)))
    rows = [row for row in result.results if row.verdict != "wrong" and row.worst is not None]
    smallest = min(rows, key=lambda row: row.worst or 0.0)
    assert f"Nearest to the truth is {smallest.way}, " in shown(page(result))


def test_what_is_wrong_without_a_record_is_not_told_as_worse_than_it(
    spring: ValidateResult,
) -> None:
    row = replace(of(spring, SPRING, "discrete"), status="not on record", expectation=None)
    text = " ".join(shown(page(replace(spring, results=(row,)))).split())
    assert "nothing on record: spring-energy on mujoco discrete" in text
    assert "Worse than on record" not in text


def failed(result: ValidateResult) -> ValidateResult:
    """The same result where all runs failed."""
    rows: list[CaseResult] = []
    for row in result.results:
        changes = replace(row, measurements=(), order=None, status="worse", refusal="gave up")
        rows.append(replace(changes, verdict="failed"))
    return replace(result, results=tuple(rows))


@pytest.mark.parametrize("details", [False, True])
def test_a_run_that_failed_is_told_with_its_case_and_engine(
    spring: ValidateResult, details: bool
) -> None:
    text = " ".join(shown(page(failed(spring), details)).split())
    assert "free-fall on mujoco Euler" in text
    assert "gave up" in text
    assert "Nearest to the truth" not in text


def test_a_run_that_failed_is_a_failed_test_of_junit(spring: ValidateResult) -> None:
    root = ElementTree.fromstring(junit_of(failed(spring)).split("\n", 1)[1])
    messages = {each.get("message") for each in root.findall(".//testcase/failure")}
    assert messages == {"failed: gave up"}


def test_a_picture_of_nothing_is_a_note_and_json_and_junit_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    need_engine("mujoco")
    case = replace(CASES["free-fall"], measure=lambda run: math.nan * run.advance(0.1))
    monkeypatch.setitem(CASES, case.name, case)
    junit, plot = tmp_path / "n.xml", tmp_path / "n.svg"
    words = ["validate", "--case", "free-fall", "--json", "--jobs", "1"]
    assert main([*words, "--junit", str(junit), "--plot", str(plot)]) == 1
    printed = capsys.readouterr()
    assert {row["verdict"] for row in json.loads(printed.out)["results"]} == {"diverges"}
    assert ElementTree.parse(junit).getroot().findall(".//failure")
    assert str(plot) in printed.err
    assert not plot.exists()


def test_two_outputs_of_one_name_are_refused(tmp_path: Path) -> None:
    file = str(tmp_path / "same.svg")
    assert main(["validate", "--case", "free-fall", "--plot", file, "--junit", file]) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_next_command_keeps_what_was_typed_in_one_line(spring: ValidateResult) -> None:
    cases = ("spring-energy", "free-fall", "order-of-*")
    request = ValidateRequest(cases=cases, timesteps=(0.003, 0.001), jobs=2)
    (line,) = [
        line
        for line in shown(page(replace(spring, request=request))).splitlines()
        if "statemachine validate" in line
    ]
    typed = shlex.split(line)
    assert [typed[k + 1] for k, word in enumerate(typed) if word == "--case"] == list(cases)
    assert [typed[k + 1] for k, word in enumerate(typed) if word == "--timestep"] == [
        "0.003",
        "0.001",
    ]
    assert typed[typed.index("--jobs") + 1] == "2"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="children are read from /proc")
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_sigterm_leaves_no_file_of_a_case(tmp_path: Path, jobs: str) -> None:
    need_engine("pybullet")
    words = ("validate", "--backend", "pybullet", "--case", "weld-*", "--jobs", jobs)
    run = subprocess.Popen(
        [sys.executable, "-m", "statemachine", *words],
        cwd=ROOT,
        env=os.environ | {"TMPDIR": str(tmp_path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    assert soon(lambda: any(tmp_path.rglob("case.xml")))
    run.terminate()
    assert run.wait(timeout=300) != 0
    assert list(tmp_path.rglob("case.xml")) == []
