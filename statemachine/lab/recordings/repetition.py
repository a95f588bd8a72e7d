"""What the engine derives from the states of a run, read in a repetition or as the run goes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from ...errors import DivergedError, UnsupportedError
from ...interface import (
    DERIVED,
    MOCAP,
    Array,
    Data,
    Model,
    forward,
    get_state,
    make_data,
    set_state,
    step,
)
from ...interface.records import Arrays
from ..runs.drive import Progress
from .trace import COLUMNS, CONTACTS

_RECORDED_ARRAYS = tuple(name for name in DERIVED if name in COLUMNS)
Start = Callable[[Model, Data], None]


class DerivedRows:
    """What an engine derives from the rows of a run, from the first row on."""

    def __init__(self) -> None:
        self._count = 0
        self._arrays: dict[str, list[Array]] = {name: [] for name in _RECORDED_ARRAYS}
        self._contacts: dict[str, list[Any]] = {name: [] for name in CONTACTS}

    def append(self, data: Data) -> None:
        """Read the next row from a Data, whose derived arrays are of that row's state."""
        for name, values in self._arrays.items():
            values.append(array_or_nan(data, name))
        touching = data.contacts
        if len(touching):
            self._contacts["contact_row"].append(np.full(len(touching), self._count))
            for name in ("geom", "dist", "pos", "frame", "force"):
                self._contacts[f"contact_{name}"].append(np.array(getattr(touching, name)))
        self._count += 1

    def read_along(self, model: Model, data: Data, moments: Iterator[float]) -> Iterator[float]:
        """Yield the moments of a run [s], and read the rows after the steps that begin in them."""
        for k, now in enumerate(moments):
            if k:
                self.append(data)
            yield now
        _take_final_step(model, data)
        self.append(data)

    def columns(self) -> dict[str, Any]:
        """Return the columns by name, those of contacts too."""
        columns: dict[str, Any] = {name: np.array(rows) for name, rows in self._arrays.items()}
        for name, width in CONTACTS.items():
            kind = np.int64 if name in ("contact_row", "contact_geom") else np.float64
            parts = [np.reshape(part, (-1, *width)) for part in self._contacts[name]]
            columns[name] = np.concatenate([np.empty((0, *width), kind), *parts], dtype=kind)
        return columns


def compute_derived(
    model: Model, begin: Start, inputs: Arrays, progress: Progress
) -> tuple[dict[str, Any], int]:
    """Repeat a run and read what is derived.

    Args:
        model: What was run.
        begin: Puts a Data to the start.
        inputs: Columns time (n,), qpos (n, nq), qvel (n, nv) and ctrl (n, nu) of the run, and
            those of mocap poses, if there are any.
        progress: Told the fraction that is done.

    Returns:
        The columns by name, those of contacts too; and how many rows began in another state
        than the step before them left.
    """
    rows = len(inputs["time"])
    derived = DerivedRows()
    reads_after_step = is_stale(model)
    rewritten = 0
    with make_data(model) as data:
        begin(model, data)
        for k in range(rows):
            rewritten += put_row(data, inputs, k)
            if data.time != inputs["time"][k]:
                data.time = float(inputs["time"][k])
            if not reads_after_step:
                forward(model, data)
                derived.append(data)
            if k < rows - 1:
                step(model, data)
            elif reads_after_step:
                _take_final_step(model, data)
            if reads_after_step:
                derived.append(data)
            if k % 32 == 0:
                progress(k / rows)
    progress(1.0)
    return derived.columns(), rewritten


def is_stale(model: Model) -> bool:
    """Tell whether derived values are, after a step, of the state that the step began in.

    They are of the state before its last engine step, or of none (RK4): of a Model with several
    engine steps in one, or with that integrator, they must be asked for before the step.
    """
    behaviour = model.capabilities.behaviours["stale after a step"]
    return model.substeps == 1 and behaviour.support != "unsupported"


def put_row(data: Data, inputs: Mapping[str, Array], k: int) -> bool:
    """Write row `k` of the inputs into a Data, and tell whether it was in another state."""
    differing: list[str] = []
    for name in ("qpos", "qvel"):
        if getattr(data, name).tobytes() != inputs[name][k].tobytes():
            differing.append(name)
            getattr(data, name)[:] = inputs[name][k]
    for name in ("ctrl", *MOCAP):
        if name in inputs:
            getattr(data, name)[:] = inputs[name][k]
    return bool(differing)


def _take_final_step(model: Model, data: Data) -> None:
    """Take the step that the last row would begin, so that it too is of the run itself.

    `forward` may start afresh: PyBullet's contacts then lack what the run has built up.
    A state that no step stands, as the last of a run that diverged, has nothing better.
    """
    state = get_state(model, data)
    try:
        step(model, data)
    except DivergedError:
        set_state(model, data, state)
        forward(model, data)


def array_or_nan(data: Data, name: str) -> Array:
    """Return a derived array of a Data, copied; one that the backend does not tell is (nv,) NaN."""
    try:
        return np.array(getattr(data, name))  # it may be the engine's memory
    except UnsupportedError:
        return np.full(np.shape(data.qvel), np.nan)
