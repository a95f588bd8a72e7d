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
    """Return the rows of a table of grades, as a program reads them."""
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

    def judge(
        self: ExerciseJudge, file: Path, progress: Any = None, submitted_files: Any = None
    ) -> Grade:
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


@pytest.fixture
def found(folder: Path) -> dict[str, Submission]:
    """The submissions of the folder, by name."""
    return {each.name: each for each in submissions([folder])}


def test_each_folder_and_each_python_file_is_a_submission(found: dict[str, Submission]) -> None:
    assert list(found) == ["ann", "bob", "cy", "dee", "eve.py", "fay.py"]


@pytest.mark.parametrize(
    ("name", "path"), [("ann", "ann/my_solution.py"), ("bob", "bob/deep/step_loop.py")]
)
def test_the_file_of_a_folder_is_the_one_with_the_functions(
    name: str, path: str, folder: Path, found: dict[str, Submission]
) -> None:
    assert found[name].path == folder / path


def test_a_folder_without_the_functions_is_refused(found: dict[str, Submission]) -> None:
    assert_has(found["cy"], path=None, refusal="no Python file in it has one of the functions")


def test_a_folder_with_two_files_of_the_functions_is_refused_with_their_names(
    found: dict[str, Submission],
) -> None:
    assert found["dee"].refusal.endswith(": a.py, b.py")


def test_a_file_that_is_named_twice_is_one_submission(folder: Path) -> None:
    files = [folder / "eve.py", folder / "fay.py", folder / "eve.py"]
    assert [each.path for each in submissions(files)] == files[:2]


@pytest.mark.parametrize(
    ("name", "says"), [("nobody", "no file or folder"), ("cy", "no Python files in")]
)
def test_where_there_is_no_submission_it_is_refused(name: str, says: str, folder: Path) -> None:
    refused((BadInputError, says, lambda: submissions([folder / name])))


@pytest.fixture
def ida(tmp_path: Path) -> Path:
    """The folder of one student: the exercise, its tests, and a helper."""
    return written_all(
        tmp_path / "ida",
        {
            "step_loop.py": SOLUTION.read_text(),
            "test_arm.py": "def test_nothing(): ...\n",
            "helper.py": "X = 1\n",
        },
    )


def test_the_folder_of_one_student_is_one_submission(ida: Path) -> None:
    assert is_one_students(ida)
    (found,) = submissions([ida])
    assert_has(found, name="ida", path=ida / "step_loop.py", folder=ida)
    assert not_looked_at([ida]) == []


def test_the_folder_of_one_student_that_is_named_twice_is_one_submission(ida: Path) -> None:
    assert [each.name for each in submissions([ida, ida.parent / "ida"])] == [ida.as_posix()]


def test_a_folder_with_the_exercise_twice_is_not_one_students(ida: Path) -> None:
    written_all(ida, {"old/step_loop.py": TEMPLATE.read_text()})
    assert not is_one_students(ida)


def test_a_folder_of_folders_is_not_one_students(ida: Path) -> None:
    assert not is_one_students(ida.parent)


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
    assert found.refusal.endswith(": " + ", ".join(names))


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
        "ctrl was written",
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
        "state: ctrl was written",
        f"forward: {'x' * 500}",
        "replay: not written",
        "please look at this: it reads a.txt",
    ]
    assert_in(row["details"], *texts)
    replace_csv(tmp_path / "t.csv", rows_of([entry]))
    assert read(tmp_path / "t.csv") == {(entry.sha256, "mujoco"): entry}


@pytest.fixture
def with_roster(folder: Path, judged: list[str], tmp_path: Path) -> tuple[list[str], Path]:
    """The words of a command that judges a class with a roster, and the table that it writes."""
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
    return ["check", str(folder), "--roster", str(roster), "--csv", str(table)], table


def rows_of_table(table: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(table.read_text(encoding="utf-8-sig").splitlines()))


@pytest.mark.parametrize(
    ("name", "column", "says"),
    [
        ("Ann Smith", "file", "ann"),
        ("Bo Lee", "file", "Lee_Bo_41017_assignment.py"),
        ("Cy", "remarks", "2 may be theirs: x_41018.py, x_again_41018.py"),
        ("Cy", "right", ""),
        ("Zoë", "right", "0"),
        ("Zoë", "remarks", "handed in nothing"),
    ],
)
def test_a_student_on_the_roster_is_found_by_file_name_or_number(
    name: str, column: str, says: str, with_roster: tuple[list[str], Path]
) -> None:
    main(with_roster[0])
    found = {row["student"]: row for row in rows_of_table(with_roster[1]) if row["student"]}
    assert found[name][column] == says


def test_students_on_the_roster_are_first_and_then_files_of_nobody_on_it(
    with_roster: tuple[list[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    main(with_roster[0])
    assert "4 students" in capsys.readouterr().out
    rows = rows_of_table(with_roster[1])
    assert [row["student"] for row in rows[:4]] == ["Ann Smith", "Bo Lee", "Cy", "Zoë"]
    assert {row["file"] for row in rows[4:]} == {
        "bob", "cy", "dee", "eve.py", "fay.py", "x_41018.py", "x_again_41018.py",
    }  # fmt: skip


def test_a_row_without_a_file_is_no_verdict_on_another_one(
    with_roster: tuple[list[str], Path],
) -> None:
    words, table = with_roster
    main(words)
    first = rows_of_table(table)
    main(words)
    assert rows_of_table(table) == first


def test_a_roster_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    nowhere = tmp_path / "nowhere.csv"
    refused((BadInputError, r"nowhere\.csv cannot be read", lambda: enrolled([], nowhere)))


@pytest.fixture
def examined(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Tests are examined by what is in them, in no time; the files that were."""
    ran: list[Path] = []

    def examine(file: Path, backend: str, submitted_files: dict[str, Path]) -> Examination:
        assert submitted_files[file.name] == file
        ran.append(file)
        caught = (FailedTest("test_x", "no"),)
        trials = tuple(
            FaultTrial(fault, caught if k else ()) for k, fault in enumerate(FAULTS.values())
        )
        bad = caught if "bad" in file.read_text() else ()
        return Examination(file.name, backend, "4", ("test_x",), bad, () if bad else trials)

    monkeypatch.setattr(classroom, "examine", examine)
    return ran


@pytest.fixture
def with_tests(folder: Path) -> Path:
    """The folder in which some handed in tests and predictions, too."""
    answers = [{"lesson": "a", "question": str(k), "right": k > 0} for k in range(3)]
    record = {"kind": "statemachine predictions", "score": 99, "answers": answers}
    return written_all(
        folder,
        {
            "ann/test_arm.py": "good",
            "bob/test_arm.py": "bad",
            "cy/test_arm.py": "good",
            "ann/lesson.json": json.dumps(record),
            "bob/lesson.json": "{}",
        },
    )


def rows_by_file(table: Path) -> dict[str, dict[str, str]]:
    """Read the rows of a table of grades, by the name of the file."""
    text = table.read_text("utf-8-sig")
    return {row["file"]: row for row in csv.DictReader(text.splitlines())}


@pytest.mark.usefixtures("judged", "examined")
@pytest.mark.parametrize(
    ("name", "tests", "predictions"),
    [
        ("ann", "13 of 14; not xyzw", "2 of 3"),  # counted, whatever the score says
        ("bob", "test_x fails on the arm without a fault",
         "lesson.json is not a record of predictions"),
        ("cy", "13 of 14; not xyzw", ""),  # without the functions
        ("eve.py", "", ""),
    ],
)  # fmt: skip
def test_tests_and_predictions_are_in_the_same_table(
    name: str, tests: str, predictions: str, with_tests: Path, tmp_path: Path
) -> None:
    table = tmp_path / "t.csv"
    main(["check", str(with_tests), "--csv", str(table), "--tests"])
    assert_has(rows_by_file(table)[name], tests=tests, predictions=predictions)


@pytest.mark.usefixtures("judged")
def test_tests_that_were_examined_are_taken_over_from_the_table(
    with_tests: Path, examined: list[Path], tmp_path: Path
) -> None:
    table = tmp_path / "t.csv"
    words = ["check", str(with_tests), "--csv", str(table), "--tests"]
    main(words)
    first, before = rows_by_file(table), len(examined)
    main(words)
    assert rows_by_file(table) == first
    assert [file.parent.name for file in examined[before:]].count("ann") == 0


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


@pytest.mark.slow
def test_a_file_in_a_class_is_judged_alone(folder: Path) -> None:
    text = SOLUTION.read_text().replace("import math", "import helper\nimport math")
    written_all(folder, {"helper.py": "ANSWER = 1\n", "gus.py": text, "ann/my_solution.py": text})
    found = [each for each in submissions([folder]) if each.name in ("ann", "gus.py")]
    ann, gus = judge_all(found, "mujoco")
    assert (ann.right, gus.judged) == (4, False)
    assert "helper.py" in gus.functions[0].remarks[0]


class Resumed:
    """A class that is judged into a table, again and again.

    Attributes:
        table: The table.
    """

    def __init__(self, folder: Path, table: Path, judged: list[str]) -> None:
        self.table = table
        self._folder, self._judged = folder, judged

    def again(self, **how: Any) -> list[str]:
        """Judge what the table lacks, and return the names of the files that were judged."""
        self._judged.clear()
        judge_all(submissions([self._folder]), "mujoco", table=self.table, **how)
        return sorted(self._judged)


@pytest.fixture
def resumed(folder: Path, tmp_path: Path, judged: list[str]) -> Resumed:
    """A class that was judged into a table once."""
    resumed = Resumed(folder, tmp_path / "grades.csv", judged)
    assert resumed.again() == ["eve.py", "fay.py", "my_solution.py", "step_loop.py"]
    return resumed


def test_a_table_begins_with_what_tells_a_spreadsheet_utf_8(resumed: Resumed) -> None:
    assert resumed.table.read_text("utf-8").startswith("\ufefffile,right")


def test_what_is_in_the_table_is_not_judged_again(resumed: Resumed) -> None:
    text = resumed.table.read_text()
    assert resumed.again() == []
    assert resumed.table.read_text() == text


def test_a_file_that_changed_is_judged_again(resumed: Resumed, folder: Path) -> None:
    (folder / "eve.py").write_text("return 1\n")
    assert resumed.again() == ["eve.py"]


def test_a_helper_that_changed_has_its_file_judged_again(resumed: Resumed, folder: Path) -> None:
    (folder / "ann" / "helper.py").write_text("X = 2\n")
    assert resumed.again() == ["my_solution.py"]


def test_all_is_judged_again_with_another_time_limit(resumed: Resumed) -> None:
    assert len(resumed.again(time_limit=7.0)) == 4


def test_a_table_with_semicolons_is_taken_over(resumed: Resumed) -> None:
    rewritten = io.StringIO()
    rows = csv.reader(io.StringIO(resumed.table.read_text()))
    csv.writer(rewritten, delimiter=";").writerows(rows)
    resumed.table.write_text(rewritten.getvalue())
    assert resumed.again() == []


@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", b""], ids=["mark", "no mark"])
def test_a_table_with_ends_of_lines_of_windows_is_taken_over(mark: bytes, resumed: Resumed) -> None:
    content = resumed.table.read_bytes().removeprefix(b"\xef\xbb\xbf").replace(b"\n", b"\r\n")
    resumed.table.write_bytes(mark + content)
    assert resumed.again() == []


def test_a_table_that_ended_early_is_one_with_fewer_rows(resumed: Resumed) -> None:
    lines = resumed.table.read_text().splitlines(keepends=True)
    resumed.table.write_text("".join(lines[:2]))
    assert resumed.again()


def test_a_table_of_something_else_is_refused_and_left(resumed: Resumed) -> None:
    resumed.table.write_text("name,mark\nann,1\n")
    refused((BadInputError, "not the columns", resumed.again))
    assert resumed.table.read_text() == "name,mark\nann,1\n"


def test_the_table_is_safe_in_a_spreadsheet(tmp_path: Path, judged: list[str]) -> None:
    evil = written(tmp_path / '=HYPERLINK("x").py', "return 'refuse'\n")
    (row,) = _table(judge_all([Submission(evil.name, evil)], "mujoco"))
    assert_has(row, file=f"'{evil.name}", remarks="it is refused")


@pytest.mark.slow
def test_all_of_a_students_folder_belongs_to_the_file(tmp_path: Path) -> None:
    written_all(tmp_path, {"step_loop.py": "from mine import *\n", "mine.py": SOLUTION.read_text()})
    assert main(["check", str(tmp_path), "--gradescope", str(tmp_path / "r.json")]) == 0
    written_all(tmp_path, {"class/ann/.old/a.py": "def demo_gravity(:\n"})
    (entry,) = judge_all(submissions([tmp_path / "class"]), "mujoco")
    assert entry.judged


@pytest.fixture
def gradescope() -> dict[str, dict[str, Any]]:
    """What Gradescope reads of a file, by the name of the function."""
    marks = (
        Judgement("demo_gravity", True, True, ("good",)),
        Judgement("demo_state", True, False, ("bad", "worse")),
        Judgement("demo_forward", False, False, ("not written yet",)),
        Judgement("demo_replay", True, False, ("busy",), judged=False),
    )
    grade = Grade("step_loop.py", "0", "mujoco", {"mujoco": "4"}, marks)
    return {each["name"]: each for each in json.loads(gradescope_results(grade))["tests"]}


def test_gradescope_reads_a_point_for_each_function_that_is_right(
    gradescope: dict[str, dict[str, Any]],
) -> None:
    assert list(gradescope) == list(JUDGES)
    rows = [(each["score"], each["max_score"], each["status"]) for each in gradescope.values()]
    assert rows == [(1, 1, "passed"), *[(0, 1, "failed")] * 3]


def test_gradescope_reads_the_remarks_below_the_verdict(
    gradescope: dict[str, dict[str, Any]],
) -> None:
    assert gradescope["demo_state"]["output"] == "wrong\nbad\nworse"
    assert gradescope["demo_replay"]["output"] == "not judged\nbusy"


def test_gradescope_reads_at_each_function_why_there_is_no_grade() -> None:
    read = json.loads(gradescope_results(None, "no file"))
    assert [each["output"] for each in read["tests"]] == ["no file"] * len(JUDGES)


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
        entry = ClassEntry(ann.name, digest(ann.files), verdicts, "", "mujoco")
        replace_csv(table, rows_of([entry]))
        answer_class(ClassRequest((tmp_path / "class",), table=table))
        told.append(sum("not judged last time" in str(each.message) for each in recwarn.list))
    assert told == [0, 1]
