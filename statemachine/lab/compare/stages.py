"""The stages of one step, as two matched Models tell them, and how far apart they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...engines import room
from ...interface import Array, Data, Ints, JointType, Model, forward, step
from ...measures import ContactNames, RobotScale
from ...measures.floors import SHARE
from ...rotations import angle_between, matrix_from_quat
from ..recordings.header import labels_of_joints
from ..recordings.recorder import array_or_nan, is_stale
from .matching import Matched

KINEMATICS, MASS, FOUND, FORCE = "kinematics", "mass matrix", "contacts found", "contact force"
ACCELERATION, AFTER = "acceleration", "velocity update"
# In the order in which a step computes them; arrays of the contract are behind their stage.
ARRAYS = {
    "bias": ("qfrc_bias",),
    "actuator": ("qfrc_actuator",),
    "passive": ("qfrc_passive",),
    FORCE: ("qfrc_contact",),
    "other constraints": ("qfrc_friction", "qfrc_limit", "qfrc_equality"),
    ACCELERATION: ("qacc",),
}
STAGES = (KINEMATICS, MASS, "bias", "actuator", "passive", FOUND, *list(ARRAYS)[3:], AFTER)
FORCES = ("bias", "actuator", "passive", FORCE, "other constraints")
_WORDS = {"qfrc_friction": "dry friction", "qfrc_limit": "limit", "qfrc_equality": "equality"}
_UNITS = ("m", "rad", "kg·m²", "kg·m", "kg", "N·m", "N", "rad/s²", "m/s²")
_LEAST = 1e-3  # of the largest: a size that is less is not usual
_MASS_COLUMN = 2  # among those of a StageReader, behind positions and rotations


class StageColumn(NamedTuple):
    """The k elements of a stage: a name and a unit for each."""

    stage: str
    names: Sequence[str]
    units: Sequence[str]


class StepReading(NamedTuple):
    """One step of one side.

    Attributes:
        values: Of each column its elements (k, size): numbers, vectors of 3, rotations of 9.
        contacts: By pair of bodies or geoms (4,): how deep [m], and the force [N].
    """

    values: list[Array]
    contacts: dict[str, Array]


class StageReader:
    """Reads the same numbers, in the same order, from a Data of either Model.

    Attributes:
        columns: What is read, but for contacts.
    """

    def __init__(self, matched: Matched) -> None:
        self._matched = matched
        self._models = left, right = matched.left, matched.right
        dofs, names, turns = _dofs(left, [a for a, _ in matched.joints])
        self._dofs = dofs, _dofs(right, [b for _, b in matched.joints])[0]
        self._upper = np.triu_indices(len(names))
        frames = _frames(matched)
        positions = StageColumn(KINEMATICS, frames, ["m"] * len(frames))
        rotations = StageColumn(KINEMATICS, frames, ["rad"] * len(frames))
        self.columns = [positions, rotations, _mass_column(names, turns)]
        self.columns += [_force_column(stage, names, turns) for stage in (*ARRAYS, AFTER)]
        self._contact_names = _contact_names(matched)

    def inertias(self, reading: StepReading) -> Array:
        """Return the inertia (n,) of each degree of freedom in a step, as it was read [kg, kg·m²].

        It is the diagonal of the mass matrix; NaN where an engine does not tell it.
        """
        diagonal = self._upper[0] == self._upper[1]
        return reading.values[_MASS_COLUMN][diagonal, 0]

    def prime(self, side: int, data: Data, before: dict[str, Array]) -> str:
        """Let a Data know of the step before, and say what of it its engine takes; "" for nothing.

        `before` are arrays of the other side.
        """
        model = self._models[side]
        engine = room(model.backend)
        if engine.primes:
            given = {name: np.zeros(model.nv) for name in before}
            for name, values in before.items():
                given[name][self._dofs[side]] = values[self._dofs[1 - side]]
            engine.prime(model, data, given)
        return engine.primes

    def step(self, side: int, data: Data, qpos: Array, qvel: Array) -> StepReading:
        """Take a step, and read what it was made of.

        Args:
            side: 0 or 1.
            data: In the state that the step begins in.
            qpos: (nq,) and qvel (nv,) of that state.
            qvel: See qpos.
        """
        model, dofs = self._models[side], self._dofs[side]
        stale = is_stale(model)
        (step if stale else forward)(model, data)
        values, contacts = self._read(side, data, qpos), self._contacts(side, data)
        if not stale:
            step(model, data)
        rate = (data.qvel - qvel) / model.timestep
        return StepReading([*values, rate[dofs, None]], contacts)

    def _read(self, side: int, data: Data, qpos: Array) -> list[Array]:
        """All columns but the velocity update."""
        model, dofs = self._models[side], self._dofs[side]
        mass = room(model.backend).mass_matrix(model, data, qpos)[np.ix_(dofs, dofs)]
        forces = []
        for arrays in ARRAYS.values():
            parts = [array_or_nan(data, name)[dofs] for name in arrays]
            forces.append(np.concatenate(parts)[:, None])
        return [*self._poses(side, data), mass[self._upper][:, None], *forces]

    def _poses(self, side: int, data: Data) -> tuple[Array, Array]:
        """Origins and rotations of the left's frames, wherever the right's are in the solids."""
        xpos, xquat, positions, rotations = data.xpos, data.xquat, [], []
        for solid in self._matched.solids[1:]:
            body = (solid.left, solid.right)[side]
            position, rotation = xpos[body], matrix_from_quat(xquat[body])
            if side:
                position = position + rotation @ solid.align.pos
                rotation = rotation @ solid.align.mat
            positions.append(position)
            rotations.append(rotation.ravel())
        for pair in self._matched.sites:
            positions.append(data.site_xpos[pair[side]])
            rotations.append(data.site_xmat[pair[side]].ravel())
        return np.reshape(positions, (-1, 3)), np.reshape(rotations, (-1, 9))

    def _contacts(self, side: int, data: Data) -> dict[str, Array]:
        contacts, (name_of, keys) = data.contacts, self._contact_names[side]
        by_pair: dict[str, Array] = {}
        for k, geoms in enumerate(contacts.geom.tolist()):
            # Of points that are apart only a force counts: an engine may push before they touch.
            depth = max(0.0, -float(contacts.dist[k]))
            force = contacts.frame[k].T @ contacts.force[k]
            if depth or force.any():
                a, b = (keys[geom] for geom in geoms)
                total = by_pair.setdefault(name_of(a, b), np.zeros(4))
                total[0] = max(depth, total[0])
                total[1:] += -force if a > b else force
        return by_pair


def _frames(matched: Matched) -> list[str]:
    """Return the names of the bodies and the sites that both Models have, as on the left."""
    left = matched.left
    bodies = [left.body_names[solid.left] or f"body {solid.left}" for solid in matched.solids[1:]]
    sites = [left.site_names[site] or f"site {site}" for site, _ in matched.sites]
    return bodies + sites


_MASS_UNITS = ("kg", "kg·m", "kg·m²")  # by how many of two degrees of freedom turn


def _mass_column(dofs: Sequence[str], turns: Ints) -> StageColumn:
    """Return the upper triangle of the mass matrix.

    Args:
        dofs: The joint of each degree of freedom.
        turns: (k,) 1 for one that turns, else 0.
    """
    names, units = [], []
    for i in range(len(dofs)):
        for j in range(i, len(dofs)):
            names.append(dofs[i] if dofs[i] == dofs[j] else f"{dofs[i]} and {dofs[j]}")
            units.append(_MASS_UNITS[turns[i] + turns[j]])
    return StageColumn(MASS, names, units)


def _force_column(stage: str, dofs: Sequence[str], turns: Ints) -> StageColumn:
    """Return the forces, or the accelerations, of a stage: of each array each degree of freedom.

    Args:
        stage: One of `ARRAYS`, or the velocity update.
        dofs: The joint of each degree of freedom.
        turns: (k,) 1 for one that turns, else 0.
    """
    is_acceleration = stage in (ACCELERATION, AFTER)
    turning, sliding = ("rad/s²", "m/s²") if is_acceleration else ("N·m", "N")
    names, units = [], []
    for array in ARRAYS.get(stage, ("",)):
        suffix = f" ({_WORDS[array]})" if array in _WORDS else ""
        names += [f"{dof}{suffix}" for dof in dofs]
        units += [turning if turn else sliding for turn in turns.tolist()]
    return StageColumn(stage, names, units)


# What says how a contact of two keys is called, and the key of each geom: of the two keys the
# larger one is that on which the force is counted, the same on both sides.
PairNames = tuple[Callable[[int, int], str], Sequence[int]]


def _contact_names(matched: Matched) -> tuple[PairNames, PairNames]:
    """By geoms, where both Models have the same; else by bodies, called as on the left."""
    left, right = matched.left, matched.right
    if left.geom_names == right.geom_names and np.array_equal(left.geom_bodyid, right.geom_bodyid):
        same: PairNames = ContactNames.of(left).geoms, range(left.ngeom)
        return same, same
    counterpart = {b: a for a, b in matched.bodies}
    # A body that only the right has comes after those of the left.
    extra = [b for b in range(right.nbody) if b not in counterpart]
    labels = [*left.body_names, *(right.body_names[b] or f"body {b} of the right" for b in extra)]
    counterpart |= {b: left.nbody + k for k, b in enumerate(extra)}
    parents = [*left.body_parentid.tolist(), *([0] * len(extra))]
    geoms = ["world", *([""] * (len(labels) - 1))]
    names = ContactNames(labels, geoms, range(len(labels)), parents)
    keys = [counterpart[int(body)] for body in right.geom_bodyid]
    return (names.pair, left.geom_bodyid.tolist()), (names.pair, keys)


def _dofs(model: Model, joints: Sequence[int]) -> tuple[Ints, list[str], Ints]:
    """The degrees of freedom of some joints, a name for each, and 1 for one that turns."""
    labels = labels_of_joints(model.joint_names, model.jnt_type, model.jnt_bodyid, model.body_names)
    dofs, names, turns = [], [], []
    for joint in joints:
        kind, start = JointType(int(model.jnt_type[joint])), int(model.jnt_dofadr[joint])
        dofs += range(start, start + kind.nv)
        names += [labels[joint]] * kind.nv
        free = [0] * 3 + [1] * 3
        turns += free if kind is JointType.FREE else [int(kind is not JointType.SLIDE)] * kind.nv
    return np.array(dofs, dtype=np.int64), names, np.array(turns, dtype=np.int64)


@dataclass(eq=False)
class StageMeasure:
    """What was read of a stage in one unit: of k elements, at n moments.

    Attributes:
        stage: Of all elements.
        unit: Of all elements.
        names: What each is of: a joint, a body, a pair of joints.
        apart: (n, k) how far the two sides are apart.
        null: (n, k) how far the left side is from itself.
        scale: Its usual size, on either side.
        floors: (k,) what counts of no element, whatever the scale is: see `RobotScale`.
        tolerance: What does not count of the scale.
    """

    stage: str
    unit: str
    names: list[str]
    apart: Array
    null: Array
    scale: float
    floors: Array
    tolerance: float = 0.0

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """(n, k) what is beyond the tolerance, beyond its floor, and beyond the null."""
        return self.apart > np.maximum(np.maximum(self.tolerance, self.floors), self.null)

    @property
    def worst(self) -> tuple[int, int]:
        """The moment and the element that differ most: of those that are beyond, if any are."""
        beyond = self.beyond
        apart = np.where(beyond, self.apart, 0.0) if beyond.any() else self.apart
        row, element = np.unravel_index(int(np.argmax(apart)), apart.shape)
        return int(row), int(element)

    def culprit(self, row: int) -> str:
        """What to look at in a moment: the element that differs most, or where that comes from.

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
        return self.names[int(np.argmax(self.apart[row]))]


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
    left = [put_back for _, put_back, _ in readings]
    right = [on_the_right for _, _, on_the_right in readings]
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
        found = StageColumn(FOUND, pairs, ["m"] * count)
        force = StageColumn(FORCE, pairs, ["N"] * count)
        by_unit += _by_unit(found, np.full(count, robot.length), *depths)
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
        return SHARE * np.sqrt(inertias[rows] * inertias[columns])
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
    for unit in _UNITS:
        places = [k for k, of in enumerate(column.units) if of == unit]
        apart = _distances(left[:, places], right[:, places])
        known = np.flatnonzero(np.isfinite(apart).all(axis=0))
        if len(known):
            null = np.nan_to_num(_distances(running[:, places], left[:, places]))
            names = [column.names[places[k]] for k in known.tolist()]
            sizes = _sizes(column.stage, left[:, places], right[:, places])
            yield StageMeasure(
                column.stage,
                unit,
                names,
                apart[:, known],
                null[:, known],
                scale=_usual_size(sizes),
                floors=floors[places][known],
            )


def _usual_size(sizes: Array) -> float:
    """Return the median of sizes (n,), of those that are no thousandth of the largest."""
    acting = sizes[sizes > _LEAST * sizes.max(initial=0.0)]
    return float(np.median(acting)) if len(acting) else 0.0


def _distances(left: Array, right: Array) -> Array:
    """How far apart elements (n, k, size) are (n, k); NaN where one is not told."""
    if left.shape[2] == 9:
        shape = *left.shape[:2], 3, 3
        return angle_between(left.reshape(shape), right.reshape(shape))
    return np.linalg.norm(left - right, axis=2)


def _sizes(stage: str, left: Array, right: Array) -> Array:
    """The largest of all elements (n,); of places their reach, of rotations one radian."""
    both = np.concatenate([left, right], axis=1)
    if both.shape[2] == 9:
        return np.ones(len(both))
    if stage == KINEMATICS:
        return np.array([float(np.linalg.norm(reach)) for reach in np.ptp(both, axis=1)])
    return np.nanmax(np.linalg.norm(both, axis=2), axis=1, initial=0.0)


def _largest_scale(rows: Sequence[StageMeasure], stages: Sequence[str], unit: str) -> float:
    """The largest scale of some stages in a unit."""
    return max((m.scale for m in rows if m.stage in stages and m.unit == unit), default=0.0)
