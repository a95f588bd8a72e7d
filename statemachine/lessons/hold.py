"""Six numbers in: a command, the way there, and what is in the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..comparison import largest, together
from ..comparison.text import apart, position, short_time
from ..errors import BadInputError, UnsupportedError
from ..interface import Array, Data, Ints, Model, forward, make_data, step
from ..page import Page, Question, Table, Text, Traces
from ..scenarios import TARGET
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.robot import command, is_slide, moved_by_actuators, scalar_joint, touching
from ..scenarios.runs import Progress, steps_in
from ._words import differences, page_of, spans, typed, where
from .records import Session
from .session import CodeRun, CodeWatch

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
_PRINTED = (0.1, 0.2, 0.3, 0.4)  # s; and at the end
_THERE = np.radians(0.1)  # rad, or m
_STILL = 1e-6  # rad/s or m/s


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """One command, and where the arm is then."""
    target = _target(model, options).tolist()
    loop, nstep = spans(model, _PRINTED, options["seconds"])
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
data.ctrl[:] = {target}
{loop}
    sm.step(model, data, {nstep})
    print(round(data.time, 3), data.qpos.round(3))
"""


def _target(model: Model, options: Mapping[str, Any]) -> Array:
    """The command (nu,) [rad or m]."""
    target = options["target"]
    if not model.nu:
        raise BadInputError(f"{model.path.name} has no actuators: nothing in it takes a command")
    if target is None and model.nu != len(TARGET):
        raise BadInputError(f"{model.path.name} has {model.nu} actuators: say where to, by target")
    return command(model, TARGET if target is None else target, "target")


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


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Hold:
    """Watch the way to the command; then the same with nothing to touch."""
    model = play.model
    names = [model.joint_names[i] if i >= 0 else "" for i in model.actuator_jntid]
    if not all(names):
        raise BadInputError(f"{model.path.name} has actuators that drive no joint")
    addresses = np.array([scalar_joint(model, name) for name in names], dtype=np.int64)
    total = steps_in(model, options["seconds"])
    way = _Way(model, addresses[:, 0], total, progress)
    play(way)
    _, data = play.worlds[0]
    way.end(data)
    goal = data.ctrl.copy()
    return Hold(
        target=goal,
        goal=np.clip(goal, *model.actuator_ctrlrange.T),
        time=np.array(way.times),
        qpos=np.array(way.poses),
        first_contact=way.first,
        touched=way.touched,
        contact_steps=way.contact_steps,
        touching=way.touching,
        speed=data.qvel[addresses[:, 1]].copy(),
        without_contacts=None if way.first is None else _freely(model, goal, total, addresses),
        joints=tuple(names),
        slides=tuple(is_slide(model, name) for name in names),
        servo=bool(np.isfinite(model.actuator_kp).all()),
        provenance=provenance(model),
    )


class _Way(CodeWatch):
    """Where the joints are after each step, and what the robot touched."""

    def __init__(self, model: Model, places: Ints, total: int, progress: Progress) -> None:
        self.robot, self.places = moved_by_actuators(model), places
        self.total, self.progress = total, progress
        self.times: list[float] = []
        self.poses: list[Array] = []
        self.first: float | None = None
        self.touched: tuple[str, ...] = ()
        self.touching: tuple[str, ...] = ()
        self.contact_steps = 0

    def before_step(self, model: Model, data: Data) -> None:
        self._note(data)

    def after_step(self, model: Model, data: Data) -> None:
        # The contacts of a step are those of the state that it started from.
        found = touching(model, data.contacts, self.robot)
        self.contact_steps += bool(found)
        if found and self.first is None:
            self.first, self.touched = self.times[-1], found
        if len(self.times) % 100 == 0:
            self.progress(len(self.times) / self.total)

    def end(self, data: Data) -> None:
        """Look at the state after the last step."""
        self._note(data)
        forward(data.model, data)
        self.touching = touching(data.model, data.contacts, self.robot)
        if self.first is None and self.touching:
            self.first, self.touched = data.time, self.touching

    def _note(self, data: Data) -> None:
        self.times.append(data.time)
        self.poses.append(data.qpos[self.places])


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


def page(results: Mapping[str, Hold], session: Session) -> Page:
    """Error over time, pose at the end, what is in the way."""
    first = next(iter(results.values()))
    end = float(first.time[-1])
    times = [t for t in _TIMES if t < end - 1e-6] + [end]
    text = (
        "ctrl is how you command this robot: one number for each actuator, in the order of "
        "model.actuator_names."
    )
    if first.servo:
        text += (
            " Each is a position servo: it pushes with kp·(ctrl − q) − kv·q̇, within its force "
            "limit, and the arm follows. A script, a joystick and a trained policy all speak to "
            "the robot through this array."
        )
    blocks: list[Any] = [
        Text(text),
        *typed(session, _question(first)),
    ]
    for k in np.flatnonzero(first.goal != first.target).tolist():
        blocks.append(
            Text(
                f"{first.joints[k]} was asked for {_at(first, first.target[k], k)}, beyond its "
                f"range: the servo takes {_at(first, first.goal[k], k)} for it."
            )
        )
    blocks += [
        Table(
            ("time", *results),
            [_row(results, time) for time in times],
            title="The worst joint on the way: how far from its goal",
        ),
        Table(
            ("joint", "goal", *results),
            [
                (
                    joint,
                    _at(first, first.goal[k], k),
                    *(_at(result, result.qpos[-1, k], k) for result in results.values()),
                )
                for k, joint in enumerate(first.joints)
            ],
            title=f"Where it is at {end:g} s",
        ),
    ]
    for name, result in results.items():
        blocks.append(Text(f"{where(results, name)}{_end(result)}"))
    blocks.append(_traces(results))
    blocks += differences(
        results,
        [
            ("any joint, until one touches", lambda a, b: _apart(a, b, False)),
            ("any joint, after that", lambda a, b: _apart(a, b, True)),
            ("any joint, at the end", lambda a, b: _gap(a, np.abs(a.qpos[-1] - b.qpos[-1]))),
            ("at the end, contacts left out", _apart_freely),
        ],
    )
    return page_of("Six numbers in", results, blocks)


def _question(first: Hold) -> Question:
    gaps = np.abs(first.qpos[-1] - first.goal)
    away, (_, worst) = int((gaps > _THERE).sum()), largest(gaps)
    because = f"{away} of {len(gaps)} are farther away; the worst, {first.joints[worst]}, by "
    because += _at(first, gaps[worst], worst)
    if first.without_contacts is not None:
        free = np.abs(first.without_contacts - first.goal)
        because += f". If nothing could touch, it would be {_at(first, free[worst], worst)}"
        if free[worst] < gaps[worst] / 2:
            because += ": what the robot touches pushes too"
    return Question(
        f"which joints are within {_at(first, _THERE, worst)} of their goals after "
        f"{first.time[-1]:g} s? Think of what is around the robot, too.",
        ("all", "some", "none"),
        0 if away == 0 else 2 if away == len(gaps) else 1,
        because + ".",
    )


def _traces(results: Mapping[str, Hold]) -> Traces:
    curves = {}
    for name, result in results.items():
        for k, joint in enumerate(result.joints):
            gap = np.degrees(result.qpos[:, k] - result.goal[k])
            curves[f"{where(results, name)}{joint}"] = (result.time.tolist(), gap.tolist())
    return Traces("The way to the goal", "time [s]", "distance to the goal [°]", curves)


def _gap(one: Hold, gaps: Array, time: float | None = None) -> str:
    """The largest of the joints' gaps, whose it is, and when."""
    gap, joint = largest(gaps)
    found = apart(gap, one.slides[joint])
    if found.startswith("below"):
        return found
    return f"{found}  {one.joints[joint]}" + ("" if time is None else f" at {short_time(time)}")


def _apart(one: Hold, two: Hold, touching: bool) -> str:
    """The worst step before the first touch of either, or from then on."""
    times = [each.first_contact for each in (one, two) if each.first_contact is not None]
    first = round(min(times) / one.provenance.timestep) if times else len(one.time) - 1
    gaps = np.abs(one.qpos - two.qpos).max(axis=1)
    if touching and not times:
        return "nothing touched"
    span = gaps[first + 1 :] if touching else gaps[: first + 1]
    worst = (first + 1 if touching else 0) + largest(span)[1] if len(span) else first
    return _gap(one, np.abs(one.qpos[worst] - two.qpos[worst]), float(one.time[worst]))


def _apart_freely(one: Hold, two: Hold) -> str:
    ends = [r.qpos[-1] if r.without_contacts is None else r.without_contacts for r in (one, two)]
    return _gap(one, np.abs(ends[0] - ends[1]))


def _at(result: Hold, value: float, joint: int) -> str:
    return position(value, result.slides[joint])


def _end(result: Hold) -> str:
    fastest, joint = largest(np.abs(result.speed))
    speed = position(fastest, result.slides[joint], 3)
    text = f"At the end {result.joints[joint]} is the fastest joint; it still moves by {speed}/s."
    if fastest < _STILL:
        text = "At the end everything stands still."
    if result.first_contact is None:
        return text + " The robot touched nothing."
    text += (
        f" The robot touches something in {result.contact_steps} of {len(result.time) - 1} steps, "
        f"first at {result.first_contact:.3f} s: {together(result.touched)}; at the end: "
        f"{together(result.touching) or 'nothing'}"
    )
    gaps = np.abs(result.qpos[-1] - result.goal)
    text += f". The joint farthest from its goal is then {_farthest(result, gaps)}"
    if result.without_contacts is not None:
        free = np.abs(result.without_contacts - result.goal)
        text += f". In a run without contacts it is {_farthest(result, free)}"
    return text + "."


def _farthest(result: Hold, gaps: Array) -> str:
    gap, joint = largest(gaps)
    return f"{result.joints[joint]}, by {_at(result, gap, joint)}"


def _row(results: Mapping[str, Hold], time: float) -> tuple[str, ...]:
    cells = [f"{time:.3f} s"]
    for result in results.values():
        k = int(np.argmin(np.abs(result.time - time)))
        joint = int(np.argmax(np.abs(result.qpos[k] - result.goal)))
        gap = position(result.error[k], result.slides[joint], 3)
        cells.append(f"{gap}  {result.joints[joint]}")
    return tuple(cells)
