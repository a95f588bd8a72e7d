"""A joint left alone: its way, the forces on it at the end, and who holds it then."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np

from ...errors import UnsupportedError
from ...interface import Array, Data, forward
from ...lab.runs.drive import number_of_steps
from ...lab.runs.robot import carried_by_joint, contact_names
from ...measures.text import NO_NUMBER, position
from ...show.blocks import Table
from ._robot import coordinate

BALANCE = 1e-3  # N·m or N; a sum below it is zero
_SHARE = 1e-4  # of the largest part; a sum below it is zero, too
_SLOW = 0.01  # rad/s or m/s; a joint below it is at rest or creeps
_STARTS = 0.02  # rad/s² or m/s²; a joint beyond it is about to move
_AT_REST = 1e-4  # the same; below it nothing of the model moves

SERVO, CONTACT, EQUALITY = "servo", "contact", "equality"  # parts, as a page calls them


@dataclass(frozen=True)
class Forces:
    """The generalized forces on one joint at one moment [N·m; of a slide, N].

    They have the names of `qfrc_…`. A part that the engine does not yield is None.

    Attributes:
        bias: Gravity and Coriolis forces. It is on the other side of the equation of motion, so
            that gravity acts as -bias.
        actuator: Of the servo.
        passive: Of springs and damping.
        friction: Of dry friction.
        contact: Of contacts.
        limit: Of the joint's limit.
        equality: Of equality constraints.
    """

    bias: float | None = None
    actuator: float | None = None
    passive: float | None = None
    friction: float | None = None
    contact: float | None = None
    limit: float | None = None
    equality: float | None = None

    def parts(self) -> dict[str, float | None]:
        """Return all but the bias, by what a page calls them."""
        return {
            SERVO: self.actuator,
            "springs, damping": self.passive,
            "dry friction": self.friction,
            CONTACT: self.contact,
            "joint limit": self.limit,
            EQUALITY: self.equality,
        }

    @property
    def total(self) -> float | None:
        """Return what is left to accelerate the joint: zero at rest, None if a part is missing."""
        parts = [part for part in self.parts().values() if part is not None]
        if self.bias is None or len(parts) < len(self.parts()):
            return None
        return sum(parts) - self.bias


def forces_on(data: Data, dof: int) -> Forces:
    """Read the forces on a degree of freedom, of the moment that the derived arrays show."""
    forces: dict[str, float | None] = {}
    for part in fields(Forces):
        try:
            forces[part.name] = float(getattr(data, f"qfrc_{part.name}")[dof])
        except UnsupportedError:
            forces[part.name] = None
    return Forces(**forces)


@dataclass(frozen=True)
class Droop:
    """One run from the default pose under an untouched ctrl.

    Of a run that the engine gave up there are only the first four; the rest is of the end.

    Attributes:
        time: (n,) moments [s].
        position: (n,) of the joint then [rad; of a slide, m]; NaN after the engine diverged.
        path: (steps + 1,) its position after each step.
        diverged: When the engine gave up [s]; None if it did not.
        qpos: (nq,) of the model.
        forces: On the joint, after `forward`.
        velocity: Of the joint [rad/s or m/s].
        acceleration: Of the joint [rad/s² or m/s²].
        most_acceleration: The largest of the whole model [rad/s² or m/s²].
        touches: When each contact of what the joint carries was first found [s]; the longer
            runs look at their end only.
        touching: Those that are there at the end.
        ctrl_untouched: Whether ctrl still is what it was at the start.
    """

    time: Array
    position: Array
    path: Array
    diverged: float | None = None
    qpos: Array | None = None
    forces: Forces = Forces()
    velocity: float = np.nan
    acceleration: float = np.nan
    most_acceleration: float = np.nan
    touches: dict[str, float] = field(default_factory=dict[str, float])
    touching: Sequence[str] = ()
    ctrl_untouched: bool = True

    def at(self, row: int, slide: bool, decimals: int = 2) -> str:
        """Return a position of the joint as text; a slower engine's run may be shorter."""
        if row >= len(self.position):
            return NO_NUMBER
        value = float(self.position[row])
        return "diverged" if np.isnan(value) else position(value, slide, decimals)

    @property
    def moves(self) -> bool:
        """Tell whether the joint moves at the end, or is about to."""
        return abs(self.velocity) > _SLOW or abs(self.acceleration) > _STARTS

    @property
    def balanced(self) -> bool:
        """Tell whether the forces on the joint sum to zero, if nothing of the model moves."""
        total, bias = self.forces.total, self.forces.bias
        if self.moves or total is None or self.most_acceleration > _AT_REST:
            return True
        parts = [total, bias, *self.forces.parts().values()]
        largest_part = max(abs(part) for part in parts if part is not None)
        return abs(total) <= max(BALANCE, _SHARE * largest_part)

    @property
    def held_by(self) -> str:
        """Return the part that carries most of the load at the end."""
        load = self.forces.bias
        if self.moves:
            return "still moves"
        if load is None or self.forces.total is None:
            return NO_NUMBER
        if abs(load) < BALANCE:
            return "no load"
        against = {
            name: part * load for name, part in self.forces.parts().items() if part is not None
        }
        strongest = max(against, key=lambda name: against[name])
        return strongest if against[strongest] > 0 else "nothing"


def droop(
    data: Data,
    joint: str,
    seconds: float,
    ctrl: Array,
    path: Array,
    touches: Iterable[tuple[float, Sequence[str]]] = (),
    diverged: float | None = None,
) -> Droop:
    """Summarize a run.

    Args:
        data: As the run left it.
        joint: That is watched.
        seconds: How long the run was to be.
        ctrl: (nu,) at its start.
        path: (steps + 1,) positions of the joint.
        touches: What of the bodies that it carries touched what, and when [s].
        diverged: When the engine gave up [s].
    """
    model, dof = data.model, coordinate(data.model, joint).dof
    time = np.array(milestones(number_of_steps(model, seconds) * model.timestep))
    rows = np.rint(time / model.timestep).astype(int)
    position = np.full(len(time), np.nan)
    position[rows < len(path)] = path[rows[rows < len(path)]]
    run = Droop(time, position, path, diverged)
    if diverged is not None:
        return run
    forward(model, data)
    pairs_at_end = contact_names(model, data.contacts, carried_by_joint(model, joint))
    first: dict[str, float] = {}
    for moment, pairs in (*touches, (data.time, pairs_at_end)):
        for pair in pairs:
            first.setdefault(pair, moment)
    return replace(
        _with_dynamics(run, data, dof),
        qpos=data.qpos.copy(),
        touches=first,
        touching=pairs_at_end,
        ctrl_untouched=np.array_equal(data.ctrl, ctrl),
    )


def _with_dynamics(run: Droop, data: Data, dof: int) -> Droop:
    """Add the forces on the joint at the end of a run, and how it moves there."""
    return replace(
        run,
        forces=forces_on(data, dof),
        velocity=float(data.qvel[dof]),
        acceleration=float(data.qacc[dof]),
        most_acceleration=float(np.abs(data.qacc).max()),
    )


def milestones(seconds: float) -> list[float]:
    """Return times worth a row of a table: 0, 1, 2, 3, 4, 10, 20, 30, 50, 100 …, and the end."""
    later = (part * 10.0**decade for decade in range(1, 8) for part in (1, 2, 3, 5))
    marks = (0.0, 1.0, 2.0, 3.0, 4.0, *later)
    return [mark for mark in marks if mark < seconds * (1 - 1e-9)] + [seconds]


def course_table(runs: Mapping[str, Droop], slide: bool, title: str = "") -> Table:
    """Show where the joint is at some moments of each run."""
    times = max((run.time for run in runs.values()), key=len)
    rows: list[tuple[str, ...]] = []
    for k, time in enumerate(times):
        cells = [
            run.at(k, slide, decimals=3 if name.endswith("on") else 2) for name, run in runs.items()
        ]
        rows.append((f"{time:.2f} s", *cells))
    headers = [name.replace(": ", "\n") for name in runs]
    return Table(("time", *headers), rows, title)
