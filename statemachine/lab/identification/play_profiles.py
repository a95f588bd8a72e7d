"""How well a fit would end if a joint had play: all widths are tried on one simulation."""

from __future__ import annotations

import numpy as np

from ..recordings.calibration import COUNT
from .linear_refit import LinearRefit
from .size_profile import SizeProfile

# Tried widths: less than a count of the servo is not seen, and servos have 0.3°, 3.4 counts.
_COUNTS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 11.0, 15.0)
_WIDTHS = COUNT * np.array(_COUNTS)  # rad


def play_profiles(refit: LinearRefit) -> tuple[SizeProfile, ...]:
    """Return the profile of each joint by the width of its play, where the others have none."""
    simulation = refit.fit.objective.simulation
    angles = simulation.angles_with_play(refit.fit.vector, _WIDTHS)
    errors = (angles - simulation.state)[:, simulation.first_frame :]
    profiles: list[SizeProfile] = []
    for joint in range(errors.shape[-1]):
        changes = np.zeros_like(errors)
        changes[:, :, joint] = (errors - refit.fit.errors)[:, :, joint]
        profiles.append(SizeProfile(_WIDTHS, tuple(map(refit.end, changes)), COUNT))
    return tuple(profiles)
