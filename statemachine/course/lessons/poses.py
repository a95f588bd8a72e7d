"""The poses that the pictures of the lessons show: one, or those of a short run on MuJoCo.

Nothing is run before a picture is drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...backends import load
from ...interface import Array, make_data, reset, step
from ...lab.runs.robot import ARM_TARGET, UNACTUATED
from ._robot import ARM, BOX

_EVERY = 16  # steps of 5 ms from one picture of a film to the next, which is shown 0.08 s later
_SLOW = 4  # the same, for four times as slow
_SWING = (0.4, -0.8, 0.5, 1.6, 1.57, 0.28)  # what the keyframe "held" commands, but to the side

Poses = tuple[Array, Array | None]  # qpos (n, nq) of what is drawn solid, and as a ghost over it


def _poses(
    name: str,
    pictures: int,
    ctrl: Sequence[float] | Array | None = None,
    keyframe: int | None = None,
    options: Mapping[str, Any] | None = None,
    every: int = _EVERY,
    **qpos: float,
) -> Array:
    """Run a model, and return its poses.

    Args:
        name: Of the model.
        pictures: Number of poses.
        ctrl: (nu,) Command; None where nobody writes it.
        keyframe: Number of the keyframe to start at; None for the default state.
        options: That the model is given.
        every: Steps from a pose to the next.
        **qpos: By the names of joints where they start instead [rad].

    Returns:
        (pictures, nq) Rows of qpos.
    """
    model = load(name).replace(**(options or {}))
    rows = np.empty((pictures, model.nq))
    with make_data(model) as data:
        reset(model, data, keyframe=keyframe)
        if ctrl is not None:
            data.ctrl[:] = ctrl
        for joint, value in qpos.items():
            data.qpos[model.jnt_qposadr[model.joint_id(joint)]] = value
        for k in range(pictures):
            rows[k] = data.qpos
            step(model, data, every)
    return rows


def at_the_start() -> Poses:
    """Return the arm in its default state."""
    return _poses(ARM, 1), None


def towards_the_goal() -> Poses:
    """Return the arm on its way to the goal, and where it starts."""
    run = _poses(ARM, 16, ctrl=ARM_TARGET, every=_SLOW)
    return run, np.tile(run[0], (len(run), 1))


def short_of_the_goal() -> Poses:
    """Return the arm on its way to the goal, and the goal."""
    run = _poses(ARM, 16, ctrl=ARM_TARGET, every=_SLOW)
    return run, np.tile(ARM_TARGET, (len(run), 1))


def box_held() -> Poses:
    """Return the arm that holds the box."""
    return _poses(BOX, 1, keyframe=0), None


def before_and_after_a_write() -> Poses:
    """Return the arm by xpos after a write, and by qpos."""
    return _poses(ARM, 1), _poses(ARM, 1, shoulder_lift=0.8)


def servos_off_and_on() -> Poses:
    """Return the arm without its servos, and with them, while nobody writes ctrl."""
    return _poses(ARM, 22, options=UNACTUATED), _poses(ARM, 22)


def two_starts() -> Poses:
    """Return the scene at keyframe 0, and in its default state."""
    return _poses(BOX, 1, keyframe=0), _poses(BOX, 1)


def two_runs() -> Poses:
    """Return the same swing of the box, run twice."""
    return _poses(BOX, 16, _SWING, keyframe=0), _poses(BOX, 16, _SWING, keyframe=0)


def while_waiting() -> Poses:
    """Return the arm after 100 steps, twice: nothing is called in between."""
    poses = _poses(BOX, 2, keyframe=0, every=100)[1:]
    return poses, poses.copy()


# By the name of the lesson.
POSES: Mapping[str, Callable[[], Poses]] = {
    "nowhere": at_the_start,
    "objects": towards_the_goal,
    "state": box_held,
    "forward": before_and_after_a_write,
    "hold": short_of_the_goal,
    "gravity": servos_off_and_on,
    "reset": two_starts,
    "replay": two_runs,
    "time": while_waiting,
    "summary": box_held,
}
