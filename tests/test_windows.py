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

from statemachine.page import Page, Table, Text, Verdict
from statemachine.report import terminal

from .conftest import ROOT, need_engine
from .posix_only import unguarded

PACKAGE = ROOT / "statemachine"
SOURCES = sorted(PACKAGE.rglob("*.py"))

# Uses that no question guards, and why each does no harm on Windows.
HARMLESS = {
    ("grading/sandbox.py", "/proc"): "globbed: where it is not there, nothing is found",
}


def test_no_call_that_windows_lacks_is_unguarded() -> None:
    found = {
        (path.relative_to(PACKAGE).as_posix(), name)
        for path in SOURCES
        for _line, name in unguarded(path.read_text(encoding="utf-8"))
    }
    assert found == set(HARMLESS)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("import os\nos.fork()", ["os.fork"]),
        ("import os\ndef f(p):\n    return [os.waitid(os.P_PID, p, 0)]", ["os.P_PID", "os.waitid"]),
        ("import fcntl", ["fcntl"]),
        ("def f():\n    from resource import getrusage", ["resource"]),
        ("from os import killpg, path", ["os.killpg"]),
        ("import os, signal\nos.kill(1, signal.SIGKILL)", ["signal.SIGKILL"]),
        ("import subprocess\nsubprocess.run([], preexec_fn=print)", ["preexec_fn"]),
        ('open(f"/proc/{1}/stat")', ["/proc/"]),
        ('"""Of /proc and os.fork."""\nimport os\nos.kill(1, 2)', []),
        ("import os, sys\nif sys.platform == 'win32':\n    raise OSError\nos.fork()", []),
        ("import os\nif os.name == 'posix':\n    os.fork()\nos.nice(1)", ["os.nice"]),
        ("import os\nn = os.nice(1) if hasattr(os, 'nice') else 0", []),
        ("import os, sys\nn = sys.platform != 'win32' and os.getuid()", []),
        ("try:\n    import fcntl\nexcept ImportError:\n    import pwd", ["pwd"]),
        ("try:\n    import fcntl\nexcept ValueError:\n    pass", ["fcntl"]),
        ("import os, sys\nif len(sys.argv) > 1:\n    raise OSError\nos.fork()", ["os.fork"]),
    ],
)
def test_an_unguarded_call_is_found(text: str, names: Sequence[str]) -> None:
    assert [name for _line, name in unguarded(text)] == list(names)


def test_every_text_file_names_its_encoding() -> None:
    """Without, Windows takes the code page of the country."""
    wrong = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            given = {word.arg: word.value for word in node.keywords}
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            opens = isinstance(node.func, ast.Name) and node.func.id == "open"
            mode = node.args[1] if opens and len(node.args) > 1 else given.get("mode")
            binary = isinstance(mode, ast.Constant) and "b" in str(mode.value)
            text = name in ("read_text", "write_text") or (opens and not binary)
            if text and "encoding" not in given:
                wrong.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert not wrong


# Letters that nobody prints: they are looked for, or belong to pages of HTML.
_NOT_PRINTED = ("report/html/", "report/notebook.py", "report/markdown.py", "report/site.py")


def test_every_letter_that_is_printed_has_a_spelling() -> None:
    known = set(map(chr, terminal.ASCII))
    for path in SOURCES:
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
    ("compare", "--models", "so101", "--backends", "mujoco", "pybullet"),
    ("trace", "record", "hold", "--seconds", "0.1", "-o", "hold.npz"),
    ("trace", "show", "hold.npz"),
    ("audit",),
    ("lesson", "gravity", "--backend", "all", "--calls"),
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
            assert " deg" in out
            assert "---" in out


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
