"""A class of 41, judged: what a teacher gets on the evening of the deadline."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import Mock

import pytest

from statemachine.course.grading.class_table import NOTHING, ClassEntry
from statemachine.course.grading.judges import JUDGES
from statemachine.course.grading.overview import ClassResult
from statemachine.course.grading.request import ClassRequest, answer_class

from .support.class_of_students import COPIES, SIZE, write_class
from .support.requirements import need_engine

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class JudgedClass:
    """A class that was judged once.

    Attributes:
        request: What was asked.
        result: What came of it.
        verdicts: The folder that keeps them.
    """

    request: ClassRequest
    result: ClassResult
    verdicts: Path

    @property
    def entries(self) -> dict[str, ClassEntry]:
        """Return the entries by name."""
        return {entry.name: entry for entry in self.result.entries}


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> JudgedClass:
    """A class of 41, judged into a table."""
    need_engine("mujoco")
    folder = tmp_path_factory.mktemp("evening")
    request = ClassRequest((write_class(folder / "class"),), table=folder / "grades.csv")
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setenv("STATEMACHINE_JUDGED", str(folder / "judged"))
        return JudgedClass(request, answer_class(request), folder / "judged")


def test_a_class_of_41_is_judged(judged: JudgedClass) -> None:
    assert len(judged.entries) == SIZE
    assert NOTHING not in [entry.refusal for entry in judged.result.entries]


def test_copies_are_right_and_nothing_but_their_likeness_tells_of_them(
    judged: JudgedClass,
) -> None:
    for number in range(1, COPIES + 1):
        copy = judged.entries[f"{number:02}_copy.py"]
        assert (copy.right, copy.flags) == (len(JUDGES), ())
    (group,) = judged.result.alike
    assert len(group.students) == COPIES


@pytest.mark.parametrize(
    ("name", "remark"),
    [
        ("31_no_import.py", "nosuchmodule"),
        ("32_endless.py", "a loop that does not end?"),
        ("37_template.py", "not written"),
    ],
)
def test_a_file_that_does_not_run_is_told_why(name: str, remark: str, judged: JudgedClass) -> None:
    assert remark in judged.entries[name].remarks[0].text


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("33_empty.py", 1),
        ("34_no_function.py", 1),
        ("38_syntax.py", 1),
        ("35_prints.py", 0),
        ("40_helper", 0),
    ],
)
def test_a_file_has_a_remark_or_none(name: str, count: int, judged: JudgedClass) -> None:
    assert len(judged.entries[name].remarks) == count


def test_what_is_no_exercise_is_not_judged(judged: JudgedClass) -> None:
    students = {reason.students for reason in judged.result.unjudged}
    assert students == {("39_notebook.ipynb",), ("41_two",)}


def test_each_student_is_counted_once_at_each_function(judged: JudgedClass) -> None:
    for each in judged.result.functions:
        assert each.right + each.wrong + each.not_written + each.not_judged == SIZE
        assert each.right >= COPIES


def test_the_mistake_of_most_students_is_first(judged: JudgedClass) -> None:
    counts = [mistake.count for mistake in judged.result.mistakes]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] >= 3


@pytest.mark.parametrize("with_table", [True, False])
def test_a_class_that_was_judged_is_not_judged_again(
    with_table: bool, judged: JudgedClass, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the table, or from the verdicts that are kept without one."""
    monkeypatch.setenv("STATEMACHINE_JUDGED", str(judged.verdicts))
    record = Mock(side_effect=AssertionError("something was judged again"))
    monkeypatch.setattr("statemachine.course.grading.recording.record", record)
    request = replace(judged.request, table=judged.request.table if with_table else None)
    assert answer_class(request) == judged.result
