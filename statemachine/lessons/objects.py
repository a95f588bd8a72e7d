"""Two objects and one function: a Model that never changes, a Data that does, and step."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..backends import load
from ..errors import BadInputError
from ..interface import Array, Model, make_data, step
from ..interface.checks import as_count
from ..measures.text import count, duration
from ..page import Page, Question, Table, Text, Verdict
from ..runs.drive import Progress, part_of
from ..runs.provenance import Provenance, provenance
from ._robot import is_of_the_arm
from ._words import differences, page_of, sentence, typed, where, words
from .in_turns import in_turns
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
        commanded: Whether each had a ctrl of its own; a model may have no actuators.
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
    commanded: bool
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
    ways: dict[str, Callable[[], object]] = {
        "load": lambda: load(model.path, backend=model.backend),
        "make": lambda: made.append(make_data(model)),
        "step": lambda: step(model, made[0], _STEPS),
    }
    walls = in_turns(ways, _TIMES, part_of(progress, 0.0, 0.5))
    costs = {name: statistics.median(times) for name, times in walls.items()}
    shared = all(getattr(data.raw, "model", None) is model.raw for data in made)
    for data in made[len(play.worlds) :]:
        data.close()
    shares = [part_of(progress, 0.5 + 0.25 * k / worlds, 0.25 / worlds) for k in range(worlds)]
    singly = [_in_turn(model, [k], worlds, shares[k])[0] for k in range(worlds)]
    together = _in_turn(model, range(worlds), worlds, part_of(progress, 0.75, 0.25))
    after = _arrays(model)
    return Objects(
        loading=costs["load"],
        making=costs["make"],
        stepping=costs["step"] / _STEPS,
        worlds=worlds,
        nstep=_STEPS,
        alone=all(np.array_equal(a, b) for a, b in zip(singly, together, strict=True)),
        different=len({end.tobytes() for end in together}),
        commanded=bool(model.nu),
        arrays=len(before),
        constant=before == after,
        shared=shared,
        provenance=provenance(model),
    )


def _in_turn(model: Model, numbers: Sequence[int], count: int, progress: Progress) -> list[Array]:
    """Where some of `count` Data end if they take their steps in turn, each under its command.

    Another one for each: of the first actuator, over a part of its range.
    """
    with ExitStack() as stack:
        worlds = [stack.enter_context(make_data(model)) for _ in numbers]
        for k, data in zip(numbers, worlds, strict=True):
            if model.nu:
                low, high = np.clip(model.actuator_ctrlrange[0], -1.0, 1.0)
                data.ctrl[0] = low + (high - low) * (k + 1) / (count + 1)
        for number in range(_STEPS):
            for data in worlds:
                step(model, data)
            progress((number + 1) / _STEPS)
        return [data.qpos.copy() for data in worlds]


def _arrays(model: Model) -> dict[str, bytes]:
    """The bytes of every array of a Model, and of the engine's own model."""
    found = {name: getattr(model, name) for name in vars(model)}
    for name in dir(model.raw):
        if not name.startswith("_"):
            found[f"raw.{name}"] = getattr(model.raw, name)
    return {name: each.tobytes() for name, each in found.items() if isinstance(each, np.ndarray)}


def page(results: Mapping[str, Objects], session: Session) -> Page:
    """What costs, what is shared, what goes its own way."""
    first = next(iter(results.values()))
    stepped = first.provenance.timestep * 100
    blocks: list[Any] = [
        Text(words(is_of_the_arm(results))),
        Text(
            "Below, a robot's file is loaded once, into a Model. Two Data are made of it, and one "
            "of them is advanced by 100 steps. What Model and Data are is said after that."
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
                ("a load costs as much as", *(f"{r.ratio:,.0f} steps" for r in results.values())),
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
                "loading is the slow part, and it is done once. Another Data is cheap, so many "
                "worlds can be simulated at the same time."
                if cheap
                else "here a Data costs nearly as much as a load, because the slow part is done "
                "again for each Data.",
            ),
            Verdict(
                f"{prefix}{result.worlds} Data of one Model took {count(result.nstep, 'step')} in "
                f"turn{_commands(result)}. Each ended in the same bits as when it runs alone",
                result.alone,
            ),
            Verdict(
                f"{prefix}none of the Model's {result.arrays} arrays has changed, those of the "
                "engine's own model included",
                result.constant,
            ),
            sentence(
                results,
                name,
                "all these Data refer to one and the same model of the engine; it is in memory "
                "once."
                if result.shared
                else "the engine itself has no Model and no Data. This interface makes the "
                "difference, and loads a world of its own for each Data.",
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


def _commands(result: Objects) -> str:
    if not result.commanded:
        return ""
    ends = result.different
    apart = "no two of them ended alike" if ends == result.worlds else f"they had {ends} ends"
    return f", each with its own ctrl, and {apart}"
