"""What one step from a given state can be asked of MuJoCo, past the interface."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...installed import require
from ...interface import Array, Data, Model

PRIMES = "qacc_warmstart, the accelerations of the step before"


def mass_matrix(model: Model, data: Data, qpos: Array) -> Array:
    """The matrix (nv, nv) of the state that the derived arrays of `data` belong to.

    Args:
        model: A Model on this engine.
        data: After a step from `qpos`, or a forward.
        qpos: (nq,) of that state; not needed here.
    """
    del qpos
    mass = np.zeros((model.nv, model.nv))
    if model.nv:
        require("mujoco").mj_fullM(model.raw, data.raw, mass)
    return mass


def prime(model: Model, data: Data, before: Mapping[str, Array]) -> None:
    """Give the contact solver the accelerations "qacc" (nv,) of the step before to begin with."""
    del model
    if "qacc" in before:
        data.raw.qacc_warmstart[:] = before["qacc"]
