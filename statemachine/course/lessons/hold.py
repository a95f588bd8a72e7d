"""Six numbers in: a command, the way there, and what is in the way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...errors import DivergedError, UnsupportedError
from ...interface import Array, Data, Ints, JointType, Model, forward, make_data, reset, step
from ...lab.runs.drive import Progress, number_of_steps
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.robot import (
    actuated_trees,
    checked_ctrl,
    contact_names,
    home_keyframe,
    is_servo,
)
from ...lab.runs.usual_commands import hold_ctrl
from ._older_release import OlderRelease, on_older_release
from ._robot import check_servos, start_line
from ._torques import Torques, exerted_by, torques_of
from .session import CodeRun, Options, stepping_loop

_PRINTED = (0.1, 0.2, 0.3, 0.4)  # s; and at the end
_SHOWN = 12  # numbers of qpos that fit in a line


@dataclass(frozen=True)
class _Look:
    """What is looked at after a step.

    Attributes:
        pairs: What of the robot touches what, or itself.
        torque: (k,) what the servos exert [N·m; of a slide, N]; None where it is not told.
    """

    pairs: tuple[str, ...]
    torque: Array | None


@dataclass(frozen=True)
class HoldResult:
    """The way of the k joints that servos drive to a command, and what is in the way.

    Attributes:
        command: (k,) what ctrl says [rad; of a slide, m].
        target: (k,) the same within ctrlrange, which is what the servos aim at.
        time: (n+1,) [s].
        qpos: (n+1, k) the joints [rad; of a slide, m].
        pairs: (n+1,) what of the robot touches what, or itself, in each of the states.
        speed: (k,) velocities of the joints at the end [rad/s; of a slide, m/s].
        without_contacts: (k,) where the joints end if nothing can touch; None if nothing did, or
            the backend cannot leave contacts out.
        joints: (k,) their names.
        slides: (k,) which of them are slides.
        keyframe: Where the run starts, None for the default state.
        torques: What the servos exert; None where the backend does not tell it.
        further: Whether what goes further was asked for.
        older: The same run on an older release; None where that was not asked for, and for another
            run than the course's.
        provenance: What it was computed with.
    """

    command: Array
    target: Array
    time: Array
    qpos: Array
    pairs: tuple[tuple[str, ...], ...] = field(metadata={"json": False})
    speed: Array
    without_contacts: Array | None
    joints: tuple[str, ...]
    slides: tuple[bool, ...]
    keyframe: str | None
    torques: Torques | None
    further: bool
    older: OlderRelease | None
    provenance: Provenance

    @property
    def error(self) -> Array:
        """Return the worst joint's distance to the target (n+1,) [rad; of a slide, m]."""
        return self.distances().max(axis=1)

    @property
    def first_contact(self) -> float | None:
        """Return when the robot first touches something, or itself [s]; None if it never does."""
        for time, pairs in zip(self.time, self.pairs, strict=True):
            if pairs:
                return float(time)
        return None

    @property
    def touched(self) -> tuple[str, ...]:
        """Return what touches what then."""
        return next((pairs for pairs in self.pairs if pairs), ())

    @property
    def contact_steps(self) -> int:
        """Return how many steps found a contact."""
        return sum(len(pairs) > 0 for pairs in self.pairs[:-1])

    @property
    def touching(self) -> tuple[str, ...]:
        """Return what the robot touches at the end."""
        return self.pairs[-1]

    def distances(self) -> Array:
        """Return how far each joint is from its target at each moment (n+1, k) [rad or m]."""
        return np.abs(self.qpos - self.target)

    def ends_without_contacts(self) -> Array:
        """Return where the joints end if nothing can touch (k,), or where they end."""
        return self.qpos[-1] if self.without_contacts is None else self.without_contacts


def code(model: Model, options: Options, load: str) -> str:
    """Write one command, and read where the robot is then."""
    check_servos(model, "hold")
    ctrl = hold_ctrl(model)
    if options["ctrl"] is not None:
        ctrl = checked_ctrl(model, options["ctrl"])
    loop, nstep = stepping_loop(model, _PRINTED, options["seconds"])
    shown = "data.qpos" if model.nq <= _SHOWN else f"data.qpos[:{_SHOWN}]"
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
{start_line(model, "model")}data.ctrl[:] = {ctrl.tolist()}
{loop}
    sm.step(model, data, {nstep})
    print(round(data.time, 3), {shown}.round(3))
"""


def run(play: CodeRun, options: Options, progress: Progress) -> HoldResult:
    """Watch the way to the command; then the same with nothing to touch."""
    model = play.model
    servos = np.flatnonzero(is_servo(model))
    joints = model.actuator_jntid[servos]
    places, total = model.jnt_qposadr[joints], number_of_steps(model, options["seconds"])
    robot = actuated_trees(model)

    def touched(model: Model, data: Data) -> tuple[str, ...]:
        return contact_names(model, data.contacts, robot, each_other=True)

    def look(model: Model, data: Data) -> _Look:
        return _Look(touched(model, data), exerted_by(data, model.jnt_dofadr[joints]))

    (course,) = play.follow(look, total, progress)
    _, data = play.worlds[0]
    forward(model, data)
    pairs = (*(each.pairs for each in course.looks), touched(model, data))
    exerted = [each.torque for each in course.looks]
    ctrl, gear = data.ctrl.copy(), model.actuator_gear[servos]
    target = np.clip(ctrl, *model.actuator_ctrlrange.T)[servos] / gear
    qpos, time = np.array(course.qpos), np.array(course.time)
    path = qpos[:, places]
    slides = tuple((model.jnt_type[joints] == JointType.SLIDE).tolist())
    speed = data.qvel[model.jnt_dofadr[joints]].copy()
    freely = _freely(model, ctrl, total, places) if any(pairs) else None
    names = _names_of(model, joints)
    torques = torques_of(model, servos, names, slides, exerted)
    older = on_older_release(model, ctrl, qpos) if options["further"] else None
    told = ctrl[servos] / gear
    return HoldResult(
        command=told,
        target=target,
        time=time,
        qpos=path,
        pairs=pairs,
        speed=speed,
        without_contacts=freely,
        joints=names,
        slides=slides,
        keyframe=home_keyframe(model),
        torques=torques,
        further=options["further"],
        older=older,
        provenance=provenance(model),
    )


def _names_of(model: Model, joints: Ints) -> tuple[str, ...]:
    """Return the names of joints, or "joint 3" of one without."""
    names = [model.joint_names[joint] for joint in joints]
    return tuple(
        name if name else f"joint {joint}" for joint, name in zip(joints, names, strict=True)
    )


def _freely(model: Model, ctrl: Array, steps: int, places: Ints) -> Array | None:
    """Return where the joints end if nothing can touch anything; None if that cannot be run."""
    try:
        alone = model.replace(contacts=False)
        with make_data(alone) as data:
            reset(alone, data, home_keyframe(model))
            data.ctrl = ctrl
            step(alone, data, steps)
            return data.qpos[places].copy()
    except (UnsupportedError, DivergedError):
        return None
