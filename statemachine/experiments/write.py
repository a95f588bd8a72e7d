"""Write into qpos: what is the same memory, what notices, and when."""

from __future__ import annotations

from dataclasses import dataclass

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
from ..lessons._bytes import read_derived
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import is_slide, scalar_joint


@dataclass(frozen=True)
class Write:
    """What a write does, and what it does not.

    Attributes:
        joint, place, value: qpos[place] of the joint was written [rad; of a slide, m].
        slide: Whether the joint is one.
        view, copy: What a name for the array, and a copy made before, say afterwards.
        kept: Inputs that were the same array after each of `calls`.
        calls: What was called between.
        in_engine: The entry as the engine's own memory shows it right after the write;
            None where the engine keeps its state elsewhere.
        changed: Derived arrays that the write changed.
        assigned: What the view says after `data.qpos = other`.
        refused: What was refused, and with which words.
        felt: How much the first step after the write differs from one without it, in
            the velocity of that joint [rad/s or m/s].
        found: How many contacts it found; otherwise: how many the one without it found.
    """

    joint: str
    slide: bool
    place: int
    value: float
    view: float
    copy: float
    kept: tuple[str, ...]
    calls: tuple[str, ...]
    in_engine: float | None
    changed: tuple[str, ...]
    assigned: float
    refused: tuple[tuple[str, str], ...]
    felt: float
    found: int
    otherwise: int
    provenance: Provenance


def run(model: Model, joint: str = "shoulder_lift", value: float = 0.8) -> Write:
    """Write one joint through a view, and look who has noticed.

    Args:
        model: Any model with the joint.
        joint: The joint to write; a hinge or slide.
        value: What to write [rad or m].

    Raises:
        UnknownNameError: No such joint.
        BadInputError: It is neither a hinge nor a slide.
    """
    place, dof = scalar_joint(model, joint)
    with make_data(model) as data, make_data(model) as other:
        forward(model, data)
        view, copy = data.qpos, data.qpos.copy()
        before = read_derived(data)
        view[place] = value
        after = read_derived(data)
        changed = tuple(name for name in before if before[name] != after[name])
        said = float(data.qpos[place]), float(copy[place])
        in_engine = _in_engine(data, place)
        step(model, data)
        step(model, other)
        felt = float(data.qvel[dof] - other.qvel[dof])
        found, otherwise = len(data.contacts), len(other.contacts)
        arrays = {name: getattr(data, name) for name in INPUTS}
        state = get_state(model, data)
        calls = {
            "step": lambda: step(model, data),
            "forward": lambda: forward(model, data),
            "reset": lambda: reset(model, data),
            "set_state": lambda: set_state(model, data, state),
        }
        same = set(INPUTS)
        for call in calls.values():
            call()
            same &= {name for name in INPUTS if getattr(data, name) is arrays[name]}
        data.qpos = copy
        return Write(
            joint=joint,
            slide=is_slide(model, joint),
            place=place,
            value=value,
            view=said[0],
            copy=said[1],
            kept=tuple(name for name in INPUTS if name in same),
            calls=tuple(calls),
            in_engine=in_engine,
            changed=changed,
            assigned=float(view[place]),
            refused=_refused(data),
            felt=felt,
            found=found,
            otherwise=otherwise,
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
        "data.xpos = …": (DERIVED[0], getattr(data, DERIVED[0]).copy()),
        "data.qpso = …": ("qpso", data.qpos.copy()),
    }
    refused = []
    for text, (name, value) in attempts.items():
        try:
            setattr(data, name, value)
        except StateMachineError as error:
            refused.append((text, str(error)))
    return tuple(refused)
