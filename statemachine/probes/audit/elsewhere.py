"""The same in another process: everything from the start, and from a pickled State."""

from __future__ import annotations

import os
import pickle
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...engines.auditing import Driver, ReferenceRun
from ...engines.futures import gap
from ...errors import EngineError
from ...interface import Array, Model, State
from ...processes import fresh_python
from .interface_driver import InterfaceDriver
from .trials import AuditFinding, finding_of

PROCESS, PICKLED = "process", "pickled State"
_PATIENCE = 300.0  # seconds

# By layer and point: what a driver read along a run.
Traces = dict[tuple[str, str], Array]


@dataclass(frozen=True)
class Job:
    """What the other process is to do."""

    model: Model
    seed: int
    steps: int
    states: dict[str, State]
    drivers: tuple[type[Driver], ...]


@dataclass(frozen=True)
class ChildRuns:
    """What it did: runs from the start, and futures of the States by point."""

    runs: Traces
    futures: dict[str, Array]


def run(job: Job) -> ChildRuns:
    """Do a job in a fresh Python, whose strings hash otherwise; nothing of it is left.

    Raises:
        EngineError: The process did not come to its end.
    """
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = Path(folder) / "job", Path(folder) / "answer"
        asked.write_bytes(pickle.dumps(job))
        files = os.fspath(asked), os.fspath(answered)
        command, environment = fresh_python(f"{__package__}._child", *files)
        try:
            done = subprocess.run(
                command,
                env={**environment, "PYTHONHASHSEED": "1"},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # engines greet there
                stderr=subprocess.PIPE,
                timeout=_PATIENCE,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise EngineError(f"a fresh process did not end in {_PATIENCE:g} s") from None
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip().splitlines()
            last = said[-1] if said else f"exit code {done.returncode}"
            raise EngineError(f"a fresh process failed: {last}")
        return pickle.loads(answered.read_bytes())


def findings(
    answer: ChildRuns, driver: Driver, runs: Sequence[ReferenceRun]
) -> Iterator[AuditFinding]:
    """The other process's runs against those of this one."""
    for run in runs:
        off = driver.gap(run, answer.runs[driver.layer, run.point.name])
        yield finding_of(driver, PROCESS, run, "a fresh process", "this process", off)


def pickled(
    answer: ChildRuns,
    driver: InterfaceDriver,
    runs: Sequence[ReferenceRun],
    states: dict[str, State],
) -> Iterator[AuditFinding]:
    """The future of a State that was pickled to another process, against its future here."""
    for run in runs:
        here = driver.future(run.point, states[run.point.name], run.steps)
        off = gap(here, answer.futures[run.point.name], driver.coordinates)
        yield finding_of(
            driver, PICKLED, run, "a pickled State, in a fresh one", "in this process", off
        )
