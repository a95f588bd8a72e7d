"""First contact is instant: no engine, and nothing heavy, before a command needs it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

import statemachine as sm
from statemachine import cli as command_line
from statemachine.errors import BadInputError, UnknownNameError
from statemachine.installed import ENGINES, require

from .support.claims import refused
from .support.files import written_all
from .support.processes import Cli, in_its_own_python, of_python, one_line
from .support.requirements import REQUIRED, ROOT

HEAVY = ("mujoco", "pybullet", "pinocchio", "numpy", "rich", "matplotlib", "viser", "xml.etree")


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import statemachine", set()),
        ("import statemachine as sm; dir(sm)", set()),
        ("from statemachine.cli import main; main([])", set()),
        ("from statemachine.cli import main; main(['--help'])", set()),
        ("from statemachine.cli import main; main(['lesson', 'gravity', '--help'])", set()),
        ("from statemachine.cli import main; main(['fingertip', '--help'])", set()),
        ("from statemachine.cli import main; main(['conventions', '--help'])", set()),
        ("from statemachine.cli import main; main(['check', '--help'])", set()),
        ("from statemachine.cli import main; main(['view', '--help'])", set()),
        ("import statemachine.interface", {"numpy"}),
        ("import statemachine.freshness", {"numpy"}),
        ("import statemachine.backends, statemachine.conformance", {"numpy", "xml.etree"}),
        ("import statemachine.kinematics", {"numpy", "xml.etree"}),
    ],
)
def test_nothing_heavy_is_imported(code: str, allowed: set[str]) -> None:
    probe = f"""
import sys
try:
    {code}
except SystemExit:
    pass
print('loaded:', *[name for name in {HEAVY!r} if name in sys.modules])
"""
    done = in_its_own_python(probe, ROOT)
    assert set(done.stdout.rpartition("loaded:")[2].split()) <= allowed, done.stderr


def test_every_engine_that_is_required_is_here() -> None:
    """STATEMACHINE_REQUIRE is a promise of the machine, whether or not a test needs it."""
    for name in sorted(REQUIRED & set(ENGINES)):
        require(name)


def test_every_public_name_is_there() -> None:
    for name in sm.__all__:
        assert getattr(sm, name) is not None
    assert set(sm.__all__) <= set(dir(sm))
    refused((AttributeError, "stpe", lambda: sm.stpe))  # pyright: ignore


THEIRS = {
    "statemachine/__init__.py": "class StateMachine: ...\n__version__ = '3.0'\n",
    "statemachine/statemachine.py": "",
}


@pytest.mark.parametrize(
    ("theirs", "ours", "typed", "code"),
    [
        # Their files lie among ours: they were installed before us.
        (
            ("statemachine/statemachine.py",),
            ("statemachine/__init__.py",),
            ("-c", "import statemachine"),
            1,
        ),
        # Theirs is found first, alone or with our files around it.
        (THEIRS, ("statemachine_sim.py",), ("-m", "statemachine_sim"), 2),
        (
            THEIRS,
            ("statemachine_sim.py", "statemachine/cli/__init__.py"),
            ("-m", "statemachine_sim"),
            2,
        ),
        # No clash: only ours is there.
        ((), (), ("-m", "statemachine_sim", "--version"), 0),
    ],
)
def test_a_clash_of_import_names_is_said_in_one_line(
    tmp_path: Path, theirs: Iterable[str], ours: Iterable[str], typed: tuple[str, ...], code: int
) -> None:
    files = {name: (ROOT / name).read_text() for name in ours}
    files |= {name: THEIRS[name] for name in theirs}
    written_all(tmp_path, files)
    done = of_python(*typed, folder=tmp_path if files else ROOT, code=code, PYTHONPATH="")
    said = done.stdout if code == 0 else done.stderr.splitlines()[-1]
    assert ("pip uninstall python-statemachine" if code else "statemachine ") in said
    assert code == 1 or len(done.stderr.splitlines()) == bool(code), done.stderr


@pytest.mark.parametrize(
    ("command", "module", "content", "says"),
    [
        ("fingertip", "pinocchio", None, "pip install pin"),
        ("fingertip", "pinocchio", "test = 1", "is not the engine"),
        (
            "fingertip",
            "pinocchio",
            "raise ImportError('libgomp.so.1: no such file')",
            "apt-get install libgomp1",
        ),
        ("lesson state", "mujoco", "raise ImportError('libGL.so.1: cannot open')", "libGL.so.1"),
        ("lesson state", "mujoco", "import nonexistent_dependency", "nonexistent_dependency"),
        ("lesson state --backend pybullet", "pybullet", None, "CPython 3.11 to 3.13"),
        ("compare hold --why", "pybullet", None, "pybullet is"),
        ("conventions --backend pybullet", "pybullet", None, "pybullet is"),
        ("conventions --calls --backend mujoco", "mujoco", None, "mujoco is"),
        ("view", "viser", None, "[view]"),
        *(
            pytest.param(f"compare hold {words}", module, None, extra, marks=pytest.mark.slow)
            for words, module, extra in (
                ("--plot a.svg", "matplotlib", "[plot]"),
                ("--film a.webp", "PIL", "[render]"),
            )
        ),
    ],
)
def test_what_is_missing_or_broken_is_one_line(
    cli: Cli, without: Any, command: str, module: str, content: str | None, says: str
) -> None:
    environment = without(module) if content is None else without(**{module: content})
    one_line(cli(*command.split(), **environment), says, 3)


def test_an_interrupt_is_no_engine_that_does_not_load(monkeypatch: pytest.MonkeyPatch) -> None:
    """A Ctrl-C in the start of a C extension comes out as an ImportError of it."""
    from statemachine import installed

    def interrupted(name: str) -> None:
        raise ImportError("initialization failed") from KeyboardInterrupt()

    monkeypatch.setattr(installed.importlib, "import_module", interrupted)
    refused((KeyboardInterrupt, "", lambda: installed.require("mujoco")))


# Errors that no command expects


INTERRUPT = """
import os, signal, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupt())
sys.argv = ["statemachine", "doctor"]
import statemachine_sim
sys.exit(statemachine_sim.main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no process sends itself Ctrl-C there")
@pytest.mark.parametrize(
    "module", ["numpy", "statemachine.cli", "statemachine.lab.installation.doctor"]
)
def test_ctrl_c_while_it_imports_ends_it_without_a_traceback(module: str) -> None:
    done = in_its_own_python(INTERRUPT.format(module=module), ROOT)
    assert done.returncode in (130, -2)  # a shell shows both as 130
    assert (done.stdout, done.stderr.strip()) == ("", "")


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (MemoryError(), 2, "memory"),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"), 2, "UTF-8"),
        (UnicodeEncodeError("utf-8", "\udcff", 0, 1, "surrogates not allowed"), 2, "UTF-8"),
    ],
)
def test_what_no_command_expects_is_one_line(
    error: Exception,
    code: int,
    says: str,
    monkeypatch: pytest.MonkeyPatch,
    here: Cli,
) -> None:
    monkeypatch.setattr("statemachine.cli.doctor.run", Mock(side_effect=error))
    one_line(here("doctor"), says, code)


def test_an_exception_that_nobody_meant_has_an_exit_code_of_its_own(
    monkeypatch: pytest.MonkeyPatch, here: Cli
) -> None:
    """Never 1, which is an answer; with the traceback, and a line that says whose fault it is."""
    fault = Mock(side_effect=IndexError("index 1 is out of bounds"))
    monkeypatch.setattr("statemachine.cli.doctor.run", fault)
    lines = here("doctor", code=70).stderr.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert lines[-2] == "IndexError: index 1 is out of bounds"
    assert lines[-1].startswith("statemachine: this is a fault of statemachine")


def test_a_package_that_cannot_be_imported_is_no_answer_either() -> None:
    done = of_python(
        "-c",
        "import sys, statemachine; sys.modules['statemachine.cli'] = None\n"
        "import statemachine_sim; sys.exit(statemachine_sim.main())",
    )
    assert done.returncode == 70
    assert "Traceback" in done.stderr


def test_an_import_that_an_interrupt_broke_is_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_options: object) -> int:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as interrupt:
            raise SystemError("initialization failed") from interrupt

    monkeypatch.setattr("statemachine.cli.doctor.run", fails)
    assert command_line.main(["doctor"]) == 130


@pytest.mark.skipif(sys.platform != "linux", reason="file names are text elsewhere")
def test_a_model_whose_file_name_is_no_text_is_refused(cli: Cli, tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/\xff.xml"
    with open(path, "w") as out:
        out.write("<mujoco/>")
    for command in (["lesson", "state", "--model"], ["fingertip"]):
        one_line(cli(*command, os.fsdecode(path)), "is not UTF-8")


@pytest.mark.usefixtures("pinocchio")
@pytest.mark.parametrize("name", [5, None, b"gripperframe", ["gripperframe"], "\udcff"])
def test_a_name_of_another_type_is_unknown_to_kinematics(name: Any) -> None:
    import statemachine as sm

    arm = sm.Kinematics("so101")
    pose = partial(arm.pose, [0.0] * arm.nq)
    lists: tuple[Any, ...] = (5, [name] * 6, "abcdef")
    refused(
        *((UnknownNameError, "known: ", partial(pose, name, kind)) for kind in ("site", "body")),
        (UnknownNameError, "kind of frame", lambda: pose("gripperframe", name)),
        *(
            (BadInputError, "list of names", partial(sm.Kinematics, "so101", names))
            for names in lists
            if names != ["\udcff"] * 6
        ),
    )
