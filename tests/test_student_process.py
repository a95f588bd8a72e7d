"""The program of a student's process, run in this one: what it writes down, in which order."""

from __future__ import annotations

import faulthandler
import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

import statemachine
from statemachine.course.grading.inside import child
from statemachine.course.grading.inside.answers import decode
from statemachine.processes import sandbox

NONCE = "a1b2c3"


class ProcessEndedError(BaseException):
    """Raised where the process would end."""


@contextmanager
def courses_kept() -> Iterator[None]:
    """Give back the modules that the program forgets."""
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in sys.modules if name.startswith("statemachine.course")]:
            patch.setitem(sys.modules, name, sys.modules[name])
        patch.setattr(statemachine, "course", sys.modules["statemachine.course"], raising=False)
        yield


class Process:
    """A student's process, whose limits and whose guard are those of this test.

    Attributes:
        job: The file that says what is called.
        answers: The file that it writes.
        trace: The file for the lines of what takes too long.
        file: The student's.
        guards: What the guard was told to guard.
        ended: With which code the process ended; None if its program returned.
        limits: The seconds that it may compute, and the file of the trace.
    """

    def __init__(self, patch: pytest.MonkeyPatch, root: Path) -> None:
        self.job, self.file = root / "job", root / "mine" / "answer.py"
        self.answers, self.trace = root / "out" / "answers", root / "out" / "trace"
        scratch = root / "scratch"
        for folder in (scratch, self.file.parent, self.answers.parent):
            folder.mkdir()
        self.guards: list[tuple[Any, ...]] = []
        self.ended: int | None = None
        self.limits: list[tuple[float, str]] = []
        patch.chdir(scratch)
        patch.setenv("ONLY_FOR_IMPORTS", "1")
        patch.setattr(sys, "argv", ["before"])
        patch.setattr(sys, "path", [*sys.path])
        patch.setattr(sys, "pycache_prefix", str(root))
        patch.setattr(faulthandler, "enable", lambda file: self.limits.append((0.0, file.name)))
        patch.setattr(os, "_exit", self._end)
        patch.setattr(child, "Guard", self._guard)
        patch.setattr(
            sandbox, "limit_cpu", lambda cpu, trace: self.limits.append((cpu, trace.name))
        )

    def _end(self, code: int) -> None:
        self.ended = code
        raise ProcessEndedError

    def _guard(self, *arguments: Any, is_only_guard: bool) -> None:
        *places, report = arguments
        self.guards.append((*places, is_only_guard))
        report("reads", "/etc/hosts")

    def run(self, code: str, backend: str = "mujoco", alone: bool = False) -> list[dict[str, Any]]:
        """Return the lines that are written while `demo_forward` of some code is called."""
        self.file.write_text(code, "utf-8")
        facts = {
            "file": str(self.file),
            "student_folder": str(self.file.parent),
            "function": "demo_forward",
            "backend": backend,
            "cpu": 7.5,
            "answers": str(self.answers),
            "trace": str(self.trace),
            "nonce": NONCE,
            "alone": alone,
            "only_for_imports": ["ONLY_FOR_IMPORTS"],
        }
        self.job.write_text(json.dumps(facts), "utf-8")
        with courses_kept(), suppress(ProcessEndedError):
            child.main(str(self.job))
        lines = [json.loads(line) for line in self.answers.read_text("utf-8").splitlines()]
        assert {line.pop("nonce") for line in lines} == {NONCE}
        return lines


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Process:
    """Return a student's process that has not begun."""
    return Process(monkeypatch, tmp_path)


READS = {"stage": "reads", "text": "/etc/hosts"}
RETURNS = "def demo_forward(model):\n    return {}\n"


def results(lines: list[dict[str, Any]]) -> list[Any]:
    """Return what the function returned on each world."""
    return [decode(line["answer"]).result for line in lines if line["stage"] == "answer"]


def test_an_answer_of_each_world_is_written(process: Process) -> None:
    lines = process.run(RETURNS.format("model.nq, model.nbody"))
    assert [line["stage"] for line in lines] == ["reads", "running", "answer", "answer"]
    course, elsewhere = results(lines)
    # Of the arm; and with a crate, a ball and a drawer, of 7, 4 and 1 coordinates.
    assert course[0] == 6
    assert elsewhere == (6 + 7 + 4 + 1, course[1] + 3)
    assert process.ended == 0


def test_a_fault_ends_what_is_written(process: Process) -> None:
    code = (
        "def demo_forward(model):\n    if model.nq > 6: raise ValueError('too many')\n    return 1"
    )
    lines = process.run(code)
    assert [line["stage"] for line in lines] == ["reads", "running", "answer", "fault"]
    assert "too many" in lines[-1]["text"]
    assert "line 2" in lines[-1]["text"]
    assert lines[-1]["written"] is True
    assert process.ended == 0


def test_a_function_that_is_still_to_be_written_is_told(process: Process) -> None:
    lines = process.run("def demo_forward(model):\n    raise NotImplementedError\n")
    assert [line["stage"] for line in lines] == ["reads", "running", "fault"]
    assert lines[-1]["written"] is False


def test_an_answer_of_more_than_eight_million_letters_is_a_fault(process: Process) -> None:
    code = "import numpy as np\n" + RETURNS.format("np.zeros(model.nq * 50_000)")
    lines = process.run(code)
    # 3.2 million letters of 300,000 numbers, and 9.6 million of 900,000.
    assert [line["stage"] for line in lines] == ["reads", "running", "answer", "fault"]
    assert lines[-1]["written"] is True


def test_a_world_that_cannot_be_made_is_told_and_nothing_runs(process: Process) -> None:
    lines = process.run(RETURNS.format("1"), backend="nonesuch")
    [line] = lines
    assert (line["stage"], line["kind"]) == ("refused", "UnknownNameError")
    assert "nonesuch" in line["text"]
    assert process.ended is None
    assert process.guards == []


def test_the_job_is_not_there_while_the_students_code_runs(process: Process) -> None:
    code = f"import os\n{RETURNS.format(f'os.path.exists({str(process.job)!r})')}"
    assert results(process.run(code)) == [False, False]


def test_the_program_is_called_as_the_students_file(process: Process) -> None:
    code = f"import sys\n{RETURNS.format('sys.argv, sys.path[0], sys.pycache_prefix')}"
    expected = ([str(process.file)], str(process.file.parent), None)
    assert results(process.run(code)) == [expected, expected]


def test_what_is_only_for_imports_is_gone(process: Process) -> None:
    is_there = "'ONLY_FOR_IMPORTS' in os.environ"
    code = f"import os\n{RETURNS.format(is_there)}"
    assert results(process.run(code)) == [False, False]


def test_nothing_of_the_judges_is_left_by_name(process: Process) -> None:
    names = "[name for name in sys.modules if name.startswith('statemachine.course')]"
    left = f"{names}, hasattr(sys.modules['statemachine'], 'course')"
    code = f"import sys\n{RETURNS.format(left)}"
    assert results(process.run(code)) == [([], False), ([], False)]


def test_other_modules_stay(process: Process) -> None:
    names = "[name in sys.modules for name in ('statemachine', 'statemachine.lab', 'numpy')]"
    code = f"import sys\n{RETURNS.format(names)}"
    assert results(process.run(code)) == [[True] * 3] * 2


@pytest.mark.parametrize("alone", [False, True])
def test_the_guard_knows_the_folders(alone: bool, process: Process) -> None:
    process.run(RETURNS.format("1"), alone=alone)
    folders = (process.file, process.file.parent, process.answers.parent)
    assert process.guards == [(*folders, alone)]


def test_its_lines_and_its_limit_go_into_the_trace(process: Process) -> None:
    process.run(RETURNS.format("1"))
    assert process.limits == [(0.0, str(process.trace)), (7.5, str(process.trace))]


def test_worlds_are_made_in_a_folder_of_their_own(process: Process) -> None:
    process.run(RETURNS.format("1"))
    made = sorted(path.name for path in Path("worlds").iterdir())
    assert made == ["crowded_scene.xml", "ordinary_scene.xml"]


def test_all_worlds_are_made_to_prepare(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    calls = "statemachine.course.grading.inside.calls"
    monkeypatch.delitem(sys.modules, calls, raising=False)
    monkeypatch.delitem(sys.modules, "statemachine.processes.sandbox", raising=False)
    child.prepare("mujoco")
    made = sorted(path.name for path in tmp_path.iterdir())
    scenes = ("scene", "scene_box")
    assert made == [f"{kind}_{scene}.xml" for kind in ("crowded", "ordinary") for scene in scenes]
    assert {calls, "statemachine.processes.sandbox"} <= set(sys.modules)
