"""Leave ctrl alone, with the servos on and off: how far does the arm droop, and who holds it?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..interface import Model
from ..records import Array
from ..verbs import forward, make_data, step
from ._common import (
    Forces,
    Progress,
    Provenance,
    forces_on,
    milestones,
    provenance,
    scalar_joint,
    silent,
    steps_in,
    touching,
)


@dataclass(frozen=True, eq=False)
class Droop:
    """One run from the zero pose under an untouched ctrl.

    Attributes:
        time: (n,) moments [s]; angle: (n,) of the joint then [rad].
        qpos: (nq,) at the end.
        forces: On the joint at the end, after `forward`.
        acceleration: Of the joint at the end [rad/s²].
        first_contact: Time of the first step that found a contact [s], or None.
        touching: What touches at the end.
    """

    time: Array
    angle: Array
    qpos: Array
    forces: Forces
    acceleration: float
    first_contact: float | None
    touching: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Gravity:
    """The same run with the servos on and off."""

    joint: str
    servos_on: Droop
    servos_off: Droop
    provenance: Provenance


def run(
    model: Model,
    seconds: float = 4.0,
    joint: str = "shoulder_lift",
    progress: Progress = silent,
) -> Gravity:
    """Let gravity act for a while, ctrl untouched, servos on and then off.

    Args:
        model: Any model with the joint.
        seconds: Simulated time.
        joint: The joint to watch; a hinge or slide.
        progress: Told the fraction that is done.

    Raises:
        UnknownNameError: No such joint.
        UnsupportedError: The backend cannot switch the servos off.
    """
    limp = model.replace(actuation=False)
    on = _droop(model, seconds, joint, lambda part: progress(part / 2))
    off = _droop(limp, seconds, joint, lambda part: progress((1 + part) / 2))
    return Gravity(joint, on, off, provenance(model))


def _droop(model: Model, seconds: float, joint: str, progress: Progress) -> Droop:
    place, dof = scalar_joint(model, joint)
    total = steps_in(model, seconds)
    marks = [round(mark / model.timestep) for mark in milestones(total * model.timestep)]
    times, angles, first = [], [], None
    with make_data(model) as data:
        for k in range(total + 1):
            if k in marks:
                times.append(data.time)
                angles.append(float(data.qpos[place]))
                progress(k / total)
            if k < total:
                began = data.time
                step(model, data)
                # The contacts of a step are those of the state that it started from.
                if first is None and len(data.contacts):
                    first = began
        forward(model, data)
        return Droop(
            time=np.array(times),
            angle=np.array(angles),
            qpos=data.qpos.copy(),
            forces=forces_on(data, dof),
            acceleration=float(data.qacc[dof]),
            first_contact=first,
            touching=touching(model, data.contacts),
        )
