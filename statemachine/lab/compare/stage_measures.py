"""How far apart two sides are in each stage of a step, and what of that counts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...interface import Array
from ...measures import RobotScale
from ...rotations import angle_between
from .stages import (
    ACCELERATION,
    AFTER,
    ARRAYS,
    FORCE,
    FORCES,
    FOUND,
    KINEMATICS,
    MASS,
    UNITS,
    StageColumn,
    StageReader,
    StepReading,
)

_LEAST = 1e-3  # of the largest: a size that is less is not usual


@dataclass(eq=False)
class StageMeasure:
    """What was read of a stage in one unit: of k elements, at n moments.

    Attributes:
        stage: Of all elements.
        unit: Of all elements.
        names: What each is of: a joint, a body, a pair of joints.
        gaps: (n, k) how far the two sides are apart.
        null: (n, k) how far the left side is from itself.
        scale: Its usual size, on either side.
        floors: (k,) what counts of no element, whatever the scale is: see `RobotScale`.
        tolerance: What does not count of the scale.
    """

    stage: str
    unit: str
    names: list[str]
    gaps: Array
    null: Array
    scale: float
    floors: Array
    tolerance: float = 0.0

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """Tell which values (n, k) are beyond the tolerance, its floor, and the null."""
        return self.gaps > np.maximum(np.maximum(self.tolerance, self.floors), self.null)

    @property
    def worst(self) -> tuple[int, int]:
        """Return the row and the element of the largest difference.

        Where differences are beyond the tolerance, only those are looked at.
        """
        beyond = self.beyond
        gaps = np.where(beyond, self.gaps, 0.0) if beyond.any() else self.gaps
        row, element = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        return int(row), int(element)

    def culprit(self, row: int) -> str:
        """Return the name of the element to look at in a row: the worst, or what moves it.

        A body that is elsewhere takes along all that hangs on it, so that the first one counts; a
        mass shows in the entries of every joint that carries it, so that the last of these counts.
        """
        hits = [
            k
            for k in np.flatnonzero(self.beyond[row]).tolist()
            if self.stage != MASS or " and " not in self.names[k]
        ]
        if hits and self.stage in (KINEMATICS, MASS):
            return self.names[hits[0 if self.stage == KINEMATICS else -1]]
        return self.names[int(np.argmax(self.gaps[row]))]


def measures(
    reader: StageReader,
    readings: Sequence[tuple[StepReading, StepReading, StepReading]],
    relative: float,
    robot: RobotScale,
) -> list[StageMeasure]:
    """Return what both sides tell, by stage and unit.

    Args:
        reader: That read them.
        readings: Of each moment: the left side as it runs, put back to its State, and the right.
        relative: What does not count, of the scale.
        robot: How heavy and how large the robot is.
    """
    if not readings:
        return []
    # Each side over all moments.
    running = [as_it_runs for as_it_runs, _, _ in readings]
    left = [left_step for _, left_step, _ in readings]
    right = [right_step for _, _, right_step in readings]
    inertias = _least_inertias(reader, [*left, *right])
    by_unit: list[StageMeasure] = []
    for number, column in enumerate(reader.columns):
        sides = [_values(side, number) for side in (running, left, right)]
        by_unit += _by_unit(column, _floors(column, robot, inertias), *sides)
    pairs = _pairs(readings)
    if pairs:
        contacts = [_contacts_of(side, pairs) for side in (running, left, right)]
        depths = [side[:, :, :1] for side in contacts]
        forces = [side[:, :, 1:] for side in contacts]
        count = len(pairs)
        detection = StageColumn(FOUND, pairs, ["m"] * count)
        force = StageColumn(FORCE, pairs, ["N"] * count)
        by_unit += _by_unit(detection, np.full(count, robot.length), *depths)
        by_unit += _by_unit(force, np.full(count, robot.force), *forces)
    # What is small beside the other forces, as the contact force of a run in which next to nothing
    # touches, is held against these, and accelerations against what forces give.
    least = {unit: _largest_scale(by_unit, FORCES, unit) for unit in ("N·m", "N")}
    for unit, force, mass in (("rad/s²", "N·m", "kg·m²"), ("m/s²", "N", "kg")):
        largest = _largest_scale(by_unit, (MASS,), mass)
        least[unit] = least[force] / largest if largest else 0.0
    for measure in by_unit:
        if measure.stage in (*FORCES, ACCELERATION, AFTER):
            measure.scale = max(measure.scale, _LEAST * least[measure.unit])
        measure.tolerance = relative * measure.scale
    return by_unit


def _least_inertias(reader: StageReader, readings: Sequence[StepReading]) -> Array:
    """Return the smallest inertia (n,) of each degree of freedom; 0 where none is told."""
    inertias = np.array([reader.inertias(reading) for reading in readings])
    return np.nan_to_num(inertias.min(axis=0))


def _floors(column: StageColumn, robot: RobotScale, inertias: Array) -> Array:
    """Return what counts of no element (k,) of a column.

    A force has that of an acceleration, times the inertia of its degree of freedom: so a light
    wrist has a lower one than the shoulder. An entry of the mass matrix has a share of both of its
    degrees of freedom.

    Args:
        column: Not one of contacts.
        robot: How heavy and how large the robot is.
        inertias: (n,) of its degrees of freedom.
    """
    if column.stage == MASS:
        rows, columns = np.triu_indices(len(inertias))
        return robot.step_share * np.sqrt(inertias[rows] * inertias[columns])
    by_unit = {
        "m": robot.length,
        "rad": robot.angle,
        "m/s²": robot.acceleration,
        "N": robot.acceleration,
        "rad/s²": robot.angular_acceleration,
        "N·m": robot.angular_acceleration,
    }
    floors = np.array([by_unit[unit] for unit in column.units])
    if column.stage in FORCES:
        arrays = len(ARRAYS[column.stage])
        floors *= np.tile(inertias, arrays)
    return floors


def _values(side: Sequence[StepReading], number: int) -> Array:
    """Return the elements (n, k, size) of a column, by its number, on one side."""
    return np.array([reading.values[number] for reading in side])


def _pairs(readings: Sequence[tuple[StepReading, StepReading, StepReading]]) -> list[str]:
    """Return who touches whom at any moment, those of the left side first."""
    pairs: dict[str, None] = {}
    for running, left, right in readings:
        for reading in (left, right, running):
            pairs |= dict.fromkeys(reading.contacts)
    return list(pairs)


def _contacts_of(side: Sequence[StepReading], pairs: Sequence[str]) -> Array:
    """Return depth and force (n, k, 4) of each pair on one side; what is not found is zero."""
    contacts = np.zeros((len(side), len(pairs), 4))
    for moment, reading in enumerate(side):
        for k, pair in enumerate(pairs):
            if pair in reading.contacts:
                contacts[moment, k] = reading.contacts[pair]
    return contacts


def _by_unit(
    column: StageColumn, floors: Array, running: Array, left: Array, right: Array
) -> Iterator[StageMeasure]:
    """Yield the elements (n, k, size) of each unit, those of them that both sides tell.

    Args:
        column: What they are.
        floors: (k,) what counts of none of them.
        running: Of the left side as it runs.
        left: Of the left side, put back to its states.
        right: Of the right side.
    """
    for unit in UNITS:
        places = [k for k, of in enumerate(column.units) if of == unit]
        gaps = _distances(left[:, places], right[:, places])
        finite = np.flatnonzero(np.isfinite(gaps).all(axis=0))
        if len(finite):
            null = np.nan_to_num(_distances(running[:, places], left[:, places]))
            names = [column.names[places[k]] for k in finite.tolist()]
            sizes = _sizes(column.stage, left[:, places], right[:, places])
            yield StageMeasure(
                column.stage,
                unit,
                names,
                gaps[:, finite],
                null[:, finite],
                scale=_usual_size(sizes),
                floors=floors[places][finite],
            )


def _usual_size(sizes: Array) -> float:
    """Return the median of sizes (n,), of those that are no thousandth of the largest."""
    acting = sizes[sizes > _LEAST * sizes.max(initial=0.0)]
    return float(np.median(acting)) if len(acting) else 0.0


def _distances(left: Array, right: Array) -> Array:
    """Return the distances (n, k) of elements (n, k, size); NaN where one is unavailable.

    Those of rotation matrices (size 9) are angles [rad].
    """
    if left.shape[2] == 9:
        shape = *left.shape[:2], 3, 3
        return angle_between(left.reshape(shape), right.reshape(shape))
    return np.linalg.norm(left - right, axis=2)


def _sizes(stage: str, left: Array, right: Array) -> Array:
    """Return the size (n,) of the largest element at each moment.

    That of places is the extent of all of them, that of rotations one radian.
    """
    both = np.concatenate([left, right], axis=1)
    if both.shape[2] == 9:
        return np.ones(len(both))
    if stage == KINEMATICS:
        return np.array([float(np.linalg.norm(reach)) for reach in np.ptp(both, axis=1)])
    return np.nanmax(np.linalg.norm(both, axis=2), axis=1, initial=0.0)


def _largest_scale(rows: Sequence[StageMeasure], stages: Sequence[str], unit: str) -> float:
    """Return the largest scale of some stages that have a unit; 0 where none has it."""
    return max((m.scale for m in rows if m.stage in stages and m.unit == unit), default=0.0)
