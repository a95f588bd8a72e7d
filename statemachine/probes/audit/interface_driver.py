"""Our own interface, on any backend: the seven verbs and nothing else; and in another process."""

from __future__ import annotations

import os
import pickle
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...engines.auditing import Disturbance, Driver, ReferenceRun, SaveMethod, SavePoint, copied
from ...engines.futures import gap
from ...errors import EngineError
from ...interface import (
    INPUTS,
    Array,
    Data,
    Model,
    State,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ...measures.quantities import readings
from ...processes import fresh_python
from ...processes.pipes import last_line
from .trials import AuditFinding, against_run, finding_of


class InterfaceDriver(Driver):
    """The interface to an engine."""

    layer = "interface"
    legend = (
        "'qpos qvel …' are written into the arrays of a Data; get_state and set_state are the "
        "two verbs."
    )

    def __init__(self, model: Model, seed: int) -> None:
        super().__init__(model, seed)
        self.name = f"this interface on {model.backend}"

    def fresh(self, point: SavePoint) -> Data:
        return make_data(point.model)

    def reset(self, machine: Data) -> None:
        reset(machine.model, machine)

    def advance(self, machine: Data, nstep: int = 1) -> None:
        step(machine.model, machine, nstep)

    def touching(self, machine: Data) -> tuple[int, None]:
        forward(machine.model, machine)
        return len(machine.contacts), None

    def save_methods(self, point: SavePoint) -> tuple[SaveMethod, ...]:
        exact = point.model.capabilities.exact_restore
        return (
            written("qpos", "qvel"),
            written("qpos", "qvel", "ctrl", "time"),
            SaveMethod("get_state, set_state", as_a_state, promised=exact, agree=True),
        )

    def disturbances(self, point: SavePoint) -> tuple[Disturbance, ...]:
        def ask(machine: Data) -> None:
            forward(machine.model, machine)
            readings(machine)

        return (
            Disturbance("forward", lambda machine: forward(machine.model, machine)),
            Disturbance("reading what is derived", readings),
            Disturbance("forward, then reading", ask),
            Disturbance("get_state", lambda machine: get_state(machine.model, machine)),
        )

    def state(self, point: SavePoint) -> State:
        """The State at a save point, to be put into a Data elsewhere."""
        with self.at(point) as machine:
            return get_state(machine.model, machine)

    def future(self, point: SavePoint, state: State, steps: int) -> Array:
        """What follows from a State in a new Data."""
        with self.new(point) as machine:
            set_state(machine.model, machine, state)
            return self.drive(machine, point, steps)


def written(*names: str) -> SaveMethod:
    """Arrays of a Data, and its time, that are written back."""

    def take(data: Data) -> dict[str, Array]:
        return {name: np.array(getattr(data, name)) for name in names}

    def give(data: Data, values: dict[str, Array]) -> None:
        for name, value in values.items():
            setattr(data, name, value if name in INPUTS else float(value))

    return SaveMethod(" ".join(names), copied(take, give))


as_a_state = copied(
    lambda data: get_state(data.model, data),
    lambda data, state: set_state(data.model, data, state),
)


PROCESS, PICKLED = "process", "pickled State"
_PATIENCE = 300.0  # seconds

# By layer and point: what a driver read along a run.
Traces = dict[tuple[str, str], Array]


# Of each run from the start, by layer and point; of each State, by point.
Answer = tuple[Traces, dict[str, Array]]


def run_elsewhere(
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


def findings_elsewhere(
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
