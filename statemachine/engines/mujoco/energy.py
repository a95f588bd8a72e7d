"""The energies that MuJoCo computes of a state."""

from __future__ import annotations

import numpy as np

from ...installed import require
from ...interface import Array, Model, make_data


def energies(model: Model, qpos: Array, qvel: Array) -> Array:
    """Kinetic and potential energy of states, (n, 2) [J].

    Args:
        model: A model on this engine.
        qpos: (n, nq) positions [rad or m].
        qvel: (n, nv) velocities [rad/s or m/s].
    """
    mujoco = require("mujoco")
    found = np.empty((len(qpos), 2))
    with make_data(model) as data:
        raw = data.raw
        for k in range(len(qpos)):
            data.qpos[:], data.qvel[:] = qpos[k], qvel[k]
            mujoco.mj_fwdPosition(model.raw, raw)
            mujoco.mj_energyPos(model.raw, raw)
            mujoco.mj_energyVel(model.raw, raw)
            found[k] = raw.energy[1], raw.energy[0]
    return found
