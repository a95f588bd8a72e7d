"""The moments at which a run is saved: at rest, in motion, mid-contact, at a limit.

They are found by running a model, so that any model has some. What a moment is like
(contacts, speed) is measured there, on each engine; its name only says how to get there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...engines.auditing import STIR, SavePoint, within
from ...errors import UnsupportedError
from ...interface import Array, JointType, Keyframe, Model, make_data

_SETTLE, _FALL, _WAY = 1.0, 0.8, 0.1  # seconds before a run is saved
_LONGEST = 400  # steps before it, at most
_ABOVE = 3.0  # what is free to move is lifted so far [m]
_THROWN = (0.3, 0.2, 0.0, 2.0, 1.0, 3.0)  # and has this velocity [m/s, rad/s]
_MOVE = (0.4, -0.2)  # added to a keyframe's command: of the lesson on replay
_REACH = 0.01  # from a limit, where a joint starts towards it [rad or m]
_ARRIVAL = 5  # in how many steps it is there


def points(model: Model, seed: int) -> tuple[tuple[SavePoint, ...], tuple[str, ...]]:
    """Save points of a model, and a line for each that it does not have.

    Args:
        model: The model.
        seed: Of the command in motion.
    """
    with make_data(model) as data:
        zero = data.qpos.copy()
    found, without = [], []
    for name, make in _MAKERS.items():
        try:
            found.append(make(model, zero, seed))
        except (UnsupportedError, LookupError) as error:
            without.append(f"{name}: {error}")
    return tuple(found), tuple(without)


def _default(model: Model, zero: Array, _seed: int) -> SavePoint:
    how = "default pose, no command, and time to settle"
    still, none = np.zeros(model.nv), within(model, np.zeros(model.nu))
    return SavePoint("default", how, model, zero, still, none, _steps(model, _SETTLE))


def _motion(model: Model, zero: Array, seed: int) -> SavePoint:
    qpos, qvel = _lifted(model, zero)
    stir = np.random.default_rng(seed).uniform(-STIR, STIR, model.nu)
    ways = ["free bodies thrown"] if list(_free(model)) else []
    ways += ["each servo on its way"] if model.nu else []
    how = ", ".join(ways) or "default pose, let go"
    return SavePoint("motion", how, model, qpos, qvel, within(model, stir), _steps(model, _WAY))


def _keyframe(model: Model, _zero: Array, _seed: int) -> SavePoint:
    if not model.keyframes:
        raise LookupError("the model has no keyframe")
    key, ctrl = model.keyframes[0], model.keyframes[0].ctrl.copy()
    ctrl[: len(_MOVE)] += _MOVE[: model.nu]
    how = f"{_named(key)}, command moved away from it"
    steps = _steps(model, 2 * _WAY)
    return SavePoint("keyframe", how, model, key.qpos, key.qvel, within(model, ctrl), steps)


def _limp(model: Model, zero: Array, _seed: int) -> SavePoint:
    if not model.nu:
        raise LookupError("the model has no servo to switch off")
    how = "default pose, servos off, and time to fall"
    still, none = np.zeros(model.nv), np.zeros(model.nu)
    limp = model.replace(actuation=False)
    return SavePoint("limp", how, limp, zero, still, none, _steps(model, _FALL), powered=False)


def _limit(model: Model, zero: Array, _seed: int) -> SavePoint:
    qpos, qvel = _lifted(model, zero)
    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = np.flatnonzero(model.jnt_limited & scalar)
    if not len(limited):
        raise LookupError("no joint of the model has a limit")
    lower, upper = model.jnt_range[limited].T
    reach = np.minimum(_REACH, (upper - lower) / 10)
    qpos[model.jnt_qposadr[limited]] = upper - reach
    qvel[model.jnt_dofadr[limited]] = reach / (_ARRIVAL * model.timestep)
    how = "servos off, each joint run into its upper limit"
    none = np.zeros(model.nu)
    loose = model.replace(actuation=False) if model.nu else model
    return SavePoint(
        "limit", how, loose, qpos, qvel, none, _ARRIVAL + 3, powered=False, at_limit=True
    )


def _clock(model: Model, zero: Array, _seed: int) -> SavePoint:
    if not model.nu:
        raise LookupError("the model has no actuator")
    qpos, qvel, ctrl, start = zero, np.zeros(model.nv), np.zeros(model.nu), "default pose"
    if model.keyframes:
        key = model.keyframes[0]
        qpos, qvel, ctrl, start = key.qpos, key.qvel, key.ctrl, _named(key)
    how = f"{start}, a controller that reads the time before each step"
    steps = _steps(model, 2 * _WAY)
    return SavePoint("clock", how, model, qpos, qvel, ctrl, steps, swings=True)


_MAKERS: dict[str, Callable[[Model, Array, int], SavePoint]] = {
    "default": _default,
    "motion": _motion,
    "keyframe": _keyframe,
    "limp": _limp,
    "limit": _limit,
    "clock": _clock,
}


def _named(key: Keyframe) -> str:
    return f"keyframe {key.name!r}" if key.name else "keyframe 0"


def _steps(model: Model, seconds: float) -> int:
    return min(max(round(seconds / model.timestep), 1), _LONGEST)


def _lifted(model: Model, zero: Array) -> tuple[Array, Array]:
    """Configuration and velocity with every free body in the air."""
    qpos, qvel = zero.copy(), np.zeros(model.nv)
    for place, dof in _free(model):
        qpos[place + 2] += _ABOVE
        qvel[dof : dof + 6] = _THROWN
    return qpos, qvel


def _free(model: Model) -> Iterator[tuple[int, int]]:
    for joint in np.flatnonzero(model.jnt_type == int(JointType.FREE)):
        yield int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
