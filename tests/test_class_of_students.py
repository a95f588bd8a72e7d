"""A class of 41, judged: what a teacher gets on the evening of the deadline."""

from __future__ import annotations

from pathlib import Path

import pytest

from statemachine.course.grading.class_table import NOTHING
from statemachine.course.grading.judges import JUDGES
from statemachine.course.grading.overview import ClassResult
from statemachine.course.grading.request import ClassRequest, answer_class

from .support.class_of_students import COPIES, SIZE, write_class
from .support.requirements import need_engine


@pytest.mark.slow
def test_a_class_of_41_is_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need_engine("mujoco")
    monkeypatch.setenv("STATEMACHINE_JUDGED", str(tmp_path / "judged"))
    folder = write_class(tmp_path / "class")
    request = ClassRequest((folder,), table=tmp_path / "grades.csv")
    result = answer_class(request)
    entries = {entry.name: entry for entry in result.entries}
    assert len(entries) == SIZE
    # Copies are right, whoever wrote them first: nothing but the likeness tells of them.
    for number in range(1, COPIES + 1):
        assert entries[f"{number:02}_copy.py"].right == len(JUDGES)
        assert entries[f"{number:02}_copy.py"].looks == ()
    (group,) = result.alike
    assert len(group.students) == COPIES
    _assert_files_that_do_not_run(result)
    for each in result.functions:
        assert each.right + each.wrong + each.not_written + each.not_judged == SIZE
        assert each.right >= COPIES
    counts = [mistake.count for mistake in result.mistakes]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] >= 3
    assert NOTHING not in [entry.refusal for entry in result.entries]
    # Once more: nothing is judged, and nothing is another.
    monkeypatch.setattr("statemachine.course.grading.recording.record", _never)
    for table in (request.table, None):
        again = answer_class(ClassRequest((folder,), table=table))
        assert again == result


def _never(*_: object) -> None:
    raise AssertionError("something was judged again")


def _assert_files_that_do_not_run(result: ClassResult) -> None:
    remarks = {entry.name: [each.text for each in entry.remarks] for entry in result.entries}
    assert "nosuchmodule" in remarks["31_no_import.py"][0]
    assert "a loop that does not end?" in remarks["32_endless.py"][0]
    assert len(remarks["33_empty.py"]) == len(remarks["34_no_function.py"]) == 1
    assert remarks["35_prints.py"] == remarks["40_helper"] == []
    assert remarks["37_template.py"] == ["not written"]
    assert len(remarks["38_syntax.py"]) == 1
    assert {reason.students for reason in result.unjudged} == {
        ("39_notebook.ipynb",),
        ("41_two",),
    }
