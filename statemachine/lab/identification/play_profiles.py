"""How well a fit would end if a joint had play: all widths are tried on one simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array
from ..recordings.calibration import COUNT
from .linear_refit import LinearRefit, RefitEnd
from .starts import AS_GOOD

# Tried widths: less than a count of the servo is not seen, and servos have 0.3°, 3.4 counts.
_COUNTS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 11.0, 15.0)
_WIDTHS = COUNT * np.array(_COUNTS)  # rad


@dataclass(frozen=True, eq=False)
class PlayProfile:
    """Where a fit would end with play of one joint, by its width.

    Attributes:
        widths: (M,) ascending from 0 [rad].
        ends: One for each width.
    """

    widths: Array
    ends: tuple[RefitEnd, ...]

    @property
    def best(self) -> int:
        """Return the place of the width of a count or more that fits best."""
        return min(self._seen, key=lambda place: self.ends[place].cost)

    @property
    def evidence(self) -> float:
        """Return by how much half the sum of squares falls with that width."""
        return self.ends[0].cost - self.ends[self.best].cost

    @property
    def as_good(self) -> Array:
        """Return by how much parameters move, (S, free), with each such width that fits as well."""
        most = min(end.cost for end in self.ends) + AS_GOOD
        shifts = [self.ends[place].shift for place in self._seen if self.ends[place].cost < most]
        return np.reshape(shifts, (-1, len(self.ends[0].shift)))

    @property
    def _seen(self) -> list[int]:
        """Return the places of the widths that a servo can show: of a count or more."""
        return [place for place, width in enumerate(self.widths.tolist()) if width >= COUNT]


def play_profiles(refit: LinearRefit) -> tuple[PlayProfile, ...]:
    """Return the profile of each joint, where the others stay as they are."""
    simulation = refit.fit.objective.simulation
    angles = simulation.angles_with_play(refit.fit.vector, _WIDTHS)
    errors = (angles - simulation.state)[:, simulation.first_frame :]
    profiles: list[PlayProfile] = []
    for joint in range(errors.shape[-1]):
        changes = np.zeros_like(errors)
        changes[:, :, joint] = (errors - refit.fit.errors)[:, :, joint]
        profiles.append(PlayProfile(_WIDTHS, tuple(map(refit.end, changes))))
    return tuple(profiles)
