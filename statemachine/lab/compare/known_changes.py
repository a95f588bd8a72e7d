"""Which known changes between two releases of an engine explain that a run is not the same."""

from __future__ import annotations

import numpy as np

from ...engines import raw_engine_of
from ...engines.records import KnownChange, RunArrays
from ...interface import Model
from ...release_names import engine_of
from ..recordings import Trace
from .agreement import Comparison
from .two_sides import SidesRun


def known_changes(run: SidesRun, comparison: Comparison) -> tuple[KnownChange, ...]:
    """Return the known changes between the releases of two sides, where their runs differ.

    Args:
        run: Both sides, run.
        comparison: Of their runs.

    Raises:
        EngineError: A release does not run.
    """
    left, right = run.reruns
    if comparison.outcome not in ("differs", "ended") or left is None or right is None:
        return ()
    return changes_between((left.model, right.model), (run.left, run.right))


def changes_between(
    models: tuple[Model, Model], traces: tuple[Trace, Trace]
) -> tuple[KnownChange, ...]:
    """Return the known changes that concern the runs of two Models.

    They are of one file on two releases of an engine; otherwise there are none.

    Args:
        models: Of both sides.
        traces: The run of each.

    Raises:
        EngineError: A release does not run.
    """
    left, right = models
    engines = engine_of(left.backend), engine_of(right.backend)
    if engines[0] != engines[1]:
        return ()
    runs = _arrays(traces[0]), _arrays(traces[1])
    return tuple(raw_engine_of(engines[0]).known_changes(left, right, runs))


def _arrays(trace: Trace) -> RunArrays:
    """Return what a run was, as arrays; of a trace without contacts there are none."""
    act = trace["act"] if "act" in trace else np.zeros((len(trace), 0))
    pairs = np.zeros((0, 2), dtype=np.int64)
    if "contact_geom" in trace:
        pairs = np.asarray(trace["contact_geom"], dtype=np.int64)
    return RunArrays(trace.qpos, trace.qvel, trace.ctrl, act, pairs)
