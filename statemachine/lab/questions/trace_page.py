"""The page of one trace: what was done on what, and every column with its range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    rows: list[tuple[str, str, str, str]] = []
    for column in COLUMNS:
        if column not in trace:
            continue
        array = trace[column]
        shape = " × ".join(str(length) for length in array.shape)
        if array.size and np.isfinite(array).any():
            least, most = float(np.nanmin(array)), float(np.nanmax(array))
            rows.append((column, shape, figure(least), figure(most)))
        else:
            rows.append((column, shape, "not told" if array.size else "", ""))
    return Table(("column", "shape", "smallest", "largest"), rows, "What is in it")


def _touches_table(trace: Trace) -> Table:
    """Return which bodies touch, from when on, and in how many rows."""
    rows: list[tuple[str, str, str]] = []
    for pair, touching in trace.touches().items():
        first = trace.time[int(np.argmax(touching))] - trace.time[0]
        rows.append((pair, short_time(first), f"{int(touching.sum())} of {len(trace)}"))
    return Table(("bodies", "first touch", "rows"), rows, "What touches what")
