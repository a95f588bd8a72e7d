"""A write into the state: it is in the simulator at once, and nothing derived has noticed it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...interface import Array, Model, forward, make_data, step
from ...interface.checks import as_scalar
from ...lab.runs.drive import Progress, number_of_steps
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.readings import Tip, tips_of, usual_tip
from ...measures import largest
from ...measures.text import count, millimetres, short_time, vector
from ...show.blocks import Block, Table
from ...show.lesson_template import Blocks, Results, Words, differences, emulated
from ...show.pictures import Diagram
from ._robot import coordinate, with_joint
from ._stages import (
    ArrayChange,
    Lag,
    OwnAnswer,
    change_tables,
    changes_by_call,
    lag_of_steps,
    lag_tables,
    own_answers,
    own_tables,
)
from ._write import WriteEffects, effects_of, in_engine, refusals, write_slots
from .diagrams.pipeline import pipeline
from .session import CodeRun, Options

_SAY = Words("course/lessons/forward")
_SECONDS = 2.0  # under a command, long enough to touch something
_INSIDE = 1e-3  # metres; less is how engines press things together
_Pairs = tuple[tuple[int, int], ...]
_CHOICES: dict[_Pairs, int] = {((0, 1),): 0, ((1, 2),): 1, ((2, 3),): 2, ((1, 3),): 3}


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
    equal: _Pairs
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


def _equal_pairs(readings: Sequence[Reading]) -> _Pairs:
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


def slots(result: ForwardResult) -> dict[str, Any]:
    """Fill the slots of the page."""
    slots: dict[str, Any] = {}
    slots["right"] = _CHOICES.get(result.equal)
    slots["zero_at_first"] = not result.readings[0].fingertip.any()
    slots["unchanged"] = (1, 2) in result.equal
    written = result.written
    slots |= vars(written)
    slots["is_view"] = written.view == result.value != written.copy
    slots["in_memory"] = written.in_engine is not None
    slots["engine_agrees"] = written.in_engine == result.value
    slots["moved"] = millimetres(result.moved, 1)
    slots["moves"] = result.moved > 0
    slots["no_time_passed"] = len({reading.time for reading in result.readings}) == 1
    stepped = result.stepped
    slots["stepped"] = stepped is not None and stepped.behind > 0
    if stepped is not None:
        slots["of_before_step"] = stepped.of_before
        slots["behind_after_step"] = millimetres(stepped.behind)
    slots["inside"] = result.deepest > _INSIDE
    slots["contacts"] = count(result.contacts, "contact")
    slots["deepest"] = millimetres(result.deepest, 1)
    slots["emulated"] = emulated(
        result, "zeros when fresh", "stale after a write", "stale after a step"
    )
    if result.further is not None:
        slots |= write_slots(result.further.effects)
        slots |= _slots_of_changes(result.further.changes)
        slots |= _slots_of_lag(result.further.lag)
    return slots


def _slots_of_changes(changes: Sequence[ArrayChange]) -> dict[str, Any]:
    """Fill the slots about the arrays that each call changes."""
    derived = [change for change in changes if not change.stored]
    same = {change.name for change in derived if change.same}
    return {
        "derived": len(derived),
        "same": len(same),
        "places_are_same": {"xpos", "xquat", "site_xpos", "site_xmat"} <= same,
    }


def _slots_of_lag(lag: Lag) -> dict[str, Any]:
    """Fill the slots about what a step leaves behind."""
    steps = len(lag.time)
    worst, step = largest(lag.distance)
    slots: dict[str, Any] = {}
    slots["lags"] = worst > 0 and not lag.neither
    slots["steps"] = count(steps, "step")
    slots["of_before"] = lag.of_before[lag.array] == steps > lag.of_after[lag.array]
    slots["array"] = lag.array
    slots["behind"] = millimetres(worst)
    slots["behind_at"] = short_time(lag.time[step])
    return slots


def tables(results: Results[ForwardResult], first: ForwardResult) -> Blocks:
    """Show the four readings; then what goes further, if that was asked for."""
    rows: dict[str, Callable[[ForwardResult, ForwardResult], str]] = {}
    for k in range(len(first.readings)):
        rows[_SAY("reading", site=first.site, number=k + 1)] = partial(_apart, k)
    blocks: dict[str, Table | Sequence[Block]] = {}
    blocks["readings"] = _readings(results, first)
    blocks["differences"] = differences(results, rows)
    further = {name: result.further for name, result in results.items() if result.further}
    return blocks | _further_tables(further)


def _further_tables(results: Results[Further]) -> dict[str, Table | Sequence[Block]]:
    """Show what goes further, by backend; nothing where that was not asked for."""
    if not results:
        return dict.fromkeys(("refused", "changes", "own_write", "lag_tables", "own_step"), ())
    first = next(iter(results.values()))
    answers = {name: further.itself for name, further in results.items()}
    changes = {name: further.changes for name, further in results.items()}
    lags = {name: further.lag for name, further in results.items()}
    return {
        "refused": refusals(first.effects, _SAY),
        "changes": change_tables(changes, _SAY),
        "own_write": own_tables(answers, "write", _SAY),
        "lag_tables": lag_tables(lags, _SAY),
        "own_step": own_tables(answers, "step", _SAY),
    }


def _readings(results: Results[ForwardResult], first: ForwardResult) -> Table:
    """Show the four readings; those that are equal to another are set off."""
    decimals = 3 if len(results) > 1 else 4  # so that two columns fit
    rows: list[tuple[str, ...]] = []
    for k, reading in enumerate(first.readings):
        cells = [vector(each.readings[k].fingertip, decimals) for each in results.values()]
        rows.append((str(k + 1), reading.after, *cells, f"{reading.time:g} s"))
    equal: set[int] = set()
    for result in results.values():
        equal.update(*result.equal)
    columns = [f"{name} [m]" for name in results]
    return Table(
        ("", "after", *columns, "data.time"),
        rows,
        title=_SAY("readings", site=first.site),
        words=frozenset({0, 1}),
        emphasis=frozenset(equal),
    )


def _apart(reading: int, left: ForwardResult, right: ForwardResult) -> str:
    """Return how far a reading on one engine is from that on another."""
    gap = math.dist(left.readings[reading].fingertip, right.readings[reading].fingertip)
    return f"{gap:.1e} m"
