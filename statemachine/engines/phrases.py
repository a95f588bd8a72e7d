"""What the part "phrasebook" of a room is made of: lines to type, and what they must bring about.

The part has `FILE`, the name and the text of a model of the pendulum; `CELLS`, a `Cell` for each
of `statemachine.conventions.phrasebook.CONCEPTS`; and `close(names)`, which ends what the lines
left open. All cells use the same numbers, so that one law says what must come of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from .samples.pendulum import acceleration

ANGLE, TORQUE = 0.4, 1.0  # rad, N·m


@dataclass(frozen=True)
class Cell:
    """What is typed for a concept, and whether it happened.

    Attributes:
        code: Lines of Python, after those of the concepts before.
        happened: Looks at the names that the lines left behind; may change the world.
    """

    code: str
    happened: Callable[[Any], bool]


class PhrasebookPart(Protocol):
    """The part "phrasebook"; see the module."""

    FILE: tuple[str, str]
    CELLS: Mapping[str, Cell]

    def close(self, names: Any) -> None:
        """End what the lines left open; some of the names may be missing."""
        ...


def accelerated(timestep: float) -> tuple[float, float]:
    """Angle and speed after one semi-implicit step from rest, under the cells' torque."""
    speed = timestep * acceleration(ANGLE, TORQUE)
    return ANGLE + timestep * speed, speed


def near(left: Any, right: Any, error: float) -> bool:
    """Whether numbers, or arrays of them, are that near each other."""
    return bool(np.all(np.abs(np.subtract(left, right)) <= error))
