"""MuJoCo's world in which something can be kept and forgotten: a pile of boxes, a driven joint."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...interface import Array
from ..auditing import Save, copied
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


def _owner(scene: MujocoPile, field: str) -> Any:
    """The Data or the options of the Model."""
    return scene.data if hasattr(scene.data, field) else scene.model.opt


def _write(scene: MujocoPile, value: float, field: str) -> None:
    """Every number of it."""
    owner = _owner(scene, field)
    setattr(owner, field, 0 * getattr(owner, field) + value)


def _read(scene: MujocoPile, field: str) -> float:
    """The number of which all are; NaN if they differ."""
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
    """Those of masks of mjtState."""
    spec = sum(int(getattr(mj.mjtState, f"mjSTATE_{part}")) for part in parts)
    return copied(
        lambda scene: saved(scene.data, spec),
        lambda scene, state: mj.mj_setState(scene.model, scene.data, state, spec),
    )


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

    def run(self, steps: int) -> Array:
        trace = []
        for _ in range(steps):
            mj.mj_step(self.model, self.data)
            trace.append(np.array(self.data.qpos))
        return np.array(trace)
