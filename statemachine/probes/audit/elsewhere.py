"""The same in another process: everything from the start, and from a pickled State."""

from __future__ import annotations

import os
import pickle
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ...engines.auditing import Driver, ReferenceRun
from ...engines.futures import gap
from ...errors import EngineError
from ...interface import Array, Model, State
from ...processes import fresh_python
from ...processes.pipes import last_line
from .interface_driver import InterfaceDriver
from .trials import AuditFinding, against_run, finding_of

PROCESS, PICKLED = "process", "pickled State"
_PATIENCE = 300.0  # seconds

# By layer and point: what a driver read along a run.
Traces = dict[tuple[str, str], Array]


# Of each run from the start, by layer and point; of each State, by point.
Answer = tuple[Traces, dict[str, Array]]


def run(
    model: Model, seed: int, steps: int, states: dict[str, State], kinds: tuple[type[Driver], ...]
) -> Answer:
    """Run the drivers of these kinds in a fresh Python, whose strings hash otherwise.

    Raises:
        EngineError: The process did not come to its end.
    """
    with tempfile.TemporaryDirectory() as folder:
        answered = Path(folder) / "answer"
        command, environment = fresh_python(f"{__package__}._child", os.fspath(answered))
        try:
            done = subprocess.run(
                command,
                env={**environment, "PYTHONHASHSEED": "1"},
                input=pickle.dumps((model, seed, steps, states, kinds)),
                stdout=subprocess.DEVNULL,  # engines greet there
                stderr=subprocess.PIPE,
                timeout=_PATIENCE,
                check=False,
            )
        except subprocess.TimeoutExpired:
            raise EngineError(f"a fresh process did not end in {_PATIENCE:g} s") from None
        if done.returncode:
            raise EngineError(f"a fresh process failed: {last_line(done.stderr, done.returncode)}")
        return pickle.loads(answered.read_bytes())


def findings(
    answer: Answer, driver: Driver, runs: Sequence[ReferenceRun], states: Mapping[str, State]
) -> Iterator[AuditFinding]:
    """The other process's runs, and the futures of States that were pickled to it, against ours."""
    traces, futures = answer
    for run in runs:
        there = traces[driver.layer, run.point.name]
        yield against_run(driver, PROCESS, run, "a fresh process", "this process", there)
    if isinstance(driver, InterfaceDriver):
        for run in runs:
            here = driver.future(run.point, states[run.point.name], run.steps)
            off = gap(here, futures[run.point.name], driver.coordinates)
            case = "a pickled State, in a fresh one"
            yield finding_of(driver, PICKLED, run, case, "in this process", off)
