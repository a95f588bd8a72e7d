"""The unit and the zero of each joint of a recording of a real arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Unit = Literal["degrees", "-100 to 100", "0 to 100"]
UnitSource = Literal["calibration", "quantum", "model range"]


@dataclass(frozen=True)
class JointUnit:
    """What the numbers of a joint mean.

    A joint angle of the model is `zero + radians * value` [rad].

    Attributes:
        joint: Name of the model's joint.
        unit: What the recording is in.
        radians: Angle of one unit [rad].
        zero: Angle of the model's joint where the recording has 0 [rad].
        counts: Range that was swept at calibration, in counts of the servo; None where it is not
            known, and not needed.
        quantum: Least difference of two measured values, in the unit; None where the joint does
            not move.
        source: What unit and scale were taken from: the calibration file, the quantum of the
            numbers, or (of a joint that does not move) the model's range.
    """

    joint: str
    unit: Unit
    radians: float
    zero: float
    counts: float | None
    quantum: float | None
    source: UnitSource
