"""A pytest plugin: which test runs which line, and how long each test takes.

It names the running test to coverage.py, in the process of the tests and in its forks. A process
that a test starts reads the name from PYTEST_CURRENT_TEST (`covered.INI`).
"""

from __future__ import annotations

import json
import os
import threading
from collections import defaultdict
from pathlib import Path

import pytest
from coverage import Coverage

_seconds: dict[str, float] = defaultdict(float)
_fixtures: dict[str, float] = defaultdict(float)
_failed: set[str] = set()


def _name(context: str) -> None:
    if measuring := Coverage.current():
        measuring.switch_context(context)


def pytest_configure() -> None:
    if measuring := Coverage.current():
        # A test that interrupts a thread may do so where coverage.py holds its lock.
        measuring._collector.data_lock = threading.RLock()  # pyright: ignore
    os.register_at_fork(after_in_child=lambda: _name(os.environ.get("PYTEST_CURRENT_TEST", "")))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> object:
    _name(f"{item.nodeid} (setup)")
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> object:
    _name(f"{item.nodeid} (call)")
    return (yield)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    _seconds[report.nodeid] += report.duration
    if report.when == "setup":
        file = report.nodeid.partition("::")[0]
        _fixtures[file] = max(_fixtures[file], report.duration)
    if report.failed:
        _failed.add(report.nodeid)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if measuring := Coverage.current():
        measuring.save()
    if not hasattr(session.config, "workerinput"):
        told = {"seconds": _seconds, "fixtures": _fixtures, "failed": sorted(_failed)}
        Path(os.environ["MUTANTS_TIMES"]).write_text(json.dumps(told), "utf-8")
