"""What follows from the states of a run: what its engine derives, and energies by one yardstick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, Literal

import numpy as np

from ..backends import on_default
from ..engines import room
from ..errors import DivergedError, StateMachineError, UnsupportedError
from ..installed import DEFAULT
from ..interface import DERIVED, Array, Data, Model, forward, get_state, make_data, set_state, step
from .drive import Progress
from .trace import COLUMNS, CONTACTS

_TOLD = tuple(name for name in DERIVED if name in COLUMNS)
Start = Callable[[Model, Data], None]


def derived(
    model: Model, begin: Start, inputs: dict[str, Array], progress: Progress
) -> tuple[dict[str, Any], int]:
    """Repeat a run and read what is derived.

    Args:
        model: What was run.
        begin: Puts a Data to the start.
        inputs: Columns time (n,), qpos (n, nq), qvel (n, nv) and ctrl (n, nu) of the run.
        progress: Told the fraction that is done.

    Returns:
        The columns by name, those of contacts too; and how many rows began in another state
        than the step before them left.
    """
    rows = len(inputs["time"])
    arrays: dict[str, list[Array]] = {name: [] for name in _TOLD}
    contacts: dict[str, list[Any]] = {name: [] for name in CONTACTS}
    # After a step, derived values are of the state before its last engine step: with one of
    # those they are of the row that began it. With more, they must be asked for before.
    after = model.substeps == 1
    rewritten = 0
    with make_data(model) as data:
        begin(model, data)
        for k in range(rows):
            rewritten += put_row(data, inputs, k)
            if data.time != inputs["time"][k]:
                data.time = float(inputs["time"][k])
            if not after:
                forward(model, data)
                _read(data, k, arrays, contacts)
            if k < rows - 1:
                step(model, data)
            elif after:
                _one_more(model, data)
            if after:
                _read(data, k, arrays, contacts)
            if k % 32 == 0:
                progress(k / rows)
    progress(1.0)
    columns: dict[str, Any] = {name: np.array(values) for name, values in arrays.items()}
    for name, width in CONTACTS.items():
        kind = np.int64 if name in ("contact_row", "contact_geom") else np.float64
        rows_of = [np.reshape(part, (-1, *width)) for part in contacts[name]]
        columns[name] = np.concatenate([np.empty((0, *width), kind), *rows_of], dtype=kind)
    return columns, rewritten


def put_row(data: Data, inputs: Mapping[str, Array], k: int) -> bool:
    """Write row `k` of the inputs into a Data; whether it was in another state."""
    others = [n for n in ("qpos", "qvel") if getattr(data, n).tobytes() != inputs[n][k].tobytes()]
    for name in others:
        getattr(data, name)[:] = inputs[name][k]
    data.ctrl[:] = inputs["ctrl"][k]
    return bool(others)


def _one_more(model: Model, data: Data) -> None:
    """The step that the last row would begin, so that it too is of the run itself.

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
    """A derived array of a Data, copied; one that the backend does not tell is (nv,) NaN."""
    try:
        return np.array(getattr(data, name))  # it may be the engine's memory
    except UnsupportedError:
        return np.full(np.shape(data.qvel), np.nan)


def _read(
    data: Data, row: int, arrays: dict[str, list[Array]], contacts: dict[str, list[Any]]
) -> None:
    for name, values in arrays.items():
        values.append(array_or_nan(data, name))
    touching = data.contacts
    if len(touching):
        contacts["contact_row"].append(np.full(len(touching), row))
        for name in ("geom", "dist", "pos", "frame", "force"):
            contacts[f"contact_{name}"].append(np.array(getattr(touching, name)))


def energies(
    model: Model,
    defaults: Literal["model", "engine"],
    qpos: Array,
    qvel: Array,
    gravity: Any = None,
    load: Callable[[Model], Model] = on_default,
    made: Callable[[Model], AbstractContextManager[Data]] = make_data,
) -> tuple[Array, str]:
    """Kinetic and potential energy of states.

    They are those of the model's masses, rotors (armature) and gravity, computed by MuJoCo
    whatever engine the states come from: so two runs are measured by one yardstick. An
    engine that leaves something out (PyBullet as it comes has no rotors, and no gravity
    until it is set) is measured by the file's, or by the gravity that it was given.

    Args:
        model: What the states are of.
        defaults: What `load` was given for it.
        qpos: (n, nq) positions [rad or m]; qvel: (n, nv) velocities.
        qvel: See qpos.
        gravity: (3,) that `Model.replace` was given for it [m/s²]; None for none.
        load: Gives the model's file on MuJoCo; made: a Data of a Model there, which is changed.
        made: See load.

    Returns:
        (n, 2) kinetic and potential energy [J], and the engine and version that gave them;
        NaN and "" where MuJoCo is missing or cannot read the model.
    """
    unknown = np.full((len(qpos), 2), np.nan), ""
    try:
        yardstick = load(model)
        if yardstick is not model:
            if (yardstick.nq, yardstick.nv) != (qpos.shape[1], qvel.shape[1]):
                return unknown
            if defaults == "model":
                yardstick = yardstick.replace(
                    gravity=model.gravity, armature=model.dof_armature, mass=model.body_mass
                )
            elif gravity is not None:
                yardstick = yardstick.replace(gravity=gravity)
        joules = room(DEFAULT).energies(yardstick, qpos, qvel, made)
    except StateMachineError:
        return unknown
    return joules, f"{DEFAULT} {yardstick.engine_version}"
