"""The documentation and the notebook are made from runs, whole, and read without a network."""

from __future__ import annotations

import ast
import re
import shutil
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import nbformat
import pytest
from nbclient import NotebookClient

import statemachine as sm
from statemachine.course import notebook as md
from statemachine.course.lessons import LESSONS
from statemachine.course.lessons.session import page_of_lesson, take
from statemachine.course.notebook import _opening, build, lesson
from statemachine.errors import BadInputError
from statemachine.show import terminal
from statemachine.show.blocks import Heading, Page, Printed, Question, Table, Text
from statemachine.show.charts import drawn
from statemachine.show.diagrams.shapes import Arrow, Box, Bracket, Label
from statemachine.show.pictures import Diagram, Traces
from tools.docs_pages import make_path

from .support.claims import assert_in, refused
from .support.pages import blocks
from .support.processes import of_python
from .support.requirements import ROOT

_NOTEBOOK = ROOT / "notebooks" / "path.ipynb"


_BOX = Box(0, 0, 9, 3, "call", "step", is_rounded=True)
_BRACKET = Bracket(11, 0, 2, "step")


@pytest.mark.parametrize(
    "picture",
    [
        Traces("t", "x", "y", {"one": ([0, 1, 2], [3, 4, 5])}),
        Traces("t", "x", "y", {"a": ([0, 1], [0.0, 1e-9]), "b": ([0, 1], [1e-3, 1e-6])}, log=True),
        Diagram("d", "w", (_BOX, Label("a", 2, 1, 5), Arrow(((9, 1), (4, 1))), _BRACKET)),
    ],
    ids=lambda each: type(each).__name__,
)
def test_a_picture_is_the_same_each_time(picture: Traces) -> None:
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
    assert lines[0] == "| time | mujoco servos on |"
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


@pytest.mark.slow
@pytest.mark.parametrize("name", LESSONS)
def test_no_page_of_the_path_shows_its_answers_open(name: str) -> None:
    entry = LESSONS[name]
    taken = take(entry, sm.load(entry.model), "mujoco", _SMALL.get(name, {}))
    page = page_of_lesson(entry, {"mujoco": taken})
    questions = blocks(page, Question)
    assert questions
    text = md.markdown(page, lambda _: "picture")
    shown, asks = _DIAGRAM.sub("", _FOLDED.sub("", text)), _opening(page)
    # The notebook asks before the cell that answers.
    assert not re.search("[✓✗]", shown + asks)
    before, _, after = shown.partition(md.asked(questions[0]))
    for question, fold in zip(questions, _FOLDED.findall(text), strict=True):
        asked = md.asked(question)
        assert md.answer(question) in fold
        assert asked in shown
        assert asked in asks
        assert question.because not in asks
        after = after.replace(asked, "")
    assert not after.strip()
    printed = {line for line in taken.printed.splitlines() if line.strip()}
    assert not printed & set(before.splitlines())


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_documentation_builds_without_a_warning(tmp_path: Path) -> None:
    source = tmp_path / "docs"
    shutil.copytree(
        ROOT / "docs",
        source,
        ignore=shutil.ignore_patterns("_build", "path", "reference", "comparisons", "__pycache__"),
    )
    for name in ("models", "statemachine", "CONTRIBUTING.md"):
        (tmp_path / name).symlink_to(ROOT / name)
    words = ("-m", "sphinx", "-W", "-q", "-b", "html", source, tmp_path / "o")
    of_python(*words, code=0, HOME=str(tmp_path), STATEMACHINE_DOCS_BACKENDS="mujoco")
    pages = [page.read_text() for page in (tmp_path / "o" / "path").glob("*.html")]
    assert len(pages) == len(LESSONS)
    for text in pages:
        assert not _ELSEWHERE.findall(text)
        assert "✗" not in text
        assert "✓" not in _FOLDED.sub("", text)
    assert sum(len(_DIAGRAM.findall(_FOLDED.sub("", text))) for text in pages) == 3
    for file in (tmp_path / "o").rglob("*.html"):
        assert not _RAW_TABLE.search(file.read_text()), file
    images = re.findall(r"<img\b[^>]*>", "".join(pages))
    assert len(images) >= 5
    assert all(re.search(r'\balt="[^"]', image) for image in images)
    for page, text in (
        ("path/06-gravity", "53.89°"),
        ("path/09-time", "--realtime"),
        ("reference/conventions", "xyzw"),
        ("reference/calls", "mj_forward"),
        ("comparisons/hold", "one count of a 12-bit encoder"),
        ("comparisons/hold-why", "servo law"),
    ):
        assert text in (tmp_path / "o" / f"{page}.html").read_text(), page


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
def test_the_notebook_is_what_the_lessons_make() -> None:
    assert _NOTEBOOK.read_text(encoding="utf-8") == build(), "run: make notebook"


def test_the_notebook_has_the_whole_path_asks_before_the_code_and_has_no_outputs() -> None:
    notebook = nbformat.read(_NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    cells = {cell.id: cell.source for cell in notebook.cells}
    assert list(cells)[1:3] == ["install", "setup"]
    parts = [f"{name}-{part}" for name in LESSONS for part in ("text", "prediction", "run")]
    assert [cell for cell in cells if cell in parts] == parts
    for name in LESSONS:
        assert list(cells).index(f"{name}-prediction") == list(cells).index(f"{name}-text") + 1
        assert f'lesson("{name}", BACKEND, prediction)' in cells[f"{name}-run"]


@pytest.mark.slow
def test_the_notebook_runs_headless(backend: str) -> None:
    notebook = nbformat.read(_NOTEBOOK, as_version=4)
    setup = next(cell for cell in notebook.cells if cell.id == "setup")
    setup.source = setup.source.replace('BACKEND = "mujoco"', f'BACKEND = "{backend}"')
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(ROOT)}}).execute()
    shown = [
        output["data"]["text/markdown"]
        for cell in notebook.cells
        for output in cell.get("outputs", ())
        if output["output_type"] == "execute_result"
    ]
    assert ["run says" in text for text in shown] == [True] * len(LESSONS)
    assert "✗" not in "".join(shown)
    assert "data:image/svg+xml;base64," in "".join(shown)


_COMPARING = ROOT / "notebooks" / "comparing.ipynb"


def test_the_notebook_of_questions_is_short_and_has_no_outputs() -> None:
    notebook = nbformat.read(_COMPARING, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert 10 <= len(code) <= 14
    assert not any(cell.outputs for cell in code)


@pytest.mark.slow
def test_the_notebook_of_questions_runs_and_shows_its_answers() -> None:
    notebook = nbformat.read(_COMPARING, as_version=4)
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    outputs = {cell.id: cell.outputs for cell in notebook.cells if cell.cell_type == "code"}
    printed = outputs["compare"][0]["text"]
    assert_in(printed, "✗", "shoulder", "lab.why(")
    for cell in ("html", "why-html", "descriptions"):
        assert '<div class="statemachine-result">' in outputs[cell][0]["data"]["text/html"]
    shares = ast.literal_eval(outputs["why"][0]["data"]["text/plain"])
    assert set(shares) == {"gains of elbow", "mass of fore"}
    assert sum(shares.values()) == pytest.approx(1.0, abs=0.02)
    assert "image/png" in outputs["plot"][-1]["data"]
    assert float(outputs["model"][0]["data"]["text/plain"]) > 1e-3
    assert "mass matrix" in outputs["one-step"][0]["data"]["text/plain"]


def test_a_lesson_in_a_notebook(backend: str) -> None:
    shown = lesson("forward", backend)
    text = shown._repr_markdown_()
    assert_in(text, backend, "The run says: b) 2 and 3.")
    assert "import statemachine" not in text
    assert "notebook" in repr(shown)
    refused(
        (KeyError, "Did you mean 'gravity'", lambda: lesson("gravty")),
        (KeyError, "seconds", lambda: lesson("hold", backend, second=1.0)),
    )


def test_a_prediction_in_the_notebook_is_judged() -> None:
    for given, said in (("c", "You predicted it: c."), (" A ", "You predicted a; it is c.")):
        assert said in lesson("state", prediction=given)._repr_markdown_()
    wrong = (partial(lesson, "state", prediction=letters) for letters in ("d", "cc", "1", "?"))
    refused(*((BadInputError, "a prediction is a letter", call) for call in wrong))
