"""How old derived values are, found out from nothing but their values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Array, JointType, Model, State, forward, make_data, set_state
from ..measures.quantities import Readings, derived_arrays
from ..rotations import times
from .gaps import same


@dataclass(frozen=True)
class Age:
    """How old derived values are, as far as it is known.

    Attributes:
        steps: Engine steps since; None if that is not known.
        writes: Changes of each input since; None if nobody counted.
        never: Whether nothing was derived since the Data was made, reset or set.
        written: Entries of the inputs that are others now; known only while watching.
        retraced: Bodies that are where one step back has them, where that is how the number of
            steps was found.
        unmatched: Bodies whose poses match neither moment.
        within: How far those of `retraced` are from there at most [m, and of quaternions 1].
    """

    steps: int | None = None
    writes: Mapping[str, int] | None = None
    never: bool = False
    written: tuple[str, ...] = ()
    retraced: tuple[str, ...] = ()
    unmatched: tuple[str, ...] = ()
    within: float = 0.0


class Scratch:
    """Another Data of a Model, in which the present of any Data of it is computed."""

    def __init__(self, model: Model) -> None:
        self._model, self._data = model, make_data(model)
        self._now: tuple[State | None, Readings] = None, {}

    def now(self, state: State) -> Readings:
        """Return all that `forward` would compute in a state."""
        if self._now[0] != state:
            set_state(self._model, self._data, state)
            forward(self._model, self._data)
            self._now = state, derived_arrays(self._data, copied=True)
        return self._now[1]

    def one_step_back(self, state: State) -> Array:
        """Return the poses (nbody, 7) of the bodies in the state from which a step led to this one.

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


def age_of(model: Model, state: State, held: Readings, scratch: Scratch) -> Age:
    """Find out how old derived values are, from nothing but their values.

    Args:
        model: Of the Data.
        state: What the Data is in now.
        held: What it says.
        scratch: Where other states are tried.
    """
    now = scratch.now(state)
    if all(same(held[name], now[name]) for name in held):
        return Age(steps=0)
    poses, current = _poses(held), _poses(now)
    if not poses[:, 3:].any():  # a rotation is never zero
        return Age(never=True)
    lag = np.abs(current - poses).max(axis=1)
    if not lag.any():  # the poses, which alone can be retraced, are of now
        return Age()
    off = np.abs(scratch.one_step_back(state) - poses).max(axis=1)
    # Nearer than rounding makes them, and much nearer than those of now. One body is enough:
    # what else is not there was written since.
    moved = lag > 0
    rounding = model.capabilities.rounding
    there = moved & (off <= rounding * (1 + np.abs(poses).max())) & (off <= lag / 100)
    if not there.any():
        return Age()

    def names(chosen: Any) -> tuple[str, ...]:
        return tuple(model.body_names[b] or f"body {b}" for b in np.flatnonzero(chosen).tolist())

    return Age(
        steps=1,
        retraced=names(there),
        unmatched=names(moved & ~there),
        within=float(off[there].max()),
    )


def back(model: Model, qpos: Array, qvel: Array, seconds: float) -> Array:
    """Return the positions (nq,) that would move to `qpos` in a time, at the velocities `qvel`
    (nv,).

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
    """Return the simulated time of one step of the engine [s]."""
    return model.timestep / model.substeps
