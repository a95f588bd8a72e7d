"""Unit and scale of each joint of a recording, which its columns do not say.

A servo measures in whole counts, 4096 to a turn. What LeRobot makes of a count is in _normalize
of its `motors/motors_bus.py`:

    degrees        (count - middle) * 360 / 4095
    -100 to 100    (count - range_min) / (range_max - range_min) * 200 - 100
    0 to 100       (count - range_min) / (range_max - range_min) * 100, of the gripper always

So every measured value lies on a grid, whose width, the quantum, tells the unit: 360 / 4095 at
all joints means degrees, and 200 / quantum is else the number of counts of the range that was
swept at calibration. Such a degree is 4095/4096 of one, as the divisor is LeRobot's
model_resolution_table less one; before June 2025 it was 4096. Of the commands nothing is taken:
their quantum is that of the leader.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import BadInputError
from ...interface import Array
from .calibration import COUNT, COUNTS_OF_A_TURN, MotorCalibration
from .count_grid import FEWEST_LEVELS, WIDEST, CountGrid, grid_of
from .joint_units import JointUnit

FEWEST_COUNTS = 300  # of a range that was swept
_LEAST_PART = 0.6  # of a joint's range in the model that a hand sweeps
# Of a degree, in LeRobot since June 2025 and before.
_DEGREES = (360.0 / (COUNTS_OF_A_TURN - 1), 360.0 / COUNTS_OF_A_TURN)
_ALIKE = 1e-4  # two quanta, as parts: a joint with one count less than 2275 has 4e-4 more
_WHOLE = 0.1  # counts: a number of counts that near to a whole one is whole
_BEYOND = 0.01  # what float32 may add to 100
_BEYOND_OLD = 10.0  # units: LeRobot bounds values to 0 and 100, and before June 2025 to -10 and 110
# LeRobot's examples/backward_compatibility/replay.py: angles of before are 90 - a and a - 90.
_OLD_ZEROS = {"shoulder_lift": (-1.0, 0.5 * math.pi), "elbow_flex": (1.0, -0.5 * math.pi)}


@dataclass(frozen=True, eq=False)
class MeasuredJoint:
    """What was measured of a joint, over all episodes, and what the model has of it.

    Attributes:
        name: In the recording.
        joint: In the model.
        levels: (m,) different finite values, ascending, in the unit of the file.
        low, high: Its range in the model [rad].
        grid: Places that its values lie on; None where they lie on none, or are few.
    """

    name: str
    joint: str
    levels: Array
    low: float
    high: float
    grid: CountGrid | None

    @property
    def is_gripper(self) -> bool:
        """Tell whether it is the gripper, whose unit is always 0 to 100."""
        return _is_gripper(self.name)

    @property
    def moves(self) -> bool:
        """Tell whether it takes on enough values to show their quantum."""
        return len(self.levels) >= FEWEST_LEVELS

    @property
    def width(self) -> float:
        """Return how wide its range is where it is not in degrees."""
        return _width(self.name)


def measured_joint(
    name: str, joint: str, values: Array, joint_range: tuple[float, float]
) -> MeasuredJoint:
    """Return a joint with its different values (all that are finite), and their grid.

    Args:
        name: In the recording.
        joint: In the model.
        values: (rows,) over all episodes, in the unit of the file.
        joint_range: Its range in the model [rad].
    """
    levels = np.unique(values[np.isfinite(values)])
    grid = grid_of(levels, finest=_width(name) / COUNTS_OF_A_TURN)
    return MeasuredJoint(name, joint, levels, *joint_range, grid)


def _is_gripper(name: str) -> bool:
    return "gripper" in name


def _width(name: str) -> float:
    """Return how wide the range of a joint is where it is not in degrees."""
    return 100.0 if _is_gripper(name) else 200.0


def infer_units(
    joints: Sequence[MeasuredJoint],
    calibration: Mapping[str, MotorCalibration] | None = None,
    has_old_zero: bool = False,
) -> tuple[JointUnit, ...]:
    """Return what the numbers of each joint mean.

    Counts grow with the angle of the model's joint. Zero of degrees and of -100 to 100 is the
    zero of the model's joint, as LeRobot's middle of the range is for the SO-101; 0 of the
    gripper is the lower limit of the model's joint.

    Args:
        joints: What was measured of each.
        calibration: LeRobot's, by the names of the recording; None for what the numbers tell.
        has_old_zero: Whether it was recorded with the zero of before June 2025.

    Raises:
        BadInputError: It cannot be told, or the calibration is not that of the recording; the
            message says what to give.
    """
    arm = [joint for joint in joints if not joint.is_gripper and joint.moves]
    if not arm:
        raise BadInputError(
            "no joint of the arm takes on more than a few values, so the unit cannot be told: "
            "record the arm while it moves"
        )
    for joint in joints:
        if joint.moves and joint.grid is None:
            raise _on_no_grid(joint)
    degree = _quantum_of_degrees(arm)
    if calibration is not None:
        return _by_calibration(joints, calibration, degree)
    units: list[JointUnit] = []
    for joint in joints:
        if joint.is_gripper:
            _check_gripper(joint, _BEYOND_OLD if has_old_zero else _BEYOND)
        unit = _told_by_quanta(joint, degree)
        units.append(_with_old_zero(unit, joint.name) if has_old_zero else unit)
    return tuple(units)


def _check_gripper(joint: MeasuredJoint, beyond: float) -> None:
    """Refuse a gripper that is not in 0 to 100, such as one in degrees.

    Raises:
        BadInputError: A value is further out of that range than `beyond`, or the quantum is that
            of degrees, at which 100 units are 1137 counts and a half.
    """
    low, high = float(joint.levels[0]), float(joint.levels[-1])
    is_in_degrees = joint.grid is not None and any(
        _alike(joint.grid.quantum, degree) for degree in _DEGREES
    )
    if low < -beyond or high > 100.0 + beyond:
        found = f"reach from {low:.4g} to {high:.4g}"
    elif is_in_degrees:
        found = "have the step of degrees"
    else:
        return
    raise BadInputError(
        f"the measured values of {joint.name} {found}, and LeRobot writes a gripper as 0 (shut) to "
        "100 (open), even where the other joints are in degrees: give the recording as LeRobot "
        "wrote it"
    )


def _quantum_of_degrees(arm: Sequence[MeasuredJoint]) -> float | None:
    """Return the quantum of degrees that all joints have; None where they are not in degrees."""
    for degree in _DEGREES:
        if all(joint.grid and _alike(joint.grid.quantum, degree) for joint in arm):
            return degree
    return None


def _by_calibration(
    joints: Sequence[MeasuredJoint],
    calibration: Mapping[str, MotorCalibration],
    degree: float | None,
) -> tuple[JointUnit, ...]:
    """Return units with the scale of a calibration, which the quanta must agree with."""
    units: list[JointUnit] = []
    for joint in joints:
        if joint.name not in calibration:
            raise BadInputError(
                f"the calibration has no motor {joint.name}; it has {', '.join(calibration)}"
            )
        if joint.is_gripper:
            _check_gripper(joint, _BEYOND)
        motor = calibration[joint.name]
        if degree is not None and not joint.is_gripper:
            degrees = _degrees(joint, degree)
            units.append(replace(degrees, counts=motor.counts, source="calibration"))
            continue
        if joint.moves and not _is_within(joint):
            raise _on_no_grid(joint)
        if joint.grid and not _alike(joint.grid.quantum, joint.width / motor.counts):
            raise BadInputError(
                f"the calibration is that of another arm: {joint.name} has {motor.counts} counts "
                f"in it, and {joint.width / joint.grid.quantum:.0f} in the recording"
            )
        unit = replace(_of_counts(joint, motor.counts), source="calibration")
        units.append(_inverted(unit, joint) if motor.drive_mode else unit)
    return tuple(units)


def _told_by_quanta(joint: MeasuredJoint, degree: float | None) -> JointUnit:
    """Return the unit of a joint without a calibration."""
    if degree is None or joint.is_gripper:
        return _by_quantum(joint)
    return _degrees(joint, degree)


def _degrees(joint: MeasuredJoint, degree: float) -> JointUnit:
    return JointUnit(
        joint=joint.joint,
        unit="degrees",
        radians=COUNT / degree,
        zero=0.0,
        counts=None,
        quantum=degree if joint.moves else None,
        source="quantum",
    )


def _by_quantum(joint: MeasuredJoint) -> JointUnit:
    """Return the unit of a joint in parts of its range, by its quantum if it moves."""
    if joint.grid is None:
        unit = _of_counts(joint, (joint.high - joint.low) / COUNT)
        return replace(unit, counts=None, source="model range")
    counts = joint.width / joint.grid.quantum
    if not _is_within(joint) or counts < FEWEST_COUNTS:
        raise _on_no_grid(joint)
    if counts * COUNT < _LEAST_PART * (joint.high - joint.low):
        raise _on_coarse_grid(joint, counts)
    if abs(counts - round(counts)) < _WHOLE:
        counts = round(counts)
    return _of_counts(joint, counts)


def _is_within(joint: MeasuredJoint) -> bool:
    """Tell whether values are within -100 to 100, which LeRobot bounds them to."""
    return joint.is_gripper or bool(np.abs(joint.levels).max() < 100.0 + _BEYOND)


def _of_counts(joint: MeasuredJoint, counts: float) -> JointUnit:
    quantum = joint.width / counts
    return JointUnit(
        joint=joint.joint,
        unit="0 to 100" if joint.is_gripper else "-100 to 100",
        radians=COUNT / quantum,
        zero=joint.low if joint.is_gripper else 0.0,
        counts=counts,
        quantum=quantum if joint.moves else None,
        source="quantum",
    )


def _inverted(unit: JointUnit, joint: MeasuredJoint) -> JointUnit:
    """Return the unit of values that drive_mode inverted, as it does all but degrees."""
    upper_end = joint.low + 100.0 * unit.radians
    zero = upper_end if joint.is_gripper else 0.0
    return replace(unit, radians=-unit.radians, zero=zero)


def _with_old_zero(unit: JointUnit, name: str) -> JointUnit:
    if unit.unit != "degrees" or name not in _OLD_ZEROS:
        return unit
    sign, zero = _OLD_ZEROS[name]
    return replace(unit, radians=sign * unit.radians, zero=zero)


def _alike(quantum: float, other: float) -> bool:
    return abs(quantum / other - 1.0) < _ALIKE


def _on_coarse_grid(joint: MeasuredJoint, counts: float) -> BadInputError:
    swept, whole = (math.degrees(angle) for angle in (counts * COUNT, joint.high - joint.low))
    return BadInputError(
        f"the step between the measured values of {joint.name} makes its range {swept:.0f}° wide, "
        f"and the model's is {whole:.0f}°: was a part of it swept at calibration, or did it take "
        "on every other count alone? Give LeRobot's calibration file"
    )


def _on_no_grid(joint: MeasuredJoint) -> BadInputError:
    low, high = float(joint.levels[0]), float(joint.levels[-1])
    if high - low > WIDEST:
        return BadInputError(
            f"the measured values of {joint.name} reach from {low:.4g} to {high:.4g}, and no joint "
            "turns that far: a value is damaged"
        )
    return BadInputError(
        f"the unit cannot be told: the measured values of {joint.name} are neither LeRobot's "
        "degrees nor its -100 to 100 (of the gripper, 0 to 100), as they are no whole counts of a "
        "servo. Were they smoothed, or are they radians? Give the recording as LeRobot wrote it"
    )
