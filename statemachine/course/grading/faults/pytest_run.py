"""One run of pytest on a student's tests, in a process of its own, and what its record says."""

from __future__ import annotations

import json
import os
import re
import sys
import tempfile
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ....errors import BadInputError, EngineError
from ....processes import sandbox
from ..recording import content, environment
from ..shown import view_of
from . import FAULT, IMPORT
from .examination import FailedTest

_RECORD_MOST = 10_000_000  # bytes
_PYTEST_FAILS = "INTERNALERROR>"  # how pytest's report of an error of its own begins, on stdout
_LONGEST = 300  # characters of what was said last
# Where the error itself stands, as pytest writes it; the first that fits counts.
_ERRORS = (r"^E   (\S.*)", r"^E +(\S.*)", r"^ +\| (\w+Group: .*)", r"^(\S.*)")
# What stands between the errors of one report, of which the last is the one of the test.
_CHAINED = re.compile(r"^(?:The above exception was|During handling of the above) .*", re.MULTILINE)


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


def run_pytest(
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
        root = Path(folder)
        settings, record = root / "pytest.ini", root / "record"
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
