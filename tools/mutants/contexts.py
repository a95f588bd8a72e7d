"""A pytest plugin: which test runs which line, and how much processor time each test takes.

It names the running test to coverage.py, in the process of the tests and in its forks. A process
that a test starts reads the name from PYTEST_CURRENT_TEST (`covered.INI`). The time of the clock
depends on what else the machine does, so what is written is the time of the processors, with that
of the processes that a test started and waited for.

Measuring all tests takes most of an hour, and more of the same rarely notices more. So of a file is
measured what comes within `FILE_SECONDS`: first a case of each test, then another of each.
"""

from __future__ import annotations

import json
import os
import threading
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from coverage import Coverage

_STAGES = ("processor setup", "processor call")  # properties of a report
FILE_SECONDS = 12.0  # of a file, under coverage.py; the test that exceeds them is the last

_seconds: dict[str, float] = defaultdict(float)
_fixtures: dict[str, float] = defaultdict(float)
_unused: set[str] = set()  # failed or skipped
_spent: dict[str, float] = defaultdict(float)  # of each file, in the process that runs its tests


def _file(test: str) -> str:
    return test.partition("::")[0]


def _name(context: str) -> None:
    if measuring := Coverage.current():
        measuring.switch_context(context)


@contextmanager
def _timed(item: pytest.Item, stage: str) -> Iterator[None]:
    """Name a stage of a test to coverage.py, and give its processor time to the test's report."""
    _name(f"{item.nodeid} ({stage})")
    before = sum(os.times()[:4])
    try:
        yield
    finally:
        took = sum(os.times()[:4]) - before
        _spent[_file(item.nodeid)] += took
        item.user_properties.append((f"processor {stage}", took))


def pytest_configure() -> None:
    if measuring := Coverage.current():
        # A test that interrupts a thread may do so where coverage.py holds its lock.
        measuring._collector.data_lock = threading.RLock()  # pyright: ignore
    os.register_at_fork(after_in_child=lambda: _name(os.environ.get("PYTEST_CURRENT_TEST", "")))


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the first cases of all tests of a file come first, then the second ones."""
    count: Counter[str] = Counter()
    place: dict[str, int] = {}
    for item in items:
        test = item.nodeid.partition("[")[0]
        place[item.nodeid] = count[test]
        count[test] += 1
    files = {file: number for number, file in enumerate(dict.fromkeys(map(_file_of, items)))}
    items.sort(key=lambda item: (files[_file_of(item)], place[item.nodeid]))


def _file_of(item: pytest.Item) -> str:
    return _file(item.nodeid)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> object:
    if _spent[_file(item.nodeid)] > FILE_SECONDS:
        pytest.skip("its file has had its time")
    with _timed(item, "setup"):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> object:
    with _timed(item, "call"):
        return (yield)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if not report.passed:
        _unused.add(report.nodeid)
    if report.when != "teardown":
        return
    spent = {name: float(str(took)) for name, took in report.user_properties if name in _STAGES}
    setup = spent.get(_STAGES[0], 0.0)
    _seconds[report.nodeid] = setup + spent.get(_STAGES[1], 0.0)
    file = _file(report.nodeid)
    _fixtures[file] = max(_fixtures[file], setup)


def pytest_sessionfinish(session: pytest.Session) -> None:
    if measuring := Coverage.current():
        measuring.save()
    if not hasattr(session.config, "workerinput"):
        told = {"seconds": _seconds, "fixtures": _fixtures, "unused": sorted(_unused)}
        Path(os.environ["MUTANTS_TIMES"]).write_text(json.dumps(told), "utf-8")
