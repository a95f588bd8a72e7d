"""What all comparisons share: contacts, moments, gaps, tolerances, numbers as text (`text`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import TraceError
from ..interface import Array, Ints, JointType
from .quantities import (
    COUNT,
    QUANTITIES,
    ContactNames,
    Quantity,
    Tolerance,
    amount,
    overlaps,
    parse_tolerances,
    same_pairs,
    together,
    tolerance_of,
)
from .text import distance, reading

__all__ = [
    "COUNT",
    "QUANTITIES",
    "SAME",
    "Common",
    "ContactNames",
    "Deviation",
    "Gap",
    "JointPlaces",
    "Quantity",
    "Tolerance",
    "amount",
    "at_moments",
    "common_moments",
    "distances",
    "farthest",
    "joint_gap",
    "largest",
    "largest_or_inf",
    "nearest",
    "overlaps",
    "parse_tolerances",
    "same_pairs",
    "together",
    "tolerance_of",
    "turns",
]


# How far apart two readings of one quantity are: at one moment, and over many.


@dataclass(frozen=True)
class Gap:
    """How far apart two readings of one quantity are.

    Attributes:
        size: The largest difference [unit], of a vector its length; None where one of the two
            is not a value, as a rotation that is all zero.
        unit: SI unit; of contacts also "appears" and "vanishes", whose sizes are how many there
            are now and were not, and the other way round.
        where: The body, site, joint or contact that differs most; "" if it has no name.
    """

    size: float | None
    unit: str
    where: str = ""

    @classmethod
    def of(cls, sizes: Array, unit: str, names: Sequence[str]) -> Gap:
        """The largest of some sizes (n,) [unit], which are of what the names say."""
        size, place = largest(sizes)
        return cls(size, unit, names[place])

    @property
    def shown(self) -> float:
        """The size in the unit that is read, mm or degrees; infinite if it has none."""
        return np.inf if self.size is None else reading(self.unit)[0] * self.size

    def __str__(self) -> str:
        if self.size is None:
            text = "all zero, which is not a rotation"
        elif self.unit in ("appears", "vanishes"):
            text = f"1 {self.unit}"
            if self.size > 1:
                text = f"{self.size:.0f} {self.unit.removesuffix('es').removesuffix('s')}"
        else:
            text = distance(self.size, self.unit)
        return f"{text} at {self.where}" if self.where else text


@dataclass(frozen=True)
class Deviation:
    """How far apart two runs are in one quantity.

    Attributes:
        unit: Of the distances: "rad" or "m".
        worst: The largest distance at any moment [unit].
        at: When that is [s].
        rms: Root of the mean square over the moments [unit].
        end: At the last moment [unit].
    """

    unit: str
    worst: float = 0.0
    at: float = 0.0
    rms: float = 0.0
    end: float = 0.0

    @classmethod
    def of(cls, sizes: Array, time: Array, unit: str) -> Deviation:
        """Of distances (n,) [unit] at moments (n,) [s]."""
        worst, row = largest(sizes)
        rms = float(np.sqrt(np.mean(sizes**2)))
        return cls(unit, worst, float(time[row]), rms, float(sizes[-1]))


@dataclass(frozen=True, eq=False)
class JointPlaces:
    """Where in qpos each kind of joint has its numbers.

    Attributes:
        hinges: Of each hinge [rad].
        slides: Of each slide [m].
        balls: Where the quaternion of each ball joint starts.
        free: Where the position of each free body starts; its quaternion follows.
    """

    hinges: Ints
    slides: Ints
    balls: Ints
    free: Ints

    @classmethod
    def of(cls, types: Sequence[int] | Ints, addresses: Sequence[int] | Ints) -> JointPlaces:
        """Of joints (n,) by their `JointType` and their place in qpos."""
        kinds, places = np.asarray(types), np.asarray(addresses, dtype=np.int64)
        of = {kind: places[kinds == int(kind)] for kind in JointType}
        hinges, slides = of[JointType.HINGE], of[JointType.SLIDE]
        return cls(hinges, slides, of[JointType.BALL], of[JointType.FREE])

    @property
    def quats(self) -> Ints:
        """Where all quaternions start: those of ball joints, then those of free bodies."""
        return np.concatenate([self.balls, self.free + 3])

    @property
    def positions(self) -> Ints:
        """Where the coordinates of free bodies are."""
        return (self.free[:, None] + np.arange(3)).ravel()

    @property
    def width(self) -> int:
        """How many numbers there are."""
        return len(self.hinges) + len(self.slides) + 4 * len(self.balls) + 7 * len(self.free)


def joint_gap(
    names: Sequence[str],
    types: Sequence[int] | Ints,
    addresses: Sequence[int] | Ints,
    left: Array,
    right: Array,
) -> Gap | None:
    """Return the gap of the hinge that differs most, or of the slide where there is no hinge.

    Args:
        names: Of the joints.
        types: Their `JointType`s.
        addresses: Their places in qpos.
        left: (nq,) one moment.
        right: (nq,) the other.
    """
    kinds, places = np.asarray(types), np.asarray(addresses)
    for kind, unit in ((JointType.HINGE, "rad"), (JointType.SLIDE, "m")):
        joints = np.flatnonzero(kinds == int(kind))
        if len(joints):
            apart = np.abs(left[places[joints]] - right[places[joints]])
            return Gap.of(apart, unit, [names[joint] for joint in joints.tolist()])
    return None


def largest(sizes: Array) -> tuple[float, int]:
    """The largest of some sizes (n,), and its place; what is not a number is larger than all."""
    place = int(np.argmax(sizes))  # the first NaN, if there is one
    return float(sizes[place]), place


def largest_or_inf(sizes: Array) -> float:
    """The largest of some sizes; infinite if one is not a number, as of a run that diverged."""
    return float(np.where(np.isnan(sizes), np.inf, sizes).max(initial=0.0))


def distances(left: Array, right: Array) -> Array:
    """Lengths (…) of the way from one vector (…, k) to another."""
    return np.linalg.norm(left - right, axis=-1)


def farthest(left: Array, right: Array) -> Array:
    """The largest difference (…) of any of k numbers (…, k)."""
    return np.abs(left - right).max(axis=-1, initial=0.0)


def turns(left: Array, right: Array) -> Array:
    """Angles (…) [rad] between unit quaternions (…, 4), in any order of their components.

    By the chord, so that tiny angles keep their digits. q and -q are one rotation.
    """
    chord = np.minimum(distances(left, right), distances(left, -right))
    return 4 * np.arcsin(np.minimum(chord / 2, 1.0))


SAME = 1e-6  # of a timestep: two moments nearer than this are one
_FEW = 20  # common moments below which a comparison says nothing


@dataclass(frozen=True, eq=False)
class Common:
    """The moments that two runs share, counted from the start of each.

    Attributes:
        time: (n,) since the start [s].
        left: (n,) rows of the one run.
        right: (n,) rows of the other.
    """

    time: Array
    left: Ints
    right: Ints


def common_moments(left: Array, right: Array, steps: tuple[float, float]) -> Common:
    """Rows of the same moment: nothing is interpolated.

    Timesteps of 1/200 and 1/240 s meet every 25 ms; what happens between is left out.

    Args:
        left: (n,) ascending, when the rows of a run are [s].
        right: (m,) those of the other.
        steps: The timesteps of both [s].

    Raises:
        TraceError: They share too few moments.
    """
    times = [time - time[0] for time in (left, right)]
    near = nearest(times[1], times[0])
    # A time is a sum of timesteps: its rounding grows with their number.
    slack = SAME * min(steps) + 1e-12 * np.arange(len(times[0]))
    rows = np.flatnonzero(np.abs(times[1][near] - times[0]) <= slack)
    if len(rows) < min(_FEW, len(left), len(right)):
        raise TraceError(
            f"timesteps of {steps[0]:g} and {steps[1]:g} s have only {len(rows)} moments "
            "in common: record one of them with the other's timestep"
        )
    return Common(times[0][rows], rows, near[rows])


def nearest(time: Array, wanted: Array) -> Ints:
    """The row of the time (n,), ascending, that is nearest to each that is wanted (k,)."""
    near = np.clip(np.searchsorted(time, wanted), 0, len(time) - 1)
    near -= (near > 0) & (np.abs(time[near - 1] - wanted) < np.abs(time[near] - wanted))
    return near


def at_moments(time: Array, values: Array, wanted: Array, slack: float) -> Array:
    """Values (n, k) of ascending moments (n,) at others (m,).

    Those of the run itself where it has the moment, to within `slack` [s]; else on the line
    between two of them.
    """
    near = nearest(time, wanted)
    rows = values[near].copy()
    off = np.flatnonzero(np.abs(time[near] - wanted) > slack)
    if len(off):
        rows[off] = np.column_stack([np.interp(wanted[off], time, column) for column in values.T])
    return rows
