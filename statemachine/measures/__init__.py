"""What comparisons share: contacts, moments, gaps, floors, tolerances, numbers as text (`text`).

Names are imported when they are first used: who asks what touches needs no tolerances.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .contacts import ContactNames, overlaps, same_pairs, together
    from .floors import OF_A_RUN, RobotScale, places_of
    from .gaps import Deviation, Gap, JointPlaces, joint_gap
    from .moments import SAME, Common, at_moments, common_moments, nearest
    from .quantities import (
        COUNT,
        QUANTITIES,
        Quantity,
        Tolerance,
        amount,
        parse_tolerances,
        tolerance_of,
    )
    from .sizes import distances, farthest, largest, largest_or_inf, turns

_HOMES = {
    "COUNT": "quantities",
    "Common": "moments",
    "ContactNames": "contacts",
    "Deviation": "gaps",
    "Gap": "gaps",
    "JointPlaces": "gaps",
    "OF_A_RUN": "floors",
    "QUANTITIES": "quantities",
    "Quantity": "quantities",
    "RobotScale": "floors",
    "SAME": "moments",
    "Tolerance": "quantities",
    "amount": "quantities",
    "at_moments": "moments",
    "common_moments": "moments",
    "distances": "sizes",
    "farthest": "sizes",
    "joint_gap": "gaps",
    "largest": "sizes",
    "largest_or_inf": "sizes",
    "nearest": "moments",
    "overlaps": "contacts",
    "parse_tolerances": "quantities",
    "places_of": "floors",
    "same_pairs": "contacts",
    "together": "contacts",
    "tolerance_of": "quantities",
    "turns": "sizes",
}

__all__ = [
    "COUNT",
    "OF_A_RUN",
    "QUANTITIES",
    "SAME",
    "Common",
    "ContactNames",
    "Deviation",
    "Gap",
    "JointPlaces",
    "Quantity",
    "RobotScale",
    "Tolerance",
    "amount",
    "at_moments",
    "common_moments",
    "distances",
    "farthest",
    "joint_gap",
    "largest",
    "largest_or_inf",
    "nearest",
    "overlaps",
    "parse_tolerances",
    "places_of",
    "same_pairs",
    "together",
    "tolerance_of",
    "turns",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value  # so that the next use is an ordinary look-up
    return value
