"""Command one pose and hold it: how the servos get there, and how old `site_xpos` is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError
from ..interface import Model
from ..records import Array
from ..verbs import forward, make_data, step
from ._common import (
    Progress,
    Provenance,
    command,
    provenance,
    scalar_joint,
    silent,
    steps_in,
    touching,
)

TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)


@dataclass(frozen=True, eq=False)
class Hold:
    """The response to one command from the zero pose.

    Attributes:
        target: (nu,) the command [rad].
        time: (n+1,) [s].
        qpos: (n+1, nu) the actuated joints [rad].
        lag: (n,) distance [m] between the fingertip that a step leaves in
            `site_xpos` and the one that `forward` computes right after it.
        first_contact: Time of the first step that found a contact [s], or None.
        touching: What touches at the end.
        speed: The fastest entry of qvel at the end [rad/s].
        joints: Names of the actuated joints.
    """

    target: Array
    time: Array
    qpos: Array
    lag: Array
    first_contact: float | None
    touching: tuple[str, ...]
    speed: float
    joints: tuple[str, ...]
    provenance: Provenance

    @property
    def error(self) -> Array:
        """(n+1,) the worst joint's distance to the target [rad]."""
        return np.abs(self.qpos - self.target).max(axis=1)


def run(
    model: Model,
    target: Sequence[float] = TARGET,
    seconds: float = 2.0,
    site: str = "gripperframe",
    progress: Progress = silent,
) -> Hold:
    """Hold a pose from the default one on.

    Args:
        model: Any model whose actuators drive hinge or slide joints.
        target: The command (nu,) [rad].
        seconds: Simulated time.
        site: The fingertip.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `target` has the wrong length.
        UnknownNameError: No such site.
    """
    goal, tip = command(model, target, "target"), model.site_id(site)
    names = [model.joint_names[i] if i >= 0 else "" for i in model.actuator_jntid]
    if not all(names):
        raise BadInputError(f"{model.path.name} has actuators that drive no joint")
    places = np.array([scalar_joint(model, name)[0] for name in names], dtype=np.int64)
    total = steps_in(model, seconds)
    times, poses, lags, first = [0.0], [], [], None
    with make_data(model) as data:
        poses.append(data.qpos[places])
        data.ctrl = goal
        for k in range(total):
            began = data.time
            step(model, data)
            if first is None and len(data.contacts):
                first = began
            stale = np.array(data.site_xpos[tip])
            forward(model, data)
            lags.append(float(np.linalg.norm(data.site_xpos[tip] - stale)))
            times.append(data.time)
            poses.append(data.qpos[places])
            if k % 100 == 0:
                progress(k / total)
        found = touching(model, data.contacts)
        moving = float(np.abs(data.qvel).max())
    return Hold(
        target=goal,
        time=np.array(times),
        qpos=np.array(poses),
        lag=np.array(lags),
        first_contact=first,
        touching=found,
        speed=moving,
        joints=tuple(names),
        provenance=provenance(model),
    )
