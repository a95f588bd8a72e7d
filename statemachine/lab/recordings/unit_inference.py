"""Unit and scale of each joint of a recording, which its columns do not say.

A servo measures in whole counts, 4096 to a turn. What LeRobot makes of a count is in `_normalize`
of its `motors/motors_bus.py`:

    degrees        (count - middle) * 360 / 4095
    -100 to 100    (count - range_min) / (range_max - range_min) * 200 - 100
    0 to 100       (count - range_min) / (range_max - range_min) * 100, of the gripper always

So every measured value lies on a grid, whose width, the quantum, tells the unit: 360 / 4095 at
all joints means degrees, and 200 / quantum is else the number of counts of the range that was
swept at calibration. Degrees are one in 4096 too large, as the divisor is 4095 (LeRobot's
`model_resolution_table` less one). Before June 2025 it was 4096, and zero was another pose.

Of the commands nothing is taken: their quantum is that of the leader.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError
from ...interface import Array
from .calibration import COUNTS_OF_A_TURN, MotorCalibration
from .joint_units import JointUnit, UnitSource

COUNT = 2.0 * math.pi / COUNTS_OF_A_TURN  # rad
FEWEST_COUNTS, MOST_COUNTS = 300, COUNTS_OF_A_TURN  # of a range that was swept
FEWEST_LEVELS = 8  # different values that a joint must take on to count as one that moves
_DIVISORS = (
    COUNTS_OF_A_TURN - 1,
    COUNTS_OF_A_TURN,
)  # of degrees, in LeRobot since June 2025; before
_COARSEST = 20  # counts: a grid that is too coarse for a servo is to be noticed, too
_MOST_LEVELS = 400  # that are compared with a grid
_FEW_LEVELS = 40  # that are compared with all of them
_MISFIT = 0.02  # of a quantum: float32 rounds to 0.0001 of one
_WITHIN = 0.95  # of the values are that near to the grid
_BEYOND = 100.01  # no normalised value is
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
    """

    name: str
    joint: str
    levels: Array
    low: float
    high: float

    @property
    def is_gripper(self) -> bool:
        """Tell whether it is the gripper, whose unit is always 0 to 100."""
        return "gripper" in self.name

    @property
    def moves(self) -> bool:
        """Tell whether it takes on enough values to show their quantum."""
        return len(self.levels) >= FEWEST_LEVELS


def measured_joint(
    name: str, joint: str, values: Array, joint_range: tuple[float, float]
) -> MeasuredJoint:
    """Return a joint with its different values (all that are finite)."""
    levels = np.unique(values[np.isfinite(values)])
    return MeasuredJoint(name, joint, levels, *joint_range)


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
        BadInputError: It cannot be told; the message says what to give.
    """
    if calibration is not None:
        return _by_calibration(joints, calibration)
    arm = [joint for joint in joints if not joint.is_gripper]
    moving = [joint for joint in arm if joint.moves]
    if not moving:
        raise BadInputError(
            "no joint of the arm takes on more than a few values, so the unit cannot be told: "
            "name an episode in which it moves, or give the arm's calibration file"
        )
    divisor = _divisor_of_degrees(moving)
    units: list[JointUnit] = []
    for joint in joints:
        if joint.is_gripper:
            unit = _gripper(joint)
        elif divisor is not None:
            unit = _degrees(joint, divisor, "quantum", None)
        else:
            unit = _normalised(joint)
        units.append(_with_old_zero(unit, joint.name) if has_old_zero else unit)
    return tuple(units)


def _by_calibration(
    joints: Sequence[MeasuredJoint], calibration: Mapping[str, MotorCalibration]
) -> tuple[JointUnit, ...]:
    lacking = [joint.name for joint in joints if joint.name not in calibration]
    if lacking:
        raise BadInputError(
            f"the calibration has no motor {lacking[0]}; it has {', '.join(calibration)}"
        )
    arm = [joint for joint in joints if not joint.is_gripper]
    divisor = _DIVISORS[0]
    in_degrees = all(
        _misfit(joint.levels, 360.0 / divisor, _middle(calibration[joint.name])) <= _MISFIT
        for joint in arm
    )
    normalised = all(_fits(joint, 200.0 / calibration[joint.name].counts, -100.0) for joint in arm)
    for joint in (joint for joint in joints if joint.is_gripper):
        if not _fits(joint, 100.0 / calibration[joint.name].counts, 0.0):
            raise _other_calibration(joint)
    if in_degrees and normalised and not _alike(arm, calibration):
        raise BadInputError(
            "the recording is too still to tell degrees from -100 to 100: name an episode in which "
            "the arm moves"
        )
    if not in_degrees and not normalised:
        raise _other_calibration(arm[0])
    units: list[JointUnit] = []
    for joint in joints:
        motor = calibration[joint.name]
        if joint.is_gripper:
            units.append(_gripper_of_counts(joint, motor.counts, "calibration", motor.drive_mode))
        elif in_degrees:
            units.append(_degrees(joint, divisor, "calibration", motor.counts))
        else:
            units.append(
                _normalised_of_counts(joint, motor.counts, "calibration", motor.drive_mode)
            )
    return tuple(units)


def _middle(motor: MotorCalibration) -> float:
    """Return the value in degrees of the least count, of which all values are whole counts away."""
    return -0.5 * (motor.range_min + motor.range_max) * 360.0 / _DIVISORS[0]


def _alike(arm: Sequence[MeasuredJoint], calibration: Mapping[str, MotorCalibration]) -> bool:
    """Tell whether degrees and -100 to 100 are the same to a thousandth."""
    return all(
        abs(calibration[joint.name].counts / 200.0 * 360.0 / _DIVISORS[0] - 1.0) < 1e-3
        for joint in arm
    )


def _other_calibration(joint: MeasuredJoint) -> BadInputError:
    return BadInputError(
        f"the measured values of {joint.name} are not whole counts of this calibration: it is of "
        "another arm, or the values were smoothed"
    )


def _divisor_of_degrees(moving: Sequence[MeasuredJoint]) -> int | None:
    """Return 4095 or 4096 if all joints are in degrees, else None."""
    misfits: dict[int, float] = {}
    for divisor in _DIVISORS:
        misfits[divisor] = max(_misfit_of_degrees(joint, divisor) for joint in moving)
    best = min(_DIVISORS, key=lambda divisor: misfits[divisor])
    return best if misfits[best] <= _MISFIT else None


def _misfit_of_degrees(joint: MeasuredJoint, divisor: int) -> float:
    """Return the misfit where the middle of the range is a count, or halfway between two."""
    quantum = 360.0 / divisor
    return min(float(_misfit(joint.levels, quantum, start)) for start in (0.0, 0.5 * quantum))


def _degrees(
    joint: MeasuredJoint, divisor: int, source: UnitSource, counts: float | None
) -> JointUnit:
    quantum = 360.0 / divisor
    return JointUnit(
        joint=joint.joint,
        unit="degrees",
        radians=COUNT / quantum,
        zero=0.0,
        counts=counts,
        quantum=quantum if joint.moves else None,
        source=source,
    )


def _normalised(joint: MeasuredJoint) -> JointUnit:
    if joint.moves:
        return _normalised_of_counts(joint, _counts(joint, 200.0, -100.0), "quantum", 0)
    return JointUnit(
        joint=joint.joint,
        unit="-100 to 100",
        radians=(joint.high - joint.low) / 200.0,
        zero=0.0,
        counts=None,
        quantum=None,
        source="model range",
    )


def _normalised_of_counts(
    joint: MeasuredJoint, counts: int, source: UnitSource, drive_mode: int
) -> JointUnit:
    quantum = 200.0 / counts
    return JointUnit(
        joint=joint.joint,
        unit="-100 to 100",
        radians=-COUNT / quantum if drive_mode else COUNT / quantum,
        zero=0.0,
        counts=counts,
        quantum=quantum if joint.moves else None,
        source=source,
    )


def _gripper(joint: MeasuredJoint) -> JointUnit:
    if joint.moves:
        return _gripper_of_counts(joint, _counts(joint, 100.0, 0.0), "quantum", 0)
    return JointUnit(
        joint=joint.joint,
        unit="0 to 100",
        radians=(joint.high - joint.low) / 100.0,
        zero=joint.low,
        counts=None,
        quantum=None,
        source="model range",
    )


def _gripper_of_counts(
    joint: MeasuredJoint, counts: int, source: UnitSource, drive_mode: int
) -> JointUnit:
    quantum = 100.0 / counts
    scale = COUNT / quantum
    return JointUnit(
        joint=joint.joint,
        unit="0 to 100",
        radians=-scale if drive_mode else scale,
        zero=joint.low + 100.0 * scale if drive_mode else joint.low,
        counts=counts,
        quantum=quantum if joint.moves else None,
        source=source,
    )


def _with_old_zero(unit: JointUnit, name: str) -> JointUnit:
    if unit.unit != "degrees" or name not in _OLD_ZEROS:
        return unit
    sign, zero = _OLD_ZEROS[name]
    return JointUnit(
        joint=unit.joint,
        unit=unit.unit,
        radians=sign * unit.radians,
        zero=zero,
        counts=unit.counts,
        quantum=unit.quantum,
        source=unit.source,
    )


def _counts(joint: MeasuredJoint, width: float, start: float) -> int:
    """Return how many counts a range of `width` has that begins at `start`.

    The values are whole counts of any multiple of it, too; so the least is taken, and of its
    neighbours, which fit a joint that moves little, the one that fits best.

    Raises:
        BadInputError: The values are on no grid of a servo.
    """
    ends = start - (_BEYOND - 100.0), start + width + (_BEYOND - 100.0)
    if joint.levels[0] < ends[0] or joint.levels[-1] > ends[1]:
        raise _on_no_grid(joint)
    numbers = np.arange(_COARSEST, MOST_COUNTS + 1)
    grids = numbers[:, np.newaxis] / width
    misfits = _misfit(_thinned(joint.levels, _FEW_LEVELS), 1.0 / grids, start)
    for index in np.flatnonzero(misfits <= 2.0 * _MISFIT):  # most do not fit a few values
        misfits[index] = _misfit(joint.levels, width / numbers[index], start)
    fitting = np.flatnonzero(misfits <= _MISFIT)
    if not len(fitting) or numbers[fitting[0]] < FEWEST_COUNTS:
        raise _on_no_grid(joint)
    near = fitting[numbers[fitting] < 1.4 * numbers[fitting[0]]]
    return int(numbers[near[np.argmin(misfits[near])]])


def _on_no_grid(joint: MeasuredJoint) -> BadInputError:
    return BadInputError(
        f"the unit cannot be told: the measured values of {joint.name} are neither LeRobot's "
        "degrees nor its -100 to 100 (0 to 100 of the gripper), as they are not whole counts of a "
        "servo (smoothed, filtered or in radians?): give the recording as LeRobot wrote it, or the "
        "arm's calibration file"
    )


def _fits(joint: MeasuredJoint, quantum: float, start: float) -> bool:
    return bool(_misfit(joint.levels, quantum, start) <= _MISFIT)


def _misfit(levels: Array, quantum: float | Array, start: float) -> Array:
    """Return how far most values are at most from whole quanta, in quanta: 0 to 0.5.

    Args:
        levels: (m,) values.
        quantum: A number, or (N, 1) numbers.
        start: Value that is on the grid.

    Returns:
        A number, or (N,) numbers.
    """
    chosen = _thinned(levels, _MOST_LEVELS)
    if not len(chosen):
        return np.array(0.0)
    places = (chosen - start) / quantum
    return np.quantile(np.abs(places - np.round(places)), _WITHIN, axis=-1)


def _thinned(levels: Array, most: int) -> Array:
    """Return at most so many of the values, evenly chosen."""
    if len(levels) <= most:
        return levels
    return levels[np.linspace(0, len(levels) - 1, most).astype(int)]
