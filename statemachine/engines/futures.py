"""Two futures of one state, byte by byte, and how far apart they are."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..interface import Array, Ints, JointType, Model


@dataclass(frozen=True)
class Coordinates:
    """What the numbers are that are read after a step.

    Attributes:
        angles: Where hinges are; lengths: where slides and coordinates of free bodies are.
        quats: Where quaternions start, in any order of their components.
    """

    angles: tuple[int, ...]
    lengths: tuple[int, ...]
    quats: tuple[int, ...]

    @property
    def width(self) -> int:
        """How many numbers are positions; velocities follow."""
        return len(self.angles) + len(self.lengths) + 4 * len(self.quats)


def coordinates_of(model: Model) -> Coordinates:
    """The coordinates of qpos."""
    angles, lengths, quats = [], [], []
    for kind, start in zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True):
        if kind == JointType.HINGE:
            angles.append(start)
        elif kind == JointType.SLIDE:
            lengths.append(start)
        elif kind == JointType.BALL:
            quats.append(start)
        else:
            lengths += range(start, start + 3)
            quats.append(start + 3)
    return Coordinates(tuple(angles), tuple(lengths), tuple(quats))


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


def gap(
    one: Array, other: Array, coordinates: Coordinates, counts: Ints | None = None
) -> FutureGap:
    """The gap between two futures.

    Args:
        one: Positions and velocities, (n, k).
        other: The same of the other future.
        coordinates: What the numbers are.
        counts: (n,) how many steps each row comes after, if not 0, 1, 2, …
    """
    rows = np.arange(len(one)) if counts is None else counts
    # As integers: what is compared are bytes, in which 0 is not -0, and NaN is NaN.
    differs = (
        np.ascontiguousarray(one).view(np.int64) != np.ascontiguousarray(other).view(np.int64)
    ).any(axis=1)
    steps = int(rows[-1])
    if not differs.any():
        return FutureGap(steps, None, 0.0, 0.0)
    off = np.abs(one - other)
    angles = [float(off[:, coordinates.angles].max(initial=0.0))]
    for start in coordinates.quats:
        a, b = one[:, start : start + 4], other[:, start : start + 4]
        # q and -q are one rotation.
        chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
        angles.append(float(4 * np.arcsin(np.minimum(chord / 2, 1.0)).max()))
    length = float(off[:, coordinates.lengths].max(initial=0.0))
    return FutureGap(steps, int(rows[np.argmax(differs)]), _worst(angles), _worst([length]))


def worst(gaps: list[FutureGap]) -> FutureGap:
    """The earliest difference and the largest, of several gaps over the same steps."""
    firsts = [each.first for each in gaps if each.first is not None]
    return FutureGap(
        gaps[0].steps,
        min(firsts, default=None),
        _worst([each.angle for each in gaps]),
        _worst([each.length for each in gaps]),
    )


def _worst(values: list[float]) -> float:
    """The largest; infinite if one is not a number, as of a run that diverged."""
    return max(math.inf if math.isnan(value) else value for value in values)
