"""A joint without its servo for much longer: who caught it, and does it stay there?"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ...errors import DivergedError, UnsupportedError
from ...interface import Model, make_data, reset
from ...lab.runs.drive import Progress, drive, number_of_steps, progress_of_stage
from ...lab.runs.robot import FREE_FALL, UNACTUATED, start_keyframe
from ...show.blocks import Block
from ...show.labels import TableLabels
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


@dataclass(frozen=True)
class Catch:
    """The contact that catches the joint, and how the joint goes on [rad; of a slide, m].

    Attributes:
        caught_at: Where the joint is at the end of the shorter run.
        long_time: Simulated time of the longer runs [s].
        long_end: Where it is at the end of the longer run.
        free_end: Where it is then without contacts.
        limit_force: What the joint's limit exerts on it there [N·m or N].
    """

    caught_at: float
    long_time: float
    long_end: float
    free_end: float
    limit_force: float

    @property
    def at_limit(self) -> bool:
        """Tell whether the joint's limit stops it where there are no contacts."""
        return self.limit_force > BALANCE

    @property
    def creeps(self) -> bool:
        """Tell whether it does not stay where it was caught."""
        return abs(self.long_end - self.caught_at) > abs(self.caught_at) * _CREEP


def catch_of(caught: Droop, longer: Mapping[str, Droop]) -> Catch | None:
    """Return the contact that catches the joint; None where it would go no further without.

    Args:
        caught: The shorter run without servos.
        longer: The longer ones, by what can touch in them.
    """
    runs = list(longer.values())
    both = len(runs) == 2 and all(run.diverged is None for run in runs)
    if not (both and caught.touching):
        return None
    then = float(caught.position[-1])
    end, free = (float(run.position[-1]) for run in runs)
    if free * np.sign(then) - abs(then) < max(_FURTHER, abs(then) * _CREEP):
        return None
    limit_force = 0.0 if runs[1].forces.limit is None else abs(runs[1].forces.limit)
    return Catch(then, float(runs[0].time[-1]), end, free, limit_force)


def long_course(
    runs: Mapping[str, Droop], joint: str, slide: bool, timestep: float, say: TableLabels
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
        course_table(runs, slide, say("longer", joint=joint)),
        Traces(say("limp", joint=joint), "time [s]", unit, curves),
    ]
