"""A test file against the healthy arm, then against every faulty one, each in a process of its own.

The tests and what records them share a process: tests that look into it can learn that there is
a fault without looking at the arm, or write the record themselves.
"""

from __future__ import annotations

import importlib.util
import os
import re
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from ....backends import backend_names
from ....engines import raw_engines_with
from ....errors import BadInputError, MissingEngineError, ModelFileError, check_name, unknown_name
from ....installed import DEFAULT, engine_version, require
from ....installing import install_command
from ....interface.checks import unsupported_by
from ....lab.runs.drive import Progress, no_progress
from ....measures.text import listed
from ....models import AnyPath
from ....processes import checked_jobs, sandbox
from ....processes.parallel import in_parallel, unwinding
from ..links import refusal_of
from ..recording import copied_to, named_by, start_of
from . import FAULTS, IMPORT, Fault
from .examination import Examination, FaultTrial
from .pytest_run import PytestRun, run_pytest

_SECONDS = 60.0  # of computing, for the tests on the healthy arm
_CLOCK = 300.0  # on the clock: the machine may be busy with others
# Under a fault they may take longer: so many times as long, and so many seconds more.
CPU_FACTOR, MORE_CPU, MORE_CLOCK = 5.0, 15.0, 120.0


def examine(
    file: AnyPath,
    backend: str = DEFAULT,
    only: Sequence[str] = (),
    seconds: float = _SECONDS,
    clock: float = _CLOCK,
    progress: Progress = no_progress,
    submitted_files: Mapping[str, Path] | None = None,
) -> Examination:
    """Run a student's tests on the healthy arm and on one with each of the faults.

    Args:
        file: Tests as pytest takes them.
        backend: What the fixture `model` is loaded on.
        only: Names of faults; none for all.
        seconds: What the tests may compute on the healthy arm [s].
        clock: What they may take there on the clock, from when the arm is ready [s].
        progress: Told the fraction that is done.
        submitted_files: All files that belong to it, by their names in its folder; without, what
            it names beside it. No other file is there for the tests.

    Raises:
        ModelFileError: There is no such file.
        BadInputError: It is a link, it cannot be imported, or there are no tests in it.
        UnknownNameError: There is no such fault or backend.
        UnsupportedError: No fault can be put into this backend.
        MissingEngineError: The engine, or pytest, is not here.
        EngineError: pytest did not come as far as the tests.
    """
    path = _test_file(file)
    for name in only:
        check_name("fault", name, FAULTS)
    faults = [FAULTS[name] for name in dict.fromkeys(only or FAULTS)]
    version = _ready(backend)
    trials: list[FaultTrial] = []
    with ExitStack() as stack:
        stack.enter_context(unwinding())
        folder = stack.enter_context(
            tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True)
        )
        files = submitted_files if submitted_files else named_by(path, _has_tests)
        copied = copied_to(Path(folder).resolve(), path, files)
        healthy = run_pytest(copied, backend, None, seconds, clock)
        for failure in healthy.failures:
            if failure.test == IMPORT and failure.why:
                raise BadInputError(f"{path.name} cannot be imported: {failure.why}")
        if not healthy.tests:
            why = "each was skipped" if healthy.skipped else "a test is a function test_…"
            raise BadInputError(f"there are no tests in {path.name}: {why}")
        if not healthy.failures:
            trials = _try_faults(faults, copied, backend, healthy.outcome, progress)
    return Examination(path.name, backend, version, healthy.tests, healthy.failures, tuple(trials))


def _try_faults(
    faults: Sequence[Fault],
    path: Path,
    backend: str,
    healthy: sandbox.ProcessOutcome,
    progress: Progress,
) -> list[FaultTrial]:
    """Run tests on an arm with each of the faults, several at once.

    Args:
        faults: One after the other.
        path: The test file.
        backend: What the arm is loaded on.
        healthy: How the run on the healthy arm ended, by which it is limited how long these take.
        progress: Told the fraction that is done, the run on the healthy arm included.
    """
    seconds = CPU_FACTOR * healthy.cpu + MORE_CPU
    clock = CPU_FACTOR * healthy.wall + MORE_CLOCK
    stop, total = threading.Event(), len(faults) + 1
    work: dict[str, Callable[[], PytestRun]] = {}
    for fault in faults:
        work[fault.name] = partial(run_pytest, path, backend, fault.name, seconds, clock, stop)
    runs = in_parallel(
        work, checked_jobs(None), stop.set, lambda left: progress((total - left) / total)
    )
    return [FaultTrial(fault, runs[fault.name].failures) for fault in faults]


def _test_file(file: AnyPath) -> Path:
    path = Path(file).absolute()
    if path.is_symlink():
        raise BadInputError(refusal_of(path, path.name))
    if not path.is_file():
        raise ModelFileError(f"no file {os.fspath(file)}: --faults takes a file of tests")
    if path.suffix != ".py":
        raise BadInputError(f"{path.name} is not a Python file: --faults takes a file of tests")
    return path


def _has_tests(file: Path) -> bool:
    """Return whether a file holds tests: then it is not another's helper."""
    return re.search(rb"^\s*def test_", start_of(file), re.M) is not None


def _ready(backend: str) -> str:
    """Return the version of the backend's engine; raise where the tests could not even begin."""
    known = raw_engines_with("backend")
    if backend not in backend_names():
        raise unknown_name("backend", backend, known)
    if backend not in known:
        reason = f"the faults are put into what the backends of {listed(known)} compile"
        raise unsupported_by(backend, "check --faults", reason)
    require(backend)
    if importlib.util.find_spec("pytest") is None:
        raise MissingEngineError(
            f"pytest is not installed here: {install_command('faults')}",
            engine="pytest",
        )
    return engine_version(backend)
