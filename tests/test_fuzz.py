"""The fuzzers: each runs, and each finds a fault that is put in."""

from __future__ import annotations

import importlib
import json
import os
import sys
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

import statemachine as sm
from statemachine.errors import BusyDataError
from statemachine.lab.recordings import formats
from tools.fuzz import command_lines, kills, models, threads, traces
from tools.fuzz.__main__ import run_apart, targets

from .support.claims import assert_has
from .support.processes import in_its_own_python, of_python
from .support.requirements import ROOT

pytestmark = pytest.mark.skipif(os.name != "posix", reason="limits and kills are POSIX's")


TIMES = 0.03  # of the tries of a target
FEW_TIMES = {"random_models": 0.005}  # of what takes more than a second each


@pytest.mark.slow
@pytest.mark.parametrize("target", targets())
def test_each_target_runs_in_a_process_of_its_own(target: str) -> None:
    """Each with so many tries that none takes long, and the slow ones with several, too."""
    tries = importlib.import_module(f"tools.fuzz.{target}").TRIES
    times = FEW_TIMES.get(target, TIMES)
    assert_has(run_apart(target, seed=3, times=times), failures=[], tried=round(times * tries))


def test_the_same_seed_draws_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []
    monkeypatch.setattr(command_lines, "furnish", lambda _folder: None)
    monkeypatch.setattr(command_lines, "examine", lambda words, _folder: seen.append(words) or "")
    for seed in (1, 1, 2):
        assert command_lines.run(seed, 20).tried == 20
    assert seen[:20] == seen[20:40] != seen[40:]


# A step that looks for no other thread; MuJoCo lets go of Python's lock within it.
UNGUARDED = """
import json, mujoco, statemachine as sm
from tools.fuzz import threads
sm.step = lambda model, data, count=1: mujoco.mj_step(model.raw, data.raw, count)
threads.available = lambda: (["mujoco"], [])
print(json.dumps(threads.run(1, 20).failures))
"""


def test_two_threads_in_one_data_are_found() -> None:
    done = in_its_own_python(UNGUARDED, ROOT)
    # A crash, which a target's own process turns into a failure, or a failure that says so.
    assert done.returncode < 0 or any(
        "others than one thread's" in line for line in json.loads(done.stdout)
    ), done.stderr


BROKEN_PARSER = """
import sys
from statemachine import cli
def error(self, message):
    raise KeyError(message)
cli._Parser.error = error
sys.exit(cli.main(sys.argv[1:]))
"""


def test_what_is_no_good_end_of_a_command_is_said(tmp_path: Path) -> None:
    for code, says in (
        ("import sys; sys.exit(7)", "exit code 7"),
        ("import os; os.abort()", "exit code -6"),
        ("import sys; print('a\\nb', file=sys.stderr); sys.exit(2)", "2 lines"),
        ("import sys; sys.exit(2)", "0 lines"),
    ):
        assert says in command_lines.examine([sys.executable, "-c", code], tmp_path)
    assert command_lines.examine([sys.executable, "-c", ""], tmp_path) == ""


# Writes in place, and the second file after a moment.
IN_PLACE = """
import contextlib, time
import statemachine.atomic_files as whole
from statemachine.lab.recordings import files
@contextlib.contextmanager
def beside(*targets):
    yield [str(target) for target in targets]
whole.beside = files.beside = beside
"""


BLIND_READER = "import statemachine as sm\nsm.load = sm.Kinematics = lambda *a, **k: {}[a]"
_LOAD = sm.load
PATCHES: dict[str, list[tuple[Any, str, Any]]] = {
    "a binary model is not refused": [
        (sm, "load", lambda file: _LOAD(file) if file.suffix == ".xml" else None),
    ],
    "a data stays taken": [(sm, "step", Mock(side_effect=BusyDataError("taken for ever")))],
    "a digest is not looked at": [
        (formats, "content_digest", lambda _text, _columns: "0" * 64),
        (traces, "CHANGES", [traces.flip] * 3),
    ],
    "a command line ends in a traceback": [
        (command_lines, "command", lambda *of: [sys.executable, "-c", BROKEN_PARSER, *of]),
        (command_lines, "furnish", lambda _folder: None),
        (command_lines, "BASES", [["doctor", "--json"]]),
    ],
    "a reader of models fails": [
        (models, "READER", models.READER.replace("import statemachine as sm", BLIND_READER))
    ],
    "a writer writes in place": [(kills, "WRITER", IN_PLACE + kills.WRITER)],
}


@pytest.mark.parametrize(
    ("fault", "target", "tries", "says"),
    [
        ("a digest is not looked at", traces, 40, "other numbers"),
        ("a data stays taken", threads, 1, ": refused when all threads were gone"),
        pytest.param("a command line ends in a traceback", command_lines, 4, "traceback",
                     marks=pytest.mark.slow),
        pytest.param("a reader of models fails", models, 2, "KeyError", marks=pytest.mark.slow),
        pytest.param("a writer writes in place", kills, 8, "half a file", marks=pytest.mark.slow),
    ],
)  # fmt: skip
def test_a_fault_is_found(
    fault: str, target: Any, tries: int, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow")
    monkeypatch.setenv("XDG_CACHE_HOME", "")  # which a target sets
    for patch in PATCHES[fault]:
        monkeypatch.setattr(*patch)
    assert any(says in line for line in target.run(1, tries).failures)


def test_a_target_that_crashes_is_a_failure(tmp_path: Path) -> None:
    """The table shows it, the others go on, and the exit code says so."""
    code = (
        "import sys, tools.fuzz.__main__ as fuzz\n"
        "from tools.fuzz._tally import Tally\n"
        "ends = {'kills': 'import os; os.abort()', 'models': ''}\n"
        "plain = fuzz.subprocess.Popen\n"
        "def start(words, **others):\n"
        "    target = words[words.index('--child') + 2]\n"
        '    ends_well = \'{"tried": 5, "failures": []}\'\n'
        "    code = ends[target] or f'open({words[4]!r}, \"w\").write({ends_well!r})'\n"
        "    return plain([sys.executable, '-c', code], **others)\n"
        "fuzz.subprocess.Popen = start\n"
        "sys.argv = ['fuzz', 'kills', 'models', '--times', '0']\n"
        "sys.exit(fuzz.main())\n"
    )
    table = of_python("-c", code, code=1).stdout.splitlines()
    assert table[1].split()[:4] == ["kills", "0", "0", "1"]
    assert "code -6" in table[1]
    assert table[2].split() == ["models", "0", "5", "0", "none"]


def test_every_file_of_the_folder_is_a_target() -> None:
    assert {"command_lines", "kills", "models", "traces"} <= set(targets())
    for name in targets():
        module = importlib.import_module(f"tools.fuzz.{name}")
        assert callable(module.run)
        assert module.TRIES >= 100  # slow ones get their share, too
