"""How commands pass on what was typed, write what is asked for, and end."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import statemachine as sm
from statemachine import cli
from statemachine.cli import check, trace
from statemachine.cli.compare import answers
from statemachine.errors import BadInputError, MissingEngineError
from statemachine.lab.recordings import Trace, read, record_scenario, write
from statemachine.lab.runs.scenarios import SCENARIOS

from .support.files import written
from .support.traces import changed

REQUESTS = "statemachine.lab.questions.requests"
QUESTIONS = "statemachine.lab.questions"


class Call:
    """Something that is called in place of what takes long, and remembers with what.

    Attributes:
        arguments: Of each call.
        result: What it returns.
        error: What it raises instead.
    """

    def __init__(self, result: Any = None) -> None:
        self.arguments: list[tuple[Any, ...]] = []
        self.result = result
        self.error: BaseException | None = None

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        self.arguments.append((*arguments, *named.values()))
        if self.error is not None:
            raise self.error
        return self.result


def replaced(patch: pytest.MonkeyPatch, module: str, name: str, result: Any = None) -> Call:
    """Replace a function of a module for the rest of a test."""
    call = Call(result)
    patch.setattr(importlib.import_module(module), name, call)
    return call


# statemachine compare.

# What is typed, where it is answered, and where the page is made.
ASKED = {
    "converge": (["hold", "--converge"], "converge", "convergence"),
    "one step": (["hold", "--one-step"], "one_step", "one_step"),
    "engines": (
        ["hold", *(f"--backend={name}" for name in ("mujoco", "pybullet", "motrix"))],
        "engines",
        "engines",
    ),
    "versions": (["hold", "--versions", "3.3.7,4.0.0"], "versions", "versions"),
    "why": (["hold", "--why"], "causes", ""),
    "gap": (["hold"], "gap", "comparison"),
}


class Compared:
    """A question of `statemachine compare` whose answer is written down here.

    Attributes:
        answer: What answers it.
        page: What makes its page.
        show: What shows the page; it returns 7 as the exit code.
    """

    def __init__(self, patch: pytest.MonkeyPatch, asked: str) -> None:
        self.words, request, page = ASKED[asked]
        comparison = SimpleNamespace(name="comparison")
        run = SimpleNamespace(traces="traces", unmatched=("a",), notes=("b",))
        self.result = SimpleNamespace(
            comparisons="comparisons",
            comparison=comparison,
            floor="floor",
            run=run,
            request=SimpleNamespace(run=SimpleNamespace(what=())),
            figures=lambda: "figures",
        )
        self.written_page = SimpleNamespace(blocks="blocks")
        module = f"{QUESTIONS}.{page}" if page else "statemachine.lab.why.page"
        self.answer = replaced(patch, f"{REQUESTS}.{request}", "answer", self.result)
        self.page = replaced(patch, module, "page", self.written_page)
        self.show = replaced(patch, "statemachine.cli.compare.answers", "show", 7)

    def run(self, *more: str) -> int:
        """Return the exit code of what is typed."""
        return answers.run(cli.options_of_words(["compare", *self.words, *more]))


@pytest.mark.parametrize("asked", ASKED)
def test_what_is_asked_is_answered_by_its_own_module_and_shown(
    asked: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared = Compared(monkeypatch, asked)
    assert compared.run() == 7
    [(request, _)] = compared.answer.arguments
    assert type(request).__module__ == f"{REQUESTS}.{ASKED[asked][1]}"
    assert compared.page.arguments == [(compared.result, False)]
    shown = "figures" if asked == "gap" else compared.result
    assert compared.show.arguments == [(compared.written_page, shown, False)]


@pytest.mark.parametrize("asked", [name for name in ASKED if name != "gap"])
def test_details_and_json_are_passed_on(asked: str, monkeypatch: pytest.MonkeyPatch) -> None:
    compared = Compared(monkeypatch, asked)
    compared.run("--details", "--json")
    assert compared.page.arguments == [(compared.result, True)]
    assert compared.show.arguments == [(compared.written_page, compared.result, True)]


@pytest.mark.parametrize("asked", ASKED)
def test_an_interrupt_before_anything_is_known_ends_the_command(
    asked: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    compared = Compared(monkeypatch, asked)
    compared.answer.error = KeyboardInterrupt()
    with pytest.raises(SystemExit) as ended:
        compared.run()
    assert ended.value.code == 130
    assert compared.show.arguments == []
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_an_interrupt_of_another_kind_is_not_taken_for_one(monkeypatch: pytest.MonkeyPatch) -> None:
    class StoppedError(KeyboardInterrupt):
        pass

    compared = Compared(monkeypatch, "converge")
    compared.answer.error = StoppedError()
    with pytest.raises(StoppedError):
        compared.run()


def test_releases_are_written_as_tests_and_drawn(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    compared = Compared(monkeypatch, "versions")
    tests = replaced(monkeypatch, f"{QUESTIONS}.run_files", "write_tests")
    pictures = replaced(monkeypatch, "statemachine.show.charts", "write_pictures")
    junit, plot = tmp_path / "a.xml", tmp_path / "a.svg"
    assert compared.run("--junit", str(junit), "--plot", str(plot)) == 7
    assert tests.arguments == [(junit, "comparisons")]
    assert pictures.arguments == [("blocks", plot)]


def test_of_releases_nothing_is_written_that_is_not_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compared = Compared(monkeypatch, "versions")
    tests = replaced(monkeypatch, f"{QUESTIONS}.run_files", "write_tests")
    pictures = replaced(monkeypatch, "statemachine.show.charts", "write_pictures")
    compared.run()
    assert (tests.arguments, pictures.arguments) == ([], [])


@pytest.mark.parametrize("asked", ["versions", "gap"])
def test_a_file_that_cannot_be_written_is_refused_before_anything_runs(
    asked: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    compared = Compared(monkeypatch, asked)
    with pytest.raises((BadInputError, OSError)):
        compared.run("--plot", str(tmp_path / "none" / "a.svg"))
    assert compared.answer.arguments == []


def test_two_runs_are_drawn_filmed_and_written_as_tests(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    compared = Compared(monkeypatch, "gap")
    files = f"{QUESTIONS}.run_files"
    tests = replaced(monkeypatch, files, "write_tests")
    figure, film = (replaced(monkeypatch, files, f"write_{name}") for name in ("figure", "film"))
    replaced(monkeypatch, files, "find_renderer", "renderer")
    shown = replaced(monkeypatch, files, "ShownModels")
    monkeypatch.setattr(shown, "of", lambda run: ("models of", run), raising=False)
    paths = tmp_path / "a.xml", tmp_path / "a.svg", tmp_path / "a.webp"
    assert (
        compared.run("--junit", str(paths[0]), "--plot", str(paths[1]), "--film", str(paths[2]))
        == 7
    )
    result = compared.result
    assert tests.arguments == [(paths[0], [result.comparison])]
    [(*drawn, _)] = figure.arguments
    assert drawn == [paths[1], "traces", result.comparison, "floor"]
    [(*filmed, _)] = film.arguments
    models = ("models of", result.request.run)
    assert filmed == [paths[2], "traces", models, "renderer", result.comparison]


@pytest.mark.parametrize(("words", "lines"), [((), 0), (("--json",), 2)])
def test_notes_go_beside_json_alone(
    words: tuple[str, ...],
    lines: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    Compared(monkeypatch, "gap").run(*words)
    assert len(capsys.readouterr().err.splitlines()) == lines


# statemachine check.


class Checked:
    """A student's file whose grade is written down here."""

    def __init__(self, patch: pytest.MonkeyPatch, folder: Path) -> None:
        self.file, self.results = written(folder / "step_loop.py", ""), folder / "results.json"
        self.answer = replaced(patch, "statemachine.course.grading.request", "answer", "grade")
        self.faults = replaced(
            patch, "statemachine.course.grading.request", "answer_faults", "examination"
        )
        self.page = replaced(patch, "statemachine.course.grading.page", "grade_page", "page")
        replaced(patch, "statemachine.course.grading.page", "faults_page", "page of faults")
        self.texts = replaced(
            patch, "statemachine.course.grading.page", "gradescope_results", "text of results"
        )
        self.show = replaced(patch, "statemachine.cli.check", "show", 5)

    def run(self, *words: str) -> int:
        """Return the exit code of what is typed."""
        return check.run(cli.options_of_words(["check", *words]))


@pytest.fixture
def checked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Checked:
    """Return a student's file that is graded at once."""
    return Checked(monkeypatch, tmp_path)


@pytest.mark.parametrize(("words", "is_json"), [((), False), (("--json",), True)])
def test_a_file_is_graded_and_shown(
    words: tuple[str, ...], is_json: bool, checked: Checked
) -> None:
    assert checked.run(str(checked.file), "--time-limit", "2", *words) == 5
    [(request, _)] = checked.answer.arguments
    assert (Path(request.file), request.time_limit) == (checked.file, 2.0)
    assert checked.show.arguments == [("page", "grade", is_json)]
    assert not checked.results.exists()


def test_a_grade_is_written_for_gradescope_and_shown(checked: Checked) -> None:
    assert checked.run(str(checked.file), "--gradescope", str(checked.results)) == 5
    assert checked.texts.arguments == [("grade",)]
    assert checked.results.read_text() == "text of results"
    assert checked.show.arguments == [("page", "grade", False)]


def test_why_a_file_is_not_graded_is_written_for_gradescope(checked: Checked) -> None:
    checked.answer.error = BadInputError("it is a folder")
    with pytest.raises(BadInputError):
        checked.run(str(checked.file), "--gradescope", str(checked.results))
    assert checked.texts.arguments == [(None, "it is a folder")]
    assert checked.results.read_text() == "text of results"
    assert checked.show.arguments == []


def test_a_file_is_not_graded_where_its_grade_cannot_be_written(
    checked: Checked, tmp_path: Path
) -> None:
    with pytest.raises((BadInputError, OSError)):
        checked.run(str(checked.file), "--gradescope", str(tmp_path / "none" / "results.json"))
    assert checked.answer.arguments == []


def test_tests_are_run_on_the_faults_that_are_named(checked: Checked) -> None:
    words = ("--faults", str(checked.file), "--only", "xyzw", "--only", "degrees", "--json")
    assert checked.run(*words) == 5
    [(request, _)] = checked.faults.arguments
    assert (Path(request.file), request.only) == (checked.file, ("xyzw", "degrees"))
    assert checked.show.arguments == [("page of faults", "examination", True)]
    assert checked.answer.arguments == []


# statemachine trace.


@pytest.fixture(scope="module")
def run_of_ten_steps() -> Trace:
    """Return a run of the arm."""
    return record_scenario(SCENARIOS["hold"], sm.load("so101"), seconds=0.05)


@pytest.fixture
def file(run_of_ten_steps: Trace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the file of a trace in the working folder."""
    monkeypatch.chdir(tmp_path)
    return write(run_of_ten_steps, tmp_path / "run.npz")


def traced(*words: str) -> int:
    """Return the exit code of `statemachine trace`."""
    options = cli.options_of_words(["trace", *words])
    return options.run(options)


@pytest.mark.parametrize(("words", "target"), [((), "run.svg"), (("-o", "b.png"), "b.png")])
def test_curves_are_drawn_beside_the_trace_or_where_it_is_said(
    words: tuple[str, ...],
    target: str,
    file: Path,
    run_of_ten_steps: Trace,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn = replaced(monkeypatch, f"{QUESTIONS}.run_files", "write_figure")
    assert traced("plot", file.name, *words) == 0
    [(path, [trace], _)] = drawn.arguments
    assert path == Path(target)
    assert trace.qpos.tolist() == run_of_ten_steps.qpos.tolist()


def test_a_figure_that_cannot_be_written_is_refused(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = replaced(monkeypatch, f"{QUESTIONS}.run_files", "write_figure")
    for target in ("a.txt", "none/a.svg"):
        with pytest.raises((BadInputError, OSError)):
            traced("plot", file.name, "-o", target)
    assert drawn.arguments == []


@pytest.mark.parametrize(
    ("words", "target", "models"),
    [
        ((), "run.webp", ([None], None)),
        (("so101", "-o", "b.webp"), "b.webp", (["so101"], None)),
    ],
)
def test_a_film_is_made_beside_the_trace_or_where_it_is_said(
    words: tuple[str, ...],
    target: str,
    models: tuple[Any, ...],
    file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    files = f"{QUESTIONS}.run_files"
    filmed = replaced(monkeypatch, files, "write_film")
    replaced(monkeypatch, files, "find_renderer", "renderer")
    assert traced("film", file.name, *words) == 0
    [(path, [trace], shown, renderer, _)] = filmed.arguments
    assert (path, renderer, len(trace)) == (Path(target), "renderer", 11)
    assert ([*shown.files], shown.menagerie) == models


def test_a_film_needs_what_renders_it(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = f"{QUESTIONS}.run_files"
    filmed = replaced(monkeypatch, files, "write_film")
    replaced(monkeypatch, files, "find_renderer").error = MissingEngineError("no renderer")
    with pytest.raises(MissingEngineError):
        traced("film", file.name)
    assert filmed.arguments == []


def test_a_trace_is_recorded_and_what_it_replaces_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("record", "hold", "--seconds", "0.05", "-o", "a.npz")
    printed: list[list[str]] = []
    for _ in range(2):
        assert traced(*words) == 0
        printed.append(capsys.readouterr().out.splitlines())
    assert [len(lines) for lines in printed] == [1, 2]
    assert "a.npz" in printed[0][0]
    assert "11" in printed[0][0]
    assert printed[1][0] == printed[0][0]
    assert len(read(tmp_path / "a.npz")) == 11


@pytest.mark.parametrize(
    ("header", "code", "lines", "errors"),
    [({}, 0, 1, 0), ({"ended": "it diverged"}, 1, 1, 1), ({"rewritten": 3}, 0, 2, 0)],
)
def test_a_run_that_ended_early_is_written_and_says_no(
    header: dict[str, Any],
    code: int,
    lines: int,
    errors: int,
    file: Path,
    run_of_ten_steps: Trace,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    played = changed(run_of_ten_steps, header)
    replaced(monkeypatch, "statemachine.lab.recordings.request", "answer_play", played)
    assert traced("play", file.name, "-o", "b.npz") == code
    told = capsys.readouterr()
    assert len(told.out.splitlines()) == lines
    assert [("it diverged" in line) for line in told.err.splitlines()] == [True] * errors
    assert len(read(Path("b.npz"))) == 11


def test_an_action_has_to_be_typed() -> None:
    with pytest.raises(BadInputError):
        trace.run(cli.options_of_words(["trace"]))
