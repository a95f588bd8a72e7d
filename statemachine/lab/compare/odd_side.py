"""Which of several sides is odd: far from each other one, while these are near each other.

That most sides agree against one says nothing of who is right: they may share a fault, as two
engines with one law of contact do. It is a hint where to look first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

# A side is odd where it is at least so many times as far from each other side as these are from one
# another. Three sides that are on a line by chance, each anywhere with the same probability, look
# like that in 2 of N + 1 cases: of N = 3 in every second, of N = 10 in 18 of 100.
ODD = 10.0
LEAST_SIDES = 3  # of two none is odd


@dataclass(frozen=True)
class SideDistance:
    """How far apart two of several sides are.

    Attributes:
        left: Number of a side.
        right: Number of another one, a larger number.
        gap: In the unit of all; infinite where it is not a number.
        is_apart: Whether the two are told apart: by more than a tolerance, and by more than
            rounding makes.
    """

    left: int
    right: int
    gap: float
    is_apart: bool

    def has(self, side: int) -> bool:
        """Tell whether a side is one of the two."""
        return side in (self.left, self.right)

    def other(self, side: int) -> int:
        """Return the number of the other of the two."""
        return self.right if side == self.left else self.left


@dataclass(frozen=True)
class OddSide:
    """A side that is odd.

    Attributes:
        side: Its number.
        nearest: Number of the other side that is nearest to it.
        gap: How far away that is [unit].
        spread: The largest gap between any two of the others [unit].
    """

    side: int
    nearest: int
    gap: float
    spread: float

    @property
    def ratio(self) -> float:
        """Return how many times as far it is from each other side as these are from one another."""
        return self.gap / self.spread if self.spread else math.inf


def odd_side(distances: Sequence[SideDistance]) -> OddSide | None:
    """Return the side that is odd; None where none is.

    It is told apart from each other side, and at least `ODD` times as far from each of them as any
    two of these are from one another. No two sides are so at once.

    Args:
        distances: One for each two sides, of three sides or more.
    """
    for side in _sides_of(distances):
        own = [distance for distance in distances if distance.has(side)]
        others = [distance for distance in distances if not distance.has(side)]
        nearest = min(own, key=lambda distance: distance.gap)
        spread = max((distance.gap for distance in others), default=math.inf)
        is_apart = all(distance.is_apart for distance in own)
        if is_apart and math.isfinite(spread) and nearest.gap >= ODD * spread:
            return OddSide(side, nearest.other(side), nearest.gap, spread)
    return None


def groups_of(distances: Sequence[SideDistance]) -> tuple[tuple[int, ...], ...]:
    """Return the sides in groups, within each of which no two are told apart.

    A side joins the first group that it belongs to; agreement is not transitive, so that it may
    agree with one of another group, too.

    Args:
        distances: One for each two sides.
    """
    apart: set[tuple[int, int]] = set()
    for distance in distances:
        if distance.is_apart:
            apart |= {(distance.left, distance.right), (distance.right, distance.left)}
    groups: list[list[int]] = []
    for side in _sides_of(distances):
        for group in groups:
            if all((side, member) not in apart for member in group):
                group.append(side)
                break
        else:
            groups.append([side])
    return tuple(tuple(group) for group in groups)


def _sides_of(distances: Sequence[SideDistance]) -> list[int]:
    """Return the numbers of all sides, in order."""
    return sorted({side for each in distances for side in (each.left, each.right)})
