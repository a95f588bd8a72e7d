"""What a student's code can reach of MuJoCo itself, past the interface, and what of it tells."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from ...backends.mujoco_backend import MujocoData

DATA = MujocoData  # on which the functions below tell of every step
STEPS = ("mj_step", "mj_step2")  # functions that advance time
FORWARDS = ("mj_forward", "mj_kinematics", "mj_fwdPosition")  # those that only recompute
_OPTIONS = ("disableflags", "enableflags", "timestep", "gravity", "integrator")


def origin(raw: Any) -> object:
    """What an MjModel and its copies have in common, and no other."""
    return raw.names


def settings(raw: Any) -> dict[str, list[float]]:
    """Options of an MjModel by name, and the checksums of its arrays."""
    found = {f"opt.{name}": np.atleast_1d(getattr(raw.opt, name)).tolist() for name in _OPTIONS}
    for name in dir(raw):
        value = None if name.startswith("_") else getattr(raw, name)
        if isinstance(value, np.ndarray):
            found[name] = [float(zlib.crc32(value.tobytes()))]
    return found
