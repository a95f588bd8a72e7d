"""Verdicts that are kept: taken over where nothing has changed, and never where anything has."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from statemachine.course.grading import classroom, judged_before
from statemachine.course.grading.classroom import judge_all
from statemachine.course.grading.exercise import LOOK, ExerciseJudge, Grade
from statemachine.course.grading.faults.examination import Examination
from statemachine.course.grading.judged_before import KnownVerdicts, VerdictStore
from statemachine.course.grading.judges import JUDGES, Judgement
from statemachine.course.grading.submissions import submissions
from statemachine.errors import MissingEngineError
from statemachine.processes import sandbox

from .support.files import written_all

VERDICTS = KnownVerdicts(
    tuple(
        Judgement(name, written=k != 1, passed=k == 2, remarks=("größer als …", "b")[: k + 1])
        for k, name in enumerate(JUDGES)
    ),
    "13 of 14; not xyzw",
)


@pytest.fixture
def kept_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which verdicts are kept, as where a student's code is shut in."""
    monkeypatch.setenv("STATEMACHINE_JUDGED", str(tmp_path / "kept"))
    monkeypatch.setattr(sandbox, "shut_in", lambda: True)
    return tmp_path / "kept"


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Files are judged by what is in them, in no time; the names of those that were."""
    seen: list[str] = []

    def judge(
        self: ExerciseJudge, file: Path, progress: Any = None, submitted_files: Any = None
    ) -> Grade:
        seen.append(Path(file).name)
        text = Path(file).read_text()
        remarks = (text, f"{LOOK}: it reads x") if "look" in text else (text,)
        marks = tuple(Judgement(name, True, True, remarks, "busy" not in text) for name in JUDGES)
        return Grade(Path(file).name, "0", self.backend, self.versions, marks)

    monkeypatch.setattr(ExerciseJudge, "judge", judge)
    return seen


@pytest.fixture
def again(tmp_path: Path, judged: list[str], kept_in: Path) -> Callable[..., list[str]]:
    """Judge a class of two again, without a table; gives the names of what was judged."""
    folder = written_all(tmp_path / "class", {"ann.py": "a = 1\n", "bob.py": "b = 2\n"})

    def run(**how: Any) -> list[str]:
        judged.clear()
        entries = judge_all(submissions([folder]), "mujoco", **how)
        for entry in entries:
            assert entry.functions[0].remarks[0] == (folder / entry.name).read_text()
        return sorted(judged)

    return run


def test_what_was_kept_is_found_again(tmp_path: Path) -> None:
    VerdictStore(tmp_path / "new" / "folder", "mujoco 4").keep("abc", VERDICTS)
    assert VerdictStore(tmp_path / "new" / "folder", "mujoco 4").find("abc") == VERDICTS


@pytest.mark.parametrize(("content", "made_with"), [("abd", "mujoco 4"), ("abc", "mujoco 5")])
def test_another_content_or_engine_is_another_verdict(
    content: str, made_with: str, tmp_path: Path
) -> None:
    VerdictStore(tmp_path, "mujoco 4").keep("abc", VERDICTS)
    assert VerdictStore(tmp_path, made_with).find(content) == KnownVerdicts()


def test_other_software_is_another_verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    VerdictStore(tmp_path, "mujoco 4").keep("abc", VERDICTS)
    monkeypatch.setattr(judged_before, "software_digest", lambda: "another")
    assert VerdictStore(tmp_path, "mujoco 4").find("abc") == KnownVerdicts()


@pytest.mark.parametrize("name", ["deep/judge.py", "scene.xml", "course_code.json"])
def test_the_digest_of_the_software_is_that_of_its_files(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def digest_of(text: str) -> str:
        written_all(tmp_path, {name: text, "notes.txt": text, "__pycache__/x.py": text})
        judged_before.software_digest.cache_clear()
        return judged_before.software_digest()

    monkeypatch.setattr(judged_before, "PACKAGE", tmp_path)
    try:
        one, two, again = digest_of("1"), digest_of("2"), digest_of("1")
        (tmp_path / name).rename(tmp_path / f"other_{Path(name).name}")
        judged_before.software_digest.cache_clear()
        moved = judged_before.software_digest()
    finally:
        judged_before.software_digest.cache_clear()
    assert one == again
    assert len({one, two, moved}) == 3


DAMAGES: dict[str, Callable[[str], str]] = {
    "half of it": lambda text: text[: len(text) // 2],
    "nothing": lambda text: "",
    "no object": lambda text: "[]",
    "another kind": lambda text: text.replace("statemachine verdicts", "something"),
    "of another content": lambda text: text.replace('"abc"', '"abd"'),
    "made with something else": lambda text: text.replace("mujoco 4", "mujoco 5"),
    "a flag that is none": lambda text: text.replace("true", "1", 1),
    "a remark that is none": lambda text: text.replace('"b"', "7", 1),
    "a function less": lambda text: json.dumps(
        json.loads(text) | {"functions": json.loads(text)["functions"][1:]}
    ),
    "tests that are no text": lambda text: text.replace('"13 of 14; not xyzw"', "13"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_no_verdict(damage: str, tmp_path: Path) -> None:
    VerdictStore(tmp_path, "mujoco 4").keep("abc", VERDICTS)
    (file,) = tmp_path.iterdir()
    text = file.read_text("utf-8")
    damaged = DAMAGES[damage](text)
    assert damaged != text
    file.write_text(damaged, "utf-8")
    assert VerdictStore(tmp_path, "mujoco 4").find("abc") == KnownVerdicts()
    VerdictStore(tmp_path, "mujoco 4").keep("abc", VERDICTS)  # and it is replaced
    assert VerdictStore(tmp_path, "mujoco 4").find("abc") == VERDICTS


def test_who_reads_while_others_write_never_sees_a_half(tmp_path: Path) -> None:
    store = VerdictStore(tmp_path, "mujoco 4")
    store.keep("abc", VERDICTS)
    long = KnownVerdicts(VERDICTS.functions, "1 of 2" + "x" * 300_000)
    done = threading.Event()

    def write() -> None:
        while not done.is_set():
            store.keep("abc", long)
            store.keep("abc", VERDICTS)

    writers = [threading.Thread(target=write) for _ in range(2)]
    for writer in writers:
        writer.start()
    try:
        for _ in range(300):
            assert store.find("abc") in (VERDICTS, long)
    finally:
        done.set()
        for writer in writers:
            writer.join()


def test_a_write_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    store = VerdictStore(tmp_path, "mujoco 4")
    monkeypatch.setattr("os.replace", full)
    store.keep("abc", VERDICTS)
    assert list(tmp_path.iterdir()) == []
    assert store.find("abc") == KnownVerdicts()


def test_what_was_written_long_ago_is_removed(tmp_path: Path) -> None:
    import os

    store = VerdictStore(tmp_path, "mujoco 4")
    store.keep("abc", VERDICTS)
    store.keep("abd", VERDICTS)
    old, new = sorted(tmp_path.iterdir())
    os.utime(old, (1.0, 1.0))
    VerdictStore(tmp_path, "mujoco 4")
    assert list(tmp_path.iterdir()) == [new]


def test_a_class_is_judged_once(again: Callable[..., list[str]], kept_in: Path) -> None:
    assert again() == ["ann.py", "bob.py"]
    assert len(list(kept_in.iterdir())) == 2
    assert again() == []


def test_a_class_is_judged_again_with_another_time_limit(again: Callable[..., list[str]]) -> None:
    again()
    assert again(time_limit=7.0) == ["ann.py", "bob.py"]
    assert again() == []  # either verdict is kept


@pytest.mark.parametrize("word", ["look", "busy"])
def test_what_needs_somebody_or_was_not_judged_is_judged_again(
    word: str, again: Callable[..., list[str]], tmp_path: Path
) -> None:
    (tmp_path / "class" / "ann.py").write_text(f"{word} = 1\n")
    assert again() == ["ann.py", "bob.py"]
    assert again() == ["ann.py"]


def test_a_changed_file_is_judged_again(again: Callable[..., list[str]], tmp_path: Path) -> None:
    assert again() == ["ann.py", "bob.py"]
    (tmp_path / "class" / "bob.py").write_text("b = 3\n")
    assert again() == ["bob.py"]


@pytest.mark.parametrize("variable", ["", None])
def test_nothing_is_kept_where_that_is_asked_for_or_code_is_only_watched(
    variable: str | None,
    again: Callable[..., list[str]],
    kept_in: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if variable is None:
        monkeypatch.setattr(sandbox, "shut_in", lambda: False)
    else:
        monkeypatch.setenv("STATEMACHINE_JUDGED", variable)
    assert again() == again() == ["ann.py", "bob.py"]
    assert not kept_in.exists()


def test_where_nothing_can_be_written_all_is_judged(
    again: Callable[..., list[str]], kept_in: Path
) -> None:
    kept_in.write_text("a file is there")
    assert again() == again() == ["ann.py", "bob.py"]


def test_what_tests_catch_is_kept_and_an_error_is_not(
    again: Callable[..., list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[str] = []

    def examined(file: Path, backend: str, submitted_files: dict[str, Path]) -> Examination:
        ran.append(file.read_text())
        if "error" in ran[-1]:
            raise MissingEngineError("pytest is not here")
        return Examination(file.name, backend, "4", ("test_x",), (), ())

    monkeypatch.setattr(classroom, "examine", examined)
    one = "def demo_state(model): return 1\n"
    folder = written_all(
        tmp_path / "tested",
        {
            "ann/step_loop.py": one,
            "ann/test_arm.py": "fine",
            "bob/step_loop.py": one,
            "bob/test_arm.py": "error",
        },
    )
    first = judge_all(submissions([folder]), "mujoco", tests=True)
    second = judge_all(submissions([folder]), "mujoco", tests=True)
    for entries in (first, second):
        fine, error = (entry.tests for entry in entries)
        assert fine == "0 of 0"
        assert "pytest" in error
    assert sorted(ran) == ["error", "error", "fine"]
    assert [entry.tests for entry in judge_all(submissions([folder]), "mujoco")] == ["", ""]
