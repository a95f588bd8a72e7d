"""Writing into the state: a view, not a copy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
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
from ..interface.checks import as_scalar
from ..measures.text import count, position
from ..page import Page, Question, Table, Text, Verdict
from ..runs.drive import Progress
from ..runs.provenance import Provenance, provenance
from ._robot import coordinate, read_derived, with_joint
from ._words import emulation, page_of, sentence, typed, where
from .records import Session
from .session import CodeRun

fit = with_joint  # a joint of this robot, and a value in its range


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
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


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Write:
    """Look who notices the write; then go on with the Data that was written."""
    model, joint = play.model, options["joint"]
    at = coordinate(model, joint)
    place, dof = at.place, at.dof
    looks: list[dict[str, bytes]] = []  # after the copy, the write and the print

    def look(_source: str, names: Mapping[str, Any]) -> None:
        if "copy" in names:
            looks.append(read_derived(names["data"]))

    names = play(line=look)
    data, copy = names["data"], names["copy"]
    before, after, *_ = looks
    view, in_engine = float(data.qpos[place]), _in_engine(data, place)
    step(model, data)
    found = len(data.contacts)
    with make_data(model) as other:
        step(model, other)
        felt, otherwise = float(data.qvel[dof] - other.qvel[dof]), len(other.contacts)
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
        slide=at.slide,
        place=place,
        value=options["value"],
        view=view,
        copy=float(copy[place]),
        kept=tuple(name for name in INPUTS if name in same),
        calls=tuple(calls),
        in_engine=in_engine,
        changed=tuple(name for name in before if before[name] != after[name]),
        assigned=float(names["view"][place]),
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


def page(results: Mapping[str, Write], session: Session) -> Page:
    """The same memory, what it changes, what is refused."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text("One number is written into data.qpos, through a second name for that array."),
        *typed(
            session,
            Question(
                f"view[slot] was set to {first.value:g}. What does data.qpos[slot] say?",
                (f"{first.value:g}", f"{first.copy}, until forward or step is called", "an error"),
                0 if first.view == first.value else 1,
                f"The view and data.qpos are one array; the copy still says {first.copy:g}.",
            ),
        ),
        Text(
            "data.qpos is no copy. A second name for it is the same array, and the next call "
            "starts from what you write there. There is nothing else to do. (To keep a value, "
            "copy it: data.qpos.copy().)"
        ),
    ]
    for name, result in results.items():
        prefix = where(results, name)
        blocks.append(
            Verdict(
                f"{prefix}qpos, qvel and ctrl are the same arrays after "
                f"{', '.join(result.calls)}: a name for one of them stays valid",
                len(result.kept) == 3,
            )
        )
        if result.in_engine is None:
            blocks.append(
                sentence(
                    results,
                    name,
                    "the engine does not give access to its own memory. The arrays belong to "
                    "this interface, and the next call passes their numbers on to the engine.",
                )
            )
        else:
            blocks.append(
                Verdict(
                    f"{prefix}the array is the engine's own memory: right after the write "
                    f"data.raw.qpos[{result.place}] is {result.in_engine:g}",
                    result.in_engine == result.value,
                )
            )
        blocks.append(
            Verdict(
                f"{prefix}the write alone changed {_changed(result)}. The next lesson is about "
                "that",
                not result.changed,
            )
        )
        blocks.append(
            sentence(
                results,
                name,
                "the next step starts from what you wrote. To see that, the same step is taken "
                f"without the write, too. It finds {count(result.otherwise, 'contact')}; the step "
                f"after the write finds {result.found}. The write changes the speed of "
                f"{result.joint} after the step by {position(result.felt, result.slide, 1)}/s.",
            )
        )
    blocks += emulation(results, "stale after a write")
    blocks.append(
        Table(
            ("you type", "and read"),
            first.refused,
            title="What is refused",
            words=frozenset({0, 1}),
        )
    )
    return page_of("Writing into the state", results, blocks)


def _changed(result: Write) -> str:
    return ", ".join(result.changed) or "no derived array"
