"""Energies of the states of a run, by one yardstick whatever engine they come from."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import numpy as np
from numpy.typing import ArrayLike

from ...backends import on_default
from ...engines import raw_engine_of
from ...errors import StateMachineError
from ...installed import DEFAULT
from ...interface import Array, Data, Model, make_data
from ...interface.records import Defaults


def energies(
    model: Model,
    defaults: Defaults,
    qpos: Array,
    qvel: Array,
    gravity: ArrayLike | None = None,
    load: Callable[[Model], Model] = on_default,
    made: Callable[[Model], AbstractContextManager[Data]] = make_data,
) -> tuple[Array, str]:
    """Compute the kinetic and potential energy of states.

    They are those of the model's masses, rotors (armature) and gravity, computed by MuJoCo
    whatever engine the states come from: so two runs are measured by one yardstick. An
    engine that leaves something out (PyBullet as it comes has no rotors, and no gravity
    until it is set) is measured by the file's, or by the gravity that it was given.

    Args:
        model: What the states are of.
        defaults: What `load` was given for it.
        qpos: (n, nq) positions [rad or m].
        qvel: (n, nv) velocities [rad/s or m/s].
        gravity: (3,) that `Model.replace` was given for it [m/s²]; None for none.
        load: Gives the model's file on MuJoCo.
        made: Makes a Data of a Model there, which is changed.

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
        joules = raw_engine_of(DEFAULT).energies(yardstick, qpos, qvel, made)
    except StateMachineError:
        return unknown
    return joules, f"{DEFAULT} {yardstick.engine_version}"
