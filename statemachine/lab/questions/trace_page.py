"""The page of one trace: what was done on what, and every column with its range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import JointType
from ...measures.text import figure, short_time, versions_of
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from ..recordings import COLUMNS, Header, Trace
from .sides_page import facts_of


@dataclass(frozen=True)
class TracePage(PageContent):
    """What the page of a trace shows.

    Attributes:
        name: Of its file.
        header: Of the trace.
        facts: Table of what it is of.
        columns: Table with a row for each column.
        touches: Table of which bodies touch.
        nothing_touches: Whether contacts were recorded, and there is none.
    """

    template = "trace.md.j2"
    name: str
    header: Header
    facts: Table
    columns: Table
    touches: Table
    nothing_touches: bool


def trace_page(trace: Trace, name: str) -> Page:
    """Return the page of a trace.

    Args:
        trace: The trace.
        name: Of its file.
    """
    touches = _touches_table(trace)
    nothing_touches = "contact_row" in trace and not touches.rows
    return render(
        TracePage(
            name, trace.header, _facts_table(trace), _columns_table(trace), touches, nothing_touches
        )
    )


def _facts_table(trace: Trace) -> Table:
    """Return what the trace is of, without what there is nothing to say of."""
    header = trace.header
    facts = {
        "experiment": header.experiment,
        "engine": header.label,
        "time": f"{trace.time[0]:g} to {trace.time[-1]:g} s, {len(trace)} rows",
        "versions": versions_of(header.provenance.versions),
    }
    facts |= facts_of(header)
    if header.rewritten:
        facts["rewritten"] = f"the controller wrote into the state in {header.rewritten} rows"
    facts["ended"] = header.ended
    known = [fact for fact in facts.items() if fact[1]]
    return Table(("what", "is"), known, "What it is of", words=frozenset({0, 1}))


def _columns_table(trace: Trace) -> Table:
    """Return the range of each column."""
    rows: list[tuple[str, str, str, str, str]] = []
    for column in COLUMNS:
        if column not in trace:
            continue
        array = trace[column]
        shape = " × ".join(str(length) for length in array.shape)
        unit = unit_of(trace.header, column)
        if array.size and np.isfinite(array).any():
            least, most = float(np.nanmin(array)), float(np.nanmax(array))
            rows.append((column, shape, unit, figure(least), figure(most)))
        else:
            rows.append((column, shape, unit, "not told" if array.size else "", ""))
    headers = ("column", "shape", "unit", "smallest", "largest")
    return Table(headers, rows, "What is in it", words=frozenset({0, 2}))


# Units of columns that do not depend on the joints; rotations have none.
_UNITS = {"time": "s", "mocap_pos": "m", "xpos": "m", "site_xpos": "m", "energy": "J"}
# Those of a coordinate that turns, and of one that slides.
_OF_COORDINATES = {"qpos": ("rad", "m"), "qvel": ("rad/s", "m/s"), "qfrc": ("N·m", "N")}


def unit_of(header: Header, column: str) -> str:
    """Return the unit of a column, or the units where coordinates turn and slide; "" for none.

    Args:
        header: Of the trace.
        column: Its name.
    """
    if column == "ctrl":
        return _unit_of_commands(header)
    units = _OF_COORDINATES.get(column.partition("_")[0])
    if units is None:
        return _UNITS.get(column, "")
    kinds = {JointType(kind) for kind in header.jnt_type}
    turning = {JointType.HINGE}
    if column != "qpos":  # in which a rotation is a quaternion
        turning |= {JointType.BALL, JointType.FREE}
    there = [bool(kinds & turning), bool(kinds & {JointType.SLIDE, JointType.FREE})]
    return ", ".join(unit for unit, is_there in zip(units, there, strict=True) if is_there)


def _unit_of_commands(header: Header) -> str:
    """Return the unit of what servos aim at; of other actuators it is their own."""
    units: list[str] = []
    for number, gear in enumerate(header.servo_gear):
        unit = "of the actuator"
        if gear:
            kind = JointType(header.jnt_type[header.actuator_jntid[number]])
            unit = "rad" if kind == JointType.HINGE else "m"
        if unit not in units:
            units.append(unit)
    return ", ".join(units)


def _touches_table(trace: Trace) -> Table:
    """Return which bodies touch, from when on, and in how many rows."""
    rows: list[tuple[str, str, str]] = []
    for pair, touching in trace.touches().items():
        first = trace.time[int(np.argmax(touching))] - trace.time[0]
        rows.append((pair, short_time(first), f"{int(touching.sum())} of {len(trace)}"))
    return Table(("bodies", "first touch", "rows"), rows, "What touches what")
