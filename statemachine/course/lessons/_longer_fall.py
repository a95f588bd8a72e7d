"""A joint without its servo for much longer: who caught it, and does it stay there?"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from ...errors import DivergedError, UnsupportedError
from ...interface import Model, make_data, reset
from ...lab.runs.drive import Progress, drive, number_of_steps, progress_of_stage
from ...lab.runs.robot import FREE_FALL, UNACTUATED, start_keyframe
from ...measures.text import position
from ...show.blocks import Block
from ...show.lesson_template import Words
from ...show.pictures import Traces
from ._falling import BALANCE, Droop, course_table, droop
from ._robot import coordinate

_CREEP = 0.05  # of the way; a joint that goes on by more has not settled
_FURTHER = 0.02  # rad or m; less is not worth a cause


def longer_falls(model: Model, joint: str, seconds: float, progress: Progress) -> dict[str, Droop]:
    """Leave a model without its servos alone, with contacts and, if it can be, without.

    Args:
        model: With its servos.
        joint: That is watched.
        seconds: Simulated time of each run; 0 for no run.
        progress: Told the fraction that is done.

    Returns:
        The runs, by what can touch in them.
    """
    variants = _variants(model, seconds)
    falls: dict[str, Droop] = {}
    for number, (name, variant) in enumerate(variants.items()):
        share = progress_of_stage(progress, number / len(variants), 1 / len(variants))
        falls[name] = _left_alone(variant, joint, seconds, share)
    return falls


def _variants(model: Model, seconds: float) -> dict[str, Model]:
    """Return the Models of the longer runs, by what can touch in them; none for no time."""
    if not seconds:
        return {}
    number_of_steps(model, seconds)  # says what is wrong with it
    variants = {"contacts": model.replace(**UNACTUATED)}
    with suppress(UnsupportedError):
        variants["no contacts"] = model.replace(**FREE_FALL)
    return variants


def _left_alone(model: Model, joint: str, seconds: float, progress: Progress) -> Droop:
    """Run a Model from its start without writing ctrl, and watch a joint."""
    place, steps = coordinate(model, joint).place, number_of_steps(model, seconds)
    with make_data(model) as data:
        reset(model, data, start_keyframe(model))
        ctrl, path, diverged = data.ctrl.copy(), list[float](), None
        try:
            for _ in drive(model, data, None, steps):
                path.append(float(data.qpos[place]))
                if len(path) % 1000 == 0:
                    progress(len(path) / steps)
        except DivergedError as error:
            diverged = error.time
        return droop(data, joint, seconds, ctrl, np.array(path), diverged=diverged)


def slots_of_the_catch(caught: Droop, longer: Mapping[str, Droop], slide: bool) -> dict[str, Any]:
    """Return what the page's slots take of the contact that catches the joint.

    Args:
        caught: The shorter run without servos.
        longer: The longer ones, by what can touch in them.
        slide: Whether the joint is a slide.
    """
    slots: dict[str, Any] = {"caught": False}
    runs = list(longer.values())
    both = len(runs) == 2 and all(run.diverged is None for run in runs)
    if not (both and caught.touching):
        return slots
    then = float(caught.position[-1])
    end, free = (float(run.position[-1]) for run in runs)
    further = free * np.sign(then) - abs(then)
    slots["caught"] = further >= max(_FURTHER, abs(then) * _CREEP)
    slots["free_end"] = position(free, slide)
    slots["at_limit"] = abs(runs[1].forces.limit or 0.0) > BALANCE
    slots["limit_force"] = f"{abs(runs[1].forces.limit or 0.0):.4f}"
    slots["creeps"] = abs(end - then) > abs(then) * _CREEP
    slots["caught_at"] = position(then, slide)
    slots["long_end"] = position(end, slide)
    slots["long_time"] = f"{runs[0].time[-1]:g} s"
    return slots


def long_course(
    runs: Mapping[str, Droop], joint: str, slide: bool, timestep: float, say: Words
) -> list[Block]:
    """Show the longer runs in a table, and every 20th step of them as curves.

    Args:
        runs: By their labels.
        joint: That is watched.
        slide: Whether it is a slide.
        timestep: Simulated time of a step [s].
        say: The words of the lesson.
    """
    if not runs:
        return []
    scale, unit = (1.0, "m") if slide else (np.degrees(1.0), "angle [°]")
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for name, run in runs.items():
        time = np.arange(len(run.path)) * timestep
        curves[name] = (time[::20].tolist(), (scale * run.path)[::20].tolist())
    return [
        course_table(runs, say("longer", joint=joint), slide),
        Traces(say("limp", joint=joint), "time [s]", unit, curves),
    ]
