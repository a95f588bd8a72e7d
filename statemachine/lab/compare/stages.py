"""The stages of one step, as two matched Models tell them: the same numbers, in the same order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...engines import raw_engine_of
from ...interface import Array, Data, Ints, JointType, Model, forward, step
from ...measures import ContactNames
from ...rotations import matrix_from_quat
from ..recordings.header import labels_of_joints
from ..recordings.repetition import array_or_nan, is_stale
from .matched import Matched

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
UNITS = ("m", "rad", "kg·m²", "kg·m", "kg", "N·m", "N", "rad/s²", "m/s²")  # of all elements
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
        dofs, names, turns = _dofs(left, [left_id for left_id, _ in matched.joints])
        self._dofs = dofs, _dofs(right, [right_id for _, right_id in matched.joints])[0]
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
        engine = raw_engine_of(model.backend)
        if engine.primes:
            arrays = {name: np.zeros(model.nv) for name in before}
            for name, values in before.items():
                arrays[name][self._dofs[side]] = values[self._dofs[1 - side]]
            engine.prime(model, data, arrays)
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
        """Return all columns of a side but the velocity update, each (k, size)."""
        model, dofs = self._models[side], self._dofs[side]
        engine = raw_engine_of(model.backend)
        mass = engine.mass_matrix(model, data, qpos)[np.ix_(dofs, dofs)]
        forces = []
        for stage, arrays in ARRAYS.items():
            parts = [array_or_nan(data, name)[dofs] for name in arrays]
            values = np.concatenate(parts)[:, None]
            if stage == ACCELERATION and not engine.tells_acceleration:
                values = np.full_like(values, np.nan)
            forces.append(values)
        return [*self._poses(side, data), mass[self._upper][:, None], *forces]

    def _poses(self, side: int, data: Data) -> tuple[Array, Array]:
        """Return the left's origins and rotations, wherever the right's are in the solids."""
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
    """Return for each side a function that names a pair of keys, and the key of each geom.

    Keys are geoms where both Models have the same; else bodies, named as on the left.
    """
    left, right = matched.left, matched.right
    if left.geom_names == right.geom_names and np.array_equal(left.geom_bodyid, right.geom_bodyid):
        same: PairNames = ContactNames.of(left).geoms, range(left.ngeom)
        return same, same
    counterpart = {right_id: left_id for left_id, right_id in matched.bodies}
    # A body that only the right has comes after those of the left.
    extra = [right_id for right_id in range(right.nbody) if right_id not in counterpart]
    labels = [
        *left.body_names,
        *(right.body_names[right_id] or f"body {right_id} of the right" for right_id in extra),
    ]
    counterpart |= {right_id: left.nbody + k for k, right_id in enumerate(extra)}
    parents = [*left.body_parentid.tolist(), *([0] * len(extra))]
    geoms = ["world", *([""] * (len(labels) - 1))]
    names = ContactNames(labels, geoms, range(len(labels)), parents)
    keys = [counterpart[int(body)] for body in right.geom_bodyid]
    return (names.pair, left.geom_bodyid.tolist()), (names.pair, keys)


def _dofs(model: Model, joints: Sequence[int]) -> tuple[Ints, list[str], Ints]:
    """Return the degrees of freedom of some joints.

    Returns:
        Their numbers (k,), a name for each, and 1 (k,) for one that turns, else 0.
    """
    labels = labels_of_joints(model.joint_names, model.jnt_type, model.jnt_bodyid, model.body_names)
    dofs, names, turns = [], [], []
    for joint in joints:
        kind, start = JointType(int(model.jnt_type[joint])), int(model.jnt_dofadr[joint])
        dofs += range(start, start + kind.nv)
        names += [labels[joint]] * kind.nv
        free = [0] * 3 + [1] * 3
        turns += free if kind is JointType.FREE else [int(kind is not JointType.SLIDE)] * kind.nv
    return np.array(dofs, dtype=np.int64), names, np.array(turns, dtype=np.int64)
