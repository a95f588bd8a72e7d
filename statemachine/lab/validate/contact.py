"""Cases of contact: friction, rolling, impact, and bodies at rest on others."""

from __future__ import annotations

from . import (
    contact_friction,
    contact_impact,
    contact_incline,
    contact_rest,
    contact_rolling,
    contact_tipping,
)
from .case import Case

CASES: tuple[Case, ...] = (
    *contact_incline.CASES,
    *contact_friction.CASES,
    *contact_rolling.CASES,
    *contact_impact.CASES,
    *contact_rest.CASES,
    *contact_tipping.CASES,
)
