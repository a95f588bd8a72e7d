"""MuJoCo's world in which something can be kept and forgotten: a pile of boxes, a driven joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array

BOX = 0.1  # half an edge [m]
# Where the boxes begin, one over the other [m], and how the lowest is turned (w, x, y, z).
PILE = ((0.0, 0.0, 0.25), (0.0, 0.02, 0.55), (0.0, 0.0, 0.85))
TILT = (0.92, 0.31, 0.21, 0.1)

MJCF = f"""<mujoco><worldbody><geom type="plane" size="5 5 1"/>
{
    "".join(
        f'<body pos="{x} {y} {z}" quat="{" ".join(map(str, TILT if k == 0 else (1, 0, 0, 0)))}">'
        f'<freejoint/><geom type="box" size="{BOX} {BOX} {BOX}"/></body>'
        for k, (x, y, z) in enumerate(PILE)
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


def scene() -> tuple[Any, Any, Any]:
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


def same(one: dict[str, Array], other: dict[str, Array]) -> set[str]:
    """Quantities that are the same in both, bit by bit."""
    return {name for name in QUANTITIES if np.array_equal(one[name], other[name])}


def run(mj: Any, model: Any, data: Any, steps: int) -> Array:
    """Go on, and tell qpos at every step."""
    trace = []
    for _ in range(steps):
        mj.mj_step(model, data)
        trace.append(np.array(data.qpos))
    return np.array(trace)


def _owner(model: Any, data: Any, field: str) -> Any:
    return data if hasattr(data, field) else model.opt
