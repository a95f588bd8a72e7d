"""MuJoCo's world in which something can be kept and forgotten: a pile of boxes, a driven joint."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ..samples.pile import HALF, PLACES, TILT

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
QUANTITIES = {
    "time": "time",
    "qpos": "qpos",
    "qvel": "qvel",
    "ctrl": "ctrl",
    "applied forces": "xfrc_applied",
    "warm start": "qacc_warmstart",
    "gravity": "gravity",
    "timestep": "timestep",
}


def build() -> tuple[Any, Any, Any]:
    """The engine, a Model and a fresh Data."""
    mj = require("mujoco")
    model = mj.MjModel.from_xml_string(MJCF)
    return mj, model, mj.MjData(model)


def read(model: Any, data: Any) -> dict[str, Array]:
    """A copy of each quantity."""
    return {
        name: np.array(getattr(_owner(model, data, field), field))
        for name, field in QUANTITIES.items()
    }


def write(model: Any, data: Any, amount: float) -> dict[str, Array]:
    """Add an amount to every number of every quantity; what they are then."""
    for field in QUANTITIES.values():
        owner = _owner(model, data, field)
        setattr(owner, field, getattr(owner, field) + amount)
    return read(model, data)


def same(left: dict[str, Array], right: dict[str, Array]) -> dict[str, bool]:
    """Which quantities are the same in both, bit by bit."""
    return {name: np.array_equal(left[name], right[name]) for name in QUANTITIES}


def run(mj: Any, model: Any, data: Any, steps: int) -> Array:
    """Go on, and give qpos (steps, nq) after every step."""
    trace = []
    for _ in range(steps):
        mj.mj_step(model, data)
        trace.append(np.array(data.qpos))
    return np.array(trace)


def ways_to_save(mj: Any, model: Any, data: Any) -> dict[str, Callable[[], Callable[[], None]]]:
    """Functions that save, by name; each gives the function that restores."""

    def copies() -> Callable[[], None]:
        qpos, qvel = np.array(data.qpos), np.array(data.qvel)

        def restore() -> None:
            data.qpos[:], data.qvel[:] = qpos, qvel

        return restore

    def state(part: Any) -> Callable[[], Callable[[], None]]:
        def save() -> Callable[[], None]:
            kept = np.empty(mj.mj_stateSize(model, part))
            mj.mj_getState(model, data, kept, part)
            return lambda: mj.mj_setState(model, data, kept, part)

        return save

    return {
        "qpos and qvel copied": copies,
        "mjSTATE_FULLPHYSICS": state(mj.mjtState.mjSTATE_FULLPHYSICS),
        "mjSTATE_INTEGRATION": state(mj.mjtState.mjSTATE_INTEGRATION),
    }


def _owner(model: Any, data: Any, field: str) -> Any:
    return data if hasattr(data, field) else model.opt
