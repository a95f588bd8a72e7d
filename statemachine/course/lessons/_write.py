"""What a write into the state does to memory and to the next step, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import StateMachineError
from ...interface import (
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
from ...show.blocks import Table
from ._robot import Coordinate


@dataclass(frozen=True)
class Refusal:
    """Assignment that was refused before anything changed.

    Attributes:
        typed: The assignment as one types it.
        message: Of the error.
    """

    typed: str
    message: str


@dataclass(frozen=True)
class WriteEffects:
    """What follows from a write into qpos, and what is refused.

    Attributes:
        same_arrays: Whether the inputs were the same arrays after step, forward, reset and
            set_state.
        speed_change: How much the first step after the write differs from one without it, in
            the velocity of the joint [rad/s or m/s].
        slide: Whether that joint is a slide.
        contacts: How many contacts that step found.
        contacts_without: How many contacts the step without the write found.
        refused: What was refused, and with which words.
    """

    same_arrays: bool
    speed_change: float
    slide: bool
    contacts: int
    contacts_without: int
    refused: tuple[Refusal, ...]


def in_engine(data: Data, place: int) -> float | None:
    """Return an entry of qpos in the engine's own memory, if that is where qpos lives."""
    raw = getattr(data.raw, "qpos", None)
    if not isinstance(raw, np.ndarray) or not np.shares_memory(raw, data.qpos):
        return None
    return float(raw[place])


def effects_of(model: Model, at: Coordinate, value: float) -> WriteEffects:
    """Write into a new Data, step it, and step another one without the write.

    Args:
        model: Of the lesson.
        at: Where it is written.
        value: What is written there [rad or m].
    """
    with make_data(model) as data, make_data(model) as other:
        for each in (data, other):
            forward(model, each)
        data.qpos[at.place] = value
        step(model, data)
        step(model, other)
        speed_change = float(data.qvel[at.dof] - other.qvel[at.dof])
        contacts, contacts_without = len(data.contacts), len(other.contacts)
        return WriteEffects(
            same_arrays=_keeps_arrays(model, data),
            speed_change=speed_change,
            slide=at.slide,
            contacts=contacts,
            contacts_without=contacts_without,
            refused=_refused(data),
        )


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
    attempts: Mapping[str, tuple[str, object]] = {
        "data.qpos = [0.8]": ("qpos", [0.8]),
        "data.xpos = …": (DERIVED[0], 0.0),
        "data.qpso = …": ("qpso", 0.0),
    }
    refused: list[Refusal] = []
    for typed, (name, value) in attempts.items():
        try:
            setattr(data, name, value)
        except StateMachineError as error:
            refused.append(Refusal(typed, str(error)))
    return tuple(refused)


def refusals(effects: WriteEffects) -> Table:
    """Show what is refused, and with which words."""
    return Table.of(
        effects.refused,
        {"you type": lambda refusal: refusal.typed, "and read": lambda refusal: refusal.message},
        words=("and read",),
    )
