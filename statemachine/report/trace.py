"""The page of a trace: what it is of, and what is in it."""

from __future__ import annotations

import numpy as np

from ..measures.text import figure, milliseconds, numbers, short_time
from ..page import Page, Table, Text
from ..runs import COLUMNS, Trace
from . import template
from .template import if_true, versions_of


def page(trace: Trace, name: str) -> Page:
    """What was done on what, then every column with its range."""
    header = trace.header
    facts = [
        ("experiment", header.experiment),
        ("engine", header.label),
        (
            "time",
            f"{trace.time[0]:g} to {trace.time[-1]:g} s, {len(trace)} rows, "
            f"{milliseconds(header.timestep)} apart"
            + (f" ({header.substeps} engine steps)" if header.substeps > 1 else ""),
        ),
        ("start", f"keyframe {header.keyframe}" if header.keyframe else "as in the first row"),
        ("model", f"{header.provenance.model_file} ({header.provenance.model_sha256[:8]})"),
        ("gravity", numbers(header.gravity) + " m/s²"),
        ("options", ", ".join(f"{key}={value}" for key, value in header.options.items()) or "none"),
        ("seed", "none" if header.provenance.seed is None else str(header.provenance.seed)),
        ("versions", versions_of(header.provenance.versions)),
        ("made by", header.command or "a program"),
    ]
    if header.rewritten:
        facts.append(
            ("rewritten", f"the controller wrote into the state in {header.rewritten} rows")
        )
    if header.ended:
        facts.append(("ended", header.ended))
    touches = [
        (
            pair,
            short_time(trace.time[int(np.argmax(rows))] - trace.time[0]),
            f"{int(rows.sum())} of {len(trace)}",
        )
        for pair, rows in trace.touches().items()
    ]
    columns = [_row(column, trace) for column in COLUMNS if column in trace]
    tables = [
        Table(("what", "is"), facts, "What it is of", words=frozenset({0, 1})),
        Table(("column", "shape", "smallest", "largest"), columns, "What is in it"),
        Table(("bodies", "first touch", "rows"), touches, "What touches what"),
    ]
    return template.page(
        "trace",
        name=name,
        experiment=header.experiment,
        engine=header.label,
        says=[Text(header.says)] if header.says else [],
        tables=[table for table in tables if table.rows],
        nothing=if_true("contact_row" in trace and not touches),
    )


def _row(column: str, trace: Trace) -> tuple[str, ...]:
    array = trace[column]
    shape = " × ".join(str(length) for length in array.shape)
    if not array.size or not np.isfinite(array).any():
        return (column, shape, "not told" if array.size else "", "")
    return (column, shape, figure(float(np.nanmin(array))), figure(float(np.nanmax(array))))
