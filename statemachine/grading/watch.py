"""See what a student's function does to a simulation, through the interface or past it.

A *run* is what an engine did without anybody touching qpos, qvel or time in between: so it
begins at a fresh Data, a reset to whatever state, or a write, however that was made.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

from ..engines import require
from ..interface import Data, Model
from ..records import Array

# Raw functions of MuJoCo that advance time, and those that only recompute.
_STEPS = ("mj_step", "mj_step2")
_FORWARDS = ("mj_forward", "mj_kinematics", "mj_fwdPosition")


@dataclass
class Run:
    """One run, from its first step on.

    Attributes:
        data: The Data, or MuJoCo's own.
        qpos, qvel, ctrl, time: What they were at the first step.
        end, end_qvel, end_time: qpos, qvel and the time after the last step.
        nstep: How many steps it took.
        ctrl_changed: After how many steps ctrl was another; None if it never was.
    """

    data: Any
    qpos: Array
    qvel: Array
    ctrl: Array
    time: float
    end: Array
    end_qvel: Array
    end_time: float
    nstep: int = 0
    ctrl_changed: int | None = None

    def continues(self, data: Any) -> bool:
        """Whether nobody touched the state since the last step."""
        return (
            data.time == self.end_time
            and bool((data.qpos == self.end).all())
            and bool((data.qvel == self.end_qvel).all())
        )


@dataclass(frozen=True)
class Nudge:
    """The next double towards something, in one entry of qpos, at the end of a run.

    Attributes:
        place: The entry.
        towards: Where to.
        after: How many steps a run must have.
    """

    place: int
    towards: float
    after: int


@dataclass
class Watch:
    """What was done while a function ran.

    Attributes:
        runs: In the order in which they began.
        datas: Every Data of the Model, or raw one that was used, in order.
        nudge: What every run but the first is pushed by, so that an engine that repeats
            itself to the bit does not.
    """

    nudge: Nudge | None = None
    runs: list[Run] = field(default_factory=list)
    datas: list[Any] = field(default_factory=list)
    _current: dict[int, Run] = field(default_factory=dict)

    def meet(self, data: Any) -> None:
        """Note a Data; the engine's own object behind a noted one is no other."""
        if not any(data is known or data is _raw(known) for known in self.datas):
            self.datas.append(data)

    def step(self, data: Any, advance: Callable[[], Any], nstep: int) -> Any:
        """Let `advance` move `data`, and note where from and where to."""
        self.meet(data)
        run = self._current.get(id(data))
        if run is None or not run.continues(data):
            run = self._begin(data)
        elif run.ctrl_changed is None and (data.ctrl != run.ctrl).any():
            run.ctrl_changed = run.nstep
        result = advance()
        run.nstep += nstep
        if self.nudge and run is not self.runs[0] and run.nstep >= self.nudge.after:
            place = self.nudge.place
            data.qpos[place] = np.nextafter(data.qpos[place], self.nudge.towards)
        run.end, run.end_qvel = np.array(data.qpos), np.array(data.qvel)
        run.end_time = float(data.time)
        return result

    def _begin(self, data: Any) -> Run:
        qpos, qvel = np.array(data.qpos), np.array(data.qvel)
        time = float(data.time)
        run = Run(data, qpos, qvel, np.array(data.ctrl), time, qpos, qvel, time)
        self.runs.append(run)
        self._current[id(data)] = run
        return run


_watch: Watch | None = None


@contextmanager
def watching(nudge: Nudge | None = None) -> Iterator[Watch]:
    """What happens meanwhile on Models that `watched` gave, and on MuJoCo itself."""
    global _watch  # noqa: PLW0603  (the engine's functions are the process's too)
    _watch = Watch(nudge)
    try:
        yield _watch
    finally:
        _watch = None


def watched(model: Model) -> Model:
    """The same Model; the Data that it makes, and those of its variants, are seen."""
    make_data, replace = model._make_data, model._replace

    def made() -> Data:
        data = make_data()
        if _watch is not None:
            _watch.meet(data)
            if model.backend != "mujoco":  # whose own functions are watched
                _listen(data)
        return data

    for name, value in (
        ("_make_data", made),
        ("_replace", lambda options: watched(replace(options))),
    ):
        object.__setattr__(model, name, value)
    return model


def _listen(data: Data) -> None:
    advance = data._advance

    def seen(nstep: int = 1) -> None:
        if _watch is None:
            advance(nstep)
        else:
            _watch.step(data, functools.partial(advance, nstep), nstep)

    object.__setattr__(data, "_advance", seen)


@contextmanager
def engine_watched(backend: str) -> Iterator[None]:
    """MuJoCo's own functions are seen too; before a student's file can import them."""
    if backend != "mujoco":
        yield
        return
    mujoco = require("mujoco")
    kept = {name: getattr(mujoco, name) for name in (*_STEPS, *_FORWARDS)}
    try:
        for name in _STEPS:
            setattr(mujoco, name, _seen_step(kept[name]))
        for name in _FORWARDS:
            setattr(mujoco, name, _seen_forward(kept[name]))
        yield
    finally:
        _restore(mujoco, kept)


def _restore(module: ModuleType, kept: dict[str, Any]) -> None:
    for name, value in kept.items():
        setattr(module, name, value)


def _seen_step(original: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(original)
    def seen(m: Any, d: Any, nstep: int = 1) -> Any:
        given = (m, d) if nstep == 1 else (m, d, nstep)
        if _watch is None:
            return original(*given)
        return _watch.step(d, functools.partial(original, *given), nstep)

    return seen


def _seen_forward(original: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(original)
    def seen(m: Any, d: Any) -> Any:
        if _watch is not None:
            _watch.meet(d)
        return original(m, d)

    return seen


def _raw(data: Any) -> Any:
    """The engine's object behind a Data that is open; None for one that is none."""
    return getattr(data, "_raw", None)
