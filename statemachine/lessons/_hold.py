"""What a robot does with a command: the record of a run, and its figures in words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..interface import Array
from ..measures import largest, together
from ..measures.text import apart, position, short_time
from ..page import Question, Traces
from ..runs.provenance import Provenance
from ._words import where

_THERE = np.radians(0.1)  # rad, or m
_STILL = 1e-6  # rad/s or m/s


@dataclass(frozen=True, eq=False)
class Hold:
    """The response to one command from the start.

    Of the k joints that are driven; of a robot whose actuators drive none directly, of all.

    Attributes:
        target: (k,) what their position servos are told [rad; of a slide, m]; NaN where a joint
            has none.
        goal: (k,) the same within ctrlrange, which is what the servos see.
        time: (n+1,) [s].
        qpos: (n+1, k) the joints.
        first_contact: When the robot first touched something [s], or None.
        touched: What touched what then; contact_steps: how many steps found a contact.
        touching: What it touches at the end.
        speed: (k,) velocities of the joints at the end.
        without_contacts: (k,) where the joints end if nothing can touch; None if
            nothing did, or the backend cannot leave contacts out.
        joints: Names of the joints; slides: which of them are slides.
        servo: Whether all are driven by position servos.
        actuators: How many numbers ctrl has; keyframe: where the run starts, None for the
            default state.
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
    actuators: int
    keyframe: str | None
    provenance: Provenance

    @property
    def error(self) -> Array:
        """(n+1,) the worst joint's distance to the goal [rad; of a slide, m]; NaN without one."""
        away = np.abs(self.qpos - self.goal)[:, self.told()]
        return away.max(axis=1) if away.size else np.full(len(self.time), np.nan)

    def told(self) -> list[int]:
        """Which of the joints have a goal."""
        return np.flatnonzero(np.isfinite(self.goal)).tolist()


def question(first: Hold) -> Question | None:
    if len(first.told()) < len(first.joints):
        return None
    gaps = np.abs(first.qpos[-1] - first.goal)
    away, (_, worst) = int((gaps > _THERE).sum()), largest(gaps)
    because = f"{away} of {len(gaps)} are farther away; the worst, {first.joints[worst]}, by "
    because += at(first, gaps[worst], worst)
    if first.without_contacts is not None:
        free = np.abs(first.without_contacts - first.goal)
        because += f". If nothing could touch, it would be {at(first, free[worst], worst)}"
        if free[worst] < gaps[worst] / 2:
            because += ": what the robot touches pushes too"
    return Question(
        f"which joints are within {at(first, _THERE, worst)} of their goals after "
        f"{first.time[-1]:g} s? Think of what is around the robot, too.",
        ("all", "some", "none"),
        0 if away == 0 else 2 if away == len(gaps) else 1,
        because + ".",
    )


def traces(results: Mapping[str, Hold]) -> list[Traces]:
    """How far each joint is from its goal, or has come where it has none; angles and lengths."""
    found = []
    for slide, unit, scale in ((False, "°", np.degrees(1.0)), (True, "mm", 1e3)):
        for told in (True, False):
            curves = {}
            for name, result in results.items():
                away = result.qpos - (result.goal if told else result.qpos[0])
                for k, joint in enumerate(result.joints):
                    if result.slides[k] is slide and (k in result.told()) is told:
                        path = (result.time.tolist(), (scale * away[:, k]).tolist())
                        curves[f"{where(results, name)}{joint}"] = path
            if curves:
                title = "The way to the goal" if told else "The way from the start"
                what = "distance to the goal" if told else "moved by"
                found.append(Traces(title, "time [s]", f"{what} [{unit}]", curves))
    return found


def gap(one: Hold, gaps: Array, time: float | None = None) -> str:
    """The largest of the joints' gaps, whose it is, and when."""
    gap, joint = largest(gaps)
    found = apart(gap, one.slides[joint])
    if found.startswith("below"):
        return found
    return f"{found}  {one.joints[joint]}" + ("" if time is None else f" at {short_time(time)}")


def apart_until(one: Hold, two: Hold, touching: bool) -> str:
    """The worst step before the first touch of either, or from then on."""
    times = [each.first_contact for each in (one, two) if each.first_contact is not None]
    first = round(min(times) / one.provenance.timestep) if times else len(one.time) - 1
    gaps = np.abs(one.qpos - two.qpos).max(axis=1)
    if touching and not times:
        return "nothing touched"
    span = gaps[first + 1 :] if touching else gaps[: first + 1]
    worst = (first + 1 if touching else 0) + largest(span)[1] if len(span) else first
    return gap(one, np.abs(one.qpos[worst] - two.qpos[worst]), float(one.time[worst]))


def apart_freely(one: Hold, two: Hold) -> str:
    ends = [r.qpos[-1] if r.without_contacts is None else r.without_contacts for r in (one, two)]
    return gap(one, np.abs(ends[0] - ends[1]))


def at(result: Hold, value: float, joint: int) -> str:
    return position(value, result.slides[joint])


def at_end(result: Hold) -> str:
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
    if not result.told():
        return text + "."
    gaps = np.abs(result.qpos[-1] - result.goal)
    text += f". The joint farthest from its goal is then {_farthest(result, gaps)}"
    if result.without_contacts is not None:
        free = np.abs(result.without_contacts - result.goal)
        text += f". In a run without contacts it is {_farthest(result, free)}"
    return text + "."


def _farthest(result: Hold, gaps: Array) -> str:
    gap, joint = largest(np.nan_to_num(gaps, nan=-1.0))
    return f"{result.joints[joint]}, by {at(result, gap, joint)}"


def row(results: Mapping[str, Hold], time: float) -> tuple[str, ...]:
    cells = [f"{time:.3f} s"]
    for result in results.values():
        k = int(np.argmin(np.abs(result.time - time)))
        joint = int(np.nanargmax(np.abs(result.qpos[k] - result.goal)))
        gap = position(result.error[k], result.slides[joint], 3)
        cells.append(f"{gap}  {result.joints[joint]}")
    return tuple(cells)
