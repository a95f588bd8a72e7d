"""The page of the lesson on gravity: the course of a joint, and who holds it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...measures.text import signed
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, emulated, where
from ...show.labels import TableLabels
from ...show.templates import PageContent
from ._falling import CONTACT, EQUALITY, Droop, Forces, course_table
from .frame import LessonFrame
from .gravity import GravityResult

if TYPE_CHECKING:
    from ...engines.records import UncommandedJoint
    from ._as_it_comes import OwnMotors
    from ._longer_fall import Catch

_OURS = ("position servo", "joint damping", "dry friction", "joint limits", "forces by part")
_SAY = TableLabels(__name__, "gravity_labels.md.j2")


@dataclass(frozen=True)
class GravityPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        course: Where the joint is at some moments.
        forces: The forces on it at the end.
        alone: The joint on each engine as it comes, where that differs from the contract.
        own_motors: The joint under the engine's own motors; None where these do not hold it.
        flailing: The joint without them if it swings to and fro, else None.
        catch: What catches the joint in the longer runs; None where nothing does.
        long_course: The longer runs.
        differences: How far the engines are from each other.
    """

    template = "gravity.md.j2"
    lesson: LessonFrame
    result: GravityResult
    course: Table
    forces: Table
    alone: Sequence[Table]
    own_motors: OwnMotors | None
    flailing: UncommandedJoint | None
    catch: Catch | None
    long_course: Sequence[Block]
    differences: Sequence[Table]

    @property
    def seconds(self) -> float:
        """Return the simulated time of both runs [s]."""
        return float(self.result.servos_on.time[-1])

    @property
    def held_at(self) -> float:
        """Return where the joint is at the end with the servos on [rad or m]."""
        return float(self.result.servos_on.position[-1])

    @property
    def right(self) -> int:
        """Return the number of the right choice: fallen, exactly at zero, or sagged."""
        sagged = abs(self.held_at)
        if sagged >= np.radians(1):
            return 0
        return 1 if sagged == 0 else 2

    @property
    def ctrl_untouched(self) -> bool:
        """Tell whether ctrl is at the end of both runs what it was at the start."""
        return self.result.servos_on.ctrl_untouched and self.result.servos_off.ctrl_untouched

    @property
    def forces_told(self) -> bool:
        """Tell whether the engine tells the forces on the joint."""
        return self.result.servos_on.forces.total is not None

    @property
    def balanced(self) -> bool:
        """Tell whether the forces on the joint sum to zero in both runs, if nothing moves."""
        return self.result.servos_on.balanced and self.result.servos_off.balanced

    @property
    def used(self) -> float | None:
        """Return the part of its limit that the servo exerts; None without a finite limit."""
        force, limit = self.result.servos_on.forces.actuator, self.result.limit
        if force is None or not 0 < limit < np.inf:
            return None
        return abs(force) / limit

    @property
    def caught_now(self) -> bool:
        """Tell whether a contact carries the load with the servos off."""
        return self.result.servos_off.held_by == CONTACT

    @property
    def touching(self) -> str:
        """Return what touches at the end with the servos off, each with the time since when."""
        off = self.result.servos_off
        return ", ".join(f"{pair} since {off.touches[pair]:.3f} s" for pair in off.touching)

    @property
    def emulated(self) -> str:
        """Return what this interface does in place of the engine; "" for nothing."""
        return emulated(self.result, *_OURS)


def contents(results: Results[GravityResult], frame: LessonFrame) -> dict[str, GravityPage]:
    """Return what the page shows of each engine."""
    first = next(iter(results.values()))
    runs: dict[str, Droop] = {}
    long_runs: dict[str, Droop] = {}
    for name, result in results.items():
        prefix = where(results, name)
        runs[f"{prefix}servos on"] = result.servos_on
        runs[f"{prefix}servos off"] = result.servos_off
        for label, long_run in result.longer.items():
            long_runs[f"{prefix}{label}"] = long_run
    course, forces = course_table(runs, first.slide), _forces(runs)
    alone = _alone(results)
    long_course, apart = _long_course(long_runs, first), _differences(results)
    pages: dict[str, GravityPage] = {}
    for name, result in results.items():
        own_motors, flailing = _as_it_comes(result)
        pages[name] = GravityPage(
            lesson=frame,
            result=result,
            course=course,
            forces=forces,
            alone=alone,
            own_motors=own_motors,
            flailing=flailing,
            catch=_catch_of(result),
            long_course=long_course,
            differences=apart,
        )
    return pages


def _alone(results: Results[GravityResult]) -> list[Table]:
    """Show the joint on each engine as it comes, where that differs from the contract."""
    if not any(result.alone for result in results.values()):
        return []
    from ._as_it_comes import uncommanded_tables  # here, for on MuJoCo nothing differs

    return uncommanded_tables(results, _SAY)


def _as_it_comes(result: GravityResult) -> tuple[OwnMotors | None, UncommandedJoint | None]:
    """Return the joint that the engine's own motors hold, and the joint that flails without."""
    if not result.alone:
        return None, None
    from ._as_it_comes import flailing, own_motors  # here, for on MuJoCo nothing differs

    return own_motors(result), flailing(result)


def _differences(results: Results[GravityResult]) -> list[Table]:
    """Compare the runs of each engine with those of the first."""
    if len(results) < 2:
        return []
    from ._fall_differences import fall_differences  # here, for most pages have one engine

    return fall_differences(results, _SAY)


def _catch_of(result: GravityResult) -> Catch | None:
    """Return what catches the joint in the longer runs, if there are any and something does."""
    if not result.longer:
        return None
    from ._longer_fall import catch_of  # here, for most lessons end before it

    return catch_of(result.servos_off, result.longer)


def _forces(runs: Mapping[str, Droop]) -> Table:
    """Show each part of the forces at the end, their sum, and who carries the load."""
    forces = [run.forces for run in runs.values()]
    rows = [_force_row("gravity (−bias)", [_gravity(each) for each in forces])]
    for part in forces[0].parts():
        values = [each.parts()[part] for each in forces]
        if part != EQUALITY or any(values):
            rows.append(_force_row(part, values))
    sums = len(rows)
    rows.append(_force_row("sum", [each.total for each in forces]))
    rows.append(["held by", *(run.held_by for run in runs.values())])
    headers = [name.replace(": ", "\n") for name in runs]
    return Table(("who", *headers), rows, emphasis=frozenset({sums}))


def _force_row(label: str, values: Iterable[float | None]) -> list[str]:
    """Return a row of forces, one for each run."""
    return [label, *(signed(value) for value in values)]


def _gravity(forces: Forces) -> float | None:
    """Return the force of gravity, which has the opposite sign of the bias."""
    return None if forces.bias is None else -forces.bias


def _long_course(runs: Mapping[str, Droop], first: GravityResult) -> list[Block]:
    """Show the longer runs, if there are any."""
    if not runs:
        return []
    from ._longer_fall import long_course  # here, for most lessons end before it

    return long_course(runs, first.joint, first.slide, first.provenance.timestep, _SAY)
