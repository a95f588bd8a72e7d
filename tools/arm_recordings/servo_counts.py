"""From angles to what LeRobot writes: whole counts, then degrees or parts of a swept range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from statemachine.interface import Array, Model
from statemachine.lab.recordings.calibration import COUNTS_OF_A_TURN, MotorCalibration
from statemachine.lab.recordings.unit_inference import COUNT

from .arm_truth import GRIPPER

FileUnit = Literal["degrees", "-100 to 100"]
_MIDDLE = COUNTS_OF_A_TURN // 2
_NARROWER, _WIDER = 0.97, 1.03  # a hand sweeps a range, by that of the model


@dataclass(frozen=True)
class CalibratedArm:
    """Servos whose ranges were swept.

    Attributes:
        unit: Of all joints but the gripper.
        motors: Calibration of each, by the joint's name.
        lower_limit: Angle of the gripper where it has 0 [rad].
    """

    unit: FileUnit
    motors: Mapping[str, MotorCalibration]
    lower_limit: float

    def values(self, angles: Array) -> Array:
        """Return what is written of recorded angles (K, n) [rad], rounded to counts and float32."""
        columns: list[Array] = []
        for column, (joint, motor) in enumerate(self.motors.items()):
            middle = 0.5 * (motor.range_min + motor.range_max)
            if joint == GRIPPER:
                counts = np.round(motor.range_min + (angles[:, column] - self.lower_limit) / COUNT)
                bounded = np.clip(counts, motor.range_min, motor.range_max)
                values = (bounded - motor.range_min) / motor.counts * 100.0
            elif self.unit == "degrees":
                counts = np.round(middle + angles[:, column] / COUNT)
                values = (counts - middle) * 360.0 / (COUNTS_OF_A_TURN - 1)
            else:
                counts = np.round(middle + angles[:, column] / COUNT)
                bounded = np.clip(counts, motor.range_min, motor.range_max)
                values = (bounded - motor.range_min) / motor.counts * 200.0 - 100.0
            columns.append(values)
        return np.stack(columns, axis=1).astype(np.float32).astype(np.float64)

    def angles(self, values: Array) -> Array:
        """Return the recorded angles (K, n) [rad] of written values."""
        columns: list[Array] = []
        for column, (joint, motor) in enumerate(self.motors.items()):
            written = values[:, column].astype(np.float64)
            if joint == GRIPPER:
                angle = self.lower_limit + written / 100.0 * motor.counts * COUNT
            elif self.unit == "degrees":
                angle = written * (COUNTS_OF_A_TURN - 1) / 360.0 * COUNT
            else:
                angle = written / 200.0 * motor.counts * COUNT
            columns.append(angle)
        return np.stack(columns, axis=1)

    def as_dict(self) -> dict[str, object]:
        """Return the calibration as LeRobot keeps it."""
        return {joint: asdict(motor) for joint, motor in self.motors.items()}


def calibrated_arm(model: Model, unit: FileUnit, rng: np.random.Generator) -> CalibratedArm:
    """Draw a calibration: ranges a little narrower or wider than those of the model."""
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
    gripper = model.joint_id(GRIPPER)
    return CalibratedArm(unit, motors, float(model.jnt_range[gripper, 0]))
