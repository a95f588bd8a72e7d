"""See what a student's function does to a simulation, through the interface or past it.

A *run* is what an engine did without anybody touching qpos, qvel or time in between: so it
begins at a fresh Data, a reset to whatever state, or a write, however that was made.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....engines import raw_engine_of
from ....errors import ClosedDataError
from ....installed import require
from ....interface import INPUTS, Array, Data, Model

_MOST = 1000  # runs, forwards and Data that are noted


@dataclass(frozen=True)
class Inputs:
    """The inputs of a Data at some moment: (nq,), (nv,), (nu,), and its time [s].

    Attributes:
        data: The number of the Data, in the order in which they were met.
    """

    data: int
    qpos: Array
    qvel: Array
    ctrl: Array
    time: float


@dataclass
class EngineRun:
    """One run, from its first step on.

    Attributes:
        on_given_model: Whether it is on a Data of the Model that the function got, or of a variant
            of it.
        start: Where it began.
        end: Where it is after the last step.
        nstep: How many steps it took.
        ctrl_changed: After how many steps ctrl was another; None if it never was.
    """

    on_given_model: bool
    start: Inputs
    end: Inputs
    nstep: int = 0
    ctrl_changed: int | None = None


@dataclass(frozen=True)
class Nudge:
    """Push to the state at the end of a run, by the smallest amount there is, or by more.

    Attributes:
        place: Entry of qpos that becomes the next double.
        towards: In which direction, infinite [rad or m].
        after: How many steps a run must have for it.
        by: What is added to the entry before that [rad or m].
    """

    place: int
    towards: float
    after: int
    by: float = 0.0

    def pushed(self, value: float) -> float:
        """Return what an entry of this value becomes [rad or m]."""
        return float(np.nextafter(value + self.by, self.towards))


def inputs_of(number: int, data: Any) -> Inputs:
    """Return a copy of the inputs of a Data, or of the engine's own, with its number."""
    qpos, qvel, ctrl = (np.array(getattr(data, name)) for name in INPUTS)
    time = math.nan
    with suppress(ClosedDataError):  # of which the inputs alone are told
        time = float(data.time)
    return Inputs(number, qpos, qvel, ctrl, time)


def _is_same_state(one: Inputs, two: Inputs) -> bool:
    """Return whether time, qpos and qvel are equal."""
    return bool(
        one.time == two.time and (one.qpos == two.qpos).all() and (one.qvel == two.qvel).all()
    )


class StudentWatch:
    """Record of what was done while a function ran.

    Attributes:
        runs: In the order in which they began.
        forwards: What the inputs were when derived values were recomputed, in order.
        datas: Every Data that was used, or the engine's own, in order.
    """

    def __init__(self, model: Model, nudge: Nudge | None) -> None:
        """Watch what is done with `model`; every run but the first is pushed by `nudge`.

        So that an engine that repeats itself to the bit does not.

        Args:
            model: What the function got.
            nudge: Of every run but the first; None for none.
        """
        self.runs: list[EngineRun] = []
        self.forwards: list[Inputs] = []
        self.datas: list[Any] = []
        self._room = raw_engine_of(model.backend)
        self._origin = self._origin_of(model.raw if self._room.can("origin") else model)
        self._nudge = nudge
        self._current: dict[int, EngineRun] = {}

    def number_of(self, data: Any) -> int:
        """Return the number of a Data; the engine's own object behind a known one is no other.

        Raises:
            RuntimeError: There are too many.
        """
        for number, known in enumerate(self.datas):
            if data is known or data is getattr(known, "_raw", None):
                return number
        if len(self.datas) == _MOST:
            raise RuntimeError(f"more than {_MOST} Data, which no exercise needs")
        self.datas.append(data)
        return len(self.datas) - 1

    def recomputed(self, data: Any) -> None:
        """Note that what is derived was."""
        if len(self.forwards) < _MOST:
            self.forwards.append(inputs_of(self.number_of(data), data))

    def step(self, model: Any, data: Any, advance: Callable[[], Any], nstep: int) -> Any:
        """Let `advance` move `data`, and note where from and where to."""
        now = inputs_of(self.number_of(data), data)
        run = self._current.get(now.data)
        if run is None or not _is_same_state(now, run.end):  # somebody touched the state
            run = EngineRun(self._origin_of(model) == self._origin, now, now)
            if len(self.runs) < _MOST:
                self.runs.append(run)
            self._current[now.data] = run
        elif run.ctrl_changed is None and (now.ctrl != run.start.ctrl).any():
            run.ctrl_changed = run.nstep
        result = advance()
        run.nstep += nstep
        if self._nudge and run is not self.runs[0] and run.nstep >= self._nudge.after:
            place = self._nudge.place
            data.qpos[place] = self._nudge.pushed(data.qpos[place])
        run.end = inputs_of(now.data, data)
        return result

    def _origin_of(self, model: Any) -> object:
        """Return what a Model shares with its variants, or the engine's own with its copies."""
        if isinstance(model, Model) or not self._room.can("origin"):
            return model.path
        return self._room.origin(model)


_watch: StudentWatch | None = None


@contextmanager
def watching(model: Model, nudge: Nudge | None = None) -> Iterator[StudentWatch]:
    """Note what happens meanwhile, where `engine_watched` holds."""
    global _watch  # noqa: PLW0603  (the engine's functions are the process's too)
    _watch = StudentWatch(model, nudge)
    try:
        yield _watch
    finally:
        _watch = None


@contextmanager
def engine_watched(backend: str) -> Iterator[None]:
    """Watch every Data made from now on, and the engine's own functions that its room names.

    To be entered before a student's file can import these.
    """
    with ExitStack() as stack:
        engine = raw_engine_of(backend)
        for name in engine.steps:
            stack.enter_context(_replaced(require(backend), name, _seen_step))
        for name in engine.forwards:
            stack.enter_context(_replaced(require(backend), name, _seen_forward))
        watched = engine.watched_data()
        for kind in Data.__subclasses__():
            if kind is not watched:
                stack.enter_context(_replaced(kind, "_recompute", _seen_forward))
        reporting_backend = backend if watched else None
        stack.enter_context(
            _replaced(Data, "__init__", functools.partial(_seen_data, reporting_backend))
        )
        yield


@contextmanager
def _replaced(owner: Any, name: str, wrapper: Callable[[Any], Any]) -> Iterator[None]:
    """Let a function of a module or class be what `wrapper` makes of it."""
    original = vars(owner)[name]
    setattr(owner, name, wrapper(original))
    try:
        yield
    finally:
        setattr(owner, name, original)


def _seen_data(reporting_backend: str | None, original: Callable[..., None]) -> Callable[..., None]:
    """Return a `Data.__init__` that tells the watch of the Data and of its steps.

    Of the steps on `reporting_backend` the engine's own functions tell.
    """

    @functools.wraps(original)
    def seen(data: Any, model: Any, advance: Callable[..., None], *more: Any) -> None:
        if model.backend != reporting_backend:
            advance = _seen_step(advance, (model, data))
        original(data, model, advance, *more)
        if _watch is not None:
            _watch.number_of(data)

    return seen


def _seen_step(
    original: Callable[..., Any], of: tuple[Any, Any] | None = None
) -> Callable[..., Any]:
    """Return a function that tells the watch of a step, and steps as `original` does.

    Args:
        original: Steps the engine's own model and data.
        of: A Model and a Data whose step it is; by default the engine's own.
    """

    @functools.wraps(original)
    def seen(m: Any, d: Any, nstep: int = 1) -> Any:
        arguments = (m, d) if nstep == 1 else (m, d, nstep)
        if _watch is None:
            return original(*arguments)
        model, data = (m, d) if of is None else of
        return _watch.step(model, data, functools.partial(original, *arguments), nstep)

    return seen


def _seen_forward(original: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that recomputes as `original` does, and tells the watch of it.

    What it recomputes is a Data or the engine's own, its last argument.
    """

    @functools.wraps(original)
    def seen(*arguments: Any, **named: Any) -> Any:
        result = original(*arguments, **named)
        if _watch is not None:
            _watch.recomputed(named["d"] if "d" in named else arguments[-1])
        return result

    return seen
