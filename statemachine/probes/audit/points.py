"""The moments at which a run is saved: at rest, in motion, mid-contact, at a limit.

They are found by running a model, so that any model has some. What a moment is like
(contacts, speed) is measured there, on each engine; its name only says how to get there.
"""

from __future__ import annotations

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
        zero, still, none = data.qpos.copy(), np.zeros(model.nv), np.zeros(model.nu)
    rest = zero, still, none
    air, thrown = zero.copy(), still.copy()
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    for place, dof in zip(model.jnt_qposadr[free], model.jnt_dofadr[free], strict=True):
        air[place + 2] += _ABOVE
        thrown[dof : dof + 6] = _THROWN
    ways = ["free bodies thrown"] if len(free) else []
    ways += ["each servo on its way"] if model.nu else []
    stir = np.random.default_rng(seed).uniform(-STIR, STIR, model.nu)

    key = model.keyframes[0] if model.keyframes else Keyframe("", 0.0, zero, still, none)
    start = f"keyframe {key.name!r}" if key.name else "keyframe 0"
    start = start if model.keyframes else "default pose"
    moved = key.ctrl.copy()
    moved[: len(_MOVE)] += _MOVE[: model.nu]

    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = np.flatnonzero(model.jnt_limited & scalar)
    lower, upper = model.jnt_range[limited].T
    reach = np.minimum(_REACH, (upper - lower) / 10)
    near, towards = air.copy(), thrown.copy()
    near[model.jnt_qposadr[limited]] = upper - reach
    towards[model.jnt_dofadr[limited]] = reach / (_ARRIVAL * model.timestep)

    # Without servos, and why not.
    limp, refused = model, ""
    try:
        limp = model.replace(actuation=False) if model.nu else model
    except UnsupportedError as error:
        refused = str(error)

    def point(
        name: str,
        how: str,
        start: tuple[Array, Array, Array],
        seconds: float,
        variant: Model = model,
        **special: bool,
    ) -> SavePoint:
        qpos, qvel, ctrl = start
        steps, command = min(max(round(seconds / model.timestep), 1), _LONGEST), within(model, ctrl)
        return SavePoint(name, how, variant, qpos, qvel, command, steps, **special)

    # Each with what the model lacks for it.
    candidates = (
        (point("default", "default pose, no command, and time to settle", rest, _SETTLE), ""),
        (
            point("motion", ", ".join(ways) or "default pose, let go", (air, thrown, stir), _WAY),
            "",
        ),
        (
            point(
                "keyframe",
                f"{start}, command moved away from it",
                (key.qpos, key.qvel, moved),
                2 * _WAY,
            ),
            "" if model.keyframes else "the model has no keyframe",
        ),
        (
            point(
                "limp",
                "default pose, servos off, and time to fall",
                rest,
                _FALL,
                limp,
                powered=False,
            ),
            refused if model.nu else "the model has no servo to switch off",
        ),
        (
            point(
                "limit",
                "servos off, each joint run into its upper limit",
                (near, towards, none),
                (_ARRIVAL + 3) * model.timestep,
                limp,
                powered=False,
                at_limit=True,
            ),
            refused if len(limited) else "no joint of the model has a limit",
        ),
        (
            point(
                "clock",
                f"{start}, a controller that reads the time before each step",
                (key.qpos, key.qvel, key.ctrl),
                2 * _WAY,
                swings=True,
            ),
            "" if model.nu else "the model has no actuator",
        ),
    )
    without = [f"{candidate.name}: {lacks}" for candidate, lacks in candidates if lacks]
    return tuple(candidate for candidate, lacks in candidates if not lacks), tuple(without)
