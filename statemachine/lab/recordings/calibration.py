"""LeRobot's calibration of an arm: which counts of each servo are the ends of its joint.

LeRobot writes it beside no recording, but into
`~/.cache/huggingface/lerobot/calibration/robots/so101_follower/NAME.json`
(`MotorCalibration` in its `motors/motors_bus.py`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import cast

from ...errors import BadInputError, printable, shown
from ...models import AnyPath, check_is_file, expanded

COUNTS_OF_A_TURN = 4096  # of the STS3215 of the SO-101: `MODEL_RESOLUTION` in feetech/tables.py
COUNT = 2.0 * math.pi / COUNTS_OF_A_TURN  # rad


@dataclass(frozen=True)
class MotorCalibration:
    """What LeRobot keeps of a servo.

    Attributes:
        id: Its number on the bus.
        drive_mode: 1 where the normalised values are inverted, else 0.
        homing_offset: What is taken from its counts.
        range_min, range_max: Counts at the ends of the range that a hand swept.
    """

    id: int
    drive_mode: int
    homing_offset: int
    range_min: int
    range_max: int

    @property
    def counts(self) -> int:
        """Return how many counts the swept range has."""
        return self.range_max - self.range_min


def read_calibration(path: AnyPath) -> dict[str, MotorCalibration]:
    """Return the calibration of each motor, by its name.

    Raises:
        BadInputError: The file is not there, or is not LeRobot's calibration.
    """
    file = expanded(path)
    check_is_file(file)
    try:
        motors = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BadInputError(f"there is no calibration {file}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise BadInputError(f"{file} is not a calibration: {printable(error)}") from None
    if not isinstance(motors, dict) or not motors:
        raise BadInputError(f"{file} is not a calibration: it names no motor")
    if "calib_mode" in motors:
        raise BadInputError(
            f"{file} is a calibration of LeRobot before June 2025; one since then has range_min "
            "and range_max for each motor"
        )
    calibrations = {
        name: _checked(name, values, file)
        for name, values in cast("dict[str, object]", motors).items()
    }
    ids = [calibration.id for calibration in calibrations.values()]
    if len(set(ids)) < len(ids):
        raise BadInputError(f"{file}: two motors have the same id")
    return calibrations


def _checked(name: str, values: object, file: Path) -> MotorCalibration:
    where = f"{file}, motor {printable(name)}"
    if not isinstance(values, Mapping):
        raise BadInputError(f"{where}: {shown(values)} is not id, drive_mode, range_min …")
    numbers: dict[str, int] = {}
    for field in fields(MotorCalibration):
        value = cast("Mapping[str, object]", values).get(field.name)
        if isinstance(value, bool) or not isinstance(value, int):
            raise BadInputError(f"{where}: {field.name} is {shown(value)}, not a whole number")
        numbers[field.name] = value
    calibration = MotorCalibration(**numbers)
    if calibration.drive_mode not in (0, 1):
        raise BadInputError(f"{where}: drive_mode is {calibration.drive_mode}, not 0 or 1")
    low, high = calibration.range_min, calibration.range_max
    if not 0 < calibration.counts < COUNTS_OF_A_TURN or abs(low) > COUNTS_OF_A_TURN:
        raise BadInputError(
            f"{where}: range_min is {shown(low)} and range_max {shown(high)}; between them are 1 "
            f"to {COUNTS_OF_A_TURN - 1} counts of one turn"
        )
    return calibration
