"""A class's folder: what is a submission, the table, resuming, and what Gradescope reads."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from statemachine.atomic_files import csv_text, replace_csv
from statemachine.cli import main
from statemachine.course.grading import classroom
from statemachine.course.grading.class_page import class_page
from statemachine.course.grading.class_table import ClassEntry, read, rows_of
from statemachine.course.grading.classroom import judge_all
from statemachine.course.grading.exercise import LOOK, ExerciseJudge, Grade
from statemachine.course.grading.faults import FAULTS
from statemachine.course.grading.faults.examination import Examination, FailedTest, FaultTrial
from statemachine.course.grading.judges import JUDGES, Judgement
from statemachine.course.grading.overview import class_result
from statemachine.course.grading.page import gradescope_results
from statemachine.course.grading.recording import digest
from statemachine.course.grading.request import ClassRequest, answer_class
from statemachine.course.grading.roster import enrolled
from statemachine.course.grading.submissions import (
    Submission,
    is_one_students,
    not_looked_at,
    submission_in,
    submissions,
)
from statemachine.errors import BadInputError
from statemachine.show.blocks import Text

from .support.claims import assert_has, assert_in, refused
from .support.exercises import SOLUTION, TEMPLATE
from .support.files import written, written_all
from .support.pages import blocks
from .support.processes import Cli, one_line
from .support.requirements import ROOT


def _table(entries: Sequence[ClassEntry]) -> list[dict[str, str]]:
    """The rows of a table of grades, as a program reads them."""
    return list(csv.DictReader(io.StringIO(csv_text(rows_of(entries)))))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Files and folders as students hand them in."""
    one_function = "def demo_gravity(model): ...\n"
    return written_all(
        tmp_path / "class",
        {
            ".git/HEAD": "",
            "ann/my_solution.py": SOLUTION.read_text(),
            "ann/helper.py": "X = 1\n",
            "bob/deep/step_loop.py": TEMPLATE.read_text(),
            "cy/notes.txt": "none\n",
            "dee/a.py": one_function,
            "dee/b.py": one_function,
            "__pycache__/x.py": one_function,
            "eve.py": "def demo_gravity(:\n",
            "fay.py": "# the same\n" + SOLUTION.read_text().replace("\n\n\n", "\n\n"),
            "grades.txt": "no Python\n",
        },
    )


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Files are judged by what is in them, in no time; the names of those that were."""
    seen: list[str] = []

    def judge(self: ExerciseJudge, file: Path, progress: Any = None, own: Any = None) -> Grade:
        seen.append(Path(file).name)
        text = Path(file).read_text()
        if "refuse" in text:
            raise BadInputError("it is refused")
        written, passed = "raise NotImplementedError" not in text, "return" in text
        marks = tuple(
            Judgement(name, written, written and passed, (f"because: of {name}", "and so on"))
            for name in JUDGES
        )
        return Grade(Path(file).name, "0", self.backend, self.versions, marks)

    monkeypatch.setattr(ExerciseJudge, "judge", judge)
    return seen


def test_what_is_a_submission(folder: Path) -> None:
    found = {each.name: each for each in submissions([folder])}
    assert list(found) == ["ann", "bob", "cy", "dee", "eve.py", "fay.py"]
    assert found["ann"].path == folder / "ann" / "my_solution.py"
    assert found["bob"].path == folder / "bob" / "deep" / "step_loop.py"
    assert_has(found["cy"], path=None, refusal="no Python file in it has one of the functions")
    assert found["dee"].refusal == "2 files in it have the functions: a.py, b.py"
    files = [folder / "eve.py", folder / "fay.py", folder / "eve.py"]
    assert [each.path for each in submissions(files)] == files[:2]
    refused(
        (BadInputError, "no file or folder", lambda: submissions([folder / "nobody"])),
        (BadInputError, "no Python files in", lambda: submissions([folder / "cy"])),
    )


def test_the_folder_of_one_student_is_no_class(tmp_path: Path, judged: list[str]) -> None:
    ida = written_all(
        tmp_path / "ida",
        {
            "step_loop.py": SOLUTION.read_text(),
            "test_arm.py": "def test_nothing(): ...\n",
            "helper.py": "X = 1\n",
        },
    )
    assert is_one_students(ida)
    (found,) = submissions([ida])
    assert_has(found, name="ida", path=ida / "step_loop.py", folder=ida)
    assert [each.name for each in submissions([ida, tmp_path / "ida"])] == [ida.as_posix()]
    assert not_looked_at([ida]) == []
    written_all(ida, {"old/step_loop.py": TEMPLATE.read_text()})
    assert not is_one_students(ida)  # whose is the other one?
    assert not is_one_students(tmp_path)


def test_a_class_beside_the_template_stays_a_class(folder: Path) -> None:
    (folder / "step_loop.py").write_text(TEMPLATE.read_text())
    assert not is_one_students(folder)
    assert len(submissions([folder])) == 7


def test_of_several_files_the_exercises_own_name_counts(tmp_path: Path) -> None:
    written_all(tmp_path, dict.fromkeys(("step_loop.py", "mine.py"), TEMPLATE.read_text()))
    assert submission_in(tmp_path) == tmp_path / "step_loop.py"


@pytest.mark.parametrize("names", [("step_loop.py", "final.py"), ("final.py", "mine.py")])
def test_several_files_with_written_functions_are_not_chosen_from(
    tmp_path: Path, names: tuple[str, str]
) -> None:
    text = SOLUTION.read_text()
    written_all(tmp_path / "ann", {names[0]: text.replace("0.8", "0.7"), names[1]: text})
    (found,) = submissions([tmp_path])
    assert found.path is None
    assert found.refusal == f"2 files in it have the functions: {', '.join(names)}"


def test_the_template_beside_a_written_file_does_not_count(tmp_path: Path) -> None:
    texts = {"step_loop.py": TEMPLATE.read_text(), "mine.py": SOLUTION.read_text()}
    written_all(tmp_path, texts)
    assert submission_in(tmp_path) == tmp_path / "mine.py"


def test_copies_of_one_file_are_one_submission(tmp_path: Path) -> None:
    written_all(tmp_path, dict.fromkeys(("a.py", "step_loop.py"), SOLUTION.read_text()))
    assert submission_in(tmp_path) == tmp_path / "step_loop.py"


def test_a_folder_with_nothing_but_tests_and_no_jobs(tmp_path: Path, folder: Path) -> None:
    only = written_all(tmp_path / "only", {"test_arm.py": "def test_nothing(): ...\n"})
    meant = r"Did you mean .* --faults .*test_arm.py\?"
    refused(
        (BadInputError, meant, lambda: submission_in(only)),
        (BadInputError, "at least 1", lambda: judge_all(submissions([folder]), "mujoco", jobs=0)),
    )


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_not_waited_for(folder: Path) -> None:
    os.mkfifo(folder / "ann" / "pipe.py")
    found = {each.name: each.path for each in submissions([folder])}
    assert found["ann"] == folder / "ann" / "my_solution.py"


def test_a_huge_file_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    huge = tmp_path / "huge.py"
    with huge.open("wb") as file:
        file.truncate(10**9)
    read = Path.read_bytes

    def read_others(path: Path) -> bytes:
        return pytest.fail("it was read") if path == huge else read(path)

    monkeypatch.setattr(Path, "read_bytes", read_others)
    (entry,) = judge_all([Submission("huge.py", huge)], "mujoco")
    assert "far too large" in entry.refusal
    assert entry.sha256 == ""


def test_what_is_not_looked_at_is_told(folder: Path, judged: list[str]) -> None:
    written_all(
        folder, dict.fromkeys(("gus.ipynb", "hal.zip", ".hidden"), "") | {"IDA.PY": "return 1\n"}
    )
    (folder / "__MACOSX").mkdir()
    found, ignored = submissions([folder]), not_looked_at([folder])
    assert {"IDA.PY", "__MACOSX"} & {each.name for each in found} == {"IDA.PY"}
    assert ignored == ["grades.txt"]
    page = class_page(class_result(judge_all(found, "mujoco"), (), ignored))
    said = "No Python files, and not looked at: grades.txt."
    assert said in [text.text for text in blocks(page, Text)]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_what_was_skipped_is_a_row_with_the_reason(folder: Path, judged: list[str]) -> None:
    written_all(folder, {"gus.ipynb": "{}", "cy/mine.ipynb": "{}", "hal.zip": ""})
    (folder / "ida.py").symlink_to("nowhere.py")
    os.mkfifo(folder / "jo.py")
    rows = {row["file"]: row for row in _table(judge_all(submissions([folder]), "mujoco"))}
    for name, reason in (
        ("gus.ipynb", "a notebook: save it as a Python file"),
        ("cy", "has one of the functions. mine.ipynb is a notebook"),
        ("hal.zip", "an archive: unpack it"),
        ("ida.py", "a link to nothing"),
        ("jo.py", "a pipe or a device, and no file"),
        ("dee", "2 files in it have the functions: a.py, b.py"),
    ):
        assert reason in rows[name]["remarks"]
        assert (rows[name]["right"], rows[name]["demo_state"]) == ("", "not judged")


def test_remarks_are_a_line_a_function_uncut_and_details_have_all(tmp_path: Path) -> None:
    texts = (
        "right on 2 other models, too",
        "ctrl was written ([0 0]): here it must stay",
        "x" * 500,
        "TODO",
    )
    marks = tuple(
        Judgement(name, text != "TODO", k == 0, (text, f"{LOOK}: it reads a.txt"))
        for k, (name, text) in enumerate(zip(JUDGES, texts, strict=True))
    )
    entry = ClassEntry("ann.py", "1" * 64, marks, "", "mujoco")
    (row,) = _table([entry])
    assert row["remarks"].split("\n") == [
        "state: ctrl was written ([0 0]): here it must stay",
        f"forward: {'x' * 500}",
        "replay: not written",
        "please look at this: it reads a.txt",
    ]
    assert_in(row["details"], *texts)
    replace_csv(tmp_path / "t.csv", rows_of([entry]))
    assert read(tmp_path / "t.csv") == {(entry.sha256, "mujoco"): entry}


def test_a_roster_gives_every_student_a_row(
    folder: Path, judged: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written_all(
        folder,
        dict.fromkeys(
            ("Lee_Bo_41017_assignment.py", "x_41018.py", "x_again_41018.py"), "return 1\n"
        ),
    )
    roster, table = tmp_path / "roster.csv", tmp_path / "t.csv"
    roster.write_text(
        "name;number;file\nAnn Smith;1;ann\nBo Lee;41017\nCy;41018\n\nZoë;99;\n",
        encoding="utf-8-sig",
    )
    for _ in range(2):  # a row without a file is not a verdict on another one
        main(["check", str(folder), "--roster", str(roster), "--csv", str(table)])
        assert "4 students have all functions right" in capsys.readouterr().out
        rows = list(csv.DictReader(table.read_text(encoding="utf-8-sig").splitlines()))
        found = {row["student"]: row for row in rows if row["student"]}
        assert [row["student"] for row in rows[:4]] == ["Ann Smith", "Bo Lee", "Cy", "Zoë"]
        for name, column, says in (
            ("Ann Smith", "file", "ann"),
            ("Bo Lee", "file", "Lee_Bo_41017_assignment.py"),
            ("Cy", "remarks", "2 may be theirs: x_41018.py, x_again_41018.py"),
            ("Cy", "right", ""),
            ("Zoë", "right", "0"),
            ("Zoë", "remarks", "handed in nothing"),
        ):
            assert found[name][column] == says, name
        assert {row["file"] for row in rows[4:]} == {
            "bob", "cy", "dee", "eve.py", "fay.py", "x_41018.py", "x_again_41018.py",
        }  # fmt: skip
    refused(
        (
            BadInputError,
            r"the roster nowhere\.csv cannot be read",
            lambda: enrolled([], tmp_path / "nowhere.csv"),
        )
    )


def test_tests_and_predictions_are_in_the_same_table(
    folder: Path, judged: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[Path] = []

    def examined(file: Path, backend: str, own: dict[str, Path]) -> Examination:
        assert own[file.name] == file
        ran.append(file)
        caught = (FailedTest("test_x", "no"),)
        trials = tuple(
            FaultTrial(fault, caught if k else ()) for k, fault in enumerate(FAULTS.values())
        )
        bad = caught if "bad" in file.read_text() else ()
        return Examination(file.name, backend, "4", ("test_x",), bad, () if bad else trials)

    monkeypatch.setattr(classroom, "examine", examined)
    answers = [{"lesson": "a", "question": str(k), "right": k > 0} for k in range(3)]
    record = {"kind": "statemachine predictions", "score": 99, "answers": answers}
    written_all(
        folder,
        {
            "ann/test_arm.py": "good",
            "bob/test_arm.py": "bad",
            "cy/test_arm.py": "good",
            "ann/lesson.json": json.dumps(record),
            "bob/lesson.json": "{}",
        },
    )
    table = tmp_path / "t.csv"
    for _ in range(2):
        main(["check", str(folder), "--csv", str(table), "--tests"])
        rows = {r["file"]: r for r in csv.DictReader(table.read_text("utf-8-sig").splitlines())}
        for name, tests, predictions in (
            ("ann", "13 of 14; not xyzw", "2 of 3"),  # counted, whatever the score says
            ("bob", "test_x fails on the arm without a fault",
             "lesson.json is not a record of predictions"),
            ("cy", "13 of 14; not xyzw", ""),  # without the functions
            ("eve.py", "", ""),
        ):  # fmt: skip
            assert (rows[name]["tests"], rows[name]["predictions"]) == (tests, predictions), name
    assert [file.parent.name for file in ran].count("ann") == 1  # taken over from the table


def test_two_folders_may_have_files_of_one_name(tmp_path: Path, judged: list[str]) -> None:
    written_all(
        tmp_path, {f"{name}/ann.py": f"return # {name}\n" for name in ("monday", "tuesday")}
    )
    entries = judge_all(submissions([tmp_path / "monday", tmp_path / "tuesday"]), "mujoco")
    assert (len(entries), len({entry.name for entry in entries}), len(judged)) == (2, 2, 2)


def test_the_most_similar_submission_is_a_cell_of_the_table(
    folder: Path, judged: list[str]
) -> None:
    (folder / "gus.py").write_text(TEMPLATE.read_text())
    entries = {e.name: e for e in judge_all(submissions([folder]), "mujoco", jobs=2)}
    assert_has(entries["fay.py"], nearest="ann", likeness=1.0)
    assert_has(entries["bob"], nearest="", likeness=0.0)  # it is not written yet
    assert [row["alike"] for row in _table([entries["fay.py"], entries["gus.py"]])] == [
        "100% ann",
        "",
    ]
    assert entries["ann"].judged
    assert not entries["cy"].judged


def test_a_file_in_a_class_is_judged_alone(folder: Path) -> None:
    text = SOLUTION.read_text().replace("import math", "import helper\nimport math")
    written_all(folder, {"helper.py": "ANSWER = 1\n", "gus.py": text, "ann/my_solution.py": text})
    found = [each for each in submissions([folder]) if each.name in ("ann", "gus.py")]
    ann, gus = judge_all(found, "mujoco")
    assert (ann.right, gus.judged) == (4, False)
    assert "helper.py, which was not handed in with it" in gus.functions[0].remarks[0]


def test_a_table_is_resumed(folder: Path, judged: list[str], tmp_path: Path) -> None:
    table = tmp_path / "grades.csv"

    def again(**how: Any) -> list[str]:
        judged.clear()
        judge_all(submissions([folder]), "mujoco", table=table, **how)
        return sorted(judged)

    assert again() == ["eve.py", "fay.py", "my_solution.py", "step_loop.py"]
    text = table.read_text()
    assert text.startswith("\ufefffile,right")  # by which a spreadsheet knows UTF-8
    assert again() == []
    assert table.read_text() == text
    # What is new or changed, or was judged otherwise, is judged.
    (folder / "eve.py").write_text("return 1\n")
    assert again() == ["eve.py"]
    assert len(again(time_limit=7.0)) == 4
    # A helper that a student's file may import is a part of what was judged.
    (folder / "ann" / "helper.py").write_text("X = 2\n")
    assert again(time_limit=7.0) == ["my_solution.py"]
    # A spreadsheet may have written it with semicolons, or with the ends of lines of Windows.
    rewritten = io.StringIO()
    csv.writer(rewritten, delimiter=";").writerows(csv.reader(io.StringIO(table.read_text())))
    table.write_text(rewritten.getvalue())
    assert again(time_limit=7.0) == []
    saved = table.read_bytes().replace(b"\n", b"\r\n")
    for content in (saved, saved.removeprefix(b"\xef\xbb\xbf")):  # with the mark and without
        table.write_bytes(content)
        assert again(time_limit=7.0) == []
    # A table that ended in the middle of a file is one with fewer rows.
    table.write_text("".join(text.splitlines(keepends=True)[:2]))
    assert again()
    table.write_text("name,mark\nann,1\n")
    refused((BadInputError, "not the columns of a table of grades", again))
    assert table.read_text() == "name,mark\nann,1\n"


def test_the_table_is_safe_in_a_spreadsheet(tmp_path: Path, judged: list[str]) -> None:
    evil = written(tmp_path / '=HYPERLINK("x").py', "return 'refuse'\n")
    (row,) = _table(judge_all([Submission(evil.name, evil)], "mujoco"))
    assert_has(row, file=f"'{evil.name}", remarks="it is refused")


def test_all_of_a_students_folder_belongs_to_the_file(tmp_path: Path) -> None:
    written_all(tmp_path, {"step_loop.py": "from mine import *\n", "mine.py": SOLUTION.read_text()})
    assert main(["check", str(tmp_path), "--gradescope", str(tmp_path / "r.json")]) == 0
    written_all(tmp_path, {"class/ann/.old/a.py": "def demo_gravity(:\n"})
    (entry,) = judge_all(submissions([tmp_path / "class"]), "mujoco")
    assert entry.judged


def test_what_gradescope_reads(judged: list[str]) -> None:
    marks = (
        Judgement("demo_gravity", True, True, ("good",)),
        Judgement("demo_state", True, False, ("bad", "worse")),
        Judgement("demo_forward", False, False, ("not written yet",)),
        Judgement("demo_replay", True, False, ("busy",), judged=False),
    )
    grade = Grade("step_loop.py", "0", "mujoco", {"mujoco": "4"}, marks)
    read = json.loads(gradescope_results(grade))
    tests = {each["name"]: each for each in read["tests"]}
    assert list(tests) == list(JUDGES)
    told = [(each["score"], each["max_score"], each["status"]) for each in tests.values()]
    assert told == [(1, 1, "passed"), *[(0, 1, "failed")] * 3]
    assert tests["demo_state"]["output"] == "wrong\nbad\nworse"
    assert tests["demo_replay"]["output"] == "not judged\nbusy"
    refused = json.loads(gradescope_results(None, "there is no file"))
    assert {each["output"] for each in refused["tests"]} == {"there is no file"}


@pytest.mark.parametrize("option", ["--csv", "--gradescope"])
@pytest.mark.parametrize(
    ("target", "says"),
    [
        ("/nope/x", "there is no folder"),
        ("", "expected the name of a file"),
        (str(ROOT), "is a folder; name a file in it"),
    ],
)
def test_where_to_write_is_asked_before_anything_is_judged(
    option: str,
    target: str,
    says: str,
    judged: list[str],
    here: Cli,
) -> None:
    files = [str(SOLUTION)] if option == "--gradescope" else [str(SOLUTION), str(TEMPLATE)]
    one_line(here("check", *files, option, target), says)
    assert judged == []


def test_the_page_of_a_class_is_written_where_html_says(
    folder: Path, judged: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "class.html"
    assert main(["check", str(folder), "--html", str(page)]) == 1  # some could not be judged
    assert "2 files in it have the functions" in page.read_text("utf-8").replace("\u00a0", " ")
    assert "wrote" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["--html", "class.txt"], ["--html", "nowhere/class.html"]])
def test_a_page_that_cannot_be_written_is_refused_before_anything_is_judged(
    words: list[str], folder: Path, judged: list[str]
) -> None:
    assert main(["check", str(folder), *words]) == 2
    assert judged == []


def test_the_json_of_a_class_has_the_overview(
    folder: Path, judged: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", str(folder), "--json"])
    document = json.loads(capsys.readouterr().out)
    assert {each["name"] for each in document["entries"]} >= {"ann", "bob", "eve.py"}
    assert [each["students"] for each in document["alike"]] == [["ann", "fay.py"]]
    assert [each["right"] for each in document["functions"]] == [2] * 4


def test_what_was_not_judged_last_time_is_told(
    tmp_path: Path, judged: list[str], recwarn: pytest.WarningsRecorder
) -> None:
    (ann,) = submissions([written_all(tmp_path / "class", {"ann.py": "return 1\n"})])
    table = tmp_path / "t.csv"
    told: list[int] = []
    for is_judged in (True, False):
        verdicts = tuple(Judgement(name, True, True, ("a",), judged=is_judged) for name in JUDGES)
        entry = ClassEntry(ann.name, digest(ann.own), verdicts, "", "mujoco")
        replace_csv(table, rows_of([entry]))
        answer_class(ClassRequest((tmp_path / "class",), table=table))
        told.append(sum("not judged last time" in str(each.message) for each in recwarn.list))
    assert told == [0, 1]
