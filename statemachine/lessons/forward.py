"""Stored, derived: what forward recomputes, and when the fingertip notices a write."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..interface import Array, Data, Model
from ..interface.checks import as_scalar
from ..measures.text import count, millimetres, vector
from ..page import Page, Question, Table, Text, Verdict
from ..runs.drive import Progress, steps_in
from ..runs.provenance import Provenance, provenance
from ._robot import a_tip, coordinate, the_tip, tip_of, usual_tip, with_joint
from ._stages import (
    Look,
    OwnAnswer,
    Stages,
    arrays_section,
    find_stages,
    lag_section,
    look_at,
    own_answers,
)
from ._words import differences, emulation, page_of, sentence, typed, where
from .records import Session
from .session import CodeRun

_SECONDS = 2.0  # under a command, long enough to touch something
_INSIDE = 1e-3  # metres; less is how engines press things together
_CHOICES: dict[tuple[tuple[int, int], ...], int] = {
    ((0, 1),): 0,
    ((1, 2),): 1,
    ((2, 3),): 2,
    ((1, 3),): 3,
}


def fit(model: Model, options: Mapping[str, Any]) -> dict[str, Any]:
    """A joint of this robot, a value in its range, and what the joint carries."""
    values = with_joint(model, options)
    if values["site"] is None:
        values["site"] = usual_tip(model, values["joint"])
    return values


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """The four readings."""
    slot = coordinate(model, options["joint"]).slot  # or says what is wrong with it
    tip = tip_of(model, options["site"])
    read = f"data.{tip.array}[tip]"
    value = as_scalar(options["value"], "value")
    return f"""\
import statemachine as sm

model = {load}
tip = {tip.found}
slot = {slot}
data = sm.make_data(model)
print(1, {read}.round(4))
sm.forward(model, data)
print(2, {read}.round(4))
data.qpos[slot] = {value}
print(3, {read}.round(4))
sm.forward(model, data)
print(4, {read}.round(4))
"""


@dataclass(frozen=True, eq=False)
class Reading:
    """One reading: what had been done, the fingertip (3,) [m], and the time [s]."""

    after: str
    fingertip: Array
    time: float


@dataclass(frozen=True, eq=False)
class Forward:
    """The four readings.

    Attributes:
        equal: Pairs (i, j), i < j, of readings that are equal bit by bit.
        moved: Distance [m] that the write and the second `forward` moved the fingertip.
        contacts: How many were found after the second `forward`; deepest: how far the two
            surfaces of the worst of them are inside each other [m].
        itself: What the engine does without us, where some of this is emulated.
        stages: What each call changes, and of which moment derived values are; of these
            two and of `itself` what was asked for.
    """

    joint: str
    value: float
    readings: tuple[Reading, ...]
    equal: tuple[tuple[int, int], ...]
    moved: float
    contacts: int
    deepest: float
    itself: tuple[OwnAnswer, ...]
    stages: Stages
    provenance: Provenance


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Forward:
    """Read the fingertip at each print; then what else was asked for."""
    model, joint, value = play.model, options["joint"], options["value"]
    place, tip = coordinate(model, joint).place, tip_of(model, options["site"])
    arrays, steps = options["arrays"], _steps(model, options)
    read: list[tuple[Array, float]] = []
    looks: list[Look] = []

    def look(source: str, names: Mapping[str, Any]) -> None:
        if source.startswith("print("):
            data: Data = names["data"]
            read.append((tip.read(data), data.time))
            if arrays:
                looks.append(look_at(data))

    names = play(line=look)
    labels = ("make_data", "forward", f"qpos[{place}] = {value:g}", "forward again")
    tips = [fingertip for fingertip, _ in read]
    found = names["data"].contacts
    itself = own_answers(model, "write") if arrays else ()
    if steps:
        itself += own_answers(model, "step")
    return Forward(
        joint=joint,
        value=value,
        readings=tuple(Reading(label, *at) for label, at in zip(labels, read, strict=True)),
        equal=tuple(
            (i, j)
            for i in range(len(tips))
            for j in range(i + 1, len(tips))
            if np.array_equal(tips[i], tips[j])
        ),
        moved=float(np.linalg.norm(tips[3] - tips[2])),
        contacts=len(found),
        deepest=max(0.0, -float(found.dist.min(initial=0.0))),
        itself=itself,
        stages=find_stages(model, tip, place, value, looks[1:], steps, progress),
        provenance=provenance(model),
    )


def _steps(model: Model, options: Mapping[str, Any]) -> int:
    """Over how many steps to look at the lag; 0 if it is not asked for."""
    seconds = options["seconds"]
    if seconds is None:
        return steps_in(model, _SECONDS) if options["lag"] else 0
    return steps_in(model, seconds)


def page(results: Mapping[str, Forward], session: Session) -> Page:
    """The readings, which are equal, and what that means; then what was asked for."""
    first = next(iter(results.values()))
    stages = {name: result.stages for name, result in results.items()}
    tip = first.stages.site
    sites = "its sites are" if the_tip(tip) == tip else "the fingertip is"
    arrays, lag = len(first.stages.changes) > 0, len(first.stages.lag) > 0
    blocks: list[Any] = [
        Text(_opening(tip)),
        *typed(
            session,
            Question(
                f"two of the four readings of {first.stages.site} are equal. Which?",
                ("1 and 2", "2 and 3", "3 and 4", "2 and 4"),
                _CHOICES.get(first.equal),
                "The write changed qpos at once, and nothing that is derived from it.",
            ),
        ),
        Text(
            "qpos, qvel, ctrl and time are stored. Everything else is derived from them: where "
            f"{sites} (site_xpos), where the bodies are (xpos), what touches what, which "
            "forces act (qfrc_…). It is computed only when you call forward or step. A write to "
            "qpos marks nothing as out of date: derived arrays keep their old numbers. forward "
            "recomputes them all, and no time passes. step recomputes them too, and then "
            "integrates: it makes the next qpos and qvel."
        ),
        *_readings(results),
    ]
    for name, result in results.items():
        blocks += _findings(results, name, result)
    promises = ["zeros when fresh", "stale after a write"]
    blocks += emulation(results, *promises, *["stale after a step"] * lag)
    rows = [
        (f"{a_tip(tip)}, reading {i + 1}", partial(_apart, i)) for i in range(len(first.readings))
    ]
    blocks += differences(results, rows)
    if arrays:
        blocks += arrays_section(stages, _own(results, "write"))
    if lag:
        blocks += lag_section(stages, _own(results, "step"))
    if not arrays:
        blocks.append(
            Text("Which arrays each call changes, one by one: statemachine lesson forward --arrays")
        )
    if not lag:
        blocks.append(
            Text(f"How far behind a step leaves {the_tip(tip)}: statemachine lesson forward --lag")
        )
    return page_of("Stored, derived, integrated", results, blocks)


def _opening(site: str) -> str:
    if the_tip(site) == site:
        return f"The robot was just made. Where is its {site}, and when is that computed?"
    return "The arm was just made. Where is its fingertip, and when is that computed?"


def _readings(results: Mapping[str, Forward]) -> list[Table | Text]:
    """The four readings, and what the first of them is."""
    first = next(iter(results.values()))
    blocks: list[Table | Text] = []
    if not any(first.readings[0].fingertip):
        blocks.append(
            Text(
                "So the first reading is no place at all: nothing had been computed yet, and the "
                "memory was still empty."
            )
        )
    twins = {index for result in results.values() for pair in result.equal for index in pair}
    several, said = len(results) > 1, a_tip(first.stages.site)
    headers = [f"{name} [m]" for name in results] if several else [f"{said} [m]"]
    digits = 3 if several else 4  # so that two columns fit
    blocks.append(
        Table(
            ("", "after", *headers, "data.time"),
            [
                (
                    str(i + 1),
                    reading.after,
                    *(vector(r.readings[i].fingertip, digits) for r in results.values()),
                    f"{reading.time:g} s",
                )
                for i, reading in enumerate(first.readings)
            ],
            title=f"{'The fingertip' if said == 'fingertip' else said}, read four times",
            words=frozenset({0, 1}),
            emphasis=frozenset(twins),
        )
    )
    return blocks


def _findings(results: Mapping[str, Forward], name: str, result: Forward) -> list[Text | Verdict]:
    """What the readings of one engine mean."""
    blocks: list[Text | Verdict] = [
        Verdict(
            f"{where(results, name)}readings 2 and 3 are equal bit by bit: the write changed "
            "nothing that is derived",
            (1, 2) in result.equal,
        )
    ]
    text = (
        f"the second forward moved {the_tip(result.stages.site)} by {millimetres(result.moved, 1)}"
    )
    if not result.moved:
        text += f": {result.joint} was there already, or does not carry it"
    blocks.append(sentence(results, name, f"{text}."))
    unmoved = all(reading.time == result.readings[0].time for reading in result.readings)
    blocks.append(
        Verdict(f"{where(results, name)}data.time is the same in all four readings", unmoved)
    )
    if result.deepest > _INSIDE:
        blocks.append(
            sentence(
                results,
                name,
                "nothing checks whether the robot can be where you write it. forward finds "
                f"{count(result.contacts, 'contact')} now, the worst "
                f"{millimetres(result.deepest, 1)} inside each other.",
            )
        )
    return blocks


def _own(results: Mapping[str, Forward], question: str) -> dict[str, list[OwnAnswer]]:
    """What each engine itself does, of one question."""
    return {
        name: [each for each in result.itself if each.question == question]
        for name, result in results.items()
    }


def _apart(reading: int, one: Forward, two: Forward) -> str:
    tips = [each.readings[reading].fingertip for each in (one, two)]
    return f"{math.dist(*tips):.1e} m"
