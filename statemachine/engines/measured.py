"""What the part "conventions" of a room measures, and the records in which it gives it.

The questions of `statemachine.conventions` let their answers follow from these. A part may lack
any of the functions: that engine is not asked that question then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..interface import Array


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


class ConventionsPart(Protocol):
    """The part "conventions": tiny models in the raw engine, as its own users drive it."""

    def quaternion(self, fours: Sequence[Sequence[float]]) -> Sequence[tuple[Array, Array]]:
        """Turn the marked body by four numbers each time.

        Returns:
            The marks (3, 3) about the first of them [m], and the four numbers that are read.
        """
        ...

    def velocity(
        self, place: Array, four: Array, six: Array, seconds: float
    ) -> tuple[Array, Array]:
        """Put the marked body somewhere, moving, and take one short step.

        Args:
            place: (3,) of the body [m].
            four: (4,) the turn, in whatever order the engine takes it.
            six: (6,) the velocity.
            seconds: Length of the step.

        Returns:
            The marks (3, 3) before and after the step [m].
        """
        ...

    def gravity(self, steps: int) -> tuple[Sequence[float], Sequence[float]]:
        """Gravity of a fresh world, told and felt by a body that falls (3,) [m/s²]."""
        ...

    def timestep(self) -> OneStep | Absent:
        """The marked body at 1 m/s, one step of a fresh engine."""
        ...

    def actuation(self, seconds: float) -> Sequence[LetGo]:
        """The pendulum that nobody commands, in each way to load it."""
        ...

    def command(self, torque: float) -> Mapping[str, Sequence[float]] | Absent:
        """Command the pendulum once, by a torque [N·m], and step twice.

        Returns:
            For each kind of command the speeds (3,) at rest and after each step [rad/s].
        """
        ...

    def damping(self, seconds: float, fast: float) -> tuple[float, float] | Absent:
        """Leave a body at 1 m/s and a fast joint [rad/s] to themselves.

        Returns:
            The body's speed after a while [m/s], and the joint's after one step [rad/s].
        """
        ...

    def write(self, angle: float, deep: float) -> Sequence[ReadTwice]:
        """The pendulum's tip after its angle was written, and a ball put into the floor [m]."""
        ...

    def step(self, speed: float, deep: float) -> Sequence[ReadTwice] | Absent:
        """The same after one step, of a pendulum [rad/s] and a ball [m/s] on their way."""
        ...

    def joints(self) -> Mapping[str, Sequence[str]]:
        """Names of the joints of the tree in the engine's order, by format."""
        ...

    def reset(self) -> Mapping[str, Mapping[str, bool]] | Absent:
        """For each way to reset, which quantities are still what was written before."""
        ...

    def friction(self) -> Mapping[str, Sliding] | Absent:
        """The block of `samples.floor` on the floor, by what is special about it."""
        ...

    def save(self) -> Mapping[str, Mapping[str, bool]] | Past:
        """For each way to save, which quantities a restore brings back."""
        ...

    def future(
        self, moments: Sequence[float], steps: int
    ) -> Mapping[str, Sequence[Futures]] | Past:
        """The pile of boxes, set back to the start or to moments [s], and its two futures."""
        ...
