"""Two objects and one function: a Model that never changes, a Data that does, and step."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..backends import load
from ..comparison.text import count, duration
from ..errors import BadInputError
from ..interface import Array, Data, Model, make_data, step
from ..interface.checks import as_count
from ..page import Page, Question, Table, Text, Verdict
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.runs import Progress
from ._robot import is_of_the_arm
from ._words import differences, page_of, sentence, typed, where, words
from .records import Session
from .session import CodeRun

_CHEAP = 5  # times; a Data that is not cheaper than that is no bargain
_TIMES = 5  # repetitions; the median counts
_STEPS = 200  # of each Data
_WORLDS_MOST = 100


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """Two Data of one Model, of which one is stepped."""
    _worlds(options)
    return f"""\
import statemachine as sm

model = {load}
one = sm.make_data(model)
two = sm.make_data(model)
sm.step(model, one, 100)
print(model)
print(round(one.time, 6), round(two.time, 6))
"""


def _worlds(options: Mapping[str, Any]) -> int:
    """How many Data step in turn."""
    worlds = as_count(options["worlds"], "worlds")
    if not 2 <= worlds <= _WORLDS_MOST:
        raise BadInputError(f"worlds must be from 2 to {_WORLDS_MOST}; got {worlds}")
    return worlds


@dataclass(frozen=True)
class Objects:
    """Costs, and who shares what.

    Attributes:
        loading, making, stepping: Median wall time of `load`, of `make_data` and of
            one `step` [s]; of a step within a bulk of `nstep`.
        worlds: How many Data stepped in turn, each under a ctrl of its own.
        nstep: Steps of each.
        alone: Whether each ended bit for bit where it ends when it runs alone.
        different: How many of the worlds' ends are different.
        arrays: How many arrays the Model and the engine's own model hold; constant:
            whether all of them are unchanged.
        shared: Whether each Data's engine object names the Model's as its own.
    """

    loading: float
    making: float
    stepping: float
    worlds: int
    nstep: int
    alone: bool
    different: int
    arrays: int
    constant: bool
    shared: bool
    provenance: Provenance

    @property
    def ratio(self) -> float:
        """How many steps one `load` costs."""
        return self.loading / self.stepping


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Objects:
    """Time the parts, then let several Data of the Model step in turn."""
    model, worlds = play.model, _worlds(options)
    before = _arrays(model)
    play()
    made = [data for _, data in play.worlds]
    loading = _median(lambda: load(model.path, backend=model.backend))
    progress(0.3)
    making = _median(lambda: made.append(make_data(model)))
    stepping = _median(lambda: step(model, made[0], _STEPS)) / _STEPS
    shared = all(getattr(data.raw, "model", None) is model.raw for data in made)
    for data in made[len(play.worlds) :]:
        data.close()
    progress(0.5)
    singly: list[Array] = []
    for k in range(worlds):
        with make_data(model) as data:
            _command(model, data, k, worlds)
            for _ in range(_STEPS):
                step(model, data)
            singly.append(data.qpos.copy())
        progress(0.5 + 0.25 * (k + 1) / worlds)
    together = _in_turn(model, worlds)
    progress(1.0)
    after = _arrays(model)
    return Objects(
        loading=loading,
        making=making,
        stepping=stepping,
        worlds=worlds,
        nstep=_STEPS,
        alone=all(np.array_equal(a, b) for a, b in zip(singly, together, strict=True)),
        different=len({end.tobytes() for end in together}),
        arrays=len(before),
        constant=before == after,
        shared=shared,
        provenance=provenance(model),
    )


def _in_turn(model: Model, count: int) -> list[Array]:
    """Where each of several Data ends if they take their steps in turn."""
    worlds = [make_data(model) for _ in range(count)]
    try:
        for k, data in enumerate(worlds):
            _command(model, data, k, count)
        for _ in range(_STEPS):
            for data in worlds:
                step(model, data)
        return [data.qpos.copy() for data in worlds]
    finally:
        for data in worlds:
            data.close()


def _command(model: Model, data: Data, k: int, count: int) -> None:
    """Another command for each world: the first actuator, over a part of its range."""
    if model.nu:
        low, high = np.clip(model.actuator_ctrlrange[0], -1.0, 1.0)
        data.ctrl[0] = low + (high - low) * (k + 1) / (count + 1)


def _arrays(model: Model) -> dict[str, bytes]:
    """The bytes of every array of a Model, and of the engine's own model."""
    found = {name: getattr(model, name) for name in vars(model)}
    for name in dir(model.raw):
        if not name.startswith("_"):
            found[f"raw.{name}"] = getattr(model.raw, name)
    return {name: each.tobytes() for name, each in found.items() if isinstance(each, np.ndarray)}


def _median(action: Callable[[], object]) -> float:
    times = []
    for _ in range(_TIMES):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def page(results: Mapping[str, Objects], session: Session) -> Page:
    """What costs, what is shared, what goes its own way."""
    first = next(iter(results.values()))
    stepped = first.provenance.timestep * 100
    blocks: list[Any] = [
        Text(words(is_of_the_arm(results))),
        Text(
            "Here a robot's file is loaded once, two of something are made of it, and one of "
            "them is advanced by 100 steps."
        ),
        *typed(
            session,
            Question(
                "only `one` was stepped. What is two.time?",
                ("0 s", f"{stepped:g} s, like one.time", "an error: a Model has one Data"),
                0 if first.alone else 1,
                f"Each of {first.worlds} Data, stepped in turn, ended where it ends alone.",
            ),
        ),
        Text(
            "A Model is everything that never changes while a simulation runs: shapes, masses, "
            "limits, gains of the servos, the length of a timestep. A Data is everything that "
            "does change: positions, velocities, your command, the time, and what follows from "
            "them. step reads both and overwrites the Data with the next state. That is all; "
            "nothing runs in the background."
        ),
        Table(
            ("", *results),
            [
                ("load: the file, once", *(duration(r.loading) for r in results.values())),
                ("make_data", *(duration(r.making) for r in results.values())),
                ("step: one timestep", *(duration(r.stepping) for r in results.values())),
                ("a load costs as much as", *(_steps(r) for r in results.values())),
            ],
            title="What each costs on this machine, now (median of five)",
        ),
    ]
    for name, result in results.items():
        prefix = where(results, name)
        cheap = result.making < result.loading / _CHEAP
        blocks += [
            sentence(
                results,
                name,
                "the slow part is done once, and many Data use it. That is how many worlds are "
                "simulated at the same time."
                if cheap
                else "here a Data costs nearly what a load does: the slow part is done anew for "
                "each.",
            ),
            Verdict(
                f"{prefix}{result.worlds} Data of one Model, each under a command of its own, took "
                f"{count(result.nstep, 'step')} in turn: each ended bit for bit where it ends "
                f"alone, at {count(result.different, 'different end')}",
                result.alone,
            ),
            Verdict(
                f"{prefix}the Model's arrays, {result.arrays} with the engine's own, have the same "
                "bytes as before",
                result.constant,
            ),
            sentence(
                results,
                name,
                "all Data name the Model's own engine object as theirs: one in memory."
                if result.shared
                else "the engine has no such two objects; the split is ours, and each Data is a "
                "world that was loaded for itself.",
            ),
        ]
    blocks += differences(
        results,
        [
            ("a load takes", lambda a, b: f"{b.loading / a.loading:.1f} ×"),
            ("a Data takes", lambda a, b: f"{b.making / a.making:.1f} ×"),
            ("a step takes", lambda a, b: f"{b.stepping / a.stepping:.1f} ×"),
        ],
    )
    return page_of("Two objects and one function", results, blocks)


def _steps(result: Objects) -> str:
    return f"{result.ratio:,.0f} steps"
