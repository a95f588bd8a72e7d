"""A joint left alone: its way, the forces on it at the end, and who holds it then."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import UnsupportedError
from ..interface import Array, Data, forward
from ..measures.text import NONE, position
from ..page import Figures
from ..runs.drive import steps_in
from ..runs.robot import touching
from ._robot import carried_by_joint, coordinate

BALANCE = 1e-3  # N·m or N; a sum below it is zero
_SHARE = 1e-4  # of the largest part; a sum below it is zero, too
_SLOW = 0.01  # rad/s or m/s; a joint below it is at rest or creeps
_STARTS = 0.02  # rad/s² or m/s²; a joint beyond it is about to move
_AT_REST = 1e-4  # the same; below it nothing of the model moves

# The generalized forces on one joint at one moment [N·m; of a slide, N], by the names of
# `qfrc_…`. "bias" is on the other side of the equation of motion, so that gravity acts as -bias;
# a part that the engine does not yield is None. "total" is what is left over to accelerate the
# joint, zero at rest; None if a part is missing.
Forces = dict[str, float | None]
PARTS = {
    "actuator": "servo",
    "passive": "springs, damping",
    "friction": "dry friction",
    "contact": "contact",
    "limit": "joint limit",
    "equality": "equality",
}


def forces_on(data: Data, dof: int) -> Forces:
    """Forces on a degree of freedom, of the moment that `data`'s derived arrays show."""
    forces: Forces = {}
    for name in ("bias", *PARTS):
        try:
            forces[name] = float(getattr(data, f"qfrc_{name}")[dof])
        except UnsupportedError:
            forces[name] = None
    return summed(forces)


def summed(forces: Mapping[str, float | None]) -> Forces:
    """The parts, and their "total"."""
    parts, bias = [forces[name] for name in PARTS], forces["bias"]
    known = [part for part in parts if part is not None]
    total = None if bias is None or len(known) < len(parts) else sum(known) - bias
    return {**forces, "total": total}


class Droop(Figures):
    """One run from the default pose under an untouched ctrl.

    Attributes:
        time: (n,) moments [s]; position: (n,) of the joint then [rad; of a slide, m]; NaN after
            the engine diverged.
        path: (steps + 1,) its position after each step.
        diverged: When the engine gave up [s]; None if it did not. The rest is of the end, and
            says nothing if it did.
        qpos: (nq,) of the model.
        forces: On the joint, after `forward`.
        velocity, acceleration: Of the joint [rad/s, rad/s²; or with m].
        most_acceleration: The largest of the whole model [rad/s² or m/s²].
        touches: When each contact of what the joint carries was first found [s]; the longer
            runs look at their end only.
        touching: Those that are there at the end.
        ctrl_untouched: Whether ctrl still is what it was at the start.
    """

    def at(self, row: int, slide: bool, decimals: int = 2) -> str:
        """A position of the joint as text; a slower engine's run may be shorter."""
        if row >= len(self.position):
            return NONE
        value = float(self.position[row])
        return "diverged" if np.isnan(value) else position(value, slide, decimals)

    @property
    def moves(self) -> bool:
        """Whether the joint moves at the end, or is about to."""
        return abs(self.velocity) > _SLOW or abs(self.acceleration) > _STARTS

    @property
    def balanced(self) -> bool:
        """Whether the forces on the joint sum to zero, if nothing of the model moves."""
        total = self.forces["total"]
        if self.moves or total is None or self.most_acceleration > _AT_REST:
            return True
        largest_part = max(abs(part or 0.0) for part in self.forces.values())
        return abs(total) <= max(BALANCE, _SHARE * largest_part)

    @property
    def held_by(self) -> str:
        """The part that carries most of the load at the end."""
        load = self.forces["bias"]
        if self.moves:
            return "still moves"
        if load is None or self.forces["total"] is None:
            return NONE
        if abs(load) < BALANCE:
            return "no load"
        against = {name: (self.forces[name] or 0.0) * load for name in PARTS}
        part = max(against, key=lambda name: against[name])
        return PARTS[part] if against[part] > 0 else "nothing"


# The rest of a run that ended so.
_DIVERGED: dict[str, Any] = {
    **{"qpos": None, "forces": {}, "touches": {}, "touching": (), "ctrl_untouched": True},
    **dict.fromkeys(("velocity", "acceleration", "most_acceleration"), np.nan),
}


def droop(
    data: Data,
    joint: str,
    seconds: float,
    ctrl: Array,
    path: Array,
    touches: Iterable[tuple[float, Sequence[str]]] = (),
    diverged: float | None = None,
) -> Droop:
    """What a run came to.

    Args:
        data: As it was left.
        joint: That is watched.
        seconds: How long the run was to be.
        ctrl: (nu,) at its start.
        path: (steps + 1,) positions of the joint.
        touches: What of the bodies that it carries touched what, and when [s].
        diverged: When the engine gave up [s].
    """
    model, dof = data.model, coordinate(data.model, joint).dof
    time = np.array(milestones(steps_in(model, seconds) * model.timestep))
    rows = np.rint(time / model.timestep).astype(int)
    position = np.full(len(time), np.nan)
    position[rows < len(path)] = path[rows[rows < len(path)]]
    ways = {"time": time, "position": position, "path": path, "diverged": diverged}
    if diverged is not None:
        return Droop(**ways, **_DIVERGED)
    forward(model, data)
    pairs_at_end = touching(model, data.contacts, carried_by_joint(model, joint))
    first: dict[str, float] = {}
    for moment, pairs in (*touches, (data.time, pairs_at_end)):
        first |= {pair: moment for pair in pairs if pair not in first}
    return Droop(
        **ways,
        qpos=data.qpos.copy(),
        forces=forces_on(data, dof),
        velocity=float(data.qvel[dof]),
        acceleration=float(data.qacc[dof]),
        most_acceleration=float(np.abs(data.qacc).max()),
        touches=first,
        touching=pairs_at_end,
        ctrl_untouched=np.array_equal(data.ctrl, ctrl),
    )


def milestones(seconds: float) -> list[float]:
    """Times worth a row of a table: 0, 1, 2, 3, 4, 10, 20, 30, 50, 100 …, and the end."""
    later = (part * 10.0**decade for decade in range(1, 8) for part in (1, 2, 3, 5))
    marks = (0.0, 1.0, 2.0, 3.0, 4.0, *later)
    return [mark for mark in marks if mark < seconds * (1 - 1e-9)] + [seconds]
