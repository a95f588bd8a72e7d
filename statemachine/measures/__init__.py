"""What comparisons share: contacts, moments, gaps, floors, tolerances, numbers as text (`text`).

Names are imported when they are first used: who asks what touches needs no tolerances.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .contacts import ContactNames, contacts_in_words, overlaps, with_left_pair_names
    from .floors import RUN_FLOORS, RobotScale, robot_points
    from .gaps import Deviation, Gap, JointAddresses, joint_gap
    from .moments import SAME_MOMENT, CommonMoments, at_moments, common_moments, nearest
    from .quantities import (
        ENCODER_COUNT,
        QUANTITIES,
        Quantity,
        Tolerance,
        parse_amount,
        parse_tolerances,
        tolerance_of,
    )
    from .sizes import distances, largest, largest_difference, largest_or_inf, rotation_angles

_MODULES = {
    "ENCODER_COUNT": "quantities",
    "CommonMoments": "moments",
    "ContactNames": "contacts",
    "Deviation": "gaps",
    "Gap": "gaps",
    "JointAddresses": "gaps",
    "RUN_FLOORS": "floors",
    "QUANTITIES": "quantities",
    "Quantity": "quantities",
    "RobotScale": "floors",
    "SAME_MOMENT": "moments",
    "Tolerance": "quantities",
    "parse_amount": "quantities",
    "at_moments": "moments",
    "common_moments": "moments",
    "distances": "sizes",
    "largest_difference": "sizes",
    "joint_gap": "gaps",
    "largest": "sizes",
    "largest_or_inf": "sizes",
    "nearest": "moments",
    "overlaps": "contacts",
    "parse_tolerances": "quantities",
    "robot_points": "floors",
    "with_left_pair_names": "contacts",
    "contacts_in_words": "contacts",
    "tolerance_of": "quantities",
    "rotation_angles": "sizes",
}

__all__ = [
    "ENCODER_COUNT",
    "QUANTITIES",
    "RUN_FLOORS",
    "SAME_MOMENT",
    "CommonMoments",
    "ContactNames",
    "Deviation",
    "Gap",
    "JointAddresses",
    "Quantity",
    "RobotScale",
    "Tolerance",
    "at_moments",
    "common_moments",
    "contacts_in_words",
    "distances",
    "joint_gap",
    "largest",
    "largest_difference",
    "largest_or_inf",
    "nearest",
    "overlaps",
    "parse_amount",
    "parse_tolerances",
    "robot_points",
    "rotation_angles",
    "tolerance_of",
    "with_left_pair_names",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = value  # so that the next use is an ordinary look-up
    return value
