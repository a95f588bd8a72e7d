"""What the numbers of a recording were taken to mean, as blocks of a page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import NO_NUMBER, degrees, fixed, grouped, significant
from ...show.blocks import Block, Table
from ...show.templates import PageContent, render_blocks
from ..recordings.arm_recording import ArmRecording
from ..recordings.joint_units import JointUnit, Unit, UnitSource
from ..recordings.robot_types import is_so_arm

_WIDTHS: dict[Unit, float] = {"degrees": 360.0, "-100 to 100": 200.0, "0 to 100": 100.0}
_SAME_ZERO = math.radians(0.05)  # what rounds to 0.0°


@dataclass(frozen=True)
class _UnitGroup:
    """Joints whose numbers are in one unit, which was taken from one source.

    Attributes:
        units: One for each of them.
    """

    units: Sequence[JointUnit]

    @property
    def unit(self) -> Unit:
        """Return the unit."""
        return self.units[0].unit

    @property
    def source(self) -> UnitSource:
        """Return what unit and scale were taken from."""
        return self.units[0].source

    @property
    def joints(self) -> list[str]:
        """Return the names of the joints."""
        return [unit.joint for unit in self.units]

    @property
    def spans(self) -> list[str]:
        """Return the least and the largest angle between the ends of the unit; one if equal."""
        spans = [abs(unit.radians) * _WIDTHS[unit.unit] for unit in self.units]
        return _ends([degrees(span, 0) for span in (min(spans), max(spans))])

    @property
    def zeros(self) -> list[str]:
        """Return between which angles of the model's joints 0 is; empty where it is their 0."""
        zeros = [unit.zero for unit in self.units]
        if max(map(abs, zeros)) < _SAME_ZERO:
            return []
        return _ends([degrees(zero, 1) for zero in (min(zeros), max(zeros))])


def _ends(texts: list[str]) -> list[str]:
    """Return two ends, once where they are the same."""
    return list(dict.fromkeys(texts))


@dataclass(frozen=True)
class UnitsPart(PageContent):
    """What the numbers of a recording were taken to mean.

    Attributes:
        units: One for each joint.
        has_table: Whether each joint has a row.
    """

    template = "recording_units.md.j2"
    units: Sequence[JointUnit]
    has_table: bool

    @property
    def groups(self) -> list[_UnitGroup]:
        """Return the joints whose numbers are in one unit, group by group."""
        by_unit = grouped(((unit.unit, unit.source), unit) for unit in self.units)
        return [_UnitGroup(units) for units in by_unit.values()]

    @property
    def joints(self) -> Table:
        """Return a table with a row for each joint."""
        headers = ("joint", "unit", "1 is", "0 is at", "counts", "step", "taken from")
        return Table(headers, [_row_of(unit) for unit in self.units], words=frozenset({0, 1, 6}))


def other_robot(recording: ArmRecording) -> str:
    """Return the robot of a recording; "" for an SO-100 or SO-101, and where it does not say."""
    return "" if is_so_arm(recording.robot) else recording.robot


def _row_of(unit: JointUnit) -> tuple[str, ...]:
    """Return what the numbers of a joint mean, in one row."""
    counts = NO_NUMBER if unit.counts is None else fixed(unit.counts, 0)
    quantum = NO_NUMBER if unit.quantum is None else significant(unit.quantum, 3)
    one, zero = degrees(unit.radians, 3), degrees(unit.zero, 1)
    return unit.joint, unit.unit, one, zero, counts, quantum, unit.source


def units_blocks(units: Sequence[JointUnit], details: bool) -> list[Block]:
    """Return what the numbers of a recording were taken to mean.

    Args:
        units: One for each joint.
        details: Whether each joint has a row, or joints of one unit a line.
    """
    return render_blocks(UnitsPart(units, details))
