"""Writing into the state: a view, not a copy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...errors import StateMachineError
from ...interface import (
    DERIVED,
    INPUTS,
    Array,
    Data,
    Model,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ...interface.checks import as_scalar
from ...lab.runs.drive import Progress
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.readings import read_derived
from ...measures.text import count, position
from ...show.blocks import Block, Table
from ...show.lesson_template import emulated
from ._robot import coordinate, with_joint
from .session import CodeRun, Options

fit = with_joint  # a joint of this robot, and a value in its range


def code(model: Model, options: Options, load: str) -> str:
    """Write code with a name for the array, a copy of it, and a write."""
    slot = coordinate(model, options["joint"]).slot  # or says what is wrong with it
    value = as_scalar(options["value"], "value")
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
sm.forward(model, data)  # works out where things are
slot = {slot}
view = data.qpos
copy = data.qpos.copy()
view[slot] = {value}
print(data.qpos[slot], copy[slot], view is data.qpos)
"""


class Refusal(NamedTuple):
    """Assignment that was refused before anything changed.

    Attributes:
        typed: The assignment as one types it.
        message: Of the error.
    """

    typed: str
    message: str


@dataclass(frozen=True)
class WriteResult:
    """Who noticed that an entry of qpos was written.

    Attributes:
        joint: The joint whose coordinate was written.
        slide: Whether it is a slide.
        place: Index of the entry in qpos.
        value: What was written [rad; of a slide, m].
        view: What the other name for the array says afterwards [rad or m].
        copy: What a copy made before says afterwards [rad or m].
        same_arrays: Whether the inputs were the same arrays after step, forward, reset and
            set_state.
        in_engine: The entry as the engine's own memory shows it right after the write [rad or m];
            None where the engine keeps its state elsewhere.
        changed: Derived arrays that the write changed.
        refused: What was refused, and with which words.
        speed_change: How much the first step after the write differs from one without it, in
            the velocity of that joint [rad/s or m/s].
        contacts: How many contacts that step found.
        contacts_without: How many contacts the step without the write found.
        provenance: What it was computed with.
    """

    joint: str
    slide: bool
    place: int
    value: float
    view: float
    copy: float
    same_arrays: bool
    in_engine: float | None
    changed: tuple[str, ...]
    refused: tuple[Refusal, ...]
    speed_change: float
    contacts: int
    contacts_without: int
    provenance: Provenance


def run(play: CodeRun, options: Options, progress: Progress) -> WriteResult:
    """Look who notices the write; then go on with the Data that was written."""
    model, joint, value = play.model, options["joint"], options["value"]
    at = coordinate(model, joint)
    before, after, _ = (  # after the copy, the write and the print
        read_derived(play.names["data"]) for _ in play.lines() if "copy" in play.names
    )
    data: Data = play.names["data"]
    copy: Array = play.names["copy"]
    in_view, in_copy = float(data.qpos[at.place]), float(copy[at.place])
    in_engine = _in_engine(data, at.place)
    step(model, data)
    contacts = len(data.contacts)
    with make_data(model) as other:  # the same without the write
        step(model, other)
        speed_change = float(data.qvel[at.dof] - other.qvel[at.dof])
        contacts_without = len(other.contacts)
    same_arrays = _keeps_arrays(model, data)
    data.qpos = copy
    refused = _refused(data)
    return WriteResult(
        joint=joint,
        slide=at.slide,
        place=at.place,
        value=value,
        view=in_view,
        copy=in_copy,
        same_arrays=same_arrays,
        in_engine=in_engine,
        changed=_changed(before, after),
        refused=refused,
        speed_change=speed_change,
        contacts=contacts,
        contacts_without=contacts_without,
        provenance=provenance(model),
    )


def _changed(before: Mapping[str, bytes], after: Mapping[str, bytes]) -> tuple[str, ...]:
    """Return the names of the arrays that have other bytes than before."""
    return tuple(name for name in before if before[name] != after[name])


def _in_engine(data: Data, place: int) -> float | None:
    """Return the entry in the engine's own memory, if that is where qpos lives."""
    raw = getattr(data.raw, "qpos", None)
    if not isinstance(raw, np.ndarray) or not np.shares_memory(raw, data.qpos):
        return None
    return float(raw[place])


def _keeps_arrays(model: Model, data: Data) -> bool:
    """Tell whether the inputs are the same arrays after each verb that changes them."""
    arrays = {name: getattr(data, name) for name in INPUTS}
    state = get_state(model, data)

    def restore(model: Model, data: Data) -> None:
        set_state(model, data, state)

    same = True
    for verb in (step, forward, reset, restore):
        verb(model, data)
        same &= all(getattr(data, name) is arrays[name] for name in INPUTS)
    return same


def _refused(data: Data) -> tuple[Refusal, ...]:
    """Try assignments that are refused before anything changes."""
    attempts = {
        "data.qpos = [0.8]": ("qpos", [0.8]),
        "data.xpos = …": (DERIVED[0], 0.0),
        "data.qpso = …": ("qpso", 0.0),
    }
    refused = []
    for typed, (name, value) in attempts.items():
        try:
            setattr(data, name, value)
        except StateMachineError as error:
            refused.append(Refusal(typed, str(error)))
    return tuple(refused)


def slots(result: WriteResult) -> dict[str, Any]:
    """Return what the page's slots take beside the fields of the result."""
    return {
        "right": 0 if result.view == result.value else 1,
        **_memory_slots(result),
        **_contact_slots(result),
        "unchanged": not result.changed,
        "what_changed": ", ".join(result.changed) if result.changed else "no derived array",
        "emulated": emulated(result, "stale after a write"),
    }


def _memory_slots(result: WriteResult) -> dict[str, Any]:
    """Return what the page says of the engine's own memory."""
    return {
        "in_memory": result.in_engine is not None,
        "in_engine": "" if result.in_engine is None else f"{result.in_engine:g}",
        "engine_agrees": result.in_engine == result.value,
    }


def _contact_slots(result: WriteResult) -> dict[str, str]:
    """Return what the page says of the steps with the write and without it."""
    return {
        "contacts_with": count(result.contacts, "contact"),
        "contacts_without": count(result.contacts_without, "contact"),
        "speed_change": f"{position(abs(result.speed_change), result.slide, 1)}/s",
    }


def tables(
    results: Mapping[str, WriteResult], first: WriteResult
) -> dict[str, Block | Sequence[Block]]:
    """Return what is refused."""
    refusals = Table.of(
        first.refused,
        {"you type": lambda refusal: refusal.typed, "and read": lambda refusal: refusal.message},
        title="What is refused",
        words=("and read",),
    )
    return {"refused": refusals}
