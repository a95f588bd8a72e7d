"""Six numbers in: a command, the way there, and what is in the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..backends import load
from ..errors import DivergedError, StateMachineError, UnsupportedError
from ..installed import DEFAULT
from ..interface import Array, Data, Ints, JointType, Model, forward, make_data, reset, step
from ..measures import largest, together
from ..measures.text import position, short_time
from ..page import Figures, Table, Traces
from ..releases import is_here, version_of
from ..runs import record_scenario, shipped
from ..runs.drive import Progress, steps_in
from ..runs.header import model_digest, provenance
from ..runs.robot import command, hold_ctrl, is_servo, start_keyframe, touching, trees_of_actuators
from ..runs.scenarios import SCENARIOS
from ._robot import check_servos, start_line
from .session import CodeRun, Options, stepping_loop
from .template import Results, differences, largest_gap, where

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
_PRINTED = (0.1, 0.2, 0.3, 0.4)  # s; and at the end
_SHOWN = 12  # numbers of qpos that fit in a line
_AT_GOAL = np.radians(0.1)  # rad, or m
OLDER = "mujoco==3.3.7"  # its servos damp where their force is at its limit, too


def code(model: Model, options: Options, load: str) -> str:
    """One command, and where the robot is then."""
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


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Watch the way to the command; then the same with nothing to touch.

    Returns:
        target: (k,) what the servos are told, of the k joints that they drive [rad; of a slide, m].
        goal: (k,) the same within ctrlrange, which is what the servos see.
        time: (n+1,) [s].
        qpos: (n+1, k) the joints.
        error: (n+1,) the worst joint's distance to the goal [rad; of a slide, m].
        first_contact: When the robot first touched something, or itself [s], or None.
        touched: What touched what then; contact_steps: how many steps found a contact.
        touching: What it touches at the end.
        speed: (k,) velocities of the joints at the end.
        without_contacts: (k,) where the joints end if nothing can touch; None if
            nothing did, or the backend cannot leave contacts out.
        joints: Names of the joints; slides: which of them are slides.
        keyframe: Where the run starts, None for the default state.
        older: The same run on an older release; None for another run than the course's.
    """
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
    looks = [*course.looks, touched(model, data)]
    touches = [(time, pairs) for time, pairs in zip(course.time, looks, strict=True) if pairs]
    first_contact, first_pairs = touches[0] if touches else (None, ())
    ctrl, gear = data.ctrl.copy(), model.actuator_gear[servos]
    goal = np.clip(ctrl, *model.actuator_ctrlrange.T)[servos] / gear
    qpos = np.array(course.qpos)
    return Figures(
        target=ctrl[servos] / gear,
        goal=goal,
        time=np.array(course.time),
        qpos=qpos[:, places],
        error=np.abs(qpos[:, places] - goal).max(axis=1),
        first_contact=first_contact,
        touched=first_pairs,
        contact_steps=sum(map(bool, course.looks)),
        touching=looks[-1],
        speed=data.qvel[model.jnt_dofadr[joints]].copy(),
        without_contacts=None if not touches else _freely(model, ctrl, total, places),
        joints=tuple(model.joint_names[joint] or f"joint {joint}" for joint in joints),
        slides=tuple((model.jnt_type[joints] == JointType.SLIDE).tolist()),
        keyframe=start_keyframe(model),
        older=_on_older_release(model, ctrl, qpos),
        provenance=provenance(model),
    )


def _on_older_release(model: Model, ctrl: Array, qpos: Array) -> Figures | None:
    """The run (n, nq) of the course on a release that is older than the installed one.

    Returns:
        version: Of that release.
        gap: The largest distance between the same joint on the two [rad]; joint: which; at: when
            [s].
        recorded: Whether it is the recorded run that comes with the package.
    """
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
    return Figures(
        version=version_of(OLDER),
        gap=gap,
        joint=model.joint_names[joint],
        at=float(known.time[moment]),
        recorded=not here,
    )


def _freely(model: Model, ctrl: Array, steps: int, places: Ints) -> Array | None:
    """Where the joints end if nothing can touch anything."""
    try:
        alone = model.replace(contacts=False)
        with make_data(alone) as data:
            reset(alone, data, start_keyframe(model))
            data.ctrl = ctrl
            step(alone, data, steps)
            return data.qpos[places].copy()
    except (UnsupportedError, DivergedError):
        return None


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    gaps, free = np.abs(result.qpos[-1] - result.goal), result.without_contacts
    away, worst = int((gaps > _AT_GOAL).sum()), largest(gaps)[1]
    free_gaps, older = gaps if free is None else np.abs(free - result.goal), result.older
    return {
        "right": 0 if away == 0 else 2 if away == len(gaps) else 1,
        "within": position(_AT_GOAL, result.slides[worst]),
        "seconds": f"{result.time[-1]:g} s",
        "away": f"{away} of {len(gaps)}",
        "worst": _farthest(result, gaps),
        "touches": result.first_contact is not None,
        "touched": together(result.touched),
        "touched_at": "" if result.first_contact is None else short_time(result.first_contact),
        "touching": together(result.touching) or "nothing",
        "contact_steps": f"{result.contact_steps} of {len(result.time) - 1} steps",
        "free": free is not None,
        "free_worst": _farthest(result, free_gaps),
        "older": bool(older),
        "older_right": sum(older.gap > np.radians(limit) for limit in (1e-3, 1)) if older else 0,
        "older_version": older and older.version,
        "older_joint": older and older.joint,
        "older_at": short_time(older.at) if older else "",
        "older_gap": position(older.gap, False) if older else "",
        "older_recorded": older and older.recorded,
        "installed": result.provenance.versions[result.provenance.backend],
    }


def _farthest(result: Figures, gaps: Array) -> str:
    gap, joint = largest(gaps)
    return f"{result.joints[joint]}, by {position(gap, result.slides[joint])}"


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """The worst joint over time, the pose at the end, and the way of each joint."""
    end = float(first.time[-1])
    clipped = not np.array_equal(first.target, first.goal)

    poses = [first.target] * clipped + [first.goal, *(r.qpos[-1] for r in results.values())]
    ends = [
        (joint, *(position(float(pose[k]), first.slides[k]) for pose in poses))
        for k, joint in enumerate(first.joints)
    ]
    return {
        "way": Table(
            ("time", *results),
            [_row(results, time) for time in [*(t for t in _TIMES if t < end - 1e-6), end]],
            title="The worst joint on the way: how far from its goal",
        ),
        "pose": Table(
            ("joint", *["asked for"] * clipped, "goal", *results),
            ends,
            title=f"Where it is at {end:g} s",
        ),
        "curves": [
            Traces("The way to the goal", "time [s]", f"distance to the goal [{unit}]", curves)
            for slide, unit, scale in ((False, "°", np.degrees(1.0)), (True, "mm", 1e3))
            if (curves := _curves(results, slide, scale))
        ],
        "differences": differences(
            results,
            {
                "any joint, until one touches": lambda a, b: _apart(a, b, slice(_touch(a, b))),
                "any joint, after that": lambda a, b: _apart(a, b, slice(_touch(a, b), None)),
                "any joint, at the end": lambda a, b: _apart(a, b, slice(-1, None)),
                "at the end, contacts left out": _apart_freely,
            },
        ),
    }


def _row(results: Results, time: float) -> tuple[str, ...]:
    cells = [f"{time:.3f} s"]
    for result in results.values():
        k = int(np.argmin(np.abs(result.time - time)))
        gap, joint = largest(np.abs(result.qpos[k] - result.goal))
        cells.append(f"{position(gap, result.slides[joint], 3)}  {result.joints[joint]}")
    return tuple(cells)


def _curves(results: Results, slide: bool, scale: float) -> dict[str, Any]:
    """How far each joint is from its goal; those that are slides, or the others."""
    return {
        f"{where(results, name)}{joint}": (
            result.time.tolist(),
            (scale * (result.qpos[:, k] - result.goal[k])).tolist(),
        )
        for name, result in results.items()
        for k, joint in enumerate(result.joints)
        if result.slides[k] is slide
    }


def _touch(left: Figures, right: Figures) -> int:
    """The row after that in which one of two runs first touches something."""
    times = [run.first_contact for run in (left, right) if run.first_contact is not None]
    return round(min(times) / left.provenance.timestep) + 1 if times else len(left.time)


def _apart(left: Figures, right: Figures, rows: slice) -> str:
    """The largest gap of a joint in some rows of two runs."""
    return largest_gap(left.qpos[rows], right.qpos[rows], left.slides, left.joints, left.time[rows])


def _apart_freely(left: Figures, right: Figures) -> str:
    """That of the ends without contacts."""
    free = [r.qpos[-1] if r.without_contacts is None else r.without_contacts for r in (left, right)]
    return largest_gap(free[0][None], free[1][None], left.slides, left.joints, np.array([]))
