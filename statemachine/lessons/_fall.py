"""What catches the falling joint: longer runs, with and without anything to touch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..comparison.text import apart, position
from ..experiments import gravity
from ..page import Table, Text, Traces, Verdict
from ._words import where

_BALANCE = 1e-3  # N·m or N; a sum below it is zero
_CREEP = 0.05  # of the way; a joint that goes on by more has not settled
_FURTHER = 0.02  # rad or m; less is not worth a cause


def longer(results: Mapping[str, gravity.Gravity]) -> list[Any]:
    """What catches the falling joint: with and without a floor, and for longer."""
    columns = {
        f"{where(results, name)}{label}": run
        for name, result in results.items()
        for label, run in result.longer.items()
    }
    if not columns:
        return []
    first = next(iter(results.values()))
    times = next(iter(columns.values())).time
    blocks: list[Any] = [
        Text(
            "What caught it? Here are two longer runs with the servos off: one as before, and "
            "one in which nothing can touch anything."
        ),
        Table(
            ("time", *(name.replace(": ", "\n") for name in columns)),
            [
                (
                    f"{time:.2f} s",
                    *(position(run.position[k], first.slide) for run in columns.values()),
                )
                for k, time in enumerate(times)
            ],
            title=f"{first.joint}, servos off, for longer",
        ),
    ]
    for name, result in results.items():
        prefix = where(results, name)
        floor, free = result.longer.get("floor"), result.longer.get("no floor")
        if floor is not None and free is not None and result.servos_off.touching:
            blocks.append(_caught(prefix, result, floor, free))
    blocks.append(
        Traces(
            f"{first.joint} with the servos off",
            "time [s]",
            "m" if first.slide else "angle [°]",
            {
                name: (
                    (np.arange(len(run.path)) * first.provenance.timestep)[::20].tolist(),
                    (run.path if first.slide else np.degrees(run.path))[::20].tolist(),
                )
                for name, run in columns.items()
            },
        )
    )
    return blocks


def longer_apart(results: Mapping[str, gravity.Gravity]) -> list[tuple[str, Any]]:
    """Rows of the differences: the ends of the longer runs."""
    first = next(iter(results.values()))

    def say(label: str) -> Any:
        def gap(one: gravity.Gravity, two: gravity.Gravity) -> str:
            if label not in one.longer or label not in two.longer:
                return "–"
            ends = [each.longer[label].position[-1] for each in (one, two)]
            return apart(abs(float(ends[0] - ends[1])), one.slide)

        return gap

    return [
        (f"servos off, {label}, at {run.time[-1]:g} s", say(label))
        for label, run in first.longer.items()
    ]


def _caught(
    prefix: str, result: gravity.Gravity, floor: gravity.Droop, free: gravity.Droop
) -> Text | Verdict:
    """Whether it is the contact that catches the joint, and whether it stays there."""
    slide, end = result.slide, float(floor.time[-1])
    short = float(result.servos_off.time[-1])
    then, alone = float(result.servos_off.position[-1]), float(free.position[-1])
    further = alone * np.sign(then) - abs(then)
    if further < max(_FURTHER, abs(then) * _CREEP):
        return Text(
            f"{prefix}without contacts {result.joint} goes no further that way: it ends at "
            f"{position(alone, slide)}."
        )
    text = (
        f"{prefix}it is the contact that catches {result.joint}, not damping or friction: without "
        f"contacts it runs on to {position(alone, slide)}"
    )
    if abs(free.forces.limit or 0.0) > _BALANCE:
        unit = "N" if slide else "N·m"
        text += f", where its limit stops it with {abs(free.forces.limit or 0):.4f} {unit}"
    if abs(float(floor.position[-1]) - then) > abs(then) * _CREEP:
        text += (
            f". And it does not stay where it was caught: at {short:g} s it is at "
            f"{position(then, slide)}, at {end:g} s at {position(floor.position[-1], slide)}"
        )
    return Verdict(text, True)
