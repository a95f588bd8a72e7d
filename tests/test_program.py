"""A command that is printed runs as printed, from where the user is."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from statemachine import installing, program
from statemachine.show.blocks import Code, Page, Table, Text

from .support.files import written
from .support.pages import shown
from .support.requirements import ROOT

Call = Callable[[Path], None]


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> Call:
    """Let a file be what the user has called, with nothing of ours on the path of the shell."""

    def call(file: Path) -> None:
        monkeypatch.setattr(sys, "argv", [str(file), "lesson"])
        monkeypatch.setenv("PATH", "/usr/bin")

    return call


def executable(file: Path) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    written(file, "#!/bin/sh\n").chmod(0o755)
    return file


@pytest.mark.parametrize(
    ("folder", "typed"),
    [
        (".", ".venv/bin/statemachine"),
        (".venv", "bin/statemachine"),
        ("other", "{here}/.venv/bin/statemachine"),
    ],
)
def test_a_program_that_no_shell_finds_is_called_by_its_file(
    tmp_path: Path, called: Call, monkeypatch: pytest.MonkeyPatch, folder: str, typed: str
) -> None:
    file = executable(tmp_path / ".venv" / "bin" / "statemachine")
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / folder)
    called(file)
    assert program.program() == typed.format(here=tmp_path)


def test_a_program_that_the_shell_finds_is_called_by_its_name(
    tmp_path: Path, called: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = executable(tmp_path / "bin" / "statemachine")
    called(file)
    monkeypatch.setenv("PATH", str(file.parent))
    assert program.program() == "statemachine"
    another = executable(tmp_path / "another" / "statemachine")
    monkeypatch.setenv("PATH", str(another.parent))
    assert program.program() == str(file)


def test_a_folder_with_a_blank_is_quoted(tmp_path: Path, called: Call) -> None:
    called(executable(tmp_path / "my robots" / "statemachine"))
    assert shlex.split(program.program()) == [str(tmp_path / "my robots" / "statemachine")]


def test_in_another_program_it_is_called_by_its_name(called: Call) -> None:
    called(Path("/usr/bin/pytest"))
    assert program.program() == "statemachine"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Next: statemachine lesson hold", "Next: x/statemachine lesson hold"),
        ("statemachine --help", "x/statemachine --help"),
        ("statemachine 0.1.0 on mujoco", "statemachine 0.1.0 on mujoco"),
        ("x/statemachine view", "x/statemachine view"),
        ("pip install statemachine-sim", "pip install statemachine-sim"),
        ("import statemachine as sm", "import statemachine as sm"),
        ("from statemachine import lab", "from statemachine import lab"),
        ("python exercises/step_loop.py", "x/python exercises/step_loop.py"),
        ("python 3.11.7", "python 3.11.7"),
    ],
)
def test_commands_alone_are_called_so(
    text: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(program, "program", lambda: "x/statemachine")
    monkeypatch.setattr(program, "python", lambda: "x/python")
    assert program.as_called(text) == expected


def test_every_block_of_a_page_names_the_program_so(
    tmp_path: Path, called: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    called(executable(tmp_path / "statemachine"))
    monkeypatch.chdir(tmp_path)
    table = Table(("a", "b"), [("`statemachine view`", "1")])
    page = Page("t", "o", [Text("`statemachine check x.py`"), Code(["statemachine doctor"]), table])
    lines = [line for line in shown(page).splitlines() if "./statemachine" in line]
    assert [line.split("./statemachine ")[1].split()[0].strip("`") for line in lines] == [
        *("check", "doctor", "view"),
    ]


def test_of_a_clone_an_extra_is_installed_from_its_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    *_, option, what = shlex.split(installing.install_command("plot"))
    assert (option, what) == ("-e", ".[plot]")
    monkeypatch.chdir(ROOT / "docs")
    assert shlex.split(installing.install_command("plot"))[-1] == f"{ROOT}[plot]"


@pytest.mark.parametrize("folder", [".", "docs"])
def test_what_is_printed_runs(folder: str) -> None:
    """Called by the file of an environment that is not activated."""
    file = Path(sys.executable).with_name("statemachine")
    if not file.is_file():
        pytest.skip("this Python has no script of ours beside it")
    environment = {**os.environ, "PATH": "/usr/bin:/bin"}
    here = ROOT / folder

    def output_of(line: str) -> str:
        words = ["sh", "-c", line]
        return subprocess.check_output(words, cwd=here, env=environment, text=True)

    line = output_of(os.path.relpath(file, here)).splitlines()[-1].partition(": ")[2]
    assert line.endswith("statemachine --help")
    assert output_of(line).startswith("usage:")
