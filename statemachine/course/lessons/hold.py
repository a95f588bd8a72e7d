"""Six numbers in: a command, the way there, and what is in the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...backends import load
from ...errors import DivergedError, StateMachineError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Array, Data, Ints, JointType, Model, forward, make_data, reset, step
from ...lab.recordings import record_scenario, shipped
from ...lab.runs.drive import Progress, steps_in
from ...lab.runs.provenance import Provenance, model_digest, provenance
from ...lab.runs.robot import (
    command,
    is_servo,
    start_keyframe,
    touching,
    trees_of_actuators,
)
from ...lab.runs.scenarios import SCENARIOS
from ...lab.runs.usual_commands import hold_ctrl
from ...measures import largest, together
from ...measures.text import position, short_time
from ...release_names import version_of
from ...releases import is_here
from ...show.blocks import Block, Table
from ...show.lesson_template import Blocks, Results, differences, largest_gap, where
from ...show.pictures import Traces
from ._robot import check_servos, start_line
from .session import CodeRun, Options, stepping_loop

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
_PRINTED = (0.1, 0.2, 0.3, 0.4)  # s; and at the end
_SHOWN = 12  # numbers of qpos that fit in a line
_AT_GOAL = np.radians(0.1)  # rad, or m
OLDER = "mujoco==3.3.7"  # its servos damp where their force is at its limit, too


@dataclass(frozen=True)
class OlderRelease:
    """The run of the course on a release that is older than the installed one.

    Attributes:
        version: Of that release.
        gap: The largest distance between the same joint on the two [rad].
        joint: Which joint it is.
        at: When [s].
        recorded: Whether it is the recorded run that comes with the package.
    """

    version: str
    gap: float
    joint: str
    at: float
    recorded: bool


@dataclass(frozen=True)
class HoldResult:
    """The way of the k joints that servos drive to a command, and what is in the way.

    Attributes:
        target: (k,) what the servos are told [rad; of a slide, m].
        goal: (k,) the same within ctrlrange, which is what the servos see.
        time: (n+1,) [s].
        qpos: (n+1, k) the joints [rad; of a slide, m].
        pairs: (n+1,) what of the robot touches what, or itself, in each of the states.
        speed: (k,) velocities of the joints at the end [rad/s; of a slide, m/s].
        without_contacts: (k,) where the joints end if nothing can touch; None if nothing did, or
            the backend cannot leave contacts out.
        joints: (k,) their names.
        slides: (k,) which of them are slides.
        keyframe: Where the run starts, None for the default state.
        older: The same run on an older release; None for another run than the course's.
        provenance: What it was computed with.
    """

    target: Array
    goal: Array
    time: Array
    qpos: Array
    pairs: tuple[tuple[str, ...], ...] = field(metadata={"json": False})
    speed: Array
    without_contacts: Array | None
    joints: tuple[str, ...]
    slides: tuple[bool, ...]
    keyframe: str | None
    older: OlderRelease | None
    provenance: Provenance

    @property
    def error(self) -> Array:
        """(n+1,) the worst joint's distance to the goal [rad; of a slide, m]."""
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
        """Return how far each joint is from its goal at each moment (n+1, k) [rad or m]."""
        return np.abs(self.qpos - self.goal)

    def ends_without_contacts(self) -> Array:
        """Return where the joints end if nothing can touch (k,), or where they end."""
        return self.qpos[-1] if self.without_contacts is None else self.without_contacts


def code(model: Model, options: Options, load: str) -> str:
    """Write one command, and read where the robot is then."""
    check_servos(model, "hold")
    target = options["target"]
    ctrl = hold_ctrl(model) if target is None else command(model, target, "target")
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
    places, total = model.jnt_qposadr[joints], steps_in(model, options["seconds"])
    robot = trees_of_actuators(model)

    def touched(model: Model, data: Data) -> tuple[str, ...]:
        return touching(model, data.contacts, robot, each_other=True)

    (course,) = play.follow(touched, total, progress)
    _, data = play.worlds[0]
    forward(model, data)
    pairs = (*course.looks, touched(model, data))
    ctrl, gear = data.ctrl.copy(), model.actuator_gear[servos]
    target = ctrl[servos] / gear
    goal = np.clip(ctrl, *model.actuator_ctrlrange.T)[servos] / gear
    qpos = np.array(course.qpos)
    path = qpos[:, places]
    slides = tuple((model.jnt_type[joints] == JointType.SLIDE).tolist())
    speed = data.qvel[model.jnt_dofadr[joints]].copy()
    freely = _freely(model, ctrl, total, places) if any(pairs) else None
    older = _on_older_release(model, ctrl, qpos)
    return HoldResult(
        target=target,
        goal=goal,
        time=np.array(course.time),
        qpos=path,
        pairs=pairs,
        speed=speed,
        without_contacts=freely,
        joints=_names_of(model, joints),
        slides=slides,
        keyframe=start_keyframe(model),
        older=older,
        provenance=provenance(model),
    )


def _names_of(model: Model, joints: Ints) -> tuple[str, ...]:
    """Return the names of joints, or "joint 3" of one without."""
    names = [model.joint_names[joint] for joint in joints]
    return tuple(
        name if name else f"joint {joint}" for joint, name in zip(joints, names, strict=True)
    )


def _on_older_release(model: Model, ctrl: Array, qpos: Array) -> OlderRelease | None:
    """Compare the run (n, nq) of the course with that on a release older than the installed one."""
    if model.backend != DEFAULT:
        return None
    known, here = shipped("hold", OLDER), is_here(OLDER)
    same_file = known.header.provenance.model_sha256 == model_digest(model.path)
    same_run = known.qpos.shape == qpos.shape and np.array_equal(known.ctrl[-1], ctrl)
    if not (same_file and same_run):
        return None
    if here:
        try:
            known = record_scenario(SCENARIOS["hold"], load(model.path, OLDER))
        except StateMachineError:  # it does not run any more
            here = False
    gap, place = largest(np.abs(known.qpos - qpos).ravel())
    moment, joint = divmod(place, qpos.shape[1])
    return OlderRelease(
        version=version_of(OLDER),
        gap=gap,
        joint=model.joint_names[joint],
        at=float(known.time[moment]),
        recorded=not here,
    )


def _freely(model: Model, ctrl: Array, steps: int, places: Ints) -> Array | None:
    """Return where the joints end if nothing can touch anything; None if that cannot be run."""
    try:
        alone = model.replace(contacts=False)
        with make_data(alone) as data:
            reset(alone, data, start_keyframe(model))
            data.ctrl = ctrl
            step(alone, data, steps)
            return data.qpos[places].copy()
    except (UnsupportedError, DivergedError):
        return None


def slots(result: HoldResult) -> dict[str, Any]:
    """Fill the slots of the page."""
    gaps = result.distances()[-1]
    away, worst = int((gaps > _AT_GOAL).sum()), largest(gaps)[1]
    slots: dict[str, Any] = {}
    slots["right"] = _right_choice(away, len(gaps))
    slots["within"] = position(_AT_GOAL, result.slides[worst])
    slots["seconds"] = f"{result.time[-1]:g} s"
    slots["away"] = f"{away} of {len(gaps)}"
    slots["worst"] = _farthest(result, gaps)
    slots["free"] = result.without_contacts is not None
    slots["free_worst"] = _farthest(result, np.abs(result.ends_without_contacts() - result.goal))
    slots["installed"] = result.provenance.versions[result.provenance.backend]
    return slots | _slots_of_touches(result) | _slots_of_older(result.older)


def _right_choice(away: int, joints: int) -> int:
    """Return the number of the right choice: all, some or none of the joints are at their goals."""
    if away == 0:
        return 0
    return 2 if away == joints else 1


def _slots_of_touches(result: HoldResult) -> dict[str, Any]:
    """Fill the slots about what the robot touches."""
    steps = len(result.time) - 1
    slots: dict[str, Any] = {"touches": result.first_contact is not None}
    slots["touched"] = together(result.touched)
    slots["touching"] = together(result.touching) if result.touching else "nothing"
    slots["contact_steps"] = f"{result.contact_steps} of {steps} steps"
    if result.first_contact is not None:
        slots["touched_at"] = short_time(result.first_contact)
    return slots


def _slots_of_older(older: OlderRelease | None) -> dict[str, Any]:
    """Fill the slots about the older release."""
    if older is None:
        texts = ("older_version", "older_joint", "older_at", "older_gap")
        return dict.fromkeys(texts, "") | {
            "older": False,
            "older_right": None,
            "older_recorded": False,
        }
    limits = np.radians(1e-3), np.radians(1)  # of the choices
    return {
        "older": True,
        "older_right": sum(older.gap > limit for limit in limits),
        "older_version": older.version,
        "older_joint": older.joint,
        "older_at": short_time(older.at),
        "older_gap": position(older.gap, False),
        "older_recorded": older.recorded,
    }


def _farthest(result: HoldResult, gaps: Array) -> str:
    """Say which joint is farthest from its goal, and by how much."""
    gap, joint = largest(gaps)
    return f"{result.joints[joint]}, by {position(gap, result.slides[joint])}"


def tables(results: Results[HoldResult], first: HoldResult) -> Blocks:
    """Show the worst joint over time, the pose at the end, and the way of each joint."""
    rows: dict[str, Callable[[HoldResult, HoldResult], str]] = {
        "any joint, until one touches": _apart_before_touch,
        "any joint, after that": _apart_after_touch,
        "any joint, at the end": _apart_at_end,
        "at the end, contacts left out": _apart_freely,
    }
    return {
        "way": _way(results, end=float(first.time[-1])),
        "pose": _pose(results, first),
        "curves": [*_curves(results, False), *_curves(results, True)],
        "differences": differences(results, rows),
    }


def _way(results: Results[HoldResult], end: float) -> Table:
    """Show how far the worst joint is from its goal at some times."""
    times = [time for time in _TIMES if time < end - 1e-6] + [end]
    rows: list[tuple[str, ...]] = []
    for time in times:
        cells = [_worst_at(result, time) for result in results.values()]
        rows.append((f"{time:.3f} s", *cells))
    title = "The worst joint on the way: how far from its goal"
    return Table(("time", *results), rows, title)


def _worst_at(result: HoldResult, time: float) -> str:
    """Say which joint is farthest from its goal at a time, and by how much."""
    moment = int(np.argmin(np.abs(result.time - time)))
    gap, joint = largest(result.distances()[moment])
    return f"{position(gap, result.slides[joint], 3)}  {result.joints[joint]}"


def _pose(results: Results[HoldResult], first: HoldResult) -> Table:
    """Show where the joints are to be, and where they are at the end."""
    poses = {"goal": first.goal}
    if not np.array_equal(first.target, first.goal):
        poses = {"asked for": first.target, **poses}
    for name, result in results.items():
        poses[name] = result.qpos[-1]
    rows: list[tuple[str, ...]] = []
    for k, joint in enumerate(first.joints):
        cells = [position(float(pose[k]), first.slides[k]) for pose in poses.values()]
        rows.append((joint, *cells))
    return Table(("joint", *poses), rows, title=f"Where it is at {first.time[-1]:g} s")


def _curves(results: Results[HoldResult], slide: bool) -> list[Block]:
    """Draw how far each slide, or each other joint, is from its goal."""
    scale, unit = (1e3, "mm") if slide else (np.degrees(1.0), "°")
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for name, result in results.items():
        prefix = where(results, name)
        distances = scale * (result.qpos - result.goal)
        for k, joint in enumerate(result.joints):
            if result.slides[k] is slide:
                curves[f"{prefix}{joint}"] = (result.time.tolist(), distances[:, k].tolist())
    if not curves:
        return []
    return [Traces("The way to the goal", "time [s]", f"distance to the goal [{unit}]", curves)]


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
