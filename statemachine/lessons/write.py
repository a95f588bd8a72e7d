"""Writing into the state: a view, not a copy."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import StateMachineError
from ..interface import (
    DERIVED,
    INPUTS,
    Data,
    Model,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ..interface.options import as_scalar
from ..measures.text import count, position
from ..page import Figures, Table
from ..runs.drive import Progress
from ..runs.header import provenance
from ._readings import read_derived
from ._robot import coordinate, with_joint
from .session import CodeRun, Options
from .template import Results, emulated

fit = with_joint  # a joint of this robot, and a value in its range


def code(model: Model, options: Options, load: str) -> str:
    """A name for the array, a copy of it, and a write."""
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


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Look who notices the write; then go on with the Data that was written.

    Returns:
        joint, place, value: qpos[place] of the joint was written [rad; of a slide, m].
        slide: Whether the joint is one.
        view, copy: What a name for the array, and a copy made before, say afterwards.
        same_arrays: Whether the inputs were the same arrays after step, forward, reset and
            set_state.
        in_engine: The entry as the engine's own memory shows it right after the write;
            None where the engine keeps its state elsewhere.
        changed: Derived arrays that the write changed.
        refused: What was refused, and with which words.
        speed_change: How much the first step after the write differs from one without it, in
            the velocity of that joint [rad/s or m/s].
        contacts: How many that step found; contacts_without: how many the other.
    """
    model, joint = play.model, options["joint"]
    at = coordinate(model, joint)
    before, after, _ = (  # after the copy, the write and the print
        read_derived(play.names["data"]) for _ in play.lines() if "copy" in play.names
    )
    data, copy = play.names["data"], play.names["copy"]
    view, in_engine = float(data.qpos[at.place]), _in_engine(data, at.place)
    step(model, data)
    contacts = len(data.contacts)
    with make_data(model) as other:  # the same without the write
        step(model, other)
        speed_change = float(data.qvel[at.dof] - other.qvel[at.dof])
        contacts_without = len(other.contacts)
    arrays, state = {name: getattr(data, name) for name in INPUTS}, get_state(model, data)
    same_arrays = True
    for call in (step, forward, reset, lambda model, data: set_state(model, data, state)):
        call(model, data)
        same_arrays &= all(getattr(data, name) is arrays[name] for name in INPUTS)
    data.qpos = copy
    return Figures(
        joint=joint,
        slide=at.slide,
        place=at.place,
        value=options["value"],
        view=view,
        copy=float(copy[at.place]),
        same_arrays=same_arrays,
        in_engine=in_engine,
        changed=tuple(name for name in before if before[name] != after[name]),
        refused=_refused(data),
        speed_change=speed_change,
        contacts=contacts,
        contacts_without=contacts_without,
        provenance=provenance(model),
    )


def _in_engine(data: Data, place: int) -> float | None:
    """The entry in the engine's own memory, if that is where qpos lives."""
    raw = getattr(data.raw, "qpos", None)
    if not isinstance(raw, np.ndarray) or not np.shares_memory(raw, data.qpos):
        return None
    return float(raw[place])


def _refused(data: Data) -> tuple[tuple[str, str], ...]:
    """Assignments that are refused before anything changes, and with which words."""
    attempts = {
        "data.qpos = [0.8]": ("qpos", [0.8]),
        "data.xpos = …": (DERIVED[0], 0.0),
        "data.qpso = …": ("qpso", 0.0),
    }
    refused = []
    for text, (name, value) in attempts.items():
        try:
            setattr(data, name, value)
        except StateMachineError as error:
            refused.append((text, str(error)))
    return tuple(refused)


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    return {
        "right": 0 if result.view == result.value else 1,
        "in_memory": result.in_engine is not None,
        "in_engine": f"{result.in_engine or 0:g}",
        "engine_agrees": result.in_engine == result.value,
        "unchanged": not result.changed,
        "what_changed": ", ".join(result.changed) or "no derived array",
        "contacts_with": count(result.contacts, "contact"),
        "contacts_without": count(result.contacts_without, "contact"),
        "speed_change": f"{position(abs(result.speed_change), result.slide, 1)}/s",
        "emulated": emulated(result, "stale after a write"),
    }


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """What is refused."""
    return {
        "refused": Table(
            ("you type", "and read"), first.refused, "What is refused", words=frozenset({0, 1})
        )
    }
