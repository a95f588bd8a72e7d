"""Traces that are recorded for a test, changed, and compared."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

import statemachine as sm
from statemachine.lab.compare import Agreement, Comparison
from statemachine.lab.recordings import (
    Trace,
    record_scenario,
)
from statemachine.lab.runs.scenarios import SCENARIOS


def changed(trace: Trace, header: dict[str, Any] | None = None, **columns: Any) -> Trace:
    """Return a trace with other fields of its header and other columns."""
    return Trace(dataclasses.replace(trace.header, **(header or {})), {**trace.columns, **columns})


def cut(trace: Trace, rows: int, **header: Any) -> Trace:
    """Return the first rows of a trace, with other fields of its header."""
    kept = {n: a[:rows] for n, a in trace.columns.items() if not n.startswith("contact_")}
    touching = trace["contact_row"] < rows
    kept |= {n: a[touching] for n, a in trace.columns.items() if n.startswith("contact_")}
    return Trace(dataclasses.replace(trace.header, **header), kept)


def named(found: Comparison) -> dict[str, Agreement]:
    """Return what was compared, by the name of its quantity."""
    return {each.name: each for each in found.agreements}


def added(array: Any, row: Any, by: Any) -> Any:
    """Return a copy of an array to whose row something is added."""
    copy = np.array(array)
    copy[row] += by
    return copy


def traced(name: str, backend: str = "mujoco", seconds: float = 0.5, **options: Any) -> Trace:
    """Return a short run of an experiment."""
    scenario = SCENARIOS[name]
    model = sm.load(scenario.model, backend=backend)
    return record_scenario(scenario, model, seconds=seconds, **options)


def same(one: Trace, two: Trace, columns: Any = None) -> bool:
    """Return whether columns of two traces are the same bit for bit."""
    return all(one[name].tobytes() == two[name].tobytes() for name in columns or one.columns)
