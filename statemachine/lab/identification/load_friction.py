"""How well a fit would end if the gears of all servos lost a part of their force to friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .linear_refit import LinearRefit, RefitEnd
from .size_profile import SizeProfile

# Tried parts: gears of a servo, which has several stages, lose a tenth to a third.
_PARTS = np.array((0.0, 0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3))


def load_friction_profile(refit: LinearRefit) -> SizeProfile:
    """Return the profile by the part of its force that each servo loses."""
    simulation = refit.fit.objective.simulation
    ends: list[RefitEnd] = []
    for part in _PARTS.tolist():
        loaded = replace(simulation, load_friction=part)
        ends.append(refit.end(refit.change_with(loaded)))
    return SizeProfile(_PARTS, tuple(ends), float(_PARTS[1]))
