"""A joint left alone: its way, the forces on it at the end, and what catches it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..engines.records import LeftAlone
from ..errors import UnsupportedError
from ..interface import Array, Data, forward
from ..measures.text import NONE, apart, position
from ..page import Table, Text, Traces, Verdict
from ..runs.drive import Progress, steps_in
from ..runs.provenance import Provenance
from ..runs.robot import carried_by, dofs_of, touching
from ._robot import coordinate
from ._words import where

BALANCE = 1e-3  # N·m or N; a sum below it is zero
_CREEP = 0.05  # of the way; a joint that goes on by more has not settled
_FURTHER = 0.02  # rad or m; less is not worth a cause


# The generalized forces on one joint at one moment [N·m; of a slide, N], by the names of
# `qfrc_…`. "bias" is on the other side of the equation of motion, so that gravity acts as -bias;
# a part that the engine does not yield is None. "total" is what is left over to accelerate the
# joint, zero at rest; None if a part is missing.
Forces = dict[str, float | None]
_PARTS = ("actuator", "passive", "friction", "contact", "limit", "equality")


def forces_on(data: Data, dof: int) -> Forces:
    """Forces on a degree of freedom, of the moment that `data`'s derived arrays show."""
    forces: Forces = {}
    for name in ("bias", *_PARTS):
        try:
            forces[name] = float(getattr(data, f"qfrc_{name}")[dof])
        except UnsupportedError:
            forces[name] = None
    return summed(forces)


def summed(forces: Mapping[str, float | None]) -> Forces:
    """The parts, and their "total"."""
    known = [part for name in _PARTS if (part := forces[name]) is not None]
    bias = forces["bias"]
    if bias is None or len(known) < len(_PARTS):
        return {**forces, "total": None}
    return {**forces, "total": sum(known) - bias}


@dataclass(frozen=True, eq=False)
class Droop:
    """One run from the default pose under an untouched ctrl.

    Attributes:
        time: (n,) moments [s]; position: (n,) of the joint then [rad; of a slide, m].
        path: (steps + 1,) its position after each step.
        qpos: (nq,) at the end.
        forces: On the joint at the end, after `forward`.
        velocity, acceleration: Of the joint at the end [rad/s, rad/s²; or with m].
        touches: When each contact of what the joint carries was first found [s]; the longer
            runs look at their end only.
        touching: Those that are there at the end.
        ctrl_is_zero: Whether ctrl still is, at the end.
        others: Of the other joints of the same robot the fastest [rad/s or m/s], and the largest
            acceleration [rad/s² or m/s²] at the end: while they move, no joint is in balance.
        diverged: When the engine gave up [s]; what would have been later is NaN. None if it
            did not.
    """

    time: Array
    position: Array
    path: Array
    qpos: Array
    forces: Forces
    velocity: float
    acceleration: float
    touches: dict[str, float]
    touching: tuple[str, ...]
    ctrl_is_zero: bool
    others: tuple[float, float]
    diverged: float | None = None

    def at(self, row: int, slide: bool, decimals: int = 2) -> str:
        """A position of the joint as text; a slower engine's run may be shorter."""
        if row >= len(self.position):
            return NONE
        value = float(self.position[row])
        return "diverged" if np.isnan(value) else position(value, slide, decimals)


@dataclass(frozen=True, eq=False)
class Gravity:
    """The same run with the actuators on and off.

    Attributes:
        joint: The joint that was watched; slide: whether it is one, and no hinge. Of a free
            body it is the height.
        servo: Whether a position servo drives it.
        drives: What the model has: "servos", "actuators" without any servo, or "".
        keyframe: Where both runs start; None for the default state.
        longer: The actuators off for longer, under the names "floor" (with contacts) and
            "no floor" (nothing can touch anything); without a floor in the scene under
            "contacts" and "no contacts".
        alone: The joint on the engine as it comes, where that differs from the contract.
    """

    joint: str
    slide: bool
    servo: bool
    drives: str
    keyframe: str | None
    servos_on: Droop
    servos_off: Droop
    longer: dict[str, Droop]
    alone: tuple[LeftAlone, ...]
    provenance: Provenance

    def runs(self) -> dict[str, Droop]:
        """Both runs by what is on; one where there is nothing to switch off."""
        if not self.drives:
            return {"nothing is driven": self.servos_off}
        return {f"{self.drives} on": self.servos_on, f"{self.drives} off": self.servos_off}

    def off(self) -> str:
        """What is said of the longer runs."""
        return f"{self.drives} off" if self.drives else "nothing is driven"


class Falling:
    """A joint of a Data that is stepped, noted after each step."""

    def __init__(self, data: Data, joint: str, seconds: float, progress: Progress) -> None:
        model = self._model = data.model
        self._data, self._progress = data, progress
        at = coordinate(model, joint)
        self._place, self._dof = at.place, at.dof
        self._bodies = carried_by(model, [int(model.jnt_bodyid[model.joint_id(joint)])])
        self._total = steps_in(model, seconds)
        marks = milestones(self._total * model.timestep)
        self._marks = [round(mark / model.timestep) for mark in marks]
        self._times: list[float] = []
        self._path: list[float] = []
        self._touches: dict[str, float] = {}
        self._look()

    def note(self, contacts: bool) -> None:
        """A step is over; `contacts`: whether to look at them, too."""
        if contacts:  # those of a step are of the state that it started from
            for touch in touching(self._model, self._data.contacts, self._bodies):
                self._touches.setdefault(touch, self._times[-1])
        self._look()

    def end(self) -> Droop:
        """Look at the state after the last step."""
        model, data = self._model, self._data
        forward(model, data)
        at_end = touching(model, data.contacts, self._bodies)
        for touch in at_end:
            self._touches.setdefault(touch, data.time)
        return Droop(
            others=self._others(),
            time=np.array(self._times)[self._marks],
            position=np.array(self._path)[self._marks],
            path=np.array(self._path),
            qpos=data.qpos.copy(),
            forces=forces_on(data, self._dof),
            velocity=float(data.qvel[self._dof]),
            acceleration=float(data.qacc[self._dof]),
            touches=self._touches,
            touching=at_end,
            ctrl_is_zero=not data.ctrl.any(),
        )

    def gave_up(self, time: float) -> Droop:
        """The run until the engine diverged; the rows after that are NaN."""
        marks = np.array(milestones(self._total * self._model.timestep))
        where = np.full(len(marks), np.nan)
        reached = [mark for mark in self._marks if mark < len(self._path)]
        where[: len(reached)] = np.array(self._path)[reached]
        none = float("nan")
        return Droop(
            time=marks,
            position=where,
            path=np.array(self._path),
            qpos=np.full(self._model.nq, np.nan),
            forces=dict.fromkeys(("bias", *_PARTS, "total")),
            velocity=none,
            acceleration=none,
            touches=self._touches,
            touching=(),
            ctrl_is_zero=False,
            others=(none, none),
            diverged=time,
        )

    def _others(self) -> tuple[float, float]:
        """The largest speed and acceleration of the other joints of this robot."""
        model, data = self._model, self._data
        root = min(self._bodies)
        while model.body_parentid[root]:
            root = int(model.body_parentid[root])
        mine = [dof for dof in dofs_of(model, carried_by(model, [root])) if dof != self._dof]
        speeds, pushes = np.abs(data.qvel[mine]), np.abs(data.qacc[mine])
        return float(speeds.max(initial=0.0)), float(pushes.max(initial=0.0))

    def _look(self) -> None:
        if len(self._path) % 1000 == 0:
            self._progress(len(self._path) / self._total)
        self._times.append(self._data.time)
        self._path.append(float(self._data.qpos[self._place]))


def milestones(seconds: float) -> list[float]:
    """Times worth a row of a table: 0, 1, 2, 3, 4, 10, 20, 30, 50, 100 …, and the end."""
    marks: list[float] = [0.0, 1.0, 2.0, 3.0, 4.0]
    decade = 10.0
    while decade <= seconds:
        marks += [decade, 2 * decade, 3 * decade, 5 * decade]
        decade *= 10
    return [mark for mark in marks if mark < seconds * (1 - 1e-9)] + [seconds]


def longer(results: Mapping[str, Gravity]) -> list[Any]:
    """What catches the falling joint: with and without a floor, and for longer."""
    columns = {
        f"{where(results, name)}{label}": run
        for name, result in results.items()
        for label, run in result.longer.items()
    }
    if not columns:
        return []
    first = next(iter(results.values()))
    times = max((run.time for run in columns.values()), key=len)
    what = f"with the {first.drives} off" if first.drives else "of the same"
    caught = "What caught it? " if first.servos_off.touching else ""
    several = (
        f"{caught}Here are two longer runs {what}: one as before, and one with contacts switched "
        "off."
    )
    blocks: list[Any] = [
        Text(several if len(first.longer) > 1 else f"Here is a longer run {what}."),
        Table(
            ("time", *(name.replace(": ", "\n") for name in columns)),
            [
                (f"{time:.2f} s", *(run.at(k, first.slide) for run in columns.values()))
                for k, time in enumerate(times)
            ],
            title=f"{first.joint}, {first.off()}, for longer",
        ),
    ]
    for name, run in columns.items():
        if run.diverged is not None:
            blocks.append(Text(f"{name}: diverged at {run.diverged:.3f} s."))
    for name, result in results.items():
        prefix = where(results, name)
        runs = list(result.longer.values())
        ended = any(run.diverged is not None for run in runs)
        if len(runs) > 1 and not ended and result.servos_off.touching:
            blocks.append(_caught(prefix, result, *runs))
    blocks.append(
        Traces(
            f"{first.joint} with the {first.drives} off" if first.drives else first.joint,
            "time [s]",
            "m" if first.slide else "angle [°]",
            {
                name: (
                    (np.arange(len(run.path)) * first.provenance.timestep)[::20].tolist(),
                    (run.path if first.slide else np.degrees(run.path))[::20].tolist(),
                )
                for name, run in columns.items()
            },
        )
    )
    return blocks


def longer_apart(results: Mapping[str, Gravity]) -> list[tuple[str, Any]]:
    """Rows of the differences: the ends of the longer runs, as far as all of them go."""
    first = next(iter(results.values()))
    rows = []
    for label in first.longer:
        runs = [each.longer[label] for each in results.values() if label in each.longer]
        last = min(len(run.position) for run in runs) - 1
        rows.append(
            (
                f"{first.off()}, {label}, at {first.longer[label].time[last]:g} s",
                partial(_gap, label, last),
            )
        )
    return rows


def _gap(label: str, row: int, one: Gravity, two: Gravity) -> str:
    if label not in one.longer or label not in two.longer:
        return NONE
    ends = [each.longer[label].position[row] for each in (one, two)]
    if not np.isfinite(ends).all():
        return "one diverged"
    return apart(abs(float(ends[0] - ends[1])), one.slide)


def _caught(prefix: str, result: Gravity, floor: Droop, free: Droop) -> Text | Verdict:
    """Whether it is the contact that catches the joint, and whether it stays there."""
    slide, end = result.slide, float(floor.time[-1])
    short = float(result.servos_off.time[-1])
    then, alone = float(result.servos_off.position[-1]), float(free.position[-1])
    further = alone * np.sign(then) - abs(then)
    if further < max(_FURTHER, abs(then) * _CREEP):
        return Text(
            f"{prefix}without contacts {result.joint} goes no further that way: it ends at "
            f"{position(alone, slide)}."
        )
    text = (
        f"{prefix}it is the contact that catches {result.joint}, not damping or friction: without "
        f"contacts it runs on to {position(alone, slide)}"
    )
    if (limit := abs(free.forces["limit"] or 0.0)) > BALANCE:
        text += f", where its limit stops it with {limit:.4f} {'N' if slide else 'N·m'}"
    if abs(float(floor.position[-1]) - then) > abs(then) * _CREEP:
        text += (
            f". And it does not stay where it was caught: at {short:g} s it is at "
            f"{position(then, slide)}, at {end:g} s at {position(floor.position[-1], slide)}"
        )
    return Verdict(text, True)
