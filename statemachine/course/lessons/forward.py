"""A write into the state: it is in the simulator at once, and nothing derived has noticed it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Array, Model, forward, make_data, step
from ...interface.checks import as_scalar
from ...lab.runs.drive import Progress, number_of_steps
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.readings import Tip, tips_of, usual_tip
from ...show.pictures import Diagram
from ._robot import coordinate, with_joint
from ._stages import (
    ArrayChange,
    Lag,
    OwnAnswer,
    changes_by_call,
    lag_of_steps,
    own_answers,
)
from ._write import WriteEffects, effects_of, in_engine
from .diagrams.pipeline import pipeline
from .session import CodeRun, Options

_SECONDS = 2.0  # under a command, long enough to touch something
Pairs = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Reading:
    """The fingertip, read once.

    Attributes:
        after: What had been done before.
        fingertip: (3,) its position [m].
        time: Of the Data [s].
    """

    after: str
    fingertip: Array
    time: float


@dataclass(frozen=True)
class WrittenEntry:
    """An entry of qpos right after it was written, as several names show it.

    Attributes:
        place: Its index.
        view: What another name for `data.qpos` says [rad or m].
        copy: What a copy of it says that was made before the write [rad or m].
        in_engine: What the engine's own memory says [rad or m]; None where the engine keeps its
            state elsewhere.
    """

    place: int
    view: float
    copy: float
    in_engine: float | None


@dataclass(frozen=True)
class AfterStep:
    """The fingertip after one step from the written state.

    Attributes:
        of_before: Whether it reads as `forward` computed it before the step, bit for bit.
        behind: Distance by which `forward` moves it after the step [m].
    """

    of_before: bool
    behind: float


@dataclass(frozen=True)
class Further:
    """What else is looked at after the four readings.

    Attributes:
        effects: What the next step makes of the write, and what is refused.
        itself: What the engine does without us, where some of this is emulated.
        changes: What each call changes.
        lag: Of which moment derived values are after a step.
    """

    effects: WriteEffects
    itself: tuple[OwnAnswer, ...]
    changes: tuple[ArrayChange, ...]
    lag: Lag


@dataclass(frozen=True)
class ForwardResult:
    """Four readings of the fingertip around a write, and what goes further.

    Attributes:
        joint: The joint that was written.
        site: What is read: the fingertip, or another site or body.
        value: What was written [rad; of a slide or a height, m].
        readings: Of the fingertip, at each print.
        equal: Pairs (i, j), i < j, of readings that are equal bit by bit.
        moved: Distance that the write and the second `forward` moved it [m].
        contacts: How many were found after the second `forward`.
        deepest: How far the two surfaces of the worst of them are inside each other [m].
        written: The entry of qpos that was written.
        stepped: What one step from there leaves; None with an integrator that leaves values of
            neither moment.
        further: What else was looked at; None where what goes further was not asked for.
        provenance: What it was computed with.
    """

    joint: str
    site: str
    value: float
    readings: tuple[Reading, ...]
    equal: Pairs
    moved: float
    contacts: int
    deepest: float
    written: WrittenEntry
    stepped: AfterStep | None
    further: Further | None
    provenance: Provenance


def fit(model: Model, options: Options) -> dict[str, Any]:
    """Complete the options with a joint, a value in its range, and a place that it carries."""
    values = with_joint(model, options)
    if values["site"] is None:
        values["site"] = usual_tip(model, values["joint"])
    return values


def code(model: Model, options: Options, load: str) -> str:
    """Write the four readings."""
    slot = coordinate(model, options["joint"]).slot  # or says what is wrong with it
    tip = tips_of(model, options["site"])[0]
    read = f"data.{tip.array}[tip]"
    value = as_scalar(options["value"], "value")
    return f"""\
import statemachine as sm

model = {load}
tip = model.{tip.kind}_id({tip.name!r})
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


def run(play: CodeRun, options: Options, progress: Progress) -> ForwardResult:
    """Read the fingertip at each print; then what goes further, if that was asked for."""
    model, joint, value = play.model, options["joint"], options["value"]
    at, tip = coordinate(model, joint), tips_of(model, options["site"])[0]
    actions = ("make_data", "forward", f"qpos[{at.place}] = {value:g}", "forward again")
    readings: list[Reading] = []
    view, copy = np.zeros(model.nq), np.zeros(model.nq)
    in_memory: float | None = None
    for source in play.lines():
        if source.startswith("data = "):
            view, copy = play.names["data"].qpos, play.names["data"].qpos.copy()
        if source.startswith("data.qpos["):
            in_memory = in_engine(play.names["data"], at.place)
        if source.startswith("print("):
            data = play.names["data"]
            readings.append(Reading(actions[len(readings)], tip.read(data), data.time))
    written = WrittenEntry(at.place, float(view[at.place]), float(copy[at.place]), in_memory)
    contacts = play.names["data"].contacts
    deepest = max(0.0, -float(contacts.dist.min(initial=0.0)))
    moved = float(np.linalg.norm(readings[3].fingertip - readings[2].fingertip))
    stepped = _after_step(model, at.place, value, tip)
    further = _further(model, options, progress) if options["further"] else None
    return ForwardResult(
        joint=joint,
        site=options["site"],
        value=value,
        readings=tuple(readings),
        equal=_equal_pairs(readings),
        moved=moved,
        contacts=len(contacts),
        deepest=deepest,
        written=written,
        stepped=stepped,
        further=further,
        provenance=provenance(model),
    )


def _after_step(model: Model, place: int, value: float, tip: Tip) -> AfterStep | None:
    """Take one step from the written state, and compare the fingertip with `forward`'s.

    Args:
        model: Of the lesson.
        place: Index in qpos that is written.
        value: What is written there [rad or m].
        tip: What is read.
    """
    if model.capabilities.behaviours["stale after a step"].support == "unsupported":
        return None
    with make_data(model) as data:
        data.qpos[place] = value
        forward(model, data)
        before = tip.read(data)
        step(model, data)
        left = tip.read(data)
        forward(model, data)
        return AfterStep(
            of_before=bool(np.array_equal(left, before)),
            behind=float(np.linalg.norm(tip.read(data) - left)),
        )


def _further(model: Model, options: Options, progress: Progress) -> Further:
    """Look at what the next step makes of the write, at each array, and at the lag of a step."""
    at, tip = coordinate(model, options["joint"]), tips_of(model, options["site"])[0]
    itself = (*own_answers(model, "write"), *own_answers(model, "step"))
    return Further(
        effects=effects_of(model, at, options["value"]),
        itself=itself,
        changes=tuple(changes_by_call(model, at.place, options["value"])),
        lag=lag_of_steps(model, tip, _steps(model, options), progress),
    )


def _equal_pairs(readings: Sequence[Reading]) -> Pairs:
    """Return the pairs of readings that are equal bit by bit."""
    pairs: list[tuple[int, int]] = []
    for (i, one), (j, other) in itertools.combinations(enumerate(readings), 2):
        if np.array_equal(one.fingertip, other.fingertip):
            pairs.append((i, j))
    return tuple(pairs)


def _steps(model: Model, options: Options) -> int:
    """Return over how many steps to look at the lag."""
    seconds = options["seconds"]
    return number_of_steps(model, _SECONDS if seconds is None else seconds)


def diagram(model: Model) -> Diagram:
    """Draw what the lesson is about."""
    return pipeline(model)
