"""Pinocchio: a Model, functions of q and v, and a Data that holds what they computed last."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..measured import ANGLE, TORQUE, Cell, Phrases, accelerated, near
from ..samples import PENDULUM_URDF, TIP, acceleration, tip_at
from .conventions import names_with

_STEP = 0.002  # s; whatever its user likes


def _loaded(n: Any) -> bool:
    return n.m.nq == n.m.nv == 1 and n.m.existFrame("tip")


def _has_state(n: Any) -> bool:
    """Functions take it."""
    return near(n.pin.aba(n.m, n.d, n.q, n.v, np.zeros(1)), acceleration(ANGLE, 0), 1e-6)


def _commanded(n: Any) -> bool:
    return not names_with(n.pin, "actuat", "motor") and near(
        n.pin.aba(n.m, n.d, n.q, n.v, n.tau), acceleration(ANGLE, TORQUE), 1e-6
    )


def _stepped(n: Any) -> bool:
    return not names_with(n.pin, "step", "simul") and near(
        (n.q[0], n.v[0]), accelerated(_STEP), 1e-8
    )


def _recomputed(n: Any) -> bool:
    return _stepped(n) and near(n.d.oMf[n.m.getFrameId("tip")].translation, tip_at(n.q[0]), 1e-12)


def _read(n: Any) -> bool:
    return near(n.tip, tip_at(n.q[0]), 1e-12)


def _was_reset(n: Any) -> bool:
    n.pin.framesForwardKinematics(n.m, n.d, n.q)
    tip = n.d.oMf[n.m.getFrameId("tip")].translation
    return not names_with(n.pin, "reset") and near(tip, (TIP, 0, 0), 1e-12) and not n.v.any()


def _restored(n: Any) -> bool:
    """What was kept is still what it was."""
    q, v = n.saved
    return _was_reset(n) and near((q[0], v[0]), (0, 0), 0)


def _apart(n: Any) -> bool:
    for data, angle in zip(n.worlds, (0.1, 0.2, 0.3), strict=True):
        n.pin.framesForwardKinematics(n.m, data, np.array([angle]))
    frame = n.m.getFrameId("tip")
    return all(
        near(data.oMf[frame].translation, tip_at(angle), 1e-12)
        for data, angle in zip(n.worlds, (0.1, 0.2, 0.3), strict=True)
    )


_CELLS = {
    "load": Cell(
        "import numpy as np\n"
        "import pinocchio as pin\n"
        "m = pin.buildModelFromUrdf(file)\n"
        "d = m.createData()",
        _loaded,
    ),
    "state": Cell(f"q, v = np.array([{ANGLE}]), np.zeros(1)", _has_state),
    "command": Cell(f"tau = np.array([{TORQUE}])  # a torque; no actuators", _commanded),
    "step": Cell(
        "a = pin.aba(m, d, q, v, tau)  # no step: integrate it yourself\n"
        f"v = v + {_STEP} * a\n"
        f"q = pin.integrate(m, q, {_STEP} * v)",
        _stepped,
    ),
    "recompute": Cell(
        "pin.forwardKinematics(m, d, q, v)  # joints\n"
        "pin.updateFramePlacements(m, d)    # and frames",
        _recomputed,
    ),
    "read a site": Cell('tip = d.oMf[m.getFrameId("tip")].translation', _read),
    "reset": Cell("q, v = pin.neutral(m), np.zeros(m.nv)  # no reset", _was_reset),
    "save": Cell(
        "saved = q.copy(), v.copy()  # they are yours\n"
        "q = pin.integrate(m, q, np.ones(m.nv))\n"
        "q, v = saved  # back",
        _restored,
    ),
    "many worlds": Cell("worlds = [m.createData() for _ in range(3)]", _apart),
}
PHRASES = Phrases(("arm.urdf", PENDULUM_URDF), _CELLS)
