"""Pinocchio: a Model, functions of q and v, and a Data that holds what they computed last."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..measured import ANGLE, TORQUE, Cell, Phrases, accelerated, near
from ..samples import PENDULUM_URDF, acceleration, tip_at
from .conventions import names_with

_STEP = 0.002  # s; whatever its user likes


def _accelerates(n: Any, torque: Any, expected: float) -> bool:
    return near(n.pin.aba(n.m, n.d, n.q, n.v, torque), acceleration(ANGLE, expected), 1e-6)


def _stepped(n: Any) -> bool:
    return not names_with(n.pin, "step", "simul") and near(
        (n.q[0], n.v[0]), accelerated(_STEP), 1e-8
    )


def _tip_at(n: Any, data: Any, angle: float) -> bool:
    return near(data.oMf[n.m.getFrameId("tip")].translation, tip_at(angle), 1e-12)


def _was_reset(n: Any) -> bool:
    n.pin.framesForwardKinematics(n.m, n.d, n.q)
    return not names_with(n.pin, "reset") and _tip_at(n, n.d, 0.0) and not n.v.any()


def _apart(n: Any) -> bool:
    worlds = dict(zip((0.1, 0.2, 0.3), n.worlds, strict=True))
    for angle, data in worlds.items():
        n.pin.framesForwardKinematics(n.m, data, np.array([angle]))
    return all(_tip_at(n, data, angle) for angle, data in worlds.items())


_CELLS = {
    "load": Cell(
        "import numpy as np\n"
        "import pinocchio as pin\n"
        "m = pin.buildModelFromUrdf(file)\n"
        "d = m.createData()",
        lambda n: n.m.nq == n.m.nv == 1 and n.m.existFrame("tip"),
    ),
    "state": Cell(
        f"q, v = np.array([{ANGLE}]), np.zeros(1)",
        lambda n: _accelerates(n, np.zeros(1), 0.0),  # functions take it
    ),
    "command": Cell(
        f"tau = np.array([{TORQUE}])  # a torque; no actuators",
        lambda n: not names_with(n.pin, "actuat", "motor") and _accelerates(n, n.tau, TORQUE),
    ),
    "step": Cell(
        "a = pin.aba(m, d, q, v, tau)  # no step: integrate it yourself\n"
        f"v = v + {_STEP} * a\n"
        f"q = pin.integrate(m, q, {_STEP} * v)",
        _stepped,
    ),
    "recompute": Cell(
        "pin.forwardKinematics(m, d, q, v)  # joints\n"
        "pin.updateFramePlacements(m, d)    # and frames",
        lambda n: _stepped(n) and _tip_at(n, n.d, n.q[0]),
    ),
    "read a site": Cell(
        'tip = d.oMf[m.getFrameId("tip")].translation',
        lambda n: near(n.tip, tip_at(n.q[0]), 1e-12),
    ),
    "reset": Cell("q, v = pin.neutral(m), np.zeros(m.nv)  # no reset", _was_reset),
    "save": Cell(
        "saved = q.copy(), v.copy()  # they are yours\n"
        "q = pin.integrate(m, q, np.ones(m.nv))\n"
        "q, v = saved  # back",
        lambda n: _was_reset(n) and n.saved[0][0] == n.saved[1][0] == 0,  # as it was kept
    ),
    "many worlds": Cell("worlds = [m.createData() for _ in range(3)]", _apart),
}
phrases = partial(Phrases, ("arm.urdf", PENDULUM_URDF), _CELLS)
