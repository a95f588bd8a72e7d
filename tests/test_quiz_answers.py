"""What a reader's answers are kept as, and what the notebook makes of the lessons' questions."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from statemachine.course import notebook, quiz
from statemachine.course.asking import Stopped
from statemachine.course.lessons import LESSONS
from statemachine.course.quiz import Reader, RecordedReader
from statemachine.show.blocks import Page, Question, Table, Text
from statemachine.show.pictures import RobotPicture

HOW_MANY = Question("how many `steps`?", ("`one`", "two", "three"), 1, "two were counted")
WHICH = Question("which?", ("x", "y"), None, "neither of them")
OPEN = Question("how fast?", ("slow", "fast"), 0, "it varies", undecided=True)


class Typist:
    """Somebody who types, line by line.

    Attributes:
        prompts: Before each line that they typed.
    """

    def __init__(self, patch: pytest.MonkeyPatch, *lines: str) -> None:
        self.prompts: list[str] = []
        self._lines: Iterator[str] = iter(lines)
        patch.setattr("builtins.input", self._input)

    def _input(self, prompt: str) -> str:
        self.prompts.append(prompt)
        line = next(self._lines)
        if line == "^D":
            raise EOFError
        return line


def kept(file: Path) -> dict[str, Any]:
    """Return what is in the file of a reader."""
    return json.loads(file.read_text("utf-8"))


@pytest.mark.parametrize(
    ("lines", "choice"),
    [
        (["a"], 0),
        (["c"], 2),
        (["B)"], 1),
        ([" b "], 1),
        (["d", "b"], 1),
        (["ab", "", "c"], None),
        ([""], None),
        (["^D"], None),
    ],
)
def test_a_letter_is_a_choice(
    lines: list[str], choice: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    Typist(monkeypatch, *lines)
    assert Reader().ask(HOW_MANY) == choice


@pytest.mark.parametrize("word", ["q", "Quit", "exit "])
def test_a_reader_may_stop(word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Typist(monkeypatch, word)
    with pytest.raises(Stopped):
        Reader().ask(HOW_MANY)


@pytest.mark.parametrize(("lines", "waits"), [([""], 1), (["x", "y", ""], 3)])
def test_a_reader_goes_on_with_enter_alone(
    lines: list[str], waits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    typist = Typist(monkeypatch, *lines)
    Reader().go_on("the end")
    assert len(typist.prompts) == waits
    assert all("the end" in prompt for prompt in typist.prompts)


@pytest.mark.parametrize("word", ["q", "^D"])
def test_a_reader_stops_instead_of_going_on(word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Typist(monkeypatch, word)
    with pytest.raises(Stopped):
        Reader().go_on()


def test_what_was_typed_ahead_is_dropped_at_a_terminal_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    termios = pytest.importorskip("termios")
    dropped: list[Any] = []
    monkeypatch.setattr(termios, "tcflush", lambda *what: dropped.append(what))
    for is_terminal in (False, True):
        stdin = SimpleNamespace(isatty=lambda answer=is_terminal: answer)
        monkeypatch.setattr(sys, "stdin", stdin)
        Typist(monkeypatch, "a")
        Reader().ask(HOW_MANY)
        assert dropped == [(stdin, termios.TCIFLUSH)] * is_terminal


@pytest.mark.parametrize(
    ("question", "letter", "found", "right"),
    [(HOW_MANY, "b", "two", True), (HOW_MANY, "a", "two", False), (WHICH, "a", None, False)],
)
def test_an_answer_is_kept_with_what_was_found(
    question: Question,
    letter: str,
    found: str | None,
    right: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Typist(monkeypatch, letter)
    RecordedReader(tmp_path / "mine.json", "state").ask(question)
    record = kept(tmp_path / "mine.json")
    predicted = question.choices["abc".index(letter)]
    answer = {
        "lesson": "state",
        "question": question.text,
        "predicted": predicted,
        "found": found,
        "right": right,
    }
    assert record["answers"] == [answer]
    assert (record["score"], record["of"]) == (int(right), 1)


@pytest.mark.parametrize(("question", "letter"), [(HOW_MANY, ""), (OPEN, "a"), (OPEN, "")])
def test_a_passed_or_undecided_question_is_not_kept(
    question: Question, letter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Typist(monkeypatch, letter)
    choice = RecordedReader(tmp_path / "mine.json", "state").ask(question)
    assert choice == (0 if letter else None)
    assert kept(tmp_path / "mine.json")["answers"] == []


@pytest.mark.parametrize(("second", "is_told"), [("a", False), ("b", True)])
def test_a_second_answer_that_is_another_is_told_the_first(
    second: str,
    is_told: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    Typist(monkeypatch, "a", second)
    reader = RecordedReader(tmp_path / "mine.json", "state")
    reader.ask(HOW_MANY)
    capsys.readouterr()
    reader.ask(HOW_MANY)
    last = capsys.readouterr().out.splitlines()[-1]
    assert ("mine.json" in last) is is_told
    assert not is_told or ("one" in last and "`" not in last)
    assert kept(tmp_path / "mine.json")["score"] == 0


def test_the_same_question_of_another_lesson_counts_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Typist(monkeypatch, "a", "b")
    reader = RecordedReader(tmp_path / "mine.json", "state")
    reader.ask(HOW_MANY)
    reader.lesson = "reset"
    reader.ask(HOW_MANY)
    record = kept(tmp_path / "mine.json")
    assert (record["score"], record["of"]) == (1, 2)


def test_a_summary_has_the_score(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Typist(monkeypatch, "b", "x", "a", "b")
    reader = RecordedReader(tmp_path / "mine.json", "state")
    reader.ask(HOW_MANY)
    reader.ask(WHICH)
    reader.lesson = "reset"
    reader.ask(HOW_MANY)
    figures = [word for word in reader.summary.split() if word.isdigit()]
    assert "mine.json" in reader.summary
    assert figures == ["2", "3"]


# The notebook.


def page_of(*blocks: Any) -> Page:
    """Return a page of some blocks."""
    return Page("How many?", "a model on an engine", blocks)


def test_a_page_opens_with_its_first_words_and_its_questions() -> None:
    table = Table(("a",), [("1",)])
    page = page_of(Text("first"), Text("second"), table, Text("third"), HOW_MANY, WHICH)
    text = notebook.opening_text(page)
    first, second, asked = text.split("\n\n", 2)
    assert (first, second) == ("first", "second")
    assert "third" not in text
    assert asked.index("how many") < asked.index("which?")
    assert "two were counted" not in text


def test_a_picture_that_opens_a_page_is_left_out_of_the_opening() -> None:
    picture: Any = object.__new__(RobotPicture)
    assert notebook.opening_text(page_of(picture, Text("first"))) == "first"
    assert notebook.opening_text(page_of(Text("first"), picture, Text("second"))) == "first"


def shown(page: Page, prediction: str) -> list[str]:
    """Return the parts that a notebook shows of a page."""
    return notebook.Shown(page, prediction)._repr_markdown_().split("\n\n")


def test_a_notebook_shows_what_a_cell_above_does_not() -> None:
    page = page_of(Text("first"), Table(("a",), [("17",)]), Text("second"))
    parts = shown(page, "")
    assert parts[0] == "*a model on an engine*"
    assert "first" not in parts
    assert parts[-1] == "second"
    assert any("17" in part for part in parts)


@pytest.mark.parametrize(
    ("prediction", "answers"),
    [("", (False, False)), ("b", (True, False)), ("ba", (True, True)), ("bb", (True, True))],
)
def test_each_question_is_judged_by_its_letter(prediction: str, answers: tuple[bool, bool]) -> None:
    page = page_of(HOW_MANY, WHICH)
    first, second = shown(page, prediction)[1:]
    nothing = notebook.Shown(page)._repr_markdown_().split("\n\n")[1:]
    assert (first != nothing[0], second != nothing[1]) == answers
    assert ("two were counted" in first, "neither of them" in second) == (True, True)


# `build`, with two lessons whose pages are written down here.


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Return the cells of a notebook of two lessons: one on the path, one beside it."""
    pages: dict[str, Sequence[Any]] = {
        "state": (Text("of state"), HOW_MANY),
        "energy": (Text("of energy"),),
    }
    monkeypatch.setattr(notebook, "LESSONS", {name: LESSONS[name] for name in pages})
    monkeypatch.setattr(notebook, "take", lambda entry, *_: entry.name)
    monkeypatch.setattr(
        notebook, "page_of_lesson", lambda entry, taken: page_of(*pages[taken["mujoco"]])
    )
    return json.loads(notebook.build())["cells"]


def test_a_notebook_has_the_cells_of_each_lesson_in_order(built: list[dict[str, Any]]) -> None:
    kinds = {cell["id"]: cell["cell_type"] for cell in built}
    assert list(kinds.items()) == [
        ("start", "markdown"),
        ("install", "code"),
        ("setup", "code"),
        ("state-text", "markdown"),
        ("state-prediction", "code"),
        ("state-code", "code"),
        ("state-run", "code"),
        ("energy-text", "markdown"),
        ("energy-code", "code"),
        ("energy-run", "code"),
        ("end", "markdown"),
    ]


def test_cells_of_code_have_not_run(built: list[dict[str, Any]]) -> None:
    code = [cell for cell in built if cell["cell_type"] == "code"]
    words = [cell for cell in built if cell["cell_type"] == "markdown"]
    assert all((cell["outputs"], cell["execution_count"]) == ([], None) for cell in code)
    assert all(cell.keys() == {"cell_type", "id", "metadata", "source"} for cell in words)


def test_a_lesson_on_the_path_is_numbered(built: list[dict[str, Any]]) -> None:
    texts = {cell["id"]: "".join(cell["source"]) for cell in built}
    assert texts["state-text"].startswith("## 1. How many?\n\nof state\n\n")
    assert texts["energy-text"] == "## How many?\n\nof energy"


def test_a_lesson_runs_with_the_prediction_where_it_asks(built: list[dict[str, Any]]) -> None:
    texts = {cell["id"]: "".join(cell["source"]) for cell in built}
    assert texts["state-prediction"].startswith('prediction = ""  # ')
    assert texts["state-prediction"].endswith("a, b or c")
    assert texts["state-run"] == 'lesson("state", BACKEND, prediction)'
    assert texts["energy-run"] == 'lesson("energy", BACKEND)'


def test_the_code_of_a_lesson_loads_its_model_on_the_chosen_engine(
    built: list[dict[str, Any]],
) -> None:
    texts = {cell["id"]: "".join(cell["source"]) for cell in built}
    for name in ("state", "energy"):
        assert f'sm.load("{LESSONS[name].model}", backend=BACKEND)' in texts[f"{name}-code"]


def test_the_code_of_the_notebook_compiles(built: list[dict[str, Any]]) -> None:
    for cell in built:
        if cell["cell_type"] == "code":
            compile("".join(cell["source"]), cell["id"], "exec")


def test_choices_are_lettered() -> None:
    assert quiz.lettered(HOW_MANY) == ["a) `one`", "b) two", "c) three"]
