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
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from ...backends import backend_names
from ...engines import rooms_with
from ...errors import (
    BadInputError,
    EngineError,
    MissingEngineError,
    ModelFileError,
    check_name,
    unknown_name,
)
from ...installed import DEFAULT, engine_version, require
from ...models import AnyPath
from ...page import Figures
from ...processes import checked_jobs, sandbox
from ...processes.parallel import in_parallel, unwinding
from ...runs.drive import Progress, silent
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


def trial_of(fault: Fault, caught_by: tuple[Figures, ...]) -> Figures:
    """A fault, the tests that caught it with what each said, and whether any did."""
    return Figures(fault=fault, caught_by=caught_by, caught=bool(caught_by))


def examination_of(
    file: str,
    backend: str,
    engine_version: str,
    tests: tuple[str, ...],
    failures: tuple[Figures, ...],
    trials: tuple[Figures, ...],
) -> Figures:
    """What a test file is worth.

    Args:
        file: Its name.
        backend: What it ran on.
        engine_version: Of its engine.
        tests: Those that are not skipped.
        failures: Those that failed on the healthy arm, each test and in a line why; then there are
            no trials.
        trials: One for each fault.

    Returns:
        The same; caught: how many faults were caught; missed: those that no test caught; idle:
        tests that caught none; holds: whether the tests pass on the healthy arm and catch all.
    """
    missed = tuple(trial.fault for trial in trials if not trial.caught)
    busy = {failure.test for trial in trials for failure in trial.caught_by}
    return Figures(
        file=file,
        backend=backend,
        engine_version=engine_version,
        tests=tests,
        failures=failures,
        trials=trials,
        caught=len(trials) - len(missed),
        missed=missed,
        idle=tuple(test for test in tests if test not in busy),
        holds=not failures and not missed,
    )


def examine(
    file: AnyPath,
    backend: str = DEFAULT,
    only: Sequence[str] = (),
    seconds: float = _SECONDS,
    clock: float = _CLOCK,
    progress: Progress = silent,
    own: Mapping[str, Path] | None = None,
) -> Figures:
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

    Returns:
        As `examination_of`.

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
    records: dict[str, Figures] = {}
    with ExitStack() as stack:
        stack.enter_context(unwinding())
        folder = stack.enter_context(
            tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True)
        )
        copied = copied_to(Path(folder).resolve(), path, own or named_by(path, _has_tests))
        healthy = _run(copied, backend, None, seconds, clock)
        if broken := healthy.failures.get(IMPORT):
            raise BadInputError(f"{path.name} cannot be imported: {broken}")
        if not healthy.tests:
            why = "each was skipped" if healthy.skipped else "a test is a function test_…"
            raise BadInputError(f"there are no tests in {path.name}: {why}")
        if not healthy.failures:
            took = healthy.outcome
            patience = _TIMES * took.cpu + _AND, _TIMES * took.wall + _CLOCK_AND
            stop, total = threading.Event(), len(faults) + 1
            records = in_parallel(
                {f.name: partial(_run, copied, backend, f.name, *patience, stop) for f in faults},
                checked_jobs(None),
                stop.set,
                lambda left: progress((total - left) / total),
            )
    return examination_of(
        file=path.name,
        backend=backend,
        engine_version=version,
        tests=healthy.tests,
        failures=_failures_of(healthy),
        trials=tuple(trial_of(f, _failures_of(records[f.name])) for f in faults if records),
    )


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
    """The version of the backend's engine; raises where the tests could not even begin."""
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


def _failures_of(record: Figures) -> tuple[Figures, ...]:
    return tuple(Figures(test=test, why=why) for test, why in record.failures.items())


def _run(
    path: Path,
    backend: str,
    fault: str | None,
    seconds: float,
    clock: float,
    stop: threading.Event | None = None,
) -> Figures:
    """What one run of pytest came to.

    Returns:
        outcome: How it ended.
        tests: Those that were not skipped; skipped: how many were.
        failures: By test what was said.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        here = Path(folder)
        settings, record = here / "pytest.ini", here / "record"
        settings.write_text("[pytest]\n", encoding="utf-8")
        record.touch()
        # -P: what lies beside the file must not pass for a module of pytest's.
        command = [
            *(sys.executable, "-P", "-m", "pytest", "-c", str(settings), "--rootdir", folder),
            *("--noconftest", "--tb=short", "--no-summary", "-q", "-p", "no:cacheprovider"),
            *("-p", f"{__package__}.plugin", "--engine", backend, "--record", str(record)),
            *([] if sandbox.shut_in() else ["--watched"]),
            os.path.join(os.curdir, path.name),  # brackets in a whole path confuse pytest
        ]
        env = _environment(backend) | (
            {FAULT: fault} if fault else {}
        )  # where no test looks for it
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


def _environment(backend: str) -> dict[str, str]:
    """Return that of a student's process, with this package to be found, for one pytest alone."""
    env = environment(backend)
    home = str(Path(__file__).resolve().parents[3])
    paths = [home, *filter(None, [env.get("PYTHONPATH")])]
    return {
        **env,
        "PYTHONPATH": os.pathsep.join(paths),
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
    }


def _read(record: Path, outcome: sandbox.ProcessOutcome, file: str) -> Figures:
    if not outcome.started:  # of which no test can be the reason
        raise EngineError(f"pytest stopped before the tests: it {_end(outcome)}")
    tests: list[str] | None = None
    running, ended = "", set[str]()
    skipped: set[str] = set()
    failures: dict[str, str] = {}
    for line in content(record, _RECORD_MOST).splitlines():
        try:
            facts = json.loads(line)
        except (ValueError, RecursionError):
            facts = None
        match facts:
            case {"ready": True}:
                pass
            case {"tests": [*names]} if all(isinstance(name, str) for name in names):
                tests = names
            case {"begins": str(name)}:
                running = name
            case {"test": str(name), "when": str(when), "outcome": outcome_of, "text": str(text)}:
                ended |= {name} if when == "teardown" else set()
                if outcome_of == "failed":
                    failures.setdefault(name, _said(text, file))  # the test before its teardown
                elif outcome_of == "skipped":
                    skipped.add(name)
            case _:
                raise BadInputError("the tests wrote into the record of what they do")
    if tests is None:
        failures.setdefault(IMPORT, f"it {_end(outcome)}")
    elif IMPORT not in failures and (rest := [test for test in tests if test not in ended]):
        # The one that was running ended them all.
        failures.setdefault(running if running in rest else rest[0], _end(outcome))
    counted = tuple(test for test in tests or () if test not in skipped)
    return Figures(outcome=outcome, tests=counted, skipped=len(skipped), failures=failures)


def _said(text: str, file: str) -> str:
    """The error in one of pytest's reports, in one line, with the last line of the file there."""
    last = _CHAINED.split(text)[-1]
    lines = re.findall(rf'{re.escape(file)}(?::|"?, line )(\d+)', last)
    errors = [match for pattern in _ERRORS for match in re.findall(pattern, last, re.MULTILINE)]
    words = re.sub(r"^(?:AssertionError: |Failed: |(?:\w+\.)+(?=\w+:))", "", [*errors, ""][0])
    if re.fullmatch(r"fixture '.*' not found", words):
        words += "; this command gives model, data and backend"
    return (f"line {lines[-1]}: " if lines else "") + words[:_LONGEST]


def _end(outcome: sandbox.ProcessOutcome) -> str:
    """How a run ended that did not come to its end, and the last line of an error, if any.

    pytest's own among them.
    """
    lines = [line.strip() for line in outcome.stderr.splitlines() if line.strip()]
    lines += [line for line in outcome.stdout.splitlines() if line.startswith(_PYTEST_FAILS)]
    said = [line for line in lines if "rror" in line.removeprefix(_PYTEST_FAILS)] or lines
    words = f": {said[-1].removeprefix(_PYTEST_FAILS).strip()[:_LONGEST]}" if said else ""
    return outcome.how + words
