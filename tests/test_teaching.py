"""What a teacher hands out and sets up: the kits, and the autograder as Gradescope runs it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from statemachine.course.grading.faults import FAULTS
from statemachine.course.lessons import LESSONS
from statemachine.lab.probes.conventions import CONCEPTS
from statemachine.lab.probes.conventions.page import CALLS_OF_THIS_LIBRARY, REMINDERS

from .support.claims import assert_not_in, refused
from .support.exercises import WRONG
from .support.files import written_all
from .support.requirements import ROOT

sys.path.insert(0, str(ROOT / "teaching"))
import make_kits  # pyright: ignore[reportMissingImports]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_kits.wheel(tmp_path_factory.mktemp("wheel"))


@pytest.mark.slow
def test_the_students_kit_has_no_solution(built: Path, tmp_path: Path) -> None:
    target = tmp_path / "kit.zip"
    make_kits.write(target, make_kits.student_kit(built))
    with zipfile.ZipFile(target) as kit:
        assert sorted(kit.namelist()) == sorted(
            [
                "README.md",
                "constraints.txt",
                "path.ipynb",
                "exercises/step_loop.py",
                "exercises/test_arm.py",
                "exercises/conftest.py",
                built.name,
            ]
        )
        whole = b"".join(kit.read(name) for name in kit.namelist())
        assert kit.read("exercises/step_loop.py").count(b"raise NotImplementedError(") == 4
        assert built.name in kit.read("README.md").decode()
    with zipfile.ZipFile(built) as wheel:
        whole += b"".join(wheel.read(name) for name in wheel.namelist())
    for file in ("step_loop.py", "test_arm.py"):
        text = (ROOT / "teaching" / "solutions" / file).read_text()
        functions = re.findall(r"^def (?:demo|test)_.*?(?=^def |\Z)", text, re.M | re.S)
        assert len(functions) >= 4
        assert_not_in(whole, *(function.encode() for function in functions))
    again = tmp_path / "again.zip"
    make_kits.write(again, make_kits.student_kit(built))
    assert again.read_bytes() == target.read_bytes()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="Gradescope runs Linux")
def test_the_autograder_grades_a_submission(built: Path, tmp_path: Path) -> None:
    home = tmp_path / "autograder"
    with zipfile.ZipFile(_zip(tmp_path, built)) as kit:
        kit.extractall(home / "source")
    # setup.sh without a package index: the dependencies are those of this environment.
    script = f'#!/bin/sh\nexec "{sys.executable}" -m statemachine "$@"\n'
    written_all(home, {"env/bin/statemachine": script, "submission/step_loop.py": ""})
    for name in ("source/setup.sh", "source/run_autograder", "env/bin/statemachine"):
        (home / name).chmod(0o755)
    for text, score, words in (
        ((ROOT / "teaching" / "solutions" / "step_loop.py").read_text(), 4, "right"),
        ("def demo_gravity(:\n", 0, "invalid syntax"),
        (None, 0, "no Python file in it has one of the functions"),
    ):
        file = home / "submission" / "step_loop.py"
        file.unlink(missing_ok=True)
        if text is not None:
            file.write_text(text)
        done = subprocess.run(
            [str(home / "source" / "run_autograder")],
            env={**os.environ, "AUTOGRADER": str(home), "PYTHONPATH": str(ROOT)},
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        results = json.loads((home / "results" / "results.json").read_text())
        assert sum(test["score"] for test in results["tests"]) == score
        assert words in json.dumps(results, ensure_ascii=False)


@pytest.mark.skipif(sys.platform == "win32", reason="cp is a shell's command")
def test_a_kit_is_not_made_of_files_that_were_worked_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "exercises").mkdir()
    file, text = (
        tmp_path / "exercises" / "step_loop.py",
        (ROOT / "exercises/step_loop.py").read_text(),
    )
    monkeypatch.setattr(make_kits, "ROOT", tmp_path)
    monkeypatch.setattr(make_kits, "is_changed", lambda _: False)
    file.write_text(text)
    assert make_kits.template_of("step_loop.py") == text.encode()
    file.write_text(text.replace("raise NotImplementedError(", "return (", 1))
    refused((SystemExit, "restore it first", lambda: make_kits.template_of("step_loop.py")))


def _zip(folder: Path, built: Path) -> Path:
    target = folder / "autograder.zip"
    make_kits.write(target, make_kits.autograder(built))
    with zipfile.ZipFile(target) as kit:
        for name in ("setup.sh", "run_autograder"):
            assert kit.getinfo(name).external_attr >> 16 & 0o111
    return target


def test_the_mistakes_of_the_teachers_page_are_those_that_are_caught() -> None:
    text = (ROOT / "docs" / "teaching.md").read_text()
    rows = re.findall(r'^\| [^|]+ \| "([^"|]+)" \| `([^`|]+)` \|$', text, re.M)
    assert len(rows) >= 10
    for said, fault in rows:
        assert any(said in attempt.message for attempt in WRONG), said
        assert fault in FAULTS


# What docs/teaching.md says that the judge prevents, watches and does not see; and what proves it.
PROOFS = {
    "| what it reads |": (
        "test_shut_in.test_who_is_shut_in_reads_nothing",
        "test_shut_in.test_what_lies_below_the_judges_is_shown",
        "test_shut_in.test_who_is_watched_is_refused",
    ),
    "| what it writes |": (
        "test_sandbox.test_shut_in_it_writes_in_its_folder_only",
        "test_check.test_a_signal_leaves_nothing_behind",
    ),
    "| other processes, the network |": (
        "test_sandbox.test_shut_in_it_reaches_no_process_and_no_network",
        "test_check.test_what_is_handed_in_is_judged",
    ),
    "| time |": (
        "test_check.test_what_is_handed_in_is_judged",
        "test_check.test_a_file_that_sleeps_is_ended_by_the_clock",
    ),
    "| the verdict |": (
        "test_check.test_what_reaches_out_does_not_pass",
        "test_shut_in.test_a_record_of_runs_that_never_were_does_not_pass",
    ),
    "Where the last column holds, the page says so": (
        "test_shut_in.test_the_table_says_where_reading_is_only_watched",
    ),
    'is "not graded", with the name of that file': (
        "test_check.test_what_reads_somebody_s_answers_is_not_graded_but_told_the_file",
    ),
    "A file outside, but for the system's (`/etc`, `/usr`)": (
        "test_check.test_what_reads_somebody_s_answers_is_not_graded_but_told_the_file",
        "test_shut_in.test_a_file_of_the_system_is_no_reason_to_look",
    ),
    "to import a judge, to start a program, to use the network or to look into another process": (
        "test_shut_in.test_who_is_watched_is_refused",
        "test_check.test_what_is_handed_in_is_judged",
    ),
    "A symbolic link that leads out is refused unread": (
        "test_shut_in.test_a_link_that_leads_out_is_refused_unread",
    ),
    "A submission may import the public interface": (
        "test_shut_in.test_what_a_submission_needs_is_there",
        "test_shut_in.test_the_public_interface_is_what_the_package_tells",
    ),
    "- somebody else's answers, typed in;": (
        "test_likeness.test_twelve_copies_in_a_class_of_41_are_one_group",
        "test_class_of_students.test_a_class_of_41_is_judged",
    ),
    "a copy that was rewritten;": ("test_likeness.test_a_copy_that_was_rewritten_is_not_seen",),
    "- a record that code forges in place of a run, with the right numbers;": (
        "test_shut_in.test_a_record_of_his_own_making_with_the_right_numbers_passes",
    ),
    "- a hard link, which cannot be told from a file;": (
        "test_shut_in.test_a_hard_link_is_as_good_as_the_file",
    ),
    "C code that opens files, and code that changes the watch": (
        "test_shut_in.test_where_it_is_only_watched_who_changes_the_watch_is_not_seen",
    ),
}


def test_what_the_judge_prevents_watches_and_does_not_see_is_proven() -> None:
    guide = " ".join((ROOT / "docs" / "teaching.md").read_text("utf-8").split())
    section = guide.partition("## What the judge prevents")[2].partition("## ")[0]
    for statement, tests in PROOFS.items():
        assert statement in section, statement
        for name in tests:
            module, _, function = name.partition(".")
            text = (ROOT / "tests" / f"{module}.py").read_text("utf-8")
            assert f"def {function}(" in text, name


def test_what_to_remember_is_of_the_lessons() -> None:
    assert tuple(CALLS_OF_THIS_LIBRARY) == CONCEPTS
    assert {lesson for lesson, _ in REMINDERS} <= set(LESSONS)


def test_our_column_of_the_cheat_sheet_runs(backend: str) -> None:
    program = "\n".join(CALLS_OF_THIS_LIBRARY.values()).replace(
        '"so101/scene"', f'"so101/scene", backend="{backend}"'
    )
    names: dict[str, Any] = {}
    exec(program, names)
    assert len(names["worlds"]) == 3
    assert names["d"].time == 0  # back where it was saved
    for data in (names["d"], *names["worlds"]):
        data.close()


@pytest.mark.skipif(sys.platform == "win32", reason="a shell's syntax")
@pytest.mark.parametrize("name", ["setup.sh", "run_autograder"])
def test_the_scripts_are_shell(name: str) -> None:
    subprocess.run(["bash", "-n", str(ROOT / "teaching" / "gradescope" / name)], check=True)
