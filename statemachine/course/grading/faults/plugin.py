"""A plugin of pytest: puts a fault in before a test file is imported, and writes down what happens.

The record goes to a file of its own, one JSON object a line, so that what tests print is no
part of it, and what was written before a crash is there.

A student's tests get the fixtures `backend`, `model` (the arm, a floor and a box; made once)
and `data` (a new one for each test). Without a fault in the environment the arm is healthy:
`pytest -p statemachine.course.grading.faults.plugin test_arm.py`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import statemachine as sm

from ....backends import backend_names
from ....installed import DEFAULT
from ..inside.guard import Guard
from . import FAULT, IMPORT

if TYPE_CHECKING:
    from statemachine import Data, Model

SCENE = "so101/scene_box"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options with which `run` starts pytest."""
    group = parser.getgroup("statemachine")
    group.addoption("--engine", choices=backend_names(), default=DEFAULT, help="backend of `model`")
    group.addoption("--record", metavar="FILE", help="write down there what happens")
    group.addoption("--watched", action="store_true", help="with --record: refuse other files, too")


def pytest_configure(config: pytest.Config) -> None:
    """Put the fault in; nothing of the student's is imported yet."""
    from .patches import PATCHES  # on the healthy arm too, so that it tells nothing

    if name := os.environ.pop(FAULT, ""):
        PATCHES[name](pytest.MonkeyPatch())  # for the life of the process
    if path := config.getoption("record"):
        config.pluginmanager.register(PytestRecorder(Path(path)))
        tests = Path(str(config.args[0]).partition("::")[0]).absolute()
        os.chdir(Path(path).parent)  # what tests write does not end up beside them
        sm.load(
            SCENE, backend=str(config.getoption("engine"))
        )  # engines start processes of their own
        Guard(
            tests,
            tests.parent,
            Path(path).parent,
            lambda _kind, _text: None,
            is_only_guard=bool(config.getoption("watched")),
            faults=True,
        )


@pytest.fixture(scope="session")
def backend(request: pytest.FixtureRequest) -> str:
    """Return the name of the backend under test."""
    return str(request.config.getoption("engine"))


@pytest.fixture(scope="session")
def model(backend: str) -> Model:
    """Return the Model of the arm on a floor, with a box."""
    return sm.load(SCENE, backend=backend)


@pytest.fixture
def data(model: Model) -> Iterator[Data]:
    """Yield a new Data of `model`: zero pose, nothing derived."""
    with closing(sm.make_data(model)) as data:
        yield data


class PytestRecorder:
    """Writes down which tests there are, and pytest's report of each as it comes.

    Lines: {"ready": true} once the fault is in, {"tests": names}, {"begins": name} as each begins,
    and of each report {"test": name, "when": "setup", "call" or "teardown", "outcome", "text"}; of
    a file that cannot be imported the name is `IMPORT`.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("a", encoding="utf-8", buffering=1)
        self._write(ready=True)

    def _write(self, **facts: Any) -> None:
        self._file.write(json.dumps(facts) + "\n")

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        self._write(tests=[_name(item.nodeid) for item in items])

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self._write(test=IMPORT, when="collect", outcome="failed", text=report.longreprtext)

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self._write(begins=_name(nodeid))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        facts = {"when": report.when, "outcome": report.outcome, "text": report.longreprtext}
        self._write(test=_name(report.nodeid), **facts)


def _name(nodeid: str) -> str:
    """Return the name of a test within its file."""
    return nodeid.partition("::")[2]
