"""The documentation and the notebook are made from runs, whole, and read without a network."""

from __future__ import annotations

import ast
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import nbformat
import pytest
from nbclient import NotebookClient

import statemachine as sm
from statemachine.course import notebook as md
from statemachine.course.lessons import LESSONS, Lesson
from statemachine.course.lessons.session import LessonRun, page_of_lesson, take
from statemachine.course.notebook import build, lesson, opening_text
from statemachine.errors import BadInputError
from statemachine.show import terminal
from statemachine.show.blocks import Heading, Page, Printed, Question, Table, Text
from statemachine.show.charts import drawn
from statemachine.show.diagrams.shapes import Arrow, Box, Bracket, Label
from statemachine.show.pictures import Diagram, Traces
from tools.docs_pages import make_path

from .support.backends import slow_on
from .support.claims import assert_in, refused
from .support.pages import blocks, need_engines_of
from .support.processes import of_python
from .support.requirements import ROOT, need_engine

_NOTEBOOK = ROOT / "notebooks" / "path.ipynb"


PICTURES: dict[str, Callable[[], Traces | Diagram]] = {
    "curve": lambda: Traces("t", "x", "y", {"one": ([0, 1, 2], [3, 4, 5])}),
    "curves on a logarithmic axis": lambda: Traces(
        "t", "x", "y", {"a": ([0, 1], [0.0, 1e-9]), "b": ([0, 1], [1e-3, 1e-6])}, log=True
    ),
    "diagram": lambda: Diagram(
        "d",
        "w",
        (
            Box(0, 0, 9, 3, "call", "step", is_rounded=True),
            Label("a", 2, 1, 5),
            Arrow(((9, 1), (4, 1))),
            Bracket(11, 0, 2, "step"),
        ),
    ),
}


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_is_the_same_each_time_and_has_its_words_as_text(name: str) -> None:
    picture = PICTURES[name]()
    text = drawn([picture], "svg")
    assert text == drawn([picture], "svg")
    ElementTree.fromstring(text)
    assert b"<text" in text  # and no glyphs as paths


def test_markdown_takes_nothing_for_its_own() -> None:
    table = Table(("a|b", "n"), [("x*y", "[1]")], title="t", emphasis=frozenset({0}))
    assert_in(md.block_as_markdown(table, lambda _: ""), r"a\|b", r"**x\*y**", ":-- | --:")
    assert md.block_as_markdown(Text("data.qpos[1] <b>"), lambda _: "") == r"data.qpos\[1\] \<b\>"


def test_a_line_break_in_a_name_breaks_no_table(capsys: pytest.CaptureFixture[str]) -> None:
    names = ["a\nb.xml", "a\r\nb.xml", "a\u2028b.xml", "\na?b.xml"]
    table = Table(("file", "n"), [(name, "1") for name in names])
    lines = md.block_as_markdown(table, lambda _: "").splitlines()
    assert [line.count("|") for line in lines] == [3] * 6
    terminal.show(Page("t", "o", [table]))
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[-5:-1]]
    assert rows == [["a?b.xml", "1"]] * 3 + [["?a?b.xml", "1"]]


def test_a_line_break_in_a_heading_breaks_no_table() -> None:
    table = Table(("time", "mujoco\nservos on"), [("0 s", "0.000°")], title="t")
    _, _, *lines = md.block_as_markdown(table, lambda _: "").splitlines()
    assert [cell.strip() for cell in lines[0].split("|")[1:-1]] == ["time", "mujoco servos on"]
    assert [line.count("|") for line in lines] == [3] * 3


def test_a_line_breaks_no_name_and_parts_no_figure_from_its_unit(
    capsys: pytest.CaptureFixture[str],
) -> None:
    row = ("bias " * 12, "0.123456789", "0.123456789", "shoulder_lift_joint (limit)", "x y " * 20)
    table = Table(("what", "n", "m", "where", "why"), [row], words=frozenset({0, 3, 4}))
    narrow = Table(
        ("a", "b"), [("very_long_name_" * 6, "x " * 31 + "3 kg mm²")], words=frozenset({0, 1})
    )
    terminal.show(Page("t", "o", [table, narrow, Text("x" * 77 + " 12 mm")]))
    out = capsys.readouterr().out
    assert_in(out, "shoulder_lift_joint", "x\n12 mm\n", "  3 kg mm²\n", "name_very_  ")


def test_a_line_parts_no_range_of_a_side(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.show(Page("t", "o", [Text("x" * 77 + " -2 2 on the right")]))
    assert "x\n-2 2 on the right\n" in capsys.readouterr().out


def test_what_follows_a_heading_is_folded_under_its_words() -> None:
    asked = Question("Which?", ("x", "y"), 1, "So it is.")
    page = Page("t", "o", [asked, Printed({"a": "1\n"}), Text("p"), Heading("More*"), Text("q")])
    text = md.markdown(page, lambda _: "")
    first, second = re.findall(r"<details>(.*?)</details>", text, re.DOTALL)
    assert_in(first, "So it is.", "p")
    assert re.search(r"<summary>More\\\*</summary>.*q\s*$", second, re.DOTALL)


# What a page loads from elsewhere.
_ELSEWHERE = re.compile(
    r'<(?:script|img)\b[^>]*\bsrc="[^"]*//'
    r'|<link\b(?=[^>]*\brel="(?:stylesheet|icon|preload)")[^>]*\bhref="[^"]*//'
)
_FOLDED = re.compile(r"<details[ >].*?</details>", re.DOTALL)
# It stands open, below the fold: it is what a lesson is to be remembered by.
_DIAGRAM = re.compile(r'<figure class="diagram".*?</figure>', re.DOTALL)
# A paragraph that was meant to be a table.
_RAW_TABLE = re.compile(r"<p>\s*\|[^<]*\|")
_SMALL: dict[str, dict[str, Any]] = {
    "objects": {"worlds": 2},
    "replay": {"steps": 50},
    "time": {"steps": 50},
}


@dataclass(frozen=True)
class PathPage:
    """A page of the path, as Markdown.

    Attributes:
        page: The page.
        opening: What the notebook shows before the cell that answers.
        text: The whole page, its pictures left out.
        printed: What the lesson's code printed.
    """

    page: Page
    opening: str
    text: str
    printed: str

    @property
    def questions(self) -> list[Question]:
        """Return the questions of the page."""
        return blocks(self.page, Question)

    @property
    def unfolded(self) -> str:
        """Return what stands open on the page, but for the diagram."""
        return _DIAGRAM.sub("", _FOLDED.sub("", self.text))


@cache
def taken(name: str) -> LessonRun:
    """Take a lesson on MuJoCo, with its own options."""
    entry = LESSONS[name]
    return take(entry, sm.load(entry.model), "mujoco", {})


@pytest.fixture(scope="module", params=LESSONS)
def path_page(request: pytest.FixtureRequest) -> PathPage:
    """The page of each lesson of the path, on MuJoCo."""
    need_engines_of(request.param)
    entry = LESSONS[request.param]
    if entry.name in _SMALL:
        run = take(entry, sm.load(entry.model), "mujoco", _SMALL[entry.name])
    else:
        run = taken(entry.name)
    page = page_of_lesson(entry, {"mujoco": run})
    text = md.markdown(page, lambda _: "picture")
    return PathPage(page, opening_text(page), text, run.printed)


@pytest.mark.slow
def test_no_verdict_on_the_path_stands_open(path_page: PathPage) -> None:
    assert not re.search("[✓✗]", path_page.unfolded + path_page.opening)


@pytest.mark.slow
def test_each_answer_on_the_path_is_in_a_fold(path_page: PathPage) -> None:
    folds = _FOLDED.findall(path_page.text)
    assert path_page.questions
    for question, fold in zip(path_page.questions, folds, strict=True):
        assert md.answer(question) in fold
        assert question.because not in path_page.opening


@pytest.mark.slow
def test_nothing_stands_open_below_the_first_question_of_a_page_but_questions(
    path_page: PathPage,
) -> None:
    asked = [md.question_text(question) for question in path_page.questions]
    _, _, rest = path_page.unfolded.partition(asked[0])
    for question in asked:
        assert question in path_page.unfolded
        assert question in path_page.opening
        rest = rest.replace(question, "")
    assert not rest.strip()


@pytest.mark.slow
def test_nothing_that_the_code_prints_stands_above_the_questions(path_page: PathPage) -> None:
    before, _, _ = path_page.unfolded.partition(md.question_text(path_page.questions[0]))
    printed = {line for line in path_page.printed.splitlines() if line.strip()}
    assert not printed & set(before.splitlines())


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The documentation as HTML, made of runs on one engine, without a warning."""
    need_engine("pybullet")
    folder = tmp_path_factory.mktemp("documentation")
    source = folder / "docs"
    shutil.copytree(
        ROOT / "docs",
        source,
        ignore=shutil.ignore_patterns("_build", "path", "reference", "comparisons", "__pycache__"),
    )
    for name in ("models", "statemachine", "CONTRIBUTING.md"):
        (folder / name).symlink_to(ROOT / name)
    words = ("-m", "sphinx", "-W", "-q", "-b", "html", source, folder / "o")
    of_python(
        *words,
        code=0,
        HOME=str(folder),
        STATEMACHINE_DOCS_BACKENDS="mujoco",
        STATEMACHINE_DOCS_COMPARISONS="fall",
    )
    return folder / "o"


@pytest.fixture(scope="module")
def built_path(built: Path) -> list[str]:
    """The pages of the path."""
    return [page.read_text() for page in (built / "path").glob("*.html")]


@pytest.mark.slow
def test_the_documentation_builds_without_a_warning_with_a_page_of_each_lesson(
    built_path: list[str],
) -> None:
    assert len(built_path) == len(LESSONS)


@pytest.mark.slow
def test_a_page_of_the_path_loads_nothing_from_elsewhere(built_path: list[str]) -> None:
    assert [_ELSEWHERE.findall(text) for text in built_path] == [[]] * len(LESSONS)


@pytest.mark.slow
def test_no_page_of_the_path_fails_or_shows_a_verdict_above_its_folds(
    built_path: list[str],
) -> None:
    for text in built_path:
        assert "✗" not in text
        assert "✓" not in _FOLDED.sub("", text)


@pytest.mark.slow
def test_three_pages_of_the_path_have_an_open_diagram(built_path: list[str]) -> None:
    assert sum(len(_DIAGRAM.findall(_FOLDED.sub("", text))) for text in built_path) == 3


@pytest.mark.slow
def test_every_image_of_the_path_says_what_it_shows(built_path: list[str]) -> None:
    images = re.findall(r"<img\b[^>]*>", "".join(built_path))
    assert len(images) >= 5
    assert all(re.search(r'\balt="[^"]', image) for image in images)


@pytest.mark.slow
def test_no_table_of_the_documentation_is_left_as_text(built: Path) -> None:
    files = list(built.rglob("*.html"))
    assert len(files) > 20
    assert [file for file in files if _RAW_TABLE.search(file.read_text())] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "text"),
    [
        ("path/06-gravity", "53.89°"),
        ("path/09-time", "--realtime"),
        ("reference/conventions", "xyzw"),
        ("reference/calls", "mj_forward"),
        ("comparisons/fall", "12-bit encoder"),
        ("comparisons/fall-why", "9.81 m/s² on the left and 0 m/s² on the right"),
    ],
)
def test_a_page_of_the_documentation_has_what_was_computed(
    page: str, text: str, built: Path
) -> None:
    assert text in (built / f"{page}.html").read_text()


@pytest.mark.slow
def test_a_page_that_is_the_same_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "tools.docs_pages.LESSONS", {name: LESSONS[name] for name in ("state", "forward")}
    )
    first = make_path(tmp_path, say=lambda _: None)
    assert all("pybullet" in path.read_text("utf-8") for path in first)  # every engine here
    times = {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    assert make_path(tmp_path, say=lambda _: None) == first
    assert {path: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == times


@pytest.mark.slow
def test_the_notebook_is_what_the_lessons_make(monkeypatch: pytest.MonkeyPatch) -> None:
    def take_once(entry: Lesson, _model: sm.Model, backend: str, options: Any) -> LessonRun:
        assert (backend, options) == ("mujoco", {})
        return taken(entry.name)

    monkeypatch.setattr(md, "take", take_once)
    assert _NOTEBOOK.read_text(encoding="utf-8") == build(), "run: make notebook"


@pytest.fixture
def cells() -> dict[str, str]:
    """The source of each cell of the notebook of the path, by its id."""
    notebook = nbformat.read(_NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    return {cell.id: cell.source for cell in notebook.cells}


@pytest.mark.parametrize("file", ["path.ipynb", "comparing.ipynb"])
def test_a_notebook_is_kept_without_outputs(file: str) -> None:
    notebook = nbformat.read(_NOTEBOOK.with_name(file), as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)


def test_the_notebook_begins_with_what_is_to_be_installed(cells: dict[str, str]) -> None:
    assert list(cells)[1:3] == ["install", "setup"]


def test_the_notebook_has_the_whole_path(cells: dict[str, str]) -> None:
    parts = [f"{name}-{part}" for name in LESSONS for part in ("text", "prediction", "run")]
    assert [cell for cell in cells if cell in parts] == parts


def test_the_notebook_asks_before_the_code_and_judges_what_was_typed(
    cells: dict[str, str],
) -> None:
    names = list(cells)
    for name in LESSONS:
        assert names.index(f"{name}-prediction") == names.index(f"{name}-text") + 1
        assert f'lesson("{name}", BACKEND, prediction)' in cells[f"{name}-run"]


def run_notebook(backend: str, *lessons: str) -> list[str]:
    """Run the notebook on a backend, and return what is shown of each lesson.

    Args:
        backend: What BACKEND is set to.
        lessons: Those that are run, all if none is named; the cells of the others are left out.
    """
    notebook = nbformat.read(_NOTEBOOK, as_version=4)
    setup = next(cell for cell in notebook.cells if cell.id == "setup")
    setup.source = setup.source.replace('BACKEND = "mujoco"', f'BACKEND = "{backend}"')
    left_out = set(LESSONS) - set(lessons or LESSONS)
    notebook.cells = [cell for cell in notebook.cells if cell.id.rpartition("-")[0] not in left_out]
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(ROOT)}}).execute()
    return [
        output["data"]["text/markdown"]
        for cell in notebook.cells
        for output in cell.get("outputs", ())
        if output["output_type"] == "execute_result"
    ]


@pytest.mark.slow
def test_the_notebook_runs_headless() -> None:
    pages = run_notebook("mujoco")
    assert ["run says" in page for page in pages] == [True] * len(LESSONS)
    assert "✗" not in "".join(pages)
    assert "data:image/svg+xml;base64," in "".join(pages)


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_notebook_runs_on_the_engine_that_its_setup_names() -> None:
    """Each lesson on each engine is run by the tests of lessons."""
    (page,) = run_notebook("pybullet", "forward")
    assert "run says" in page
    assert "✗" not in page
    assert "pybullet" in page


_COMPARING = ROOT / "notebooks" / "comparing.ipynb"


def test_the_notebook_of_questions_is_short() -> None:
    notebook = nbformat.read(_COMPARING, as_version=4)
    nbformat.validate(notebook)
    assert 10 <= sum(cell.cell_type == "code" for cell in notebook.cells) <= 14


@pytest.fixture(scope="module")
def answers() -> dict[str, list[Any]]:
    """The outputs of the notebook of questions, by the id of the cell."""
    notebook = nbformat.read(_COMPARING, as_version=4)
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    return {cell.id: cell.outputs for cell in notebook.cells if cell.cell_type == "code"}


@pytest.mark.slow
def test_a_comparison_is_printed_in_the_notebook_of_questions(
    answers: dict[str, list[Any]],
) -> None:
    assert_in(answers["compare"][0]["text"], "✗", "shoulder", "lab.why(")


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["html", "why-html", "descriptions"])
def test_a_result_is_html_in_the_notebook_of_questions(
    cell: str, answers: dict[str, list[Any]]
) -> None:
    assert '<div class="statemachine-result">' in answers[cell][0]["data"]["text/html"]


@pytest.mark.slow
def test_shares_of_the_notebook_of_questions_add_up(answers: dict[str, list[Any]]) -> None:
    shares = ast.literal_eval(answers["why"][0]["data"]["text/plain"])
    assert set(shares) == {"gains of elbow", "mass of fore"}
    assert sum(shares.values()) == pytest.approx(1.0, abs=0.02)


@pytest.mark.slow
def test_the_notebook_of_questions_draws_a_picture(answers: dict[str, list[Any]]) -> None:
    assert "image/png" in answers["plot"][-1]["data"]


@pytest.mark.slow
def test_the_notebook_of_questions_compares_a_model_and_names_a_stage(
    answers: dict[str, list[Any]],
) -> None:
    assert float(answers["model"][0]["data"]["text/plain"]) > 1e-3
    assert "mass matrix" in answers["one-step"][0]["data"]["text/plain"]


@pytest.mark.slow
@pytest.mark.parametrize("backend", slow_on("pybullet"), indirect=True)
def test_a_lesson_in_a_notebook_is_of_the_engine_that_is_asked_for(backend: str) -> None:
    result = lesson("forward", backend)
    text = result._repr_markdown_()  # as a notebook shows it
    assert_in(text, backend, "run says: b)")
    assert "import statemachine" not in text
    assert "notebook" in repr(result)


def test_a_lesson_of_a_notebook_is_refused_by_its_name() -> None:
    refused((KeyError, "Did you mean 'gravity'", lambda: lesson("gravty")))


def test_an_option_of_a_lesson_in_a_notebook_is_refused_by_its_name() -> None:
    refused((KeyError, "seconds", lambda: lesson("hold", "mujoco", second=1.0)))


@pytest.mark.parametrize(
    ("letter", "says"),
    [
        ("c", "predicted it: c."),
        pytest.param(" A ", "predicted a; it is c.", marks=pytest.mark.slow),
    ],
)
def test_a_prediction_in_the_notebook_is_judged(letter: str, says: str) -> None:
    assert says in lesson("state", prediction=letter)._repr_markdown_()


@pytest.mark.parametrize("letters", ["d", "cc", "1", "?"])
def test_what_is_no_letter_of_a_question_is_refused(letters: str) -> None:
    call = partial(lesson, "state", prediction=letters)
    refused((BadInputError, "a prediction is a letter", call))
