"""From angles to what LeRobot writes: whole counts, then degrees or parts of a swept range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from statemachine.interface import Array, Model
from statemachine.lab.recordings.calibration import COUNT, COUNTS_OF_A_TURN, MotorCalibration

from .arm_truth import GRIPPER

FileUnit = Literal["degrees", "-100 to 100"]
_MIDDLE = COUNTS_OF_A_TURN // 2
_ROUNDED = 0.002  # counts: what float32 may have rounded
_NARROWER, _WIDER = 0.97, 1.03  # a hand sweeps a range, by that of the model


@dataclass(frozen=True, eq=False)
class CalibratedArm:
    """Servos whose ranges were swept.

    A count c is the angle `zero + COUNT * (c - origin)` and the value `width * (c - origin)`.

    Attributes:
        motors: Calibration of each, by the joint's name.
        origin: (n,) count whose value is 0: the middle of the range, of the gripper its least.
        width: (n,) value of a count, in the unit of the file.
        zero: (n,) angle of the origin [rad].
        lowest, highest: (n,) counts that values are bounded to; infinite where they are not.
    """

    motors: Mapping[str, MotorCalibration]
    origin: Array
    width: Array
    zero: Array
    lowest: Array
    highest: Array

    def measured(self, angles: Array) -> Array:
        """Return what is written of measured angles (K, n) [rad], rounded to counts."""
        return self._written(np.round(self._counts(angles)))

    def told(self, angles: Array) -> Array:
        """Return what is written of commanded angles (K, n) [rad], which are on no counts."""
        return self._written(self._counts(angles))

    def sent(self, values: Array) -> Array:
        """Return the angles (K, n) [rad] that are sent of commanded values: whole counts below."""
        counts = np.clip(values / self.width + self.origin, self.lowest, self.highest)
        return self.zero + COUNT * (np.trunc(counts + _ROUNDED) - self.origin)

    def angles(self, values: Array) -> Array:
        """Return the angles (K, n) [rad] of written values."""
        return self.zero + COUNT * values / self.width

    def as_dict(self) -> dict[str, object]:
        """Return the calibration as LeRobot keeps it."""
        return {joint: asdict(motor) for joint, motor in self.motors.items()}

    def _counts(self, angles: Array) -> Array:
        return self.origin + (angles - self.zero) / COUNT

    def _written(self, counts: Array) -> Array:
        values = self.width * (np.clip(counts, self.lowest, self.highest) - self.origin)
        return values.astype(np.float32).astype(np.float64)


def calibrated_arm(model: Model, unit: FileUnit, rng: np.random.Generator) -> CalibratedArm:
    """Draw a calibration: ranges a little narrower or wider than those of the model.

    Args:
        model: Of the arm.
        unit: Of all joints but the gripper.
        rng: Draws it.
    """
    motors: dict[str, MotorCalibration] = {}
    for number, joint in enumerate(model.joint_names):
        low, high = (float(end) for end in model.jnt_range[number])
        counts = round((high - low) / COUNT * rng.uniform(_NARROWER, _WIDER))
        counts = min(counts, COUNTS_OF_A_TURN - 1)
        range_min = _MIDDLE - counts // 2
        motors[joint] = MotorCalibration(
            id=number + 1,
            drive_mode=0,
            homing_offset=int(rng.integers(-1000, 1000)),
            range_min=range_min,
            range_max=range_min + counts,
        )
    lowest = np.array([float(motor.range_min) for motor in motors.values()])
    highest = np.array([float(motor.range_max) for motor in motors.values()])
    origin = 0.5 * (lowest + highest)
    width = 200.0 / (highest - lowest)
    zero = np.zeros(len(motors))
    gripper = model.joint_id(GRIPPER)
    origin[gripper] = lowest[gripper]
    width[gripper] *= 0.5
    zero[gripper] = model.jnt_range[gripper, 0]
    if unit == "degrees":
        others = np.arange(len(motors)) != gripper
        width[others] = 360.0 / (COUNTS_OF_A_TURN - 1)
        lowest[others], highest[others] = -np.inf, np.inf
    return CalibratedArm(motors, origin, width, zero, lowest, highest)
