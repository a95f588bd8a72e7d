"""Of which moment are the derived arrays of a Data, and how wrong are they by now?

    print(sm.freshness(model, data))  # a table: each array, of which moment, how far off

A write marks nothing dirty, and a step leaves values of the state before it. Nothing is
recorded on the way, so that who does not ask pays nothing: `freshness` finds out afterwards,
by computing what the derived values would be now in another Data. `watch` counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import closing, nullcontext
from typing import Any, cast

import numpy as np

from ..interface import (
    DERIVED,
    INPUTS,
    POSES,
    Array,
    Contacts,
    Data,
    JointType,
    Model,
    State,
    forward,
    get_state,
    make_data,
    set_state,
)
from ..measures.quantities import Readings, readings
from ..measures.text import count, few, listed, milliseconds
from ..page import Figures
from ..rotations import times
from .stale_rows import Freshness, Row, gaps, same

# The inputs that each is computed from; a write to another is not a reason why it is stale.
DEPEND = dict.fromkeys(DERIVED, INPUTS) | {"contacts": INPUTS}
DEPEND |= dict.fromkeys(POSES, INPUTS[:1])
DEPEND |= dict.fromkeys(("qfrc_bias", "qfrc_passive"), INPUTS[:2])
_ROUNDING = 1e-12  # of poses that are equal but for the order of additions [m, and 1]


def age_from(**known: Any) -> Figures:
    """How old derived values are, as far as it is known.

    Returns:
        steps: Engine steps since; None if that is not known.
        writes: Changes of each input since; None if nobody counted.
        never: Whether nothing was derived since the Data was made, reset or set.
        written: Entries of the inputs that are others now; known only while watching.
        retraced: Bodies that are where one step back has them, within `within` [m, and of
            quaternions 1], where that is how the number of steps was found; unmatched: bodies
            whose poses match neither moment.
    """
    unknown = {"steps": None, "writes": None, "never": False, "within": 0.0}
    return Figures(**unknown | dict.fromkeys(("written", "retraced", "unmatched"), ()) | known)


class Scratch:
    """Another Data of a Model, in which the present of any Data of it is computed."""

    def __init__(self, model: Model) -> None:
        self._model, self._data = model, make_data(model)
        self._now: tuple[State | None, Readings] = None, {}

    def now(self, state: State) -> Readings:
        """All that `forward` would compute in a state."""
        if self._now[0] != state:
            set_state(self._model, self._data, state)
            forward(self._model, self._data)
            self._now = state, readings(self._data, copied=True)
        return self._now[1]

    def one_step_back(self, state: State) -> Array:
        """The poses (nbody, 7) of the bodies in the state that a step led to this one from.

        The engines integrate semi-implicitly: the new velocity moves the old position, and
        moves the new one back. The velocity of that state cannot be found so.
        """
        model, data = self._model, self._data
        set_state(model, data, state)
        data.qpos[:] = back(model, state["qpos"], state["qvel"], engine_step(model))
        forward(model, data)
        return np.hstack((data.xpos, data.xquat))

    def close(self) -> None:
        """Give the Data back."""
        self._data.close()


def row(
    model: Model, name: str, age: Figures, held: Array | Contacts, now: Array | Contacts | None
) -> Row:
    """What is to be told of one array.

    Args:
        model: Of the Data.
        name: Of `DERIVED`, or "contacts".
        age: How old it is, if it is not of now.
        held: What the Data says.
        now: What `forward` would compute; None where the present state is not a state.
    """
    if now is not None and same(held, now):
        return Row(name, True, 0, 0, "now", ())
    off = () if now is None else gaps(model, name, held, now)
    if age.never:
        return Row(name, False, None, None, "never computed", off)
    writes = None if age.writes is None else sum(age.writes[part] for part in DEPEND[name])
    words = [count(age.steps, "substep" if model.substeps > 1 else "step")] if age.steps else []
    words += [count(writes, "write")] if writes else []
    of = f"{listed(words)} ago" if words else "an earlier state"
    return Row(name, False, age.steps, writes, of, off)


def age_of(model: Model, state: State, held: Readings, scratch: Scratch) -> Figures:
    """How old derived values are, from nothing but their values.

    Args:
        model: Of the Data.
        state: What the Data is in now.
        held: What it says.
        scratch: Where other states are tried.
    """
    now = scratch.now(state)
    if all(same(held[name], now[name]) for name in held):
        return age_from(steps=0)
    poses, current = _poses(held), _poses(now)
    if not poses[:, 3:].any():  # a rotation is never zero
        return age_from(never=True)
    lag = np.abs(current - poses).max(axis=1)
    if not lag.any():  # the poses, which alone can be retraced, are of now
        return age_from()
    off = np.abs(scratch.one_step_back(state) - poses).max(axis=1)
    # Nearer than rounding makes them, and much nearer than those of now. One body is enough:
    # what else is not there was written since.
    moved = lag > 0
    there = moved & (off <= _ROUNDING * (1 + np.abs(poses).max())) & (off <= lag / 100)
    if not there.any():
        return age_from()

    def names(chosen: Any) -> tuple[str, ...]:
        return tuple(model.body_names[b] or f"body {b}" for b in np.flatnonzero(chosen).tolist())

    return age_from(
        steps=1,
        retraced=names(there),
        unmatched=names(moved & ~there),
        within=float(off[there].max()),
    )


def back(model: Model, qpos: Array, qvel: Array, seconds: float) -> Array:
    """Positions (nq,) that would move to `qpos` in a time, at the velocities `qvel` (nv,).

    The inverse of `mj_integratePos`: a quaternion turns about an axis of the body.
    """
    earlier = np.array(qpos)
    for joint, kind in enumerate(model.jnt_type.tolist()):
        place, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        if kind in (JointType.HINGE, JointType.SLIDE):
            earlier[place] -= seconds * qvel[dof]
            continue
        if kind == JointType.FREE:
            earlier[place : place + 3] -= seconds * qvel[dof : dof + 3]
            place, dof = place + 3, dof + 3
        spin = qvel[dof : dof + 3]
        speed = float(np.linalg.norm(spin))
        if speed:
            half = -seconds * speed / 2
            turn = np.array([math.cos(half), *(math.sin(half) * spin / speed)])
            earlier[place : place + 4] = times(qpos[place : place + 4], turn)
    return earlier


def _poses(values: Mapping[str, Any]) -> Array:
    return np.hstack([values["xpos"], values["xquat"]])


def engine_step(model: Model) -> float:
    """Simulated time of one step of the engine [s]."""
    return model.timestep / model.substeps


_REMEMBERED = {"contacts", "qacc", "qfrc_constraint", "qfrc_contact"}


def freshness(model: Model, data: Data) -> Freshness:
    """Of which moment is each derived array of `data`, and how wrong is it by now?

    It needs no preparation and changes nothing: what the arrays would be now is computed in
    another Data. An array is of now if `forward` would leave every number of it as it is.
    Otherwise it is one step old if its poses are those of qpos − h·qvel; how many writes ago
    only `watch_freshness` can tell.

    Args:
        model: The Model that made `data`.
        data: Read, and not touched.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: An input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    state = get_state(model, data)
    watch = getattr(type(data), "_watch", None)
    with nullcontext() if watch is None else watch.aside():
        held = readings(data)
    if watch is not None:
        now, age = watch.scratch.now(state), watch.age()
    else:
        with closing(Scratch(model)) as scratch:
            now, age = scratch.now(state), age_of(model, state, held, scratch)
    touching = any(len(cast("Contacts", values["contacts"])) for values in (held, now))
    rows = tuple(row(model, name, age, held[name], now[name]) for name in held)
    return Freshness(
        backend=model.backend,
        engine_version=model.engine_version,
        model=model.path.stem,
        time=state.time,
        rows=rows,
        written=age.written,
        notes=tuple(_notes(model, rows, age, touching)),
    )


def _notes(model: Model, rows: tuple[Row, ...], age: Figures, touching: bool) -> list[str]:
    """What has to be added to the rows: each sentence with what it holds under."""
    behaviours = model.capabilities.behaviours
    stale = {row.name for row in rows if not row.now}
    untold = [name for name in DERIVED if name not in {row.name for row in rows}]
    after_a_step, restore = behaviours["stale after a step"], behaviours["exact restore"]
    unknown = not age.never and age.steps is None
    notes = [f"This backend does not tell: {', '.join(untold)}."] if untold else []
    if not stale:
        return [*notes, "All are of now."]
    sentences = [
        (
            age.retraced,
            f"Found by going back: qpos − h·qvel, h = {milliseconds(engine_step(model))}, gives "
            f"the poses of {few(age.retraced)}, "
            f"{f'to {age.within:.1e} m' if age.within else 'to the bit'}.",
        ),
        (
            age.unmatched,
            f"{few(age.unmatched)} match neither moment: qpos or qvel was written since, or "
            "the engine integrates otherwise.",
        ),
        (
            unknown and stale & set(POSES),
            "Going back one step, to qpos − h·qvel, does not lead to these poses.",
        ),
        (unknown, "Writes are not recorded, unless sm.watch_freshness(model, data) does."),
        (age.written, f"Written since: {', '.join(age.written)}."),
        (after_a_step.support == "unsupported", f"After a step: {after_a_step.note}."),
        (
            touching and not model.capabilities.exact_restore and stale & _REMEMBERED,
            "In contacts, and the forces and accelerations of what touches, not all of the "
            f"difference need be age: {restore.note}.",
        ),
        (True, "sm.forward(model, data) makes all of them of now."),
    ]
    return notes + [text for holds, text in sentences if holds]
