"""Which of two sides is nearer to the truth, in a case of the battery: a record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ..validate.case import Integrator

DecidedCause = Literal["integrator", "cone", "offset centre of mass", "release"]
Nearer = Literal["left", "right"]

_CLEAR = 0.9  # the smaller error is at most this part of the larger one where one side is nearer


@dataclass(frozen=True)
class SideInCase:
    """What a side gave in a case.

    Attributes:
        case: Name of the case.
        setting: What the side has of the cause: an integrator, a cone, a release or an engine.
        backend: What ran the case.
        integrator: How it stepped.
        timestep: [s].
        truth: The closed form [unit of the case].
        error: How far the side is from it [error_unit]; None if its run diverged.
        error_unit: "" of a relative error.
    """

    case: str
    setting: str
    backend: str
    integrator: Integrator
    timestep: float
    truth: float
    error: float | None
    error_unit: str

    @property
    def size(self) -> float:
        """Return the size of the error [error_unit]; infinite where the run diverged."""
        if self.error is None or math.isnan(self.error):
            return math.inf
        return abs(self.error)


@dataclass(frozen=True)
class CitedCase:
    """A case of the battery in which one of two sides is nearer to the truth.

    Attributes:
        cause: What the sides differ in.
        description: What happens in the case and what is measured.
        source: Textbook and section, or paper, of the closed form.
        reason: Why the case decides the cause.
        left: What the left side gave.
        right: What the right side gave.
        nearer: The side whose error is smaller.
        command: What shows the case on every integrator.
    """

    cause: DecidedCause
    description: str
    source: str
    reason: str
    left: SideInCase
    right: SideInCase
    nearer: Nearer
    command: str


def nearer_side(left: SideInCase, right: SideInCase, rounding: float) -> Nearer | None:
    """Return the side that is nearer to the truth; None where neither clearly is.

    Args:
        left: What the left side gave.
        right: What the right side gave.
        rounding: Largest size of an error that counts as none [error_unit].
    """
    smaller, larger = sorted((left.size, right.size))
    if larger <= rounding or smaller > _CLEAR * larger or math.isinf(smaller):
        return None
    return "left" if left.size < right.size else "right"
