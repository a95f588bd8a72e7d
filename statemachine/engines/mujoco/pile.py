"""MuJoCo's world in which something can be kept and forgotten: a pile of boxes, a driven joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...interface import Array
from ..pile import HALF, PLACES, TILT, Pile
from .audit import mj, saved

MJCF = f"""<mujoco><worldbody><geom type="plane" size="5 5 1"/>
{
    "".join(
        f'<body pos="{x} {y} {z}" quat="{" ".join(map(str, TILT if k == 0 else (1, 0, 0, 0)))}">'
        f'<freejoint/><geom type="box" size="{HALF} {HALF} {HALF}"/></body>'
        for k, (x, y, z) in enumerate(PLACES)
    )
}
<body pos="2 0 2"><joint name="j" axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body></worldbody>
<actuator><position joint="j" kp="20"/></actuator></mujoco>"""

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


@contextmanager
def _copied(scene: MujocoPile) -> Iterator[Callable[[MujocoPile], object]]:
    qpos, qvel = np.array(scene.data.qpos), np.array(scene.data.qvel)

    def restore(other: MujocoPile) -> None:
        other.data.qpos[:], other.data.qvel[:] = qpos, qvel

    yield restore


@contextmanager
def _state(scene: MujocoPile, part: str) -> Iterator[Callable[[MujocoPile], object]]:
    """The components of a mask of mjtState."""
    mask = getattr(mj.mjtState, part)
    state = saved(scene.data, int(mask))
    yield lambda other: mj.mj_setState(other.model, other.data, state, mask)


class MujocoPile(Pile):
    """A Model and a Data."""

    quantities = tuple(_FIELDS)
    resets: ClassVar = {"mj_resetData": lambda scene: mj.mj_resetData(scene.model, scene.data)}
    ways_to_save: ClassVar = {
        "qpos and qvel copied": _copied,
        "mjSTATE_FULLPHYSICS": partial(_state, part="mjSTATE_FULLPHYSICS"),
        "mjSTATE_INTEGRATION": partial(_state, part="mjSTATE_INTEGRATION"),
    }

    def __init__(self) -> None:
        self.model = mj.MjModel.from_xml_string(MJCF)
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

    def _owner(self, field: str) -> Any:
        return self.data if hasattr(self.data, field) else self.model.opt

    def write(self, quantity: str, value: float) -> None:
        """Every number of it."""
        owner, field = self._owner(_FIELDS[quantity]), _FIELDS[quantity]
        setattr(owner, field, 0 * getattr(owner, field) + value)

    def read(self, quantity: str) -> float:
        """The number of which all are; NaN if they differ."""
        values = np.ravel(getattr(self._owner(_FIELDS[quantity]), _FIELDS[quantity]))
        return float(values[0]) if (values == values[0]).all() else np.nan

    def run(self, steps: int) -> Array:
        trace = []
        for _ in range(steps):
            mj.mj_step(self.model, self.data)
            trace.append(np.array(self.data.qpos))
        return np.array(trace)
