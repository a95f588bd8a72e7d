"""A clock of a recording that is off: all figures with a time in them are then off with it.

Times are frame / fps, and were not measured. A loop that is late at each frame, or a clock that
runs otherwise, changes nothing else: no recording tells it from other viscous friction, inertia and
delay. So it is considered, and not fitted (consider covariance analysis: B. Tapley, B. Schutz and
G. Born, Statistical Orbit Determination, 2004, chapter 6).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from ...interface import Array
from .fit import Fit
from .linear_refit import LinearRefit

UNCERTAIN_RATE: Final = 0.01  # standard deviation of the rate of frames, as a part of it


def moved_by_clock(best: Fit) -> Array:
    """Return by how much parameters (free,) move if the rate is off by its standard deviation."""
    simulation, vector = best.objective.simulation, best.vector
    recording = simulation.recording
    faster = replace(recording, fps=(1.0 + UNCERTAIN_RATE) * recording.fps)
    change = replace(simulation, recording=faster).angles(vector) - simulation.angles(vector)
    return LinearRefit.of(best).end(change[simulation.first_frame :]).shift
