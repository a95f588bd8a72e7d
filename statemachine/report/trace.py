"""The page of a trace: what it is of, and what is in it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..measures.text import figure, milliseconds, numbers, short_time
from ..page import Page, Table, Text
from ..runs import COLUMNS, Trace


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
        ("versions", ", ".join(f"{k} {v}" for k, v in header.provenance.versions.items())),
        ("made by", header.command or "a program"),
    ]
    if header.rewritten:
        facts.append(
            ("rewritten", f"the controller wrote into the state in {header.rewritten} rows")
        )
    if header.ended:
        facts.append(("ended", header.ended))
    blocks: list[Any] = [Text(header.says)] if header.says else []
    blocks += [
        Table(("what", "is"), facts, title="What it is of", words=frozenset({0, 1})),
        Table(
            ("column", "shape", "smallest", "largest"),
            [_row(column, trace) for column in COLUMNS if column in trace],
            title="What is in it",
        ),
    ]
    touches = trace.touches()
    if touches:
        blocks.append(
            Table(
                ("bodies", "first touch", "rows"),
                [
                    (
                        pair,
                        short_time(trace.time[int(np.argmax(rows))] - trace.time[0]),
                        f"{int(rows.sum())} of {len(trace)}",
                    )
                    for pair, rows in touches.items()
                ],
                title="What touches what",
            )
        )
    elif "contact_row" in trace:
        blocks.append(Text("Nothing touches anything."))
    return Page(
        f"{name}: {header.experiment} on {header.label}", "opened without an engine", blocks
    )


def _row(column: str, trace: Trace) -> tuple[str, ...]:
    array = trace[column]
    shape = " × ".join(str(length) for length in array.shape)
    if not array.size or not np.isfinite(array).any():
        return (column, shape, "not told" if array.size else "", "")
    return (column, shape, figure(float(np.nanmin(array))), figure(float(np.nanmax(array))))
