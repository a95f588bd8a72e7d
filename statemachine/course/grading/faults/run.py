"""A test file against the healthy arm, then against every faulty one, each in a process of its own.

The tests and what records them share a process: tests that look into it can learn that there is
a fault without looking at the arm, or write the record themselves.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from ....backends import backend_names
from ....engines import rooms_with
from ....errors import (
    BadInputError,
    EngineError,
    MissingEngineError,
    ModelFileError,
    check_name,
    unknown_name,
)
from ....installed import DEFAULT, engine_version, require
from ....lab.runs.drive import Progress, silent
from ....models import AnyPath
from ....processes import checked_jobs, sandbox
from ....processes.parallel import in_parallel, unwinding
from ..links import refusal_of
from ..recording import content, copied_to, environment, named_by, start_of
from ..shown import view_of
from . import FAULT, FAULTS, IMPORT, Fault

_SECONDS = 60.0  # of computing, for the tests on the healthy arm
_CLOCK = 300.0  # on the clock: the machine may be busy with others
# Under a fault they may take longer: so many times as long, and so many seconds more.
_TIMES, _AND, _CLOCK_AND = 5.0, 15.0, 120.0
_RECORD_MOST = 10_000_000  # bytes
_PYTEST_FAILS = "INTERNALERROR>"  # how pytest's report of an error of its own begins, on stdout
_LONGEST = 300  # characters of what was said last
# What stands between the errors of one report, of which the last is the one of the test.
# Where the error itself stands, as pytest writes it; the first that fits counts.
_ERRORS = (r"^E   (\S.*)", r"^E +(\S.*)", r"^ +\| (\w+Group: .*)", r"^(\S.*)")
_CHAINED = re.compile(r"^(?:The above exception was|During handling of the above) .*", re.MULTILINE)


@dataclass(frozen=True)
class FailedTest:
    """Test that failed.

    Attributes:
        test: Its name.
        why: What it said, in a line.
    """

    test: str
    why: str


@dataclass(frozen=True)
class FaultTrial:
    """Tests against an arm with one fault.

    Attributes:
        fault: What is wrong with the arm.
        caught_by: The tests that failed on it.
    """

    fault: Fault
    caught_by: tuple[FailedTest, ...]

    @property
    def caught(self) -> bool:
        """Whether any test caught the fault."""
        return bool(self.caught_by)


@dataclass(frozen=True)
class Examination:
    """What a test file is worth.

    Attributes:
        file: Its name.
        backend: What it ran on.
        engine_version: Of its engine.
        tests: Those that are not skipped.
        failures: Those that failed on the healthy arm; then there are no trials.
        trials: One for each fault.
    """

    file: str
    backend: str
    engine_version: str
    tests: tuple[str, ...]
    failures: tuple[FailedTest, ...]
    trials: tuple[FaultTrial, ...]

    @property
    def caught(self) -> int:
        """How many faults were caught."""
        return len(self.trials) - len(self.missed)

    @property
    def missed(self) -> tuple[Fault, ...]:
        """Faults that no test caught."""
        return tuple(trial.fault for trial in self.trials if not trial.caught)

    @property
    def idle(self) -> tuple[str, ...]:
        """Tests that caught no fault."""
        busy: set[str] = set()
        for trial in self.trials:
            busy.update(failure.test for failure in trial.caught_by)
        return tuple(test for test in self.tests if test not in busy)

    @property
    def holds(self) -> bool:
        """Whether the tests pass on the healthy arm and catch all faults."""
        return not self.failures and not self.missed


@dataclass(frozen=True)
class PytestRun:
    """What one run of pytest came to.

    Attributes:
        outcome: How its process ended.
        tests: Those that were not skipped.
        skipped: How many were.
        failures: Those that failed; of a file that cannot be imported the name is `IMPORT`.
    """

    outcome: sandbox.ProcessOutcome
    tests: tuple[str, ...]
    skipped: int
    failures: tuple[FailedTest, ...]


def examine(
    file: AnyPath,
    backend: str = DEFAULT,
    only: Sequence[str] = (),
    seconds: float = _SECONDS,
    clock: float = _CLOCK,
    progress: Progress = silent,
    own: Mapping[str, Path] | None = None,
) -> Examination:
    """Run a student's tests on the healthy arm and on one with each of the faults.

    Args:
        file: Tests as pytest takes them.
        backend: What the fixture `model` is loaded on.
        only: Names of faults; none for all.
        seconds: What the tests may compute on the healthy arm [s].
        clock: What they may take there on the clock, from when the arm is ready [s].
        progress: Told the fraction that is done.
        own: All files that belong to it, by their names in its folder; without, what it names
            beside it. No other file is there for the tests.

    Raises:
        ModelFileError: There is no such file.
        BadInputError: It is a link, it cannot be imported, or there are no tests in it.
        UnknownNameError: There is no such fault or backend.
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
        files = own if own else named_by(path, _has_tests)
        copied = copied_to(Path(folder).resolve(), path, files)
        healthy = _run(copied, backend, None, seconds, clock)
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
    seconds = _TIMES * healthy.cpu + _AND
    clock = _TIMES * healthy.wall + _CLOCK_AND
    stop, total = threading.Event(), len(faults) + 1
    work: dict[str, Callable[[], PytestRun]] = {}
    for fault in faults:
        work[fault.name] = partial(_run, path, backend, fault.name, seconds, clock, stop)
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
    known = rooms_with("backend")
    if backend not in backend_names():
        raise unknown_name("backend", backend, known)
    if backend not in known:
        raise BadInputError(
            f"the faults are made for {' and '.join(known)}, not for backend {backend!r}"
        )
    require(backend)
    if importlib.util.find_spec("pytest") is None:
        raise MissingEngineError(
            "pytest is not installed here: pip install 'statemachine-sim[faults]'",
            engine="pytest",
        )
    return engine_version(backend)


def _run(
    path: Path,
    backend: str,
    fault: str | None,
    seconds: float,
    clock: float,
    stop: threading.Event | None = None,
) -> PytestRun:
    """Run pytest once.

    Args:
        path: The test file.
        backend: What the arm is loaded on.
        fault: Name of the arm's fault; None for the healthy arm.
        seconds: What the tests may compute [s].
        clock: What they may take on the clock, from when the arm is ready [s].
        stop: Ends it.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        here = Path(folder)
        settings, record = here / "pytest.ini", here / "record"
        settings.write_text("[pytest]\n", encoding="utf-8")
        record.touch()
        env = _environment(backend)
        if fault:
            env[FAULT] = fault  # where no test looks for it
        command = _command(path.name, backend, folder, str(settings), str(record))
        outcome = sandbox.run(
            command,
            sandbox.Limits(cpu=seconds, wall=clock),
            started=lambda: record.stat().st_size > 0,
            cwd=path.parent,
            env=env,
            writable=folder,
            view=view_of(backend, [path.parent], faults=True),
            stop=stop,
        )
        return _read(record, outcome, path.name)


def _command(file: str, backend: str, folder: str, settings: str, record: str) -> list[str]:
    """Return the command that runs pytest.

    Args:
        file: Name of the test file, in the folder that it runs in.
        backend: What the arm is loaded on.
        folder: That of `settings` and `record`.
        settings: The file that pytest reads.
        record: The file that the plugin writes.
    """
    # -P: what lies beside the file must not pass for a module of pytest's.
    command = [sys.executable, "-P", "-m", "pytest", "-c", settings, "--rootdir", folder]
    command += ["--noconftest", "--tb=short", "--no-summary", "-q", "-p", "no:cacheprovider"]
    command += ["-p", f"{__package__}.plugin", "--engine", backend, "--record", record]
    if not sandbox.shut_in():
        command.append("--watched")
    command.append(os.path.join(os.curdir, file))  # brackets in a whole path confuse pytest
    return command


def _environment(backend: str) -> dict[str, str]:
    """Return that of a student's process, with this package to be found, for one pytest alone."""
    env = environment(backend)
    paths = [str(Path(__file__).resolve().parents[4])]
    if env.get("PYTHONPATH"):
        paths.append(env["PYTHONPATH"])
    return {
        **env,
        "PYTHONPATH": os.pathsep.join(paths),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
    }


@dataclass
class _PytestRecord:
    """What the plugin wrote of a run of pytest; see `plugin.PytestRecorder`.

    Attributes:
        file: Name of the test file.
        tests: All tests; None before pytest has collected them.
        running: The test that began last; "" before the first.
        ended: Tests that came to their end.
        skipped: Tests that were skipped.
        failures: What each test said that failed.
    """

    file: str
    tests: list[str] | None = None
    running: str = ""
    ended: set[str] = field(default_factory=set)
    skipped: set[str] = field(default_factory=set)
    failures: dict[str, str] = field(default_factory=dict)

    def add(self, line: bytes) -> None:
        """Take a line.

        Raises:
            BadInputError: It is not one of the plugin's.
        """
        try:
            facts = json.loads(line)
        except (ValueError, RecursionError):
            facts = None
        match facts:
            case {"ready": True}:
                pass
            case {"tests": [*names]} if all(isinstance(name, str) for name in names):
                self.tests = names
            case {"begins": str(name)}:
                self.running = name
            case {"test": str(name), "when": str(when), "outcome": outcome, "text": str(text)}:
                self._add_report(name, when, outcome, text)
            case _:
                raise BadInputError("the tests wrote into the record of what they do")

    def _add_report(self, name: str, when: str, outcome: Any, text: str) -> None:
        """Take one of pytest's reports of a test."""
        if when == "teardown":
            self.ended.add(name)
        if outcome == "failed":
            # The test before its teardown.
            self.failures.setdefault(name, _error_in(text, self.file))
        elif outcome == "skipped":
            self.skipped.add(name)

    def add_end(self, end: str) -> None:
        """Take how the process ended: a test that did not come to its end failed by that."""
        if self.tests is None:
            self.failures.setdefault(IMPORT, f"it {end}")
        elif IMPORT not in self.failures:
            not_ended = [test for test in self.tests if test not in self.ended]
            if not_ended:
                # The one that was running ended them all.
                test = self.running if self.running in not_ended else not_ended[0]
                self.failures.setdefault(test, end)


def _read(file: Path, outcome: sandbox.ProcessOutcome, tests: str) -> PytestRun:
    """Read what a run of pytest came to.

    Args:
        file: The plugin's record.
        outcome: How the process ended.
        tests: Name of the test file.
    """
    if not outcome.started:  # of which no test can be the reason
        raise EngineError(f"pytest stopped before the tests: it {_end(outcome)}")
    record = _PytestRecord(tests)
    for line in content(file, _RECORD_MOST).splitlines():
        record.add(line)
    record.add_end(_end(outcome))
    counted = tuple(test for test in record.tests or () if test not in record.skipped)
    failures = tuple(FailedTest(test, why) for test, why in record.failures.items())
    return PytestRun(outcome, counted, len(record.skipped), failures)


def _error_in(text: str, file: str) -> str:
    """Return the error in one of pytest's reports, in one line, with the last line of the file."""
    last = _CHAINED.split(text)[-1]
    words = ""
    for pattern in _ERRORS:
        match = re.search(pattern, last, re.MULTILINE)
        if match:
            words = match[1]
            break
    words = re.sub(r"^(?:AssertionError: |Failed: |(?:\w+\.)+(?=\w+:))", "", words)
    if re.fullmatch(r"fixture '.*' not found", words):
        words += "; this command gives model, data and backend"
    words = words[:_LONGEST]
    lines = re.findall(rf'{re.escape(file)}(?::|"?, line )(\d+)', last)
    return f"line {lines[-1]}: {words}" if lines else words


def _end(outcome: sandbox.ProcessOutcome) -> str:
    """Return how a run ended that did not come to its end, with the last line of an error, if any.

    pytest's own among them.
    """
    lines = [line.strip() for line in outcome.stderr.splitlines() if line.strip()]
    lines += [line for line in outcome.stdout.splitlines() if line.startswith(_PYTEST_FAILS)]
    errors = [line for line in lines if "rror" in line.removeprefix(_PYTEST_FAILS)]
    if errors:
        last = errors[-1]
    elif lines:
        last = lines[-1]
    else:
        return outcome.how
    return f"{outcome.how}: {last.removeprefix(_PYTEST_FAILS).strip()[:_LONGEST]}"
