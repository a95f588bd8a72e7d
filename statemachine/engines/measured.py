"""Records of what rooms measure of tiny models, and of the lines to type that they offer.

The questions of `probes.conventions` derive their answers from these, and state the arguments and
the result of each measurement. All lines to type use the same numbers, so that one closed form
gives what they must lead to.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Array
from .samples import acceleration

ANGLE, TORQUE = 0.4, 1.0  # rad, N·m; of the lines to type


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


# A body at 1 m/s, one step: the engine's timestep, as it reports it [s]; how far the body came [m];
# what the engine calls its time, if it has one; by how much that went on [s].
OneStep = tuple[float, float, str, float]
# The pendulum of `samples`, let go straight out: how it was loaded; its angle at the end [rad], or
# its first acceleration [rad/s²]; simulated time until then [s], None for the acceleration; what
# acts on it.
LetGo = tuple[str, float, float | None, tuple[Measurement, ...]]
# Something that follows from the state [m]: what it is; a number or a place (3,) as it is read; the
# same after the engine was asked to compute it; what it must be in the engine's state.
ReadTwice = tuple[str, float | Array, float | Array, float | tuple[float, float, float]]
# Speed [m/s] of a block of one friction on a floor of another, with gravity leaning by a
# tangent.
Sliding = Callable[[float, float, float], float]
# Coordinates at every step, twice: (n, 7·boxes + 1), the boxes first.
Futures = tuple[Array, Array]


@dataclass(frozen=True)
class AfterNan:
    """What a step made of a joint whose position was written as NaN.

    Attributes:
        part: How the engine was used; empty where there is one way.
        angle: Position of the joint after the step [rad].
        said: What the engine let its user know: "warning", the name of an exception, or "".
    """

    part: str
    angle: float
    said: str


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
        cells: By concept, of `probes.conventions.CONCEPTS`.
        close: Ends what the lines left open; some of the names may be missing.
    """

    file: tuple[str, str]
    cells: Mapping[str, Cell]
    close: Callable[[Any], object] = lambda _names: None


def accelerated(timestep: float) -> tuple[float, float]:
    """Return the angle and speed after one semi-implicit step from rest, under the cells'
    torque.
    """
    speed = timestep * acceleration(ANGLE, TORQUE)
    return ANGLE + timestep * speed, speed


def near(left: Any, right: Any, error: float) -> bool:
    """Tell whether numbers, or arrays of them, are equal within a tolerance."""
    return bool(np.all(np.abs(np.subtract(left, right)) <= error))
