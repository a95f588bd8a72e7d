"""Data sets of LeRobot, as a calibrated arm would write them."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from statemachine.lab.recordings.calibration import MotorCalibration
from tools.arm_recordings.data_set import Frames, Version, WrittenDataSet, write_data_set

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
COUNT = 2.0 * np.pi / 4096.0  # rad
# Counts of the swept range of each joint, as on the recording that the project looked at.
COUNTS = (2548, 2304, 2205, 2286, 3831, 1250)


@dataclass(frozen=True)
class Servo:
    """A servo's swept range, and what it writes of a count."""

    range_min: int
    range_max: int
    unit: str  # "degrees", "-100 to 100", "0 to 100"
    drive_mode: int = 0

    @property
    def middle(self) -> float:
        return 0.5 * (self.range_min + self.range_max)

    def values(self, counts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what LeRobot writes, in its own order of operations."""
        if self.unit == "degrees":
            return (counts - self.middle) * 360 / 4095
        width = 200 if self.unit == "-100 to 100" else 100
        start = 100 if width == 200 else 0
        share = (counts - self.range_min) / (self.range_max - self.range_min) * width - start
        if not self.drive_mode:
            return share
        return -share if width == 200 else 100 - share


def servos(unit: str, counts: tuple[int, ...] = COUNTS) -> tuple[Servo, ...]:
    """Return servos whose ranges have as many counts, all in one unit but for the gripper."""
    made: list[Servo] = []
    for joint, number in zip(JOINTS, counts, strict=True):
        low = 2048 - number // 2
        made.append(Servo(low, low + number, "0 to 100" if joint == "gripper" else unit))
    return tuple(made)


def moved_counts(
    each: tuple[Servo, ...], frames: int = 120, seed: int = 0, travel: int = 300
) -> NDArray[np.float64]:
    """Return counts of each servo, (frames, n): waves about a place off the middle."""
    rng = np.random.default_rng(seed)
    time = np.arange(frames) / 30.0
    columns: list[NDArray[np.float64]] = []
    for servo in each:
        phase = rng.uniform(0, 2 * np.pi)
        wave = np.sin(2 * np.pi * (0.3 + 0.1 * rng.uniform()) * time + phase)
        columns.append(np.round(servo.middle + 57 + 0.5 * travel * wave))
    return np.stack(columns, axis=1)


def frames_of(each: tuple[Servo, ...], counts: NDArray[np.float64]) -> Frames:
    """Return the frames that LeRobot writes of counts; commands are between two counts."""
    columns = [servo.values(counts[:, k]) for k, servo in enumerate(each)]
    state = np.stack(columns, axis=1)
    return Frames(action=state + 0.013, state=state)


def data_set(
    each: tuple[Servo, ...], episodes: int = 2, frames: int = 120, travel: int = 300
) -> WrittenDataSet:
    """Return a data set of an arm that moves."""
    made = [frames_of(each, moved_counts(each, frames, seed, travel)) for seed in range(episodes)]
    return WrittenDataSet(tuple(f"{joint}.pos" for joint in JOINTS), 30, made)


def written(folder: Path, made: WrittenDataSet, version: Version = "v3.0") -> str:
    """Write a data set; return the source that names it."""
    write_data_set(folder, made, version)
    return f"lerobot:{folder}"


def with_state(
    made: WrittenDataSet, state: NDArray[np.float64], episode: int = 0
) -> WrittenDataSet:
    """Return the data set with other measured values in an episode."""
    episodes = list(made.episodes)
    episodes[episode] = replace(episodes[episode], state=state)
    return replace(made, episodes=episodes)


def calibration_of(each: tuple[Servo, ...]) -> dict[str, MotorCalibration]:
    """Return what LeRobot would keep of servos."""
    return {
        name: MotorCalibration(number + 1, servo.drive_mode, 0, servo.range_min, servo.range_max)
        for number, (name, servo) in enumerate(zip(JOINTS, each, strict=True))
    }


def calibration_file(folder: Path, each: tuple[Servo, ...]) -> Path:
    """Write what LeRobot would keep of servos; return the file."""
    motors = {name: asdict(motor) for name, motor in calibration_of(each).items()}
    path = folder / "arm.json"
    path.write_text(json.dumps(motors), "utf-8")
    return path
