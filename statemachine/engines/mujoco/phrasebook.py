"""MuJoCo: a Model, a Data, and functions that take both."""

from __future__ import annotations

from functools import partial
from typing import Any

from ..measured import ANGLE, TORQUE, Cell, Phrases, accelerated, near
from ..samples import PENDULUM_MJCF, acceleration, tip_at


def _accelerates(n: Any, torque: float) -> bool:
    """The engine computes with the state, and with the command."""
    n.mujoco.mj_forward(n.m, n.d)
    return near(n.d.qacc[0], acceleration(ANGLE, torque), 1e-9)


def _stepped(n: Any) -> bool:
    h = n.m.opt.timestep
    return n.d.time == h and near((n.d.qpos[0], n.d.qvel[0]), accelerated(h), 1e-12)


def _was_reset(n: Any) -> bool:
    return n.d.time == n.d.qpos[0] == n.d.qvel[0] == n.d.ctrl[0] == 0


def _restored(n: Any) -> bool:
    """And again, from where a hundred steps lead."""
    back = _was_reset(n)
    n.mujoco.mj_step(n.m, n.d, 100)
    away = abs(n.d.qpos[0])
    n.mujoco.mj_setState(n.m, n.d, n.saved, n.part)
    return back and away > 0.1 and _was_reset(n)


def _apart(n: Any) -> bool:
    n.mujoco.mj_step(n.m, n.worlds[1])
    return [world.time for world in n.worlds] == [0, n.m.opt.timestep, 0]


_CELLS = {
    "load": Cell(
        "import mujoco\n"
        "import numpy as np\n"
        "m = mujoco.MjModel.from_xml_path(file)\n"
        "d = mujoco.MjData(m)",
        lambda n: n.m.nq == n.m.nu == 1 and n.d.time == 0,
    ),
    "state": Cell(f"d.qpos[0], d.qvel[0] = {ANGLE}, 0", partial(_accelerates, torque=0.0)),
    "command": Cell(f"d.ctrl[0] = {TORQUE}", partial(_accelerates, torque=TORQUE)),
    "step": Cell("mujoco.mj_step(m, d)", _stepped),
    "recompute": Cell(
        "mujoco.mj_forward(m, d)",  # and no time passes
        lambda n: (
            n.d.time == n.m.opt.timestep and near(n.d.site("tip").xpos, tip_at(n.d.qpos[0]), 1e-12)
        ),
    ),
    "read a site": Cell(
        'tip = d.site("tip").xpos', lambda n: near(n.tip, tip_at(n.d.qpos[0]), 1e-12)
    ),
    "reset": Cell("mujoco.mj_resetData(m, d)", _was_reset),
    "save": Cell(
        "part = mujoco.mjtState.mjSTATE_INTEGRATION\n"
        "saved = np.empty(mujoco.mj_stateSize(m, part))\n"
        "mujoco.mj_getState(m, d, saved, part)\n"
        "mujoco.mj_step(m, d, 100)\n"
        "mujoco.mj_setState(m, d, saved, part)  # back",
        _restored,
    ),
    "many worlds": Cell("worlds = [mujoco.MjData(m) for _ in range(3)]", _apart),
}
phrases = partial(
    Phrases,
    ("arm.xml", PENDULUM_MJCF % '<actuator><motor joint="j"/></actuator>'),
    _CELLS,
)
