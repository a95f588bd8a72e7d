"""Who is audited: the engine itself, by its own functions, and our interface to it."""

from __future__ import annotations

import importlib
from typing import cast

from ...interface import Model
from ._driver import ONLY, Driver, Hiding, Look, Machine, Restore, Run, Save, Seen, Way
from .interface_driver import InterfaceDriver

__all__ = [
    "ONLY",
    "Driver",
    "Hiding",
    "Look",
    "Machine",
    "Restore",
    "Run",
    "Save",
    "Seen",
    "Way",
    "drivers",
]

# The engines that are asked themselves, by the name of their backend.
_RAW = {
    "mujoco": ("mujoco_driver", "MujocoDriver"),
    "pybullet": ("pybullet_driver", "PybulletDriver"),
}


def drivers(model: Model, seed: int) -> tuple[Driver, ...]:
    """The engine behind a Model, where there is a driver for it, and the interface."""
    found: list[Driver] = []
    if model.backend in _RAW:
        module, name = _RAW[model.backend]
        kind = getattr(importlib.import_module(f".{module}", __name__), name)
        found.append(cast("Driver", kind(model, seed)))
    return (*found, InterfaceDriver(model, seed))
