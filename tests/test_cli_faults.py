"""The command line when it is interrupted, starved, or given text that is none."""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from statemachine import cli as command_line
from statemachine.errors import BadInputError, UnknownNameError

from .conftest import ROOT, Cli, in_its_own_python, one_line, refused

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
@pytest.mark.parametrize("module", ["numpy", "statemachine.commands", "statemachine.report.doctor"])
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
    monkeypatch.setattr("statemachine.commands.doctor.run", Mock(side_effect=error))
    one_line(here("doctor"), says, code)


def test_an_import_that_an_interrupt_broke_is_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_options: object) -> int:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt as interrupt:
            raise SystemError("initialization failed") from interrupt

    monkeypatch.setattr("statemachine.commands.doctor.run", fails)
    assert command_line.main(["doctor"]) == 130


@pytest.mark.skipif(sys.platform != "linux", reason="file names are text elsewhere")
def test_a_model_whose_file_name_is_no_text_is_refused(cli: Cli, tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/\xff.xml"
    with open(path, "w") as out:
        out.write("<mujoco/>")
    for command in (["lesson", "state"], ["fingertip"]):
        one_line(cli(*command, "--model", os.fsdecode(path)), "is not UTF-8")


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
