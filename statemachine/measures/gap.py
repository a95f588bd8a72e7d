"""The largest difference of something: how large, of what, and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..interface import Array
from .text import distance, reading


@dataclass(frozen=True)
class Gap:
    """How far apart two readings of one quantity are.

    Attributes:
        size: The largest difference [unit], of a vector its length; None where one of the two
            is no value, as a rotation that is all zero.
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
            text = "all zero, which is no rotation"
        elif self.unit in ("appears", "vanishes"):
            text = f"1 {self.unit}"
            if self.size > 1:
                text = f"{self.size:.0f} {self.unit.removesuffix('es').removesuffix('s')}"
        else:
            text = distance(self.size, self.unit)
        return f"{text} at {self.where}" if self.where else text


def largest(sizes: Array) -> tuple[float, int]:
    """The largest of some sizes (n,), and its place; what is no number is larger than all."""
    place = int(np.argmax(sizes))  # the first NaN, if there is one
    return float(sizes[place]), place
