"""Our own interface, on any backend: the seven verbs and nothing else; and in another process."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...engines.auditing import (
    STIR,
    Disturbance,
    Driver,
    ReferenceRun,
    SaveMethod,
    SavePoint,
    copied,
    within,
)
from ...engines.measured import gap
from ...errors import EngineError, UnsupportedError
from ...interface import (
    INPUTS,
    Array,
    Data,
    JointType,
    Keyframe,
    Model,
    State,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ...interface.records import Arrays
from ...measures.quantities import readings
from ...page import Figures
from ...processes import fresh_python, last_line
from .trials import against_run, finding_of

# The moments at which a run is saved: at rest, in motion, mid-contact, at a limit.
#
# They are found by running a model, so that any model has some. What a moment is like
# (contacts, speed) is measured there, on each engine; its name only says how to get there.

_SETTLE, _FALL, _WAY = 1.0, 0.8, 0.1  # seconds before a run is saved
_LONGEST = 400  # steps before it, at most
_ABOVE = 3.0  # what is free to move is lifted so far [m]
_THROWN = (0.3, 0.2, 0.0, 2.0, 1.0, 3.0)  # and has this velocity [m/s, rad/s]
_MOVE = (0.4, -0.2)  # added to a keyframe's command: of the lesson on replay
_REACH = 0.01  # from a limit, where a joint starts towards it [rad or m]
_ARRIVAL = 5  # in how many steps it is there


def points(model: Model, seed: int) -> tuple[tuple[SavePoint, ...], tuple[str, ...]]:
    """Save points of a model, and a line for each that it does not have.

    Args:
        model: The model.
        seed: Of the command in motion.
    """
    with make_data(model) as data:
        zero, still, none = data.qpos.copy(), np.zeros(model.nv), np.zeros(model.nu)
    rest = zero, still, none
    air, thrown = zero.copy(), still.copy()
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    for place, dof in zip(model.jnt_qposadr[free], model.jnt_dofadr[free], strict=True):
        air[place + 2] += _ABOVE
        thrown[dof : dof + 6] = _THROWN
    ways = ["free bodies thrown"] if len(free) else []
    ways += ["each servo on its way"] if model.nu else []
    stir = np.random.default_rng(seed).uniform(-STIR, STIR, model.nu)

    led = model.mocap_pos0, model.mocap_quat0
    key = model.keyframes[0] if model.keyframes else Keyframe("", 0.0, *rest, *led)
    start = f"keyframe {key.name!r}" if key.name else "keyframe 0"
    start = start if model.keyframes else "default pose"
    moved = key.ctrl.copy()
    moved[: len(_MOVE)] += _MOVE[: model.nu]

    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = np.flatnonzero(model.jnt_limited & scalar)
    lower, upper = model.jnt_range[limited].T
    reach = np.minimum(_REACH, (upper - lower) / 10)
    near, towards = air.copy(), thrown.copy()
    near[model.jnt_qposadr[limited]] = upper - reach
    towards[model.jnt_dofadr[limited]] = reach / (_ARRIVAL * model.timestep)

    # Without servos, and why not.
    limp, refused = model, ""
    try:
        limp = model.replace(actuation=False) if model.nu else model
    except UnsupportedError as error:
        refused = str(error)

    def point(
        name: str,
        how: str,
        start: tuple[Array, Array, Array],
        seconds: float,
        variant: Model = model,
        **special: bool,
    ) -> SavePoint:
        qpos, qvel, ctrl = start
        steps, command = min(max(round(seconds / model.timestep), 1), _LONGEST), within(model, ctrl)
        return SavePoint(name, how, variant, qpos, qvel, command, steps, **special)

    # Each with what the model lacks for it.
    candidates = (
        (point("default", "default pose, no command, and time to settle", rest, _SETTLE), ""),
        (
            point("motion", ", ".join(ways) or "default pose, let go", (air, thrown, stir), _WAY),
            "",
        ),
        (
            point(
                "keyframe",
                f"{start}, command moved away from it",
                (key.qpos, key.qvel, moved),
                2 * _WAY,
            ),
            "" if model.keyframes else "the model has no keyframe",
        ),
        (
            point(
                "limp",
                "default pose, servos off, and time to fall",
                rest,
                _FALL,
                limp,
                powered=False,
            ),
            refused if model.nu else "the model has no servo to switch off",
        ),
        (
            point(
                "limit",
                "servos off, each joint run into its upper limit",
                (near, towards, none),
                (_ARRIVAL + 3) * model.timestep,
                limp,
                powered=False,
                at_limit=True,
            ),
            refused if len(limited) else "no joint of the model has a limit",
        ),
        (
            point(
                "clock",
                f"{start}, a controller that reads the time before each step",
                (key.qpos, key.qvel, key.ctrl),
                2 * _WAY,
                swings=True,
            ),
            "" if model.nu else "the model has no actuator",
        ),
    )
    without = [f"{candidate.name}: {lacks}" for candidate, lacks in candidates if lacks]
    return tuple(candidate for candidate, lacks in candidates if not lacks), tuple(without)


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

    def take(data: Data) -> Arrays:
        return {name: np.array(getattr(data, name)) for name in names}

    def give(data: Data, values: Arrays) -> None:
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
Answer = tuple[Traces, Arrays]


def run_elsewhere(
    model: Model, seed: int, steps: int, states: dict[str, State], kinds: tuple[type[Driver], ...]
) -> Answer:
    """Run the drivers of these kinds in a fresh Python, whose strings hash otherwise.

    Raises:
        EngineError: The process did not come to its end.
    """
    with tempfile.TemporaryDirectory() as folder:
        answered = Path(folder) / "answer"
        command, environment = fresh_python(f"{__name__}:answer_into", os.fspath(answered))
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
) -> Iterator[Figures]:
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


# The fresh process: it is told what to run, runs it and writes the answer.


def answer(
    model: Model, seed: int, steps: int, states: dict[str, State], kinds: tuple[type[Driver], ...]
) -> Answer:
    """All runs from the start, and a future of each State."""
    runs: Traces = {}
    futures = {}
    # A point without a State is one at which somebody diverged.
    places = [point for point in points(model, seed)[0] if point.name in states]
    for driver in (kind(model, seed) for kind in kinds):
        for point in places:
            if not driver.lacks(point):
                runs[driver.layer, point.name] = driver.run(point, steps).future
            if isinstance(driver, InterfaceDriver):
                futures[point.name] = driver.future(point, states[point.name], steps)
    return runs, futures


def answer_into(file: str) -> None:
    """Write the answer to what standard input asks."""
    Path(file).write_bytes(pickle.dumps(answer(*pickle.load(sys.stdin.buffer))))
