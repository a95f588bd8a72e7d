"""What rooms measure of tiny models, and the lines to type that they offer: the records.

The questions of `probes.conventions` let their answers follow from these, and say what a
measurement is given and gives. All lines of the phrasebook use the same numbers, so that one law
says what must come of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Array
from .samples.pendulum import acceleration

ANGLE, TORQUE = 0.4, 1.0  # rad, N·m; of the phrasebook


@dataclass(frozen=True)
class Measurement:
    """Something that was measured: a number in SI units, several, or words."""

    name: str
    value: float | str | tuple[float, ...] | tuple[str, ...]
    unit: str = ""


@dataclass(frozen=True)
class Absent:
    """The question does not arise: the engine has no function for such a thing.

    Attributes:
        words: What was looked for in its public names.
        names: Those that have one of the words. If there are any, the engine has become
            another one, and they are the answer.
        part: Which part of the question this is about; empty where there is one.
        figures: What was measured all the same.
    """

    words: tuple[str, ...]
    names: tuple[str, ...]
    part: str = ""
    figures: tuple[Measurement, ...] = ()


@dataclass(frozen=True)
class Past:
    """The engine's Data holds no state: all that it computes is of what it is handed.

    Attributes:
        difference: By how much a used Data computes an acceleration otherwise than a new one
            [rad/s²].
    """

    difference: float


@dataclass(frozen=True)
class OneStep:
    """A body at 1 m/s, one step.

    Attributes:
        told: The engine's timestep, as it tells it [s].
        moved: How far the body came [m].
        clock: What the engine calls its time, if it has one.
        ticked: By how much that went on [s].
    """

    told: float
    moved: float
    clock: str
    ticked: float


@dataclass(frozen=True)
class LetGo:
    """The pendulum of `samples`, let go straight out.

    Attributes:
        part: How it was loaded.
        moved: Its angle at the end [rad], or its first acceleration [rad/s²].
        seconds: Simulated time until then; None for the acceleration.
        figures: What acts on it.
    """

    part: str
    moved: float
    seconds: float | None
    figures: tuple[Measurement, ...] = ()


@dataclass(frozen=True)
class ReadTwice:
    """Something that follows from the state [m], read, and read again once recomputed.

    Attributes:
        part: What it is.
        read: A number, or a place (3,).
        recomputed: The same after the engine was asked to compute it.
        true: What it must be in the state that the engine is in.
    """

    part: str
    read: float | Array
    recomputed: float | Array
    true: float | tuple[float, float, float]


# Speed [m/s] of a block of one friction on a floor of another, with gravity leaning by a
# tangent.
Sliding = Callable[[float, float, float], float]
# Coordinates at every step, twice: (n, 7·boxes + 1), the boxes first.
Futures = tuple[Array, Array]


@dataclass(frozen=True)
class Cell:
    """What is typed for a concept, and whether it happened.

    Attributes:
        code: Lines of Python, after those of the concepts before.
        happened: Looks at the names that the lines left behind; may change the world.
    """

    code: str
    happened: Callable[[Any], bool]


@dataclass(frozen=True)
class Phrases:
    """The lines of one engine.

    Attributes:
        file: Name and text of a model of the pendulum.
        cells: By concept, of `probes.phrasebook.CONCEPTS`.
        close: Ends what the lines left open; some of the names may be missing.
    """

    file: tuple[str, str]
    cells: Mapping[str, Cell]
    close: Callable[[Any], object] = lambda _names: None


def accelerated(timestep: float) -> tuple[float, float]:
    """Angle and speed after one semi-implicit step from rest, under the cells' torque."""
    speed = timestep * acceleration(ANGLE, TORQUE)
    return ANGLE + timestep * speed, speed


def near(left: Any, right: Any, error: float) -> bool:
    """Whether numbers, or arrays of them, are that near each other."""
    return bool(np.all(np.abs(np.subtract(left, right)) <= error))
