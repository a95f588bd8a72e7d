"""What a Windows user meets, as far as it can be tried elsewhere: code pages, old consoles,
and no call that Windows does not have."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from statemachine.show import terminal, text_blocks
from statemachine.show.blocks import Page, Table, Text, Verdict

from .support.claims import assert_in
from .support.processes import of_python
from .support.requirements import ROOT, need_engine

PACKAGE = ROOT / "statemachine"

# What a question guards that a type checker does not follow: `hasattr`, or an import that may fail.
GUARDED = {
    ("backends/bullet/client.py", "memfd_create"),
    ("backends/hidden_world.py", "register_at_fork"),
    ("backends/motrix/links.py", "register_at_fork"),
    ("processes/stderr_capture.py", "register_at_fork"),
    ("interface/exclusive_access.py", "register_at_fork"),
    ("backends/served/child_server.py", "poll"),
    ("processes/__init__.py", "resource"),  # there is no /proc
    ("processes/__init__.py", "sysconf"),
    ("processes/sandbox.py", "SIGKILL"),  # a return code below zero is POSIX's
    ("processes/sandbox.py", "SIGPROF"),
    ("processes/sandbox.py", "SIGXCPU"),
    ("installed.py", "register_at_fork"),
    ("lab/sweep/worker.py", "ITIMER_REAL"),
    ("lab/sweep/worker.py", "SIGALRM"),
    ("lab/sweep/worker.py", "setitimer"),
    ("processes/signals.py", "SIG_BLOCK"),
    ("processes/signals.py", "SIG_SETMASK"),
    ("processes/signals.py", "pthread_sigmask"),
    ("processes/__init__.py", "register_at_fork"),
}


# Modules that differ between platforms, and what differs of those that every file uses.
_OF_A_PLATFORM = re.compile(
    r"\b(import|from) (_posixsubprocess|asyncio|ctypes|errno|faulthandler|fcntl|mmap|msvcrt|"
    r"multiprocessing|os|resource|select|shutil|signal|socket|stat|subprocess|tempfile|termios|"
    r"threading|time|urllib|webbrowser)\b|\b(abiflags|[gs]etdlopenflags|owner|group|is_mount)\("
)


def files_of_a_platform() -> list[Path]:
    """Return the files of the package that may use what a platform lacks."""
    files = sorted(PACKAGE.rglob("*.py"))
    return [path for path in files if _OF_A_PLATFORM.search(path.read_text("utf-8"))]


@pytest.mark.slow
def test_no_call_that_windows_lacks_is_unguarded() -> None:
    pytest.importorskip("pyright")
    words = ("--pythonplatform", "Windows", "--pythonpath", sys.executable, "--outputjson")
    done = of_python("-m", "pyright", *words, *files_of_a_platform())
    found = {
        (Path(each["file"]).relative_to(PACKAGE).as_posix(), each["message"].split('"')[1])
        for each in json.loads(done.stdout)["generalDiagnostics"]
    }
    assert found == GUARDED


def test_every_text_file_names_its_encoding() -> None:
    """Without, Windows takes the code page of the country."""
    pytest.importorskip("ruff")
    of_python("-m", "ruff", "check", "--preview", "--select", "PLW1514", PACKAGE, code=0)


# Letters that nobody prints: they are looked for, or belong to pages of HTML.
_NOT_PRINTED = (
    "show/html/",
    "lab/questions/stage/",
    "course/notebook.py",
)


def test_every_letter_that_is_printed_has_a_spelling() -> None:
    known = set(map(chr, text_blocks.ASCII))
    for path in PACKAGE.rglob("*.py"):
        if path.relative_to(PACKAGE).as_posix().startswith(_NOT_PRINTED):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and id(node) not in docs:
                text = node.value if isinstance(node.value, str) else ""
                lacking = {c for c in text if ord(c) > 126 and c.isprintable()} - known
                assert not lacking, f"{path.name}:{node.lineno}: {lacking}"


def _run(encoding: str, folder: Path, *arguments: str) -> tuple[int, str, str]:
    environment = {"PYTHONPATH": str(ROOT), "PYTHONUTF8": "0", "PYTHONIOENCODING": encoding}
    done = subprocess.run(
        [sys.executable, "-m", "statemachine", *arguments],
        capture_output=True,
        timeout=300,
        cwd=folder,
        env={**os.environ, **environment},
        check=False,
    )
    return done.returncode, done.stdout.decode(encoding), done.stderr.decode(encoding)


_COMMANDS = (
    (),
    ("--help",),
    ("lesson", "hold"),
    ("lesson", "gravity", "--json"),
    ("conventions", "quaternion", "--backend", "mujoco"),
    ("doctor",),
    ("lesson", "hold", "--backend", "µ→"),
)
_ON_BOTH_ENGINES = (
    ("compare", "hold", "--why"),
    ("compare", "--models", "so101", "--backend", "mujoco", "--backend", "pybullet"),
    ("trace", "record", "hold", "--seconds", "0.1", "-o", "hold.npz"),
    ("trace", "show", "hold.npz"),
    ("lesson", "gravity", "--backend", "mujoco", "--backend", "pybullet", "--calls"),
)


@pytest.mark.slow
@pytest.mark.parametrize("commands", [_COMMANDS, _ON_BOTH_ENGINES], ids=["one", "both"])
@pytest.mark.parametrize("encoding", ["cp1252", "cp437"])
def test_an_old_code_page_is_enough_for_every_command(
    encoding: str, commands: Sequence[Sequence[str]], tmp_path: Path
) -> None:
    if commands is _ON_BOTH_ENGINES:
        need_engine("pybullet")
    for arguments in commands:
        code, out, error = _run(encoding, tmp_path, *arguments)
        assert code == 2 if "µ→" in arguments else code in (0, commands is _ON_BOTH_ENGINES), error
        assert not re.search("Traceback|Unicode", error)
        assert "µ→" not in arguments or "->" in error
        # Questions may be asked, but no letter of ours has become one.
        assert not re.search(r"\?(?![\n ]|$)", out), out
        if "--json" in arguments:
            assert json.loads(out)
            assert out.isascii()
        if arguments == ("lesson", "hold"):
            assert_in(out, " deg", "---")


def test_a_console_that_knows_no_colour_codes_gets_none(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = Page(
        "Title",
        "origin",
        [
            Table(("a", "b"), [("1°", "2 → 3")], emphasis=frozenset({0})),
            Text("x"),
            Verdict("y", True),
        ],
    )
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    terminal.show(page, "footer")
    assert "\x1b[" in capsys.readouterr().out
    monkeypatch.setattr("rich.console.detect_legacy_windows", lambda: True)
    terminal.show(page, "footer")
    out = capsys.readouterr().out
    assert "\x1b" not in out
    assert "2 -> 3" in out
    assert out.isascii()
