"""Two futures of one state, byte by byte, and how far apart they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..interface import Array, Ints
from ..measures import JointPlaces, farthest, largest_or_inf, turns


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
