"""A plugin of pytest: puts a fault in before a test file is imported, and writes down what happens.

The record goes to a file of its own, one JSON object a line, so that what tests print is no
part of it, and what was written before a crash is there.

A student's tests get the fixtures `backend`, `model` (the arm, a floor and a box; made once)
and `data` (a new one for each test). Without a fault in the environment the arm is healthy:
`pytest -p statemachine.grading.mutants.plugin test_arm.py`.
"""

from __future__ import annotations

import json
import os
import traceback
from collections.abc import Generator, Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import statemachine as sm

from ...engines import rooms_with
from ...installed import DEFAULT
from ..guard import Guard
from . import FAULT, IMPORT

if TYPE_CHECKING:
    from statemachine import Data, Model

SCENE = "so101/scene_box"
_LONGEST = 300  # characters of what an error says


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options with which `run` starts it."""
    group = parser.getgroup("statemachine")
    group.addoption(
        "--engine", choices=rooms_with("backend"), default=DEFAULT, help="backend of `model`"
    )
    group.addoption("--record", metavar="FILE", help="write down there what happens")


def pytest_configure(config: pytest.Config) -> None:
    """Put the fault in; nothing of the student's is imported yet."""
    from .faults import FAULTS  # on the healthy arm too, so that it tells nothing

    if name := os.environ.pop(FAULT, ""):
        FAULTS[name](pytest.MonkeyPatch())  # for the life of the process
    if path := config.getoption("record"):
        config.pluginmanager.register(PytestRecorder(Path(path)))
        os.chdir(Path(path).parent)  # what tests write does not end up beside them
        sm.load(
            SCENE, backend=str(config.getoption("engine"))
        )  # engines start processes of their own
        tests = Path(str(config.args[0]).partition("::")[0])
        Guard(tests, tests.parent, Path(path).parent, lambda _kind, _text: None)


@pytest.fixture(scope="session")
def backend(request: pytest.FixtureRequest) -> str:
    """The backend under test."""
    return str(request.config.getoption("engine"))


@pytest.fixture(scope="session")
def model(backend: str) -> Model:
    """The arm on a floor, with a box."""
    return sm.load(SCENE, backend=backend)


@pytest.fixture
def data(model: Model) -> Iterator[Data]:
    """A new Data of `model`: zero pose, nothing derived."""
    with closing(sm.make_data(model)) as data:
        yield data


class PytestRecorder:
    """Writes down what was found, what began and how it ended.

    Lines: {"ready": true} once the fault is in, {"tests": names}, {"began": name},
    {"failed": name, "why": …} (of `IMPORT` for a file that cannot be imported), {"skipped": name}
    and {"ended": name}.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("a", encoding="utf-8", buffering=1)
        self._write(ready=True)

    def _write(self, **facts: Any) -> None:
        self._file.write(json.dumps(facts) + "\n")

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        self._write(tests=[_name(item.nodeid) for item in items])

    def pytest_exception_interact(self, node: Any, call: Any, report: Any) -> None:
        if isinstance(report, pytest.CollectReport):
            error = call.excinfo.value
            self._write(failed=IMPORT, why=_said(error.__cause__ or error, node.path))

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self._write(began=_name(nodeid))

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        report = yield
        if report.failed:
            why = _said(call.excinfo.value, item.path) if call.excinfo else str(report.longrepr)
            self._write(failed=_name(item.nodeid), why=why)
        elif report.skipped:
            self._write(skipped=_name(item.nodeid))
        return report

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        self._write(ended=_name(nodeid))


def _name(nodeid: str) -> str:
    """A test's name within its file."""
    return nodeid.partition("::")[2]


def _said(error: BaseException, path: Path) -> str:
    """An error in one line, with the last line of the student's file that led to it."""
    text = next((line.strip() for line in str(error).splitlines() if line.strip()), "")[:_LONGEST]
    if isinstance(error, pytest.FixtureLookupError):
        return f"there is no fixture {error.argname!r}; this command gives model, data and backend"
    if isinstance(error, SyntaxError):
        return f"line {error.lineno}: {error.msg}"
    if not isinstance(error, AssertionError | pytest.fail.Exception):
        text = f"{type(error).__name__}: {text}".removesuffix(": ")
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    return f"line {lines[-1]}: {text}" if lines else text
