"""How far apart two readings of one quantity are: at one moment, and over many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..interface import Array, Ints, JointType
from .sizes import largest
from .text import display_unit, distance


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
        """Return the largest of some sizes (n,) [unit], with its name."""
        size, place = largest(sizes)
        return cls(size, unit, names[place])

    @property
    def shown(self) -> float:
        """Return the size in the unit that is read, mm or degrees; infinite if it has none."""
        return np.inf if self.size is None else display_unit(self.unit)[0] * self.size

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
        """Return the deviation of distances (n,) [unit] at moments (n,) [s]."""
        worst, row = largest(sizes)
        rms = float(np.sqrt(np.mean(sizes**2)))
        return cls(unit, worst, float(time[row]), rms, float(sizes[-1]))


@dataclass(frozen=True, eq=False)
class JointAddresses:
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
    def of(cls, types: Sequence[int] | Ints, addresses: Sequence[int] | Ints) -> JointAddresses:
        """Return the addresses of joints (n,) of each `JointType` in qpos."""
        kinds, places = np.asarray(types), np.asarray(addresses, dtype=np.int64)
        of = {kind: places[kinds == int(kind)] for kind in JointType}
        hinges, slides = of[JointType.HINGE], of[JointType.SLIDE]
        return cls(hinges, slides, of[JointType.BALL], of[JointType.FREE])

    @property
    def quats(self) -> Ints:
        """Return the starts of all quaternions: those of ball joints, then those of free bodies."""
        return np.concatenate([self.balls, self.free + 3])

    @property
    def positions(self) -> Ints:
        """Return the places of the coordinates of free bodies."""
        return (self.free[:, None] + np.arange(3)).ravel()

    @property
    def width(self) -> int:
        """Return the number of coordinates."""
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
