"""Two objects and one function: a Model that never changes, a Data that does, and step."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison.text import count, duration
from ..experiments import objects
from ..page import Page, Question, Table, Text, Verdict
from ._words import WORDS, differences, page_of, sentence, typed, where
from .records import Session

_CHEAP = 5  # times; a Data that is not cheaper than that is no bargain


def run(play: Any, options: Mapping[str, Any], progress: Any) -> objects.Objects:
    """Costs, and several Data of one Model."""
    model = play.model
    play()
    return objects.run(model, worlds=options["worlds"], progress=progress)


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """Two Data of one Model, of which one is stepped."""
    return f"""\
import statemachine as sm

model = {load}
one = sm.make_data(model)
two = sm.make_data(model)
sm.step(model, one, 100)
print(model)
print(round(one.time, 6), round(two.time, 6))
"""


def page(results: Mapping[str, objects.Objects], session: Session) -> Page:
    """What costs, what is shared, what goes its own way."""
    first = next(iter(results.values()))
    stepped = first.provenance.timestep * 100
    blocks: list[Any] = [
        Text(WORDS),
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


def _steps(result: objects.Objects) -> str:
    return f"{result.ratio:,.0f} steps"
