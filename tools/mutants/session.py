"""A pytest plugin: a session that stays, and runs the tests of each fault in a fork of itself.

What tests import and what pytest collects takes seconds; the tests that notice a fault often take
less. So all of it is done once, and a fork puts the fault into the functions that are in memory.
`places.Session` starts it and writes one `Order` a line into its pipe.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import signal
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from types import CodeType, FunctionType
from typing import NoReturn

import pytest

PIPES = "MUTANTS_PIPES"  # the variable with the two file descriptors
PAUSE = 0.02  # between two looks whether a fork has ended [s]
# What a fork says with its exit code.
PASSED, FAILED, NOT_PATCHED = 0, 1, 3

Functions = dict[tuple[str, str, int], list[FunctionType]]


@dataclass(frozen=True)
class Order:
    """The tests that are to be run, and the fault that is to be put into the functions.

    Attributes:
        tests: Names of the tests, in their order.
        processor: Processor time that the fork, and each process that it starts, may take [s].
        clock: Time of the clock that it may take [s].
        file: Path of the module, relative to the root of the project; "" for no fault.
        before: The source of the module.
        after: The source with the fault.
    """

    tests: list[str]
    processor: int
    clock: float
    file: str = ""
    before: str = ""
    after: str = ""


@dataclass(frozen=True)
class Answer:
    """What came of an Order.

    Attributes:
        result: "killed", "survived", "timed out" or "not patched".
        test: The test that failed; "" where none did.
    """

    result: str
    test: str = ""


def _codes(code: CodeType) -> Iterator[CodeType]:
    """Yield the code of each function and class in a module, and of those in these."""
    for inner in code.co_consts:
        if isinstance(inner, CodeType) and not inner.co_name.startswith("<"):
            yield inner
            yield from _codes(inner)


def functions_of(root: Path) -> Functions:
    """Return the functions in memory by file, qualified name and first line.

    Args:
        root: The checkout; others' functions are left out.
    """
    functions: Functions = defaultdict(list)
    for function in gc.get_objects():
        if isinstance(function, FunctionType):
            code = function.__code__
            with suppress(ValueError):
                file = Path(code.co_filename).relative_to(root).as_posix()
                functions[file, code.co_qualname, code.co_firstlineno].append(function)
    return functions


def patch(functions: Functions, order: Order) -> bool:
    """Put a fault into the functions that are in memory, and return whether that could be done.

    A module that is not yet imported has no functions here: its import reads the fault.
    """
    before = defaultdict(list)
    for code in _codes(compile(order.before, order.file, "exec")):
        before[code.co_qualname].append(code)
    after = defaultdict(list)
    for code in _codes(compile(order.after, order.file, "exec")):
        after[code.co_qualname].append(code)
    for name, codes in before.items():
        if len(codes) != len(after[name]):
            return False
        for old, new in zip(codes, after[name], strict=True):
            for function in functions.get((order.file, name, old.co_firstlineno), []):
                if len(new.co_freevars) != len(function.__code__.co_freevars):
                    return False
                function.__code__ = new.replace(co_filename=function.__code__.co_filename)
    return True


class _Noticing:
    """A plugin that remembers the first test that failed."""

    def __init__(self) -> None:
        self.test = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.test:
            self.test = report.nodeid


def _fork(session: pytest.Session, functions: Functions, order: Order, told: int) -> NoReturn:
    """Run the tests of an order in a fork, write the one that failed, and end the fork."""
    os.setpgid(0, 0)
    resource.setrlimit(resource.RLIMIT_CPU, (order.processor, order.processor + 2))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if order.file and not patch(functions, order):
        os._exit(NOT_PATCHED)
    noticing = _Noticing()
    session.config.pluginmanager.register(noticing)
    by_name = {item.nodeid: item for item in session.items}
    items = [by_name[test] for test in order.tests if test in by_name]
    try:
        for item, following in zip(items, [*items[1:], None], strict=True):
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            if noticing.test:
                break
    except BaseException as error:  # a fork must not go on as the session
        if not noticing.test:
            noticing.test = f"{type(error).__name__} in pytest"
    os.write(told, noticing.test.encode())
    os._exit(FAILED if noticing.test else PASSED)


def _wait(fork: int, seconds: float) -> int | None:
    """Return the exit code of a fork, or what signal ended it as a negative number.

    Returns:
        None where the clock ended it.
    """
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        ended, status = os.waitpid(fork, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(PAUSE)
    with suppress(ProcessLookupError):
        os.killpg(fork, signal.SIGKILL)
    os.waitpid(fork, 0)
    return None


def answer(session: pytest.Session, functions: Functions, order: Order) -> Answer:
    """Return what comes of an order in a fork of this process."""
    reading, writing = os.pipe()
    fork = os.fork()
    if not fork:
        _fork(session, functions, order, writing)
    os.close(writing)
    code = _wait(fork, order.clock)
    os.set_blocking(reading, False)
    test = ""
    with suppress(BlockingIOError):
        test = os.read(reading, 10_000).decode()
    os.close(reading)
    if code is None or code == -signal.SIGXCPU:
        return Answer("timed out")
    if code == NOT_PATCHED:
        return Answer("not patched")
    if code == PASSED:
        return Answer("survived")
    return Answer("killed", test or f"exit code {code}")


def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Answer orders until the pipe is closed, in place of running all tests."""
    if session.testsfailed:
        return None  # what could not be collected ends the session, as ever
    reading, writing = (int(number) for number in os.environ[PIPES].split(","))
    functions = functions_of(Path.cwd())
    gc.collect()
    gc.freeze()  # a collection of a fork does not touch, and so copy, what was there before
    with os.fdopen(reading) as orders, os.fdopen(writing, "w") as answers:
        print(json.dumps("ready"), file=answers, flush=True)
        for line in orders:
            told = answer(session, functions, Order(**json.loads(line)))
            print(json.dumps(asdict(told)), file=answers, flush=True)
    return True
