"""Six numbers in: a command, the way there, and what is in the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

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
from ...measures import contacts_in_words, largest
from ...measures.text import position, short_time
from ...show.blocks import Block, Table
from ...show.lesson_template import Blocks, Results, Words, differences, largest_gap, where
from ...show.pictures import Traces
from ._older_release import OlderRelease, on_older_release, slots_of_older
from ._robot import check_servos, start_line
from ._torques import Torques, exerted_by, torque_slots, torque_table, torques_of
from .session import CodeRun, Options, stepping_loop

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
_PRINTED = (0.1, 0.2, 0.3, 0.4)  # s; and at the end
_SHOWN = 12  # numbers of qpos that fit in a line
_AT_TARGET = np.radians(0.1)  # rad, or m
_SAY = Words("course/lessons/hold")


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
        """(n+1,) the worst joint's distance to the target [rad; of a slide, m]."""
        return self.distances().max(axis=1)

    @property
    def first_contact(self) -> float | None:
        """When the robot first touches something, or itself [s]; None if it never does."""
        for time, pairs in zip(self.time, self.pairs, strict=True):
            if pairs:
                return float(time)
        return None

    @property
    def touched(self) -> tuple[str, ...]:
        """What touches what then."""
        return next((pairs for pairs in self.pairs if pairs), ())

    @property
    def contact_steps(self) -> int:
        """How many steps found a contact."""
        return sum(len(pairs) > 0 for pairs in self.pairs[:-1])

    @property
    def touching(self) -> tuple[str, ...]:
        """What the robot touches at the end."""
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


def slots(result: HoldResult) -> dict[str, Any]:
    """Fill the slots of the page."""
    gaps = result.distances()[-1]
    away, worst = int((gaps > _AT_TARGET).sum()), largest(gaps)[1]
    slots: dict[str, Any] = {}
    slots["right"] = _right_choice(away, len(gaps))
    slots["within"] = position(_AT_TARGET, result.slides[worst])
    slots["seconds"] = f"{result.time[-1]:g} s"
    slots["away"] = f"{away} of {len(gaps)}"
    slots["worst"] = _farthest(result, gaps)
    slots["free"] = result.without_contacts is not None
    slots["free_worst"] = _farthest(result, np.abs(result.ends_without_contacts() - result.target))
    slots["installed"] = result.provenance.versions[result.provenance.backend]
    slots |= slots_of_older(result.older)
    return slots | _slots_of_touches(result) | torque_slots(result.torques)


def _right_choice(away: int, joints: int) -> int:
    """Return the number of the right choice: all, some or none of the joints are at the target."""
    if away == 0:
        return 0
    return 2 if away == joints else 1


def _slots_of_touches(result: HoldResult) -> dict[str, Any]:
    """Fill the slots about what the robot touches."""
    steps = len(result.time) - 1
    slots: dict[str, Any] = {"touches": result.first_contact is not None}
    slots["touched"] = contacts_in_words(result.touched)
    slots["touching"] = contacts_in_words(result.touching) if result.touching else "nothing"
    ends = [result.qpos[-1], result.ends_without_contacts()]
    gap, free_gap = (float(np.abs(end - result.target).max()) for end in ends)
    slots["pressed"] = bool(result.touching) and gap > max(_AT_TARGET, free_gap)
    slots["contact_steps"] = f"{result.contact_steps} of {steps} steps"
    if result.first_contact is not None:
        slots["touched_at"] = short_time(result.first_contact)
    return slots


def _farthest(result: HoldResult, gaps: Array) -> str:
    """Say which joint is farthest from its target, and by how much."""
    gap, joint = largest(gaps)
    return f"{result.joints[joint]}, by {position(gap, result.slides[joint])}"


def tables(results: Results[HoldResult], first: HoldResult) -> Blocks:
    """Show the worst joint over time, the pose at the end, and the way of each joint."""
    rows: dict[str, Callable[[HoldResult, HoldResult], str]] = {
        _SAY("apart_before"): _apart_before_touch,
        _SAY("apart_after"): _apart_after_touch,
        _SAY("apart_end"): _apart_at_end,
        _SAY("apart_freely"): _apart_freely,
    }
    torques = {name: result.torques for name, result in results.items()}
    curves = [*_curves(results, False), *_curves(results, True)]
    return {
        "way": _way(results, end=float(first.time[-1])),
        "pose": _pose(results, first),
        "torque": torque_table(torques, _SAY),
        "curves": curves,
        "differences": differences(results, rows),
    }


def _way(results: Results[HoldResult], end: float) -> Table:
    """Show how far the worst joint is from its target at some times."""
    times = [time for time in _TIMES if time < end - 1e-6] + [end]
    rows: list[tuple[str, ...]] = []
    for time in times:
        cells = [_worst_at(result, time) for result in results.values()]
        rows.append((f"{time:.3f} s", *cells))
    return Table(("time", *results), rows, _SAY("way"))


def _worst_at(result: HoldResult, time: float) -> str:
    """Say which joint is farthest from its target at a time, and by how much."""
    moment = int(np.argmin(np.abs(result.time - time)))
    gap, joint = largest(result.distances()[moment])
    return f"{position(gap, result.slides[joint], 3)}  {result.joints[joint]}"


def _pose(results: Results[HoldResult], first: HoldResult) -> Table:
    """Show where the joints are to be, and where they are at the end."""
    poses = {"target": first.target}
    if not np.array_equal(first.command, first.target):
        poses = {"command": first.command, **poses}
    for name, result in results.items():
        poses[name] = result.qpos[-1]
    rows: list[tuple[str, ...]] = []
    for k, joint in enumerate(first.joints):
        cells = [position(float(pose[k]), first.slides[k]) for pose in poses.values()]
        rows.append((joint, *cells))
    return Table(("joint", *poses), rows, _SAY("pose", time=f"{first.time[-1]:g} s"))


def _curves(results: Results[HoldResult], slide: bool) -> list[Block]:
    """Draw how far each slide, or each other joint, is from its target."""
    scale, unit = (1e3, "mm") if slide else (np.degrees(1.0), "°")
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for name, result in results.items():
        prefix = where(results, name)
        distances = scale * (result.qpos - result.target)
        for k, joint in enumerate(result.joints):
            if result.slides[k] is slide:
                curves[f"{prefix}{joint}"] = (result.time.tolist(), distances[:, k].tolist())
    if not curves:
        return []
    return [Traces(_SAY("curves"), "time [s]", _SAY("distance", unit=unit), curves)]


def _after_touch(left: HoldResult, right: HoldResult) -> int:
    """Return the row after that in which one of two runs first touches something."""
    times = [run.first_contact for run in (left, right) if run.first_contact is not None]
    if not times:
        return len(left.time)
    return round(min(times) / left.provenance.timestep) + 1


def _apart_before_touch(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint up to the first touch."""
    return _apart(left, right, slice(_after_touch(left, right)))


def _apart_after_touch(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint after the first touch."""
    return _apart(left, right, slice(_after_touch(left, right), None))


def _apart_at_end(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint at the end."""
    return _apart(left, right, slice(-1, None))


def _apart(left: HoldResult, right: HoldResult, rows: slice) -> str:
    """Return the largest gap of a joint in some rows of two runs."""
    return largest_gap(left.qpos[rows], right.qpos[rows], left.slides, left.joints, left.time[rows])


def _apart_freely(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint at the ends without contacts."""
    poses = left.ends_without_contacts()[None], right.ends_without_contacts()[None]
    return largest_gap(*poses, slides=left.slides, names=left.joints, time=np.array([]))
