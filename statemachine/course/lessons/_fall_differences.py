"""How far the falls of a joint on several engines are from each other."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ...measures.text import NO_NUMBER, joint_difference
from ...show.blocks import Table
from ...show.engine_tables import Results, differences, largest_gap
from ...show.labels import TableLabels
from ._falling import Droop
from .gravity import GravityResult


def fall_differences(results: Results[GravityResult], say: TableLabels) -> list[Table]:
    """Compare the runs of each engine with those of the first.

    Args:
        results: By backend.
        say: The labels of the lesson.
    """
    first = next(iter(results.values()))
    rows: dict[str, Callable[[GravityResult, GravityResult], str]] = {
        say("apart_on"): _apart_with_servos,
        say("apart_off"): _apart_before_touch,
        say("apart_later"): _apart_after_touch,
    }
    for label, run in first.longer.items():
        time = f"{run.time[-1]:g} s"
        rows[say("apart_long", label=label, time=time)] = partial(_ends_apart, label)
    return differences(results, rows)


def _apart_with_servos(left: GravityResult, right: GravityResult) -> str:
    """Return the largest distance between two runs with the servos on."""
    return _apart(left, left.servos_on, right.servos_on, slice(None))


def _apart_before_touch(left: GravityResult, right: GravityResult) -> str:
    """Return that of the servos off, up to the first touch of either."""
    touch = _first_touch(left, right)
    return _apart(left, left.servos_off, right.servos_off, slice(touch + 1))


def _apart_after_touch(left: GravityResult, right: GravityResult) -> str:
    """Return that of the servos off, from the first touch of either."""
    touch = _first_touch(left, right)
    return _apart(left, left.servos_off, right.servos_off, slice(touch, None))


def _first_touch(left: GravityResult, right: GravityResult) -> int:
    """Return the step in which one of two runs first touches; without a touch, their end."""
    touches = [*left.servos_off.touches.values(), *right.servos_off.touches.values()]
    if not touches:
        return len(left.servos_off.path)
    return round(min(touches) / left.provenance.timestep)


def _apart(of: GravityResult, left: Droop, right: Droop, rows: slice) -> str:
    """Return the largest distance between two runs in some rows, and when it is reached."""
    time = np.arange(len(left.path), dtype=np.float64) * of.provenance.timestep
    paths = left.path[rows, None], right.path[rows, None]
    return largest_gap(*paths, slides=[of.slide], names=[""], time=time[rows])


def _ends_apart(label: str, left: GravityResult, right: GravityResult) -> str:
    """Return how far apart the ends of two longer runs are, as far as both go."""
    if label not in left.longer or label not in right.longer:
        return NO_NUMBER
    runs = left.longer[label], right.longer[label]
    row = min(len(run.position) for run in runs) - 1
    gap = abs(float(runs[0].position[row] - runs[1].position[row]))
    return joint_difference(gap, left.slide) if np.isfinite(gap) else "one diverged"
