"""The page of a trace: what it is of, and what is in it."""

from __future__ import annotations

import numpy as np

from ..measures.text import figure, short_time
from ..page import Page, Table
from ..runs import COLUMNS, Trace
from . import template
from .sides import facts_of
from .template import if_true, versions_of


def page(trace: Trace, name: str) -> Page:
    """What was done on what, then every column with its range."""
    header = trace.header
    facts = {
        "experiment": header.experiment,
        "engine": header.label,
        "time": f"{trace.time[0]:g} to {trace.time[-1]:g} s, {len(trace)} rows",
        "versions": versions_of(header.provenance.versions),
        **facts_of(header),
    }
    if header.rewritten:
        facts["rewritten"] = f"the controller wrote into the state in {header.rewritten} rows"
    if header.ended:
        facts["ended"] = header.ended
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
        Table(
            ("what", "is"),
            [fact for fact in facts.items() if fact[1]],
            "What it is of",
            words=frozenset({0, 1}),
        ),
        Table(("column", "shape", "smallest", "largest"), columns, "What is in it"),
        Table(("bodies", "first touch", "rows"), touches, "What touches what"),
    ]
    return template.page(
        "trace",
        name=name,
        experiment=header.experiment,
        engine=header.label,
        says=header.says or None,
        tables=tables,
        nothing=if_true("contact_row" in trace and not touches),
    )


def _row(column: str, trace: Trace) -> tuple[str, ...]:
    array = trace[column]
    shape = " × ".join(str(length) for length in array.shape)
    if not array.size or not np.isfinite(array).any():
        return (column, shape, "not told" if array.size else "", "")
    return (column, shape, figure(float(np.nanmin(array))), figure(float(np.nanmax(array))))
