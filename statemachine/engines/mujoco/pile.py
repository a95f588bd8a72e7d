"""MuJoCo's world in which something can be kept and forgotten: boxes, a driven joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...installed import require
from ...interface import Array
from ..pile import PILE_MJCF, Pile, Save

mj: Any = require("mujoco")


def _owner(scene: MujocoPile, field: str) -> Any:
    """Return the owner of a field: the Data, or the options of the Model."""
    return scene.data if hasattr(scene.data, field) else scene.model.opt


def _write(scene: MujocoPile, value: float, field: str) -> None:
    """Write one value into every number of a field."""
    owner = _owner(scene, field)
    setattr(owner, field, 0 * getattr(owner, field) + value)


def _read(scene: MujocoPile, field: str) -> float:
    """Return the value of all numbers of a field; NaN if they differ."""
    values = np.ravel(getattr(_owner(scene, field), field))
    return float(values[0]) if (values == values[0]).all() else np.nan


# What decides the future, by where the engine has it; the last two belong to the Model.
_FIELDS = {
    "time": "time",
    "qpos": "qpos",
    "qvel": "qvel",
    "ctrl": "ctrl",
    "applied forces": "xfrc_applied",
    "warm start": "qacc_warmstart",
    "gravity": "gravity",
    "timestep": "timestep",
}


def _components(*parts: str) -> Save:
    """Return a way to save by components of mjtState."""
    spec = sum(int(getattr(mj.mjtState, f"mjSTATE_{part}")) for part in parts)

    @contextmanager
    def save(scene: Any) -> Iterator[Callable[[Any], object]]:
        state = np.empty(mj.mj_stateSize(scene.model, spec))
        mj.mj_getState(scene.model, scene.data, state, spec)
        yield lambda other: mj.mj_setState(other.model, other.data, state, spec)

    return save


class MujocoPile(Pile):
    """A Model and a Data."""

    quantities: ClassVar = {
        name: (partial(_write, field=field), partial(_read, field=field))
        for name, field in _FIELDS.items()
    }
    resets: ClassVar = {"mj_resetData": lambda scene: mj.mj_resetData(scene.model, scene.data)}
    ways_to_save: ClassVar = {
        "qpos and qvel copied": _components("QPOS", "QVEL"),
        "mjSTATE_FULLPHYSICS": _components("FULLPHYSICS"),
        "mjSTATE_INTEGRATION": _components("INTEGRATION"),
    }

    def __init__(self) -> None:
        self.model = mj.MjModel.from_xml_string(PILE_MJCF)
        self.data = mj.MjData(self.model)

    @classmethod
    @contextmanager
    def fresh(cls) -> Iterator[MujocoPile]:
        yield cls()

    @property
    def timestep(self) -> float:
        return self.model.opt.timestep

    def bodies(self) -> int:
        return self.model.nbody

    def run(self, steps: int) -> Array:
        trace = []
        for _ in range(steps):
            mj.mj_step(self.model, self.data)
            trace.append(np.array(self.data.qpos))
        return np.array(trace)
