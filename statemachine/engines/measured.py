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

from ..interface import Array, Ints
from ..measures import JointPlaces, farthest, largest_or_inf, turns
from .samples import acceleration

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


# A body at 1 m/s, one step: the engine's timestep, as it tells it [s]; how far the body came [m];
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
    """Angle and speed after one semi-implicit step from rest, under the cells' torque."""
    speed = timestep * acceleration(ANGLE, TORQUE)
    return ANGLE + timestep * speed, speed


def near(left: Any, right: Any, error: float) -> bool:
    """Whether numbers, or arrays of them, are that near each other."""
    return bool(np.all(np.abs(np.subtract(left, right)) <= error))


# Two futures of one state, byte by byte, and how far apart they are.


@dataclass(frozen=True)
class FutureGap:
    """How far two futures are apart.

    Attributes:
        steps: How many steps were compared.
        first: After how many a byte differs first: 0 is before any step, where what was
            restored does not read back as it was; None where none differs.
        angle: The largest difference of a hinge, or of a body's orientation, at any step [rad].
        length: That of a slide, or of a coordinate of a free body [m].
    """

    steps: int
    first: int | None
    angle: float
    length: float

    @property
    def exact(self) -> bool:
        """Whether every byte is the same."""
        return self.first is None

    @property
    def size(self) -> float:
        """The larger of angle and length, in SI units."""
        return max(self.angle, self.length)


def gap(first: Array, second: Array, places: JointPlaces, counts: Ints | None = None) -> FutureGap:
    """The gap between two futures.

    Args:
        first: Positions and velocities, (n, k).
        second: The same of the other future.
        places: What the numbers of a row are; velocities follow.
        counts: (n,) how many steps each row comes after, if not 0, 1, 2, …
    """
    rows = np.arange(len(first)) if counts is None else counts
    # As integers: what is compared are bytes, in which 0 is not -0, and NaN is NaN.
    differs = (
        np.ascontiguousarray(first).view(np.int64) != np.ascontiguousarray(second).view(np.int64)
    ).any(axis=1)
    steps = int(rows[-1])
    if not differs.any():
        return FutureGap(steps, None, 0.0, 0.0)
    moved = [np.concatenate((places.slides, places.positions)), places.hinges]
    length, angle = (farthest(first[:, chosen], second[:, chosen]) for chosen in moved)
    quats = places.quats[:, None] + np.arange(4)
    turned = turns(first[:, quats], second[:, quats])
    return FutureGap(
        steps,
        int(rows[np.argmax(differs)]),
        max(largest_or_inf(angle), largest_or_inf(turned)),
        largest_or_inf(length),
    )


def worst(gaps: list[FutureGap]) -> FutureGap:
    """The earliest difference and the largest, of several gaps over the same steps."""
    firsts = [of.first for of in gaps if of.first is not None]
    return FutureGap(
        gaps[0].steps,
        min(firsts, default=None),
        max(of.angle for of in gaps),
        max(of.length for of in gaps),
    )
