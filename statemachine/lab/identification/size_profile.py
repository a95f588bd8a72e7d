"""How well a fit would end if the arm had something that its model lacks, by the size of that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array
from .linear_refit import RefitEnd
from .starts import AS_GOOD


@dataclass(frozen=True, eq=False)
class SizeProfile:
    """Where a fit would end, by the size of what the model lacks.

    Attributes:
        sizes: (M,) ascending from 0.
        ends: One for each size.
        least: The least size that a recording can show.
    """

    sizes: Array
    ends: tuple[RefitEnd, ...]
    least: float

    @property
    def best(self) -> int:
        """Return the place of the size that can be shown and fits best."""
        return min(self._shown, key=lambda place: self.ends[place].cost)

    @property
    def evidence(self) -> float:
        """Return by how much half the sum of squares falls with that size."""
        return self.ends[0].cost - self.ends[self.best].cost

    @property
    def as_good(self) -> Array:
        """Return by how much parameters move, (S, free), with each such size that fits as well."""
        most = min(end.cost for end in self.ends) + AS_GOOD
        shifts = [self.ends[place].shift for place in self._shown if self.ends[place].cost < most]
        return np.reshape(shifts, (-1, len(self.ends[0].shift)))

    @property
    def _shown(self) -> list[int]:
        """Return the places of the sizes that a recording can show."""
        return [place for place, size in enumerate(self.sizes.tolist()) if size >= self.least]
