"""Leave ctrl alone, with the servos on and off: how far does the arm droop, and who holds it?"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..engines import part
from ..engines.parts import AsItComes, LeftAlone
from ..errors import UnsupportedError
from ..interface import Array, Model, forward, make_data, step
from ._common import (
    Forces,
    Progress,
    Provenance,
    carried_by,
    forces_on,
    is_slide,
    milestones,
    part_of,
    provenance,
    scalar_joint,
    silent,
    steps_in,
    touching,
)


@dataclass(frozen=True, eq=False)
class Droop:
    """One run from the default pose under an untouched ctrl.

    Attributes:
        time: (n,) moments [s]; position: (n,) of the joint then [rad; of a slide, m].
        path: (steps + 1,) its position after each step.
        qpos: (nq,) at the end.
        forces: On the joint at the end, after `forward`.
        velocity, acceleration: Of the joint at the end [rad/s, rad/s²; or with m].
        touches: When each contact of what the joint carries was first found [s]; the longer
            runs look at their end only.
        touching: Those that are there at the end.
        ctrl_is_zero: Whether ctrl still is, at the end.
    """

    time: Array
    position: Array
    path: Array
    qpos: Array
    forces: Forces
    velocity: float
    acceleration: float
    touches: dict[str, float]
    touching: tuple[str, ...]
    ctrl_is_zero: bool


@dataclass(frozen=True, eq=False)
class Gravity:
    """The same run with the actuators on and off.

    Attributes:
        joint: The joint that was watched; slide: whether it is one, and no hinge.
        servo: Whether a position servo drives it.
        longer: The actuators off for longer, under the names "floor" (with contacts) and
            "no floor" (nothing can touch anything).
        alone: The joint on the engine as it comes, where that differs from the contract.
    """

    joint: str
    slide: bool
    servo: bool
    servos_on: Droop
    servos_off: Droop
    longer: dict[str, Droop]
    alone: tuple[LeftAlone, ...]
    provenance: Provenance


def run(
    model: Model,
    seconds: float = 4.0,
    joint: str = "shoulder_lift",
    longer: float = 100.0,
    progress: Progress = silent,
) -> Gravity:
    """Let gravity act for a while, ctrl untouched, actuators on and then off.

    Args:
        model: Any model with the joint.
        seconds: Simulated time.
        longer: Simulated time of two more runs with the actuators off, one of them with
            contacts left out, where the backend can; 0 for none.
        joint: The joint to watch; a hinge or slide.
        progress: Told the fraction that is done.

    Raises:
        UnknownNameError: No such joint.
        BadInputError: It is neither a hinge nor a slide, or `seconds` is not above 0.
        UnsupportedError: The backend cannot switch the actuators off.
    """
    for name, time in (("seconds", seconds), ("longer", longer)):
        if time or name == "seconds":
            steps_in(model, time)  # says what is wrong with it
    limp = model.replace(actuation=False)
    runs = {"on": (model, seconds), "off": (limp, seconds)}
    if longer:
        runs["floor"] = limp, longer
        with suppress(UnsupportedError):
            runs["no floor"] = limp.replace(contacts=False), longer
    total, done, droops = sum(time for _, time in runs.values()), 0.0, {}
    for name, (each, time) in runs.items():
        share = part_of(progress, done / total, time / total)
        droops[name] = _droop(each, time, joint, share, watch=name in ("on", "off"))
        done += time
    on, off = droops.pop("on"), droops.pop("off")
    which = model.joint_id(joint)
    own: AsItComes | None = part(model.backend, "as_it_comes")
    return Gravity(
        joint=joint,
        slide=is_slide(model, joint),
        servo=bool(np.isfinite(model.actuator_kp[model.actuator_jntid == which]).any()),
        servos_on=on,
        servos_off=off,
        longer=droops,
        alone=own.left_alone(model, seconds, which) if own else (),
        provenance=provenance(model),
    )


def _droop(model: Model, seconds: float, joint: str, progress: Progress, watch: bool) -> Droop:
    place, dof = scalar_joint(model, joint)
    bodies = carried_by(model, [int(model.jnt_bodyid[model.joint_id(joint)])])
    total = steps_in(model, seconds)
    marks = {round(mark / model.timestep) for mark in milestones(total * model.timestep)}
    times, positions, path, touches = [], [], np.empty(total + 1), {}
    with make_data(model) as data:
        for k in range(total + 1):
            path[k] = data.qpos[place]
            if k in marks:
                times.append(data.time)
                positions.append(float(data.qpos[place]))
            if k % 1000 == 0:
                progress(k / total)
            if k < total:
                began = data.time
                step(model, data)
                if watch:  # the contacts of a step are those of the state that it started from
                    for touch in touching(model, data.contacts, bodies):
                        touches.setdefault(touch, began)
        forward(model, data)
        at_end = touching(model, data.contacts, bodies)
        for touch in at_end:
            touches.setdefault(touch, data.time)
        return Droop(
            time=np.array(times),
            position=np.array(positions),
            path=path,
            qpos=data.qpos.copy(),
            forces=forces_on(data, dof),
            velocity=float(data.qvel[dof]),
            acceleration=float(data.qacc[dof]),
            touches=touches,
            touching=at_end,
            ctrl_is_zero=not data.ctrl.any(),
        )
