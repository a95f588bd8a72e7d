"""Predictions kept in a file to hand in."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from statemachine.errors import BadInputError
from statemachine.page import Question
from statemachine.report.quiz import RecordedReader

from .conftest import assert_in, refused, written
from .test_lessons import _at_a_terminal

ONE = Question("how many?", ("1", "2"), 1, "counted")
NONE = Question("which?", ("x", "y"), None, "neither")


def test_the_first_answer_counts_and_a_session_is_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.json"
    typed = iter(["", "a", "b", "b"])
    monkeypatch.setattr("builtins.input", lambda _: next(typed))
    reader = RecordedReader(file, "state")
    assert json.loads(file.read_text())["of"] == 0
    assert reader.ask(ONE) is None  # passed: no answer
    assert json.loads(file.read_text())["of"] == 0
    assert reader.ask(ONE) == 0
    again = RecordedReader(file, "state")
    capsys.readouterr()
    assert again.ask(ONE) == 1  # now right, but the first counts
    assert "your first answer counts: 1" in capsys.readouterr().out
    assert again.summary == "mine.json: 0 of 1 predictions right"
    again.lesson = "reset"
    assert again.ask(NONE) == 1
    record = json.loads(file.read_text())
    assert (record["score"], record["of"]) == (0, 2)
    assert record["answers"] == [
        {"lesson": "state", "question": "how many?", "predicted": "1", "found": "2",
         "right": False},
        {"lesson": "reset", "question": "which?", "predicted": "y", "found": None,
         "right": False},
    ]  # fmt: skip


@pytest.mark.parametrize(
    "text", ["", "[]", '{"kind": "x"}', '{"kind": "statemachine predictions", "answers": [1]}']
)
def test_another_file_is_not_overwritten(tmp_path: Path, text: str) -> None:
    file = written(tmp_path / "mine.json", text)
    refused((BadInputError, "no record of predictions", lambda: RecordedReader(file)))
    assert file.read_text() == text


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_lesson_at_a_terminal_is_recorded(tmp_path: Path) -> None:
    file = tmp_path / "mine.json"
    assert_in(
        _at_a_terminal(
            *("lesson", "state", "--record", str(file)), typed=[("Your prediction", "c\n")]
        ),
        "You predicted it",
        "mine.json: 1 of 1 predictions right",
    )
    record = json.loads(file.read_text())
    assert (record["score"], record["of"]) == (1, 1)
    assert record["answers"][0]["predicted"] == "12"
