"""`statemachine check`: wrong solutions are told from right ones, and from each other."""

from __future__ import annotations

import copy
import functools
import json
import os
import random
import re
import runpy
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.course.grading import exercise, recording
from statemachine.course.grading.inside.answers import Answer, OtherValue, decode, encode
from statemachine.course.grading.inside.calls import FaultError, answers_of, answers_of_file
from statemachine.course.grading.inside.watch import EngineRun, Inputs, engine_watched
from statemachine.course.grading.inside.worlds import AnyWorld, Scenes, worlds_of
from statemachine.course.grading.judges import JUDGES, Judgement, judge_of, judgement_of
from statemachine.errors import MissingEngineError
from statemachine.processes import sandbox

from .support.backends import slow_on
from .support.claims import assert_has, assert_in, refused
from .support.exercises import RIGHT, SOLUTION, TEMPLATE, WRONG, Attempt
from .support.files import written, written_all
from .support.processes import (
    Cli,
    files_below,
    in_its_own_python,
    processes_with,
    soon,
    without_estimates,
)
from .support.requirements import ROOT, need_engine

Prepared = tuple[Sequence[AnyWorld], list[Any]]


def _verdict(attempt: Attempt, prepared: Prepared) -> Judgement:
    worlds, rights = prepared
    if attempt.raw:  # which may leave the engine's own model changed
        with tempfile.TemporaryDirectory() as folder:
            worlds = worlds_of(attempt.solves, Scenes("mujoco", Path(folder)))
    with engine_watched(worlds[0].model.backend):
        answers = (
            answer
            if isinstance(answer, FaultError)
            else decode(json.loads(json.dumps(answer)))  # as from another process
            for answer in answers_of(attempt.function, worlds)
        )
        verdict: Any = judgement_of(attempt.solves, worlds, rights, answers)
    return verdict


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Prepared]:
    """The worlds of a judge on a backend and what is right there, worked out once."""

    @functools.cache
    def prepare(name: str, backend: str) -> Prepared:
        need_engine(backend)
        worlds = worlds_of(name, Scenes(backend, tmp_path_factory.mktemp(name)))
        return worlds, [*map(judge_of(name).right, worlds)]

    return prepare


Prepare = Callable[[str, str], Prepared]


@pytest.mark.parametrize(
    ("backend", "attempt"),
    [
        *(pytest.param("mujoco", each, id=each.name) for each in WRONG + RIGHT),
        *(
            pytest.param("pybullet", each, id=f"pybullet-{each.name}", marks=pytest.mark.slow)
            for each in WRONG + RIGHT
            if not each.raw
        ),
    ],
)
def test_a_solution_passes_or_is_told_what_is_wrong(
    backend: str, attempt: Attempt, prepared: Prepare
) -> None:
    verdict = _verdict(attempt, prepared(attempt.solves, backend))
    texts = verdict.remarks
    assert verdict.passed == (attempt in RIGHT), texts
    assert any(attempt.message in text for text in texts), texts
    assert all("\n" not in text for text in texts)
    absurd = r"you return (.+?)( at \d s| m)? where \1( |$)|\b1 (steps|joints|numbers)"
    assert not any(re.search(absurd, text) for text in texts), texts


@pytest.mark.parametrize(
    ("name", "misleading"),
    [
        ("replay-one_run_under_two_names", "copy"),
        ("replay-command_for_position", "did not begin"),
        ("gravity-speed_for_position", "no gravity"),
        ("gravity-nothing_read_from_the_runs", "no gravity"),
        ("forward-two_readings", "positions is"),
    ],
)
def test_a_hint_does_not_lead_astray(name: str, misleading: str, prepared: Prepare) -> None:
    wrong = {attempt.name: attempt for attempt in WRONG}[name]
    texts = _verdict(wrong, prepared(wrong.solves, "mujoco")).remarks
    assert not any(misleading in text for text in texts), texts


def test_a_command_that_was_written_for_nothing_is_mentioned(prepared: Prepare) -> None:
    right = {attempt.name: attempt for attempt in RIGHT}
    needless = right["forward-command_written_too"]
    (remark,) = _verdict(needless, prepared(needless.solves, "mujoco")).remarks
    assert "you wrote ctrl" in remark


def test_no_two_mistakes_have_the_same_message() -> None:
    mistakes_of: dict[str, set[str]] = {}
    for attempt in WRONG:
        mistakes_of.setdefault(attempt.message, set()).add(attempt.name)
    assert [names for names in mistakes_of.values() if len(names) > 1] == []


_HEAD = """
import ctypes, os, socket, subprocess, sys, threading, time
import numpy as np
import statemachine as sm
"""


def _grade(folder: Path, *functions: str, limit: float = 5.0) -> dict[str, Judgement]:
    """Return the judgements on a file of these functions, by name; `RIGHT.f` is the solution's."""
    file = folder / "student.py"
    right = f"RIGHT = {{}}; exec({SOLUTION.read_text(encoding='utf-8')!r}, RIGHT)\n"
    file.write_text(_HEAD + right + "\n".join(functions), encoding="utf-8")
    grade = exercise.run(file, time_limit=limit)
    assert grade.right == sum(each.passed for each in grade.functions)
    assert not (folder / "__pycache__").exists()
    return {each.function.removeprefix("demo_"): each for each in grade.functions}


def _one(judgement: Any) -> str:
    assert not judgement.passed
    (remark,) = judgement.remarks
    assert "\n" not in remark
    return remark


_SAYS = """
def says(stage, **facts):
    frame = sys._getframe()
    while 'say' not in frame.f_locals: frame = frame.f_back
    frame.f_locals['say'](stage, **facts)
    os._exit(0)
def row(*values):
    import base64
    return {"array": ["<f8", [len(values)], base64.b64encode(np.array(values)).decode()]}
NOTHING = {name: {'tuple': []} for name in ("memory", "live", "runs", "forwards", "ends")}
NOTHING['changed'] = {'dict': []}
"""
_NO_RECORD = r"what its process recorded is not a record of a run \("
_REPLACED_JUDGE = """
from statemachine.course.grading import judges
for name in judges.JUDGES:
    judges.judge_of(name).judge = lambda *_: 'patched'
    judges.judge_of(name).right = lambda _: None
judges.judged = lambda *_: judges.Judgement('demo_gravity', True, True, ('patched',))
"""
# What is handed in for each function, and a pattern that is in its one remark; "": it passes.
HANDED_IN = {
    "what never returns or ends the process": (
        ("def demo_gravity(model, seconds=4):\n    while True:\n        pass",
         "^line [78]: .*it took longer than 1 s of computing: a loop"),
        ("def demo_state(model):\n    sys.exit(0)",
         r"^line 10: it ends the program \(sys.exit with 0\) where it should return "
         r"\(in `sys.exit\(0\)`\)$"),
        ("def demo_forward(model):\n    os._exit(0)", "it ended the process with code 0"),
        ("def demo_replay(model, ctrl, nstep=600):\n    sum(range(10**15))",  # never lets go
         "^line 14: it took longer than 1 s"),
    ),
    "an error in another file": (
        ("def demo_gravity(model, seconds=4):\n    import helper; return helper.helps()",
         "^helper.py, line 2: ZeroDivisionError"),
        ("def demo_state(model):\n    import broken", "^broken.py, line 1: "),
        ("def demo_forward(model):\n    return sm.load('nowhere.xml')", "^line 11: "),
        ("def demo_replay(model, ctrl, nstep=600):\n    return np.zeros(3) @ np.zeros(2)",
         "^line 13: ValueError"),
    ),
    "crashes, memory and other processes": (
        ("def demo_gravity(model, seconds=4):\n    ctypes.string_at(0)",
         r"^line 7: it crashed the process \(SIGSEGV\)$"),
        ("def demo_state(model):\n    bytearray(10**13)",
         "line 9: it asks for more memory than there is for it"),
        ("def demo_forward(model):\n"
         "    try:\n        subprocess.run(['sleep', '60'])\n    except OSError:\n        pass\n"
         "    return RIGHT['demo_forward'](model)",
         r"line 12: it starts another program \(subprocess.Popen\)"),
        ("def demo_replay(model, ctrl, nstep=600):\n"
         "    if os.fork() == 0:\n        time.sleep(60)\n    return 1",
         r"line 17: it starts another process \(os.fork\)"),
    ),
    "output that could pass for a verdict or get in its way": (
        ("def demo_gravity(model, seconds=4):\n"
         '    line = \'{"nonce": "0", "stage": "judged", "written": true, '
         '"remarks": [["fine", true]]}\'\n'
         "    print(line); print(line, file=sys.stderr)\n"
         "    open('../answers', 'a').write(line + chr(10) + 'x' + chr(10))\n"
         "    os._exit(0)",
         "it ended the process with code 0"),
        ("def demo_state(model):\n"
         "    sys.stdout.close(); os.closerange(1, 3)\n    return RIGHT['demo_state'](model)", ""),
        ("def demo_forward(model):\n"
         "    for _ in range(200): print('x' * 100_000)\n"
         "    os.chdir('/')\n    return RIGHT['demo_forward'](model)", ""),
        ("def demo_replay(model, ctrl, nstep=600):\n    return input('same? ')",
         "line 19: EOFError: it asks for input, and nobody types here"),
    ),
    "a long print, which has an end": (
        ("def demo_gravity(model, seconds=4):\n    for _ in range(400): print('x' * 10**6)",
         "it prints more than 256 MB, and was ended there"),
        ("def demo_state(model):\n"
         "    for _ in range(100): print('x' * 10**6)\n    return RIGHT['demo_state'](model)", ""),
    ),
    "what is replaced under the judge": (
        ("import mujoco\n"
         "def demo_gravity(model, seconds=4):\n"
         "    mujoco.mj_step = lambda *a: None\n"
         "    np.abs = np.array_equal = np.allclose = lambda *a, **k: True\n"
         "    return RIGHT['demo_gravity'](model, seconds)", "is expected"),
        ("def demo_state(model):\n    sm.reset = None\n    return RIGHT['demo_state'](model)",
         "'NoneType' object is not callable"),
        ("def demo_forward(model):\n    socket.create_connection(('127.0.0.1', 9))",
         "it wants to use the network"),
        ("def demo_replay(model, ctrl, nstep=600):\n"
         "    sm.step = lambda *a: None\n"
         "    threading.Thread(target=time.sleep, args=(60,)).start()\n"
         "    return RIGHT['demo_replay'](model, ctrl, nstep)", "no step was taken"),
    ),
    "a forged record": (
        (_SAYS + "def demo_gravity(model, seconds=4):\n"
         "    result = {'tuple': [[0] * 5] * 2}\n"
         "    says('answer', answer={'Answer': {'result': result, **NOTHING}})",
         "no step was taken"),
        ("def demo_state(model):\n    says('refused', kind='SystemExit', text='boo')", _NO_RECORD),
        ("def demo_forward(model):\n    time.sleep(0.5); os.unlink('../answers')\n    os._exit(0)",
         rf"{_NO_RECORD}.*it is gone\)"),
        ("def demo_replay(model, ctrl, nstep=600):\n"
         "    result = {'tuple': [True, row(1), row(1)]}\n"
         "    says('answer', answer={'Answer': {'result': result, **NOTHING}})", _NO_RECORD),
    ),
    "a judge that is replaced, which is another process's": (
        (f"{_REPLACED_JUDGE}def demo_gravity(*_): return 1",
         r"^line 7: it imports statemachine\.course\.grading, which is not "),
        *((f"def {name}(*_): return 1", "^line 7: it imports") for name in [*JUDGES][1:]),
    ),
}  # fmt: skip
_OF_SEVERAL = ("is expected", "no step was taken")  # patterns of the first of several remarks
_SLOW = ("what never returns or ends the process", "a long print, which has an end",
         "an error in another file", "what is replaced under the judge", "a forged record",
         "a judge that is replaced, which is another process's")  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n in _SLOW)) for n in HANDED_IN]
)
def test_what_is_handed_in_is_judged(name: str, tmp_path: Path) -> None:
    written_all(
        tmp_path, {"helper.py": "def helps():\n    return 1 / 0\n", "broken.py": "def f(:\n"}
    )
    functions, patterns = zip(*HANDED_IN[name], strict=True)
    found = _grade(tmp_path, *functions, limit=1.0 if name == _SLOW[0] else 5.0)
    for judgement, pattern in zip(found.values(), patterns, strict=False):
        remark = judgement.remarks[0] if not pattern or pattern in _OF_SEVERAL else _one(judgement)
        assert re.search(pattern, remark), judgement.remarks
        assert judgement.passed == (not pattern), judgement.remarks


def test_what_does_not_get_ready_is_not_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "CHILD_PROGRAM", "import os, sys; os._exit(7)")
    for judgement in exercise.run(SOLUTION).functions:
        assert not judgement.judged
        assert_in(
            _one(judgement),
            "the judge itself",
            "with code 7",
            "was not run",
        )


@pytest.mark.slow
def test_a_file_that_sleeps_is_ended_by_the_clock(tmp_path: Path) -> None:
    calls = "time.sleep(1e6)", "ctypes.PyDLL(None).sleep(10**6)", "LOCK.acquire()", "sig.pause()"
    waits = "def {}(*_):\n    {}\n"
    file = written(
        tmp_path / "student.py",
        "import ctypes, threading, time, signal as sig\nLOCK = threading.Lock(); LOCK.acquire()\n"
        + "".join(waits.format(*pair) for pair in zip(JUDGES, calls, strict=True)),
    )
    grade = exercise.run(file, time_limit=1.0, wall_limit=4.0)
    for line, judgement in zip((4, 6, 8, 10), grade.functions, strict=True):
        assert not judgement.judged
        says = rf"^line {line}: nothing could be judged: it took .*longer than 12 s on the clock"
        assert re.search(says, _one(judgement))


@pytest.mark.slow
def test_a_right_answer_passes_on_a_busy_machine() -> None:
    busy = "import time; end = time.monotonic() + 60\nwhile time.monotonic() < end: pass"
    others = [subprocess.Popen([sys.executable, "-c", busy]) for _ in range(8)]
    try:
        grade = exercise.run(SOLUTION, wall_limit=4.0, time_limit=2.0)
    finally:
        for other in others:
            other.kill()
            other.wait()
    assert (grade.right, grade.passed) == (4, True)


@pytest.mark.skipif(sys.platform != "linux", reason="processes are found in /proc")
@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        pytest.param(signal.SIGHUP, marks=pytest.mark.slow),
        pytest.param(signal.SIGINT, marks=pytest.mark.slow),
    ],
)
def test_a_signal_leaves_nothing_behind(number: signal.Signals, tmp_path: Path) -> None:
    here = tmp_path / "temporary"
    here.mkdir()
    waits = "def {0}(*_):\n    open('begun', 'w').close()\n    time.sleep(600)\n"
    file = written(tmp_path / "student.py", "import time\n" + "".join(map(waits.format, JUDGES)))
    with subprocess.Popen(
        [sys.executable, "-m", "statemachine", "check", str(file)],
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(here)},
        stderr=subprocess.PIPE,
    ) as process:
        assert soon(lambda: len(files_below(here, "*/*/*/scratch/begun")) >= len(JUDGES))
        assert len(processes_with(here)) >= len(JUDGES)
        process.send_signal(number)
        process.communicate(timeout=300)
    assert process.returncode in (-number, 128 + number)
    assert (list(here.iterdir()), processes_with(here)) == ([], [])


@dataclass(frozen=True)
class Judged:
    """What a file is judged to be, and where it lay.

    Attributes:
        folder: Where the file lay.
        found: The judgements by function.
    """

    folder: Path
    found: dict[str, Judgement]


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory) -> Judged:
    """A file of which three functions read somebody's answers, and one reads another file."""
    folder = tmp_path_factory.mktemp("reader")
    written_all(folder, {"bob.py": SOLUTION.read_text("utf-8"), "notes.txt": "hello"})
    source = "exec(open({!r}).read(), n := {{}}); return n[{!r}]"
    beside = "exec(open(__file__.replace('student', 'bob')).read(), n := {}); return n"
    found = _grade(
        folder,
        "def demo_gravity(model, seconds=4):\n    "
        + source.format(str(SOLUTION), "demo_gravity")
        + "(model, seconds)",
        f"def demo_state(model):\n    {beside}['demo_state'](model)",
        "def demo_forward(model):\n    import bob\n    return bob.demo_forward(model)",
        "def demo_replay(model, ctrl, nstep=600):\n"
        f"    open({str(folder / 'notes.txt')!r}).read()\n"
        "    return RIGHT['demo_replay'](model, ctrl, nstep)",
    )
    return Judged(folder, found)


@pytest.mark.parametrize(
    ("name", "file"),
    [("gravity", "solutions/step_loop.py"), ("state", "bob.py"), ("forward", "bob.py")],
)
def test_what_reads_somebody_s_answers_is_not_graded_but_told_the_file(
    name: str, file: str, reader: Judged
) -> None:
    judgement = reader.found[name]
    assert not judgement.judged
    assert _one(judgement).startswith("not graded: ")
    whole = file if "/" in file else (reader.folder / file).as_posix()
    assert f"{whole}, which" in _one(judgement)


def test_another_file_is_not_there_and_somebody_is_to_look(reader: Judged) -> None:
    first, *more = reader.found["replay"].remarks
    assert re.match("line 14: (FileNotFoundError|PermissionError)", first)
    (look,) = more
    assert look.startswith(exercise.LOOK)
    assert look.endswith((reader.folder / "notes.txt").as_posix())


@pytest.fixture
def several_files(tmp_path: Path) -> Path:
    """A folder with a file of a student, what it names, and what it does not."""
    empty = "deeper.py", "table.json", "unnamed.py", ".hidden.py", "tools.txt", "env/pyvenv.cfg"
    texts = {
        "student.py": "import helper\nfrom tools import more\nDATA = 'table.json'\n",
        "helper.py": "import deeper\n",
        "tools/__init__.py": "from more import demo_gravity\n",
        "more.py": "def demo_gravity(model): return bob\n",
    }
    return written_all(tmp_path, texts | dict.fromkeys((*empty, "env/x.py"), ""))


def test_what_a_file_names_is_given_along_but_no_other_exercise(several_files: Path) -> None:
    assert set(recording.named_by(several_files / "student.py")) == {
        "student.py", "helper.py", "deeper.py", "table.json", "tools/__init__.py", "tools.txt",
    }  # fmt: skip


def test_of_a_student_s_folder_all_but_hidden_files_and_environments_is_given(
    several_files: Path,
) -> None:
    whole = set(recording.in_folder(several_files))
    assert {"more.py", "unnamed.py", "tools/__init__.py"} < whole
    assert not {"env/x.py", ".hidden.py"} & whole


@pytest.fixture(scope="module")
def reaching(tmp_path_factory: pytest.TempPathFactory) -> Judged:
    """A file that stops its judge, kills its parent, and writes into two folders of its user."""
    folder = tmp_path_factory.mktemp("reaching")
    home = folder / "home"
    home.mkdir()
    kill = "ctypes.CDLL(None).kill"
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setenv("HOME", str(home))
        found = _grade(
            folder,
            f"def demo_gravity(model, seconds=4):\n    {kill}({os.getpid()}, 19)\n    return 1",
            f"def demo_state(model):\n    {kill}(os.getppid(), 19)\n    {kill}(os.getppid(), 9)",
            "def demo_forward(model):\n"
            "    open(os.path.expanduser('~/left'), 'w').close()\n"
            "    return RIGHT['demo_forward'](model)",
            f"def demo_replay(model, ctrl, nstep=600):\n    open({str(folder / 'left')!r}, 'w')",
        )
    return Judged(folder, found)


linux_only = pytest.mark.skipif(sys.platform != "linux", reason="it is shut in on Linux only")


@pytest.fixture
def shut_in() -> None:
    """Only where this system lets a user make namespaces."""
    if not sandbox.shut_in():
        pytest.skip("this system does not let a user make namespaces")


@linux_only
@pytest.mark.parametrize("name", ["gravity", "state", "replay"])
def test_what_reaches_out_does_not_pass(name: str, reaching: Judged) -> None:
    assert not reaching.found[name].passed


@linux_only
def test_what_it_writes_at_home_is_not_there_afterwards(reaching: Judged) -> None:
    assert reaching.found["forward"].passed
    assert list((reaching.folder / "home").iterdir()) == []


@linux_only
@pytest.mark.usefixtures("shut_in")
@pytest.mark.parametrize(
    ("name", "says"), [("gravity", "it returns an int"), ("state", "it returns nothing")]
)
def test_signals_to_other_processes_reach_nobody(name: str, says: str, reaching: Judged) -> None:
    assert _one(reaching.found[name]).startswith(says)


@linux_only
@pytest.mark.usefixtures("shut_in")
def test_folders_of_the_machine_are_not_there(reaching: Judged) -> None:
    assert "No such file" in _one(reaching.found["replay"])
    assert not (reaching.folder / "left").exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("def demo_gravity(model:\n", "be loaded: line 1: SyntaxError: '(' was never closed"),
        ("import sys\nsys.exit(0)\n", "the file cannot be loaded: line 2: it ends the program"),
        ("import sys\nsys.exit(0)\n", 'below `if __name__ == "__main__":`'),
        ("x = 1 / 0\n", "line 1: ZeroDivisionError: division by zero (in `x = 1 / 0`)"),
        ("import not_there\n", "No module named 'not_there'"),
        ("x = '\\udc80'.encode()\n", "UnicodeEncodeError"),
        ("# caf\xe9\n", "loaded: line 1: this is not UTF-8, and Python refuses the file. Save"),
        ("import os\n\nx = '\xe9'\n", "the file cannot be loaded: line 3: this is not UTF-8"),
        ("# -*- coding: latin-1 -*-\nx = '\xe9'\n", "the file has none of the functions"),
        ("", "the file is empty"),
        ("x = 1\n", "none of the functions demo_gravity, demo_state, demo_forward, demo_replay"),
        ("def demo_state(model): pass\n", "the file has no function demo_gravity"),
        ("demo_gravity = 4\n", "demo_gravity is not a function: int"),
        ("def demo_gravity(): pass\n", "too many positional arguments"),
        ("def demo_gravity(model, /, *, seconds): pass\n", "with a model and 1 argument more"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_called_is_told_in_a_line(
    content: str, message: str, tmp_path: Path, prepared: Prepare
) -> None:
    file = tmp_path / "student.py"
    file.write_text(content, encoding="latin-1")
    worlds, rights = prepared("demo_gravity", "mujoco")
    answers = answers_of_file(file, "demo_gravity", worlds)
    assert message in _one(judgement_of("demo_gravity", worlds, rights, answers))


def test_a_file_that_is_saved_as_utf_16_is_told_as_any_other_encoding(
    tmp_path: Path, prepared: Prepare
) -> None:
    file = tmp_path / "student.py"
    file.write_text("def demo_gravity(model, seconds): pass\n", encoding="utf-16")
    worlds, rights = prepared("demo_gravity", "mujoco")
    answers = answers_of_file(exercise.python_file(file), "demo_gravity", worlds)
    judgement = judgement_of("demo_gravity", worlds, rights, answers)
    assert "UTF-16" in _one(judgement)
    assert judgement is not None
    assert judgement.judged


@pytest.mark.slow
@pytest.mark.parametrize("backend", slow_on("pybullet"), indirect=True)
def test_the_solution_passes_on_every_backend(here: Cli, backend: str) -> None:
    done = here("check", str(SOLUTION), "--backend", backend, "--json", code=0)
    assert done.stderr == ""
    assert_has(json.loads(done.stdout), right=4, passed=True)


def test_the_students_file_is_still_to_be_written(here: Cli) -> None:
    found = json.loads(here("check", str(TEMPLATE), "--json", code=1).stdout)
    assert (found["right"], found["passed"]) == (0, False)
    functions = [(each["function"], each["written"]) for each in found["functions"]]
    assert functions == [(name, False) for name in JUDGES]


def test_a_missing_engine_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mujoco.py").write_text("raise ImportError('libnothing.so.1 is missing')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    refused((MissingEngineError, r"libnothing\.so\.1 is missing", lambda: exercise.run(SOLUTION)))


RunFile = Callable[..., tuple[int, list[str]]]


@pytest.fixture
def run_file(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> RunFile:
    """Run the exercise's file as a program: its exit code, and the lines that it prints."""

    def run(file: Path, *arguments: str) -> tuple[int, list[str]]:
        monkeypatch.setattr(sys, "argv", [str(file), *arguments])
        with pytest.raises(SystemExit) as ended:
            runpy.run_path(str(file), run_name="__main__")
        printed = capsys.readouterr()
        assert without_estimates(printed.err) == ""
        lines = printed.out.splitlines()
        # Where the checkout stands is no width of ours: a line may name the file with its folder.
        widths = [len(line.replace(str(file), file.name)) for line in lines]
        assert ended.value.code == 2 or max(widths) <= 80
        return int(ended.value.code or 0), lines

    return run


def test_the_template_says_what_is_to_be_written(run_file: RunFile) -> None:
    code, lines = run_file(TEMPLATE)
    assert (code, sum("TODO(you)" in line for line in lines)) == (0, 4)


def test_a_function_that_is_written_is_no_more_to_be_done(
    run_file: RunFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # whose name is longer than a line
    text = TEMPLATE.read_text("utf-8")
    one_written = re.sub(r"raise NotImplementedError\(.*", "return 1", text, count=1)
    code, lines = run_file(written(Path("mine.py"), one_written))
    assert (code, sum("TODO(you)" in line for line in lines)) == (0, 3)


def test_a_function_that_is_to_be_written_is_one_line(run_file: RunFile) -> None:
    code, (line,) = run_file(TEMPLATE, "--gravity")
    assert code == 1
    assert line.startswith("demo_gravity: TODO(you)")


def test_a_program_refuses_an_engine_that_is_mistyped(run_file: RunFile) -> None:
    assert run_file(TEMPLATE, "--state", "--backend", "mujcoo")[0] == 2


@pytest.mark.parametrize("name", ["gravity", "state", "forward", "replay"])
def test_each_function_of_the_solution_is_shown(name: str, run_file: RunFile) -> None:
    code, lines = run_file(SOLUTION, f"--{name}")
    assert code == 0
    assert name != "replay" or lines[-1] == "Your answer: equal"


@pytest.mark.parametrize("name", ["hold", "speed"])
def test_what_needs_no_answer_is_shown_by_the_template(name: str, run_file: RunFile) -> None:
    assert run_file(TEMPLATE, f"--{name}")[0] == 0


def test_an_error_in_a_script_is_a_line_and_a_hint_and_all_of_it_if_asked(tmp_path: Path) -> None:
    text = re.sub(r"raise .*read the fingertip.*", "return [dta.qpos]", TEMPLATE.read_text())
    script = str(written(tmp_path / "step_loop.py", text))
    run = "import runpy, sys; sys.argv = {!r}; runpy.run_path(sys.argv[0], run_name='__main__')"
    short, full = (
        in_its_own_python(run.format([script, "--forward", *flags]), tmp_path)
        for flags in ((), ("--traceback",))
    )
    line, says = text[: text.index("dta")].count("\n") + 1, "NameError: name 'dta' is not defined\n"
    hint = f"For a hint, type: statemachine check {script}\n"
    assert short.stdout == f"demo_forward: {script}, line {line}: {says}{hint}"
    assert short.stderr == ""
    assert_in(full.stderr, "Traceback", f"line {line}", says)


# Answers as text: the same again, and whatever else is written there is refused


def _answer() -> Answer:
    row = np.array([1.5, np.nan, -0.0])
    inputs = Inputs(0, row, row, row[:1], 0.5)
    run = EngineRun(True, inputs, Inputs(0, row, row, row[:0], 1.5), 3, None)
    result = (
        [True, None, "text", 3, 2.5, float("inf")],
        {"joint": (slice(0, None), slice(1, 2, None))},
        np.arange(6, dtype=np.float32).reshape(2, 3),
        np.array([True, False]),
        OtherValue("an object"),
    )
    changed = {"opt.gravity": ([0.0], [1.0])}
    return Answer(result, (0, 1, 2), ("", "qpos", ""), (run,), (inputs,), (inputs,), changed)


def _text(answer: Answer) -> str:
    return json.dumps(encode(answer))


def test_an_answer_comes_back_as_it_was() -> None:
    text = _text(_answer())
    back = decode(json.loads(text))
    assert _text(back) == text
    assert back.result[1] == _answer().result[1]
    assert (back.result[2].dtype, back.result[2].shape) == (np.float32, (2, 3))
    assert back.runs[0].start.qpos.tobytes() == _answer().runs[0].start.qpos.tobytes()


def test_no_object_gets_through() -> None:
    class Any3:
        def __iter__(self) -> Any:
            raise SystemExit

        def __repr__(self) -> str:
            return "x" * 1000

    odd = [Any3(), {1: 2j}, np.array([1j]), np.array(["a"]), 10**30, {1, 2}]
    value = decode(json.loads(_text(Answer(odd)))).result
    things, numbers = value[:1] + value[2:], value[1]
    assert [type(thing) for thing in things] == [OtherValue] * 5
    assert numbers == {"an int: 1": OtherValue("a complex: 2j")}


def _places(found: Any) -> list[tuple[Any, Any]]:
    """Return every container with each of its keys."""
    if not isinstance(found, (dict, list)):
        return []
    keys = list(found) if isinstance(found, dict) else range(len(found))
    return [place for key in keys for place in ((found, key), *_places(found[key]))]


OTHERS = [
    None, True, -1, 2**70, 0.5, float("nan"), "", "x" * 20_000, "<f8", "|O8", "<U3", [], {},
    [1], {"array": ["<f8", [2], "AAAA"]}, {"array": ["|O", [1], ""]}, {"code": "1"}, [[[]]],
    {"array": ["<f8", [-1], ""]}, {"slice": [1]}, {"tuple": 5}, {"dict": [[1, 2, 3]]},
]  # fmt: skip


def test_whatever_is_written_there_is_an_answer_or_refused() -> None:
    chance = random.Random(1)
    refused = 0
    for _ in range(1000):
        found = copy.deepcopy(encode(_answer()))
        for _ in range(chance.randint(1, 3)):
            where, key = chance.choice(_places(found))
            if isinstance(where, dict) and chance.random() < 0.2:
                del where[key]
            else:
                where[key] = copy.deepcopy(chance.choice(OTHERS))
        try:
            decode(found)
        except ValueError:
            refused += 1
    assert 500 < refused < 1000


@pytest.mark.parametrize("found", [None, 3, [], "x", {}, {"result": 1}])
def test_no_answer_at_all(found: Any) -> None:
    refused((ValueError, "", lambda: decode(found)))
