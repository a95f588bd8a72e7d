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
    found: list[SavePoint] = []
    without: list[str] = []

    def add(
        name: str, how: str, qpos: Array, qvel: Array, ctrl: Array, seconds: float,
        lacks: str = "", limp: bool = False, **special: bool,
    ) -> None:  # fmt: skip
        variant = model
        try:
            variant = model.replace(actuation=False) if limp and model.nu else model
        except UnsupportedError as error:
            lacks = lacks or str(error)
        if lacks:
            without.append(f"{name}: {lacks}")
            return
        steps, ctrl = min(max(round(seconds / model.timestep), 1), _LONGEST), within(model, ctrl)
        found.append(
            SavePoint(name, how, variant, qpos, qvel, ctrl, steps, powered=not limp, **special)
        )

    with make_data(model) as data:
        zero, still, none = data.qpos.copy(), np.zeros(model.nv), np.zeros(model.nu)
    add("default", "default pose, no command, and time to settle", zero, still, none, _SETTLE)

    air, thrown = zero.copy(), still.copy()
    free = np.flatnonzero(model.jnt_type == int(JointType.FREE))
    for place, dof in zip(model.jnt_qposadr[free], model.jnt_dofadr[free], strict=True):
        air[place + 2] += _ABOVE
        thrown[dof : dof + 6] = _THROWN
    ways = ["free bodies thrown"] if len(free) else []
    ways += ["each servo on its way"] if model.nu else []
    stir = np.random.default_rng(seed).uniform(-STIR, STIR, model.nu)
    add("motion", ", ".join(ways) or "default pose, let go", air, thrown, stir, _WAY)

    lacks = "" if model.keyframes else "the model has no keyframe"
    key = model.keyframes[0] if model.keyframes else Keyframe("", 0.0, zero, still, none)
    start = "default pose" if lacks else f"keyframe {key.name!r}" if key.name else "keyframe 0"
    moved = key.ctrl.copy()
    moved[: len(_MOVE)] += _MOVE[: model.nu]
    add(
        *("keyframe", f"{start}, command moved away from it"),
        *(key.qpos, key.qvel, moved, 2 * _WAY, lacks),
    )

    lacks = "" if model.nu else "the model has no servo to switch off"
    add(
        *("limp", "default pose, servos off, and time to fall"),
        *(zero, still, none, _FALL, lacks),
        limp=True,
    )

    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = np.flatnonzero(model.jnt_limited & scalar)
    lower, upper = model.jnt_range[limited].T
    reach = np.minimum(_REACH, (upper - lower) / 10)
    near, towards = air.copy(), thrown.copy()
    near[model.jnt_qposadr[limited]] = upper - reach
    towards[model.jnt_dofadr[limited]] = reach / (_ARRIVAL * model.timestep)
    lacks = "" if len(limited) else "no joint of the model has a limit"
    add(
        *("limit", "servos off, each joint run into its upper limit"),
        *(near, towards, none, (_ARRIVAL + 3) * model.timestep, lacks),
        limp=True,
        at_limit=True,
    )

    lacks = "" if model.nu else "the model has no actuator"
    add(
        *("clock", f"{start}, a controller that reads the time before each step"),
        *(key.qpos, key.qvel, key.ctrl, 2 * _WAY, lacks),
        swings=True,
    )
    return tuple(found), tuple(without)
