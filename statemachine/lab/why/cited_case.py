"""Which of two sides is nearer to the truth, in a case of the battery: a record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ..validate.case import Integrator

DecidedCause = Literal["integrator", "cone", "offset centre of mass", "release"]
Nearer = Literal["left", "right"]

_CLEAR = 0.9  # the smaller error is at most this part of the larger one where one side is nearer
_CONVERGES = 0.5  # of the gap: with steps 8 times finer, less stays of what a timestep costs


@dataclass(frozen=True)
class SideInCase:
    """What a side gave in a case.

    Attributes:
        case: Name of the case.
        setting: What the side has of the cause: an integrator, a cone, a release or an engine.
        backend: What ran the case.
        integrator: How it stepped.
        timestep: Of the case's run [s].
        own_timestep: Of an engine step of the side [s], which differs from `timestep` where the
            case has no whole number of such steps, or would take too long with them.
        truth: The closed form [unit of the case].
        error: How far the side is from it [error_unit]; None if its run diverged.
        error_unit: "" of a relative error.
    """

    case: str
    setting: str
    backend: str
    integrator: Integrator
    timestep: float
    own_timestep: float
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
class ErrorsInRun:
    """How far each side is from its own run with finer steps, in the run that was asked.

    Attributes:
        quantity: What is measured: that of the gap that is explained.
        unit: Of it, SI.
        finer: How many times as many engine steps the finer runs have.
        left: How far the left is from its own finer run [unit].
        right: How far the right is from its own [unit].
        gap: Between the two sides as they come [unit].
        finer_gap: Between their finer runs [unit].
        negligible: Sizes below this are taken for rounding [unit].
    """

    quantity: str
    unit: str
    finer: int
    left: float
    right: float
    gap: float
    finer_gap: float
    negligible: float

    @property
    def nearer(self) -> Nearer | None:
        """Return the side that is nearer to its own finer run; None where neither clearly is.

        The finer runs have errors, too. What these may come to is the gap between them: where that
        is more than what the sides differ by, neither is clearly nearer to the truth.
        """
        if self.finer_gap >= abs(self.left - self.right):
            return None
        return _nearer(self.left, self.right, self.negligible)

    @property
    def converges(self) -> bool:
        """Tell whether both sides approach one motion: with finer steps their gap is smaller."""
        return self.finer_gap <= _CONVERGES * self.gap


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
        in_run: What the run that was asked says of it; None where its two sides compute two laws,
            which no finer step brings together, or where a finer run does not reach the end.
    """

    cause: DecidedCause
    description: str
    source: str
    reason: str
    left: SideInCase
    right: SideInCase
    nearer: Nearer
    command: str
    in_run: ErrorsInRun | None = None


def nearer_side(left: SideInCase, right: SideInCase, rounding: float) -> Nearer | None:
    """Return the side that is nearer to the truth; None where neither clearly is.

    Args:
        left: What the left side gave.
        right: What the right side gave.
        rounding: Largest size of an error that counts as none [error_unit].
    """
    return _nearer(left.size, right.size, rounding)


def _nearer(left: float, right: float, rounding: float) -> Nearer | None:
    """Return the side whose error is smaller; None where neither clearly is.

    Args:
        left: Size of the left's error.
        right: Size of the right's, in the same unit.
        rounding: Largest size that counts as none.
    """
    smaller, larger = sorted((left, right))
    if larger <= rounding or smaller > _CLEAR * larger or math.isinf(smaller):
        return None
    return "left" if left < right else "right"
