"""Command one pose and hold it: how the servos get there, and what is in the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError, UnsupportedError
from ..interface import Array, Ints, Model, forward, make_data, step
from ._common import (
    TARGET,
    Progress,
    Provenance,
    command,
    is_slide,
    moved_by_actuators,
    provenance,
    scalar_joint,
    silent,
    steps_in,
    touching,
)


@dataclass(frozen=True, eq=False)
class Hold:
    """The response to one command from the default pose.

    Attributes:
        target: (nu,) the command [rad; of a slide, m].
        goal: (nu,) the command within ctrlrange, which is what the actuators see.
        time: (n+1,) [s].
        qpos: (n+1, nu) the actuated joints.
        first_contact: When the robot first touched something [s], or None.
        touched: What touched what then; contact_steps: how many steps found a contact.
        touching: What it touches at the end.
        speed: (nu,) velocities of the actuated joints at the end.
        without_contacts: (nu,) where the joints end if nothing can touch; None if
            nothing did, or the backend cannot leave contacts out.
        joints: Names of the actuated joints; slides: which of them are slides.
        servo: Whether all are driven by position servos.
    """

    target: Array
    goal: Array
    time: Array
    qpos: Array
    first_contact: float | None
    touched: tuple[str, ...]
    contact_steps: int
    touching: tuple[str, ...]
    speed: Array
    without_contacts: Array | None
    joints: tuple[str, ...]
    slides: tuple[bool, ...]
    servo: bool
    provenance: Provenance

    @property
    def error(self) -> Array:
        """(n+1,) the worst joint's distance to the goal [rad; of a slide, m]."""
        return np.abs(self.qpos - self.goal).max(axis=1)


def run(
    model: Model,
    target: Sequence[float] | None = None,
    seconds: float = 2.0,
    progress: Progress = silent,
) -> Hold:
    """Hold a pose from the default one on.

    Args:
        model: Any model whose actuators drive hinge or slide joints.
        target: The command (nu,) [rad or m]; by default `TARGET`, for six actuators.
        seconds: Simulated time.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `target` has the wrong length, or `seconds` is not above 0.
    """
    if not model.nu:
        raise BadInputError(f"{model.path.name} has no actuators: nothing in it takes a command")
    if target is None and model.nu != len(TARGET):
        raise BadInputError(f"{model.path.name} has {model.nu} actuators: say where to, by target")
    goal = command(model, TARGET if target is None else target, "target")
    names = [model.joint_names[i] if i >= 0 else "" for i in model.actuator_jntid]
    if not all(names) or not names:
        raise BadInputError(f"{model.path.name} has no actuators, or some that drive no joint")
    addresses = np.array([scalar_joint(model, name) for name in names], dtype=np.int64)
    robot, total = moved_by_actuators(model), steps_in(model, seconds)
    times, poses, first = [0.0], [], None
    touched: tuple[str, ...] = ()
    contact_steps = 0
    with make_data(model) as data:
        poses.append(data.qpos[addresses[:, 0]])
        data.ctrl = goal
        for k in range(total):
            began = data.time
            step(model, data)
            found = touching(model, data.contacts, robot)
            contact_steps += bool(found)
            if found and first is None:
                first, touched = began, found
            times.append(data.time)
            poses.append(data.qpos[addresses[:, 0]])
            if k % 100 == 0:
                progress(k / total)
        forward(model, data)
        at_end = touching(model, data.contacts, robot)
        if first is None and at_end:
            first, touched = data.time, at_end
        return Hold(
            target=goal,
            goal=np.clip(goal, *model.actuator_ctrlrange.T),
            time=np.array(times),
            qpos=np.array(poses),
            first_contact=first,
            touched=touched,
            contact_steps=contact_steps,
            touching=at_end,
            speed=data.qvel[addresses[:, 1]].copy(),
            without_contacts=None if first is None else _freely(model, goal, total, addresses),
            joints=tuple(names),
            slides=tuple(is_slide(model, name) for name in names),
            servo=bool(np.isfinite(model.actuator_kp).all()),
            provenance=provenance(model),
        )


def _freely(model: Model, goal: Array, steps: int, addresses: Ints) -> Array | None:
    """Where the actuated joints end if nothing can touch anything."""
    try:
        alone = model.replace(contacts=False)
    except UnsupportedError:
        return None
    with make_data(alone) as data:
        data.ctrl = goal
        step(alone, data, steps)
        return data.qpos[addresses[:, 0]].copy()
