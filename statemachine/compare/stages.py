"""The stages of one step, as two matched Models tell them: what is compared, and of what."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..engines import room
from ..interface import Array, Data, Ints, JointType, Model
from ..measures import ContactNames
from ..rotations import angle_between, matrix_from_quat
from ..runs.derived import array_or_nan
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
_WORDS = {"qfrc_friction": "dry friction", "qfrc_limit": "limit", "qfrc_equality": "equality"}


@dataclass(frozen=True, eq=False)
class StageGroup:
    """Numbers of one stage that have one unit.

    Attributes:
        stage: One of `STAGES`.
        unit: Theirs.
        names: What each is of: a joint, a body, a pair of joints.
        size: Of an element: 1 for a number, 3 for a vector, 9 for a rotation.
    """

    stage: str
    unit: str
    names: tuple[str, ...]
    size: int = 1

    def apart(self, one: Array, two: Array) -> Array:
        """How far apart the elements (n, k) are at n moments; NaN where one is not told."""
        shape = len(one), len(self.names), self.size
        if self.size == 9:
            return angle_between(one.reshape(*shape[:2], 3, 3), two.reshape(*shape[:2], 3, 3))
        return np.linalg.norm((one - two).reshape(shape), axis=2)

    def largest(self, one: Array, two: Array) -> Array:
        """The largest of all elements (n,); of places their reach, of rotations one radian."""
        if self.size == 9:
            return np.ones(len(one))
        both = np.concatenate([one, two], axis=1).reshape(len(one), -1, self.size)
        if self.size == 3:
            return np.array([float(np.linalg.norm(reach)) for reach in np.ptp(both, axis=1)])
        return np.nanmax(np.abs(both[:, :, 0]), axis=1, initial=0.0)


Touching = dict[str, Array]  # by pair (4,): how deep [m], and the force [N]
Reading = tuple[list[Array], Touching]


class StageReader:
    """Reads the same numbers, in the same order, from a Data of either Model.

    Attributes:
        groups: What is read.
        dofs: For each Model the degrees of freedom that both have.
    """

    def __init__(self, matched: Matched) -> None:
        self._matched = matched
        self._models = matched.one, matched.two
        self._rooms = [room(model.backend) for model in self._models]
        one, two = self._models
        here, names, turns = _dofs(one, [a for a, _ in matched.joints])
        self.dofs, self._turns = (here, _dofs(two, [b for _, b in matched.joints])[0]), turns
        bodies = tuple(one.body_names[s.one] or f"body {s.one}" for s in matched.solids[1:])
        sites = tuple(one.site_names[a] or f"site {a}" for a, _ in matched.sites)
        self.groups: list[StageGroup] = [
            StageGroup(KINEMATICS, "m", bodies + sites, 3),
            StageGroup(KINEMATICS, "rad", bodies + sites, 9),
        ]
        upper = np.triu_indices(len(names))
        self._mass_units: list[tuple[Ints, Ints]] = []
        for both, unit in ((2, "kg·m²"), (1, "kg·m"), (0, "kg")):
            chosen = turns[upper[0]].astype(int) + turns[upper[1]].astype(int) == both
            rows, columns = upper[0][chosen], upper[1][chosen]
            pairs = zip(rows.tolist(), columns.tolist(), strict=True)
            labels = tuple(names[i] if i == j else f"{names[i]} and {names[j]}" for i, j in pairs)
            self._mass_units.append((rows, columns))
            self.groups.append(StageGroup(MASS, unit, labels))
        for stage, arrays in {**ARRAYS, AFTER: ("",)}.items():
            units = ("rad/s²", "m/s²") if stage in (ACCELERATION, AFTER) else ("N·m", "N")
            self.groups += self._of_dofs(stage, names, units, arrays)
        self._names = _contact_names(matched)

    def _of_dofs(
        self, stage: str, names: Sequence[str], units: tuple[str, str], arrays: Sequence[str]
    ) -> list[StageGroup]:
        labels = [
            f"{name} ({_WORDS[array]})" if array in _WORDS else name
            for array in arrays
            for name in names
        ]
        turns = np.tile(self._turns, len(arrays))
        return [
            StageGroup(stage, unit, tuple(np.array(labels, dtype=object)[chosen]))
            for unit, chosen in ((units[0], turns), (units[1], ~turns))
        ]

    def prime(self, side: int, data: Data, before: dict[str, Array]) -> str:
        """Let a Data know of the step before, and say what of it its engine takes; "" for nothing.

        `before` are arrays of the other side.
        """
        own, model = self._rooms[side], self._models[side]
        if not own.primes:
            return ""
        given = {}
        for name, values in before.items():
            given[name] = np.zeros(model.nv)
            given[name][self.dofs[side]] = values[self.dofs[1 - side]]
        own.prime(model, data, given)
        return own.primes

    def read(self, side: int, data: Data, qpos: Array) -> Reading:
        """The numbers of all groups but the last, and the contacts.

        Args:
            side: 0 or 1.
            data: Its derived arrays are of the state.
            qpos: (nq,) of the state.
        """
        model, dofs = self._models[side], self.dofs[side]
        where, turned = self._poses(side, data)
        found: list[Array] = [where, turned]
        mass = self._rooms[side].mass_matrix(model, data, qpos)[np.ix_(dofs, dofs)]
        found += [mass[rows, columns] for rows, columns in self._mass_units]
        for arrays in ARRAYS.values():
            values = np.concatenate([array_or_nan(data, name)[dofs] for name in arrays])
            turns = np.tile(self._turns, len(arrays))
            found += [values[turns], values[~turns]]
        return found, self._touching(side, data)

    def whole(self, side: int, reading: Reading, rate: Array) -> list[Array]:
        """The numbers of all groups; `rate` (nv,) is how the velocity changed, a second."""
        own = rate[self.dofs[side]]
        return [*reading[0], own[self._turns], own[~self._turns]]

    def _poses(self, side: int, data: Data) -> tuple[Array, Array]:
        """Origins and rotations of the left's frames, wherever the right's are in the solids."""
        solids, sites = self._matched.solids[1:], self._matched.sites
        xpos, xquat = data.xpos, data.xquat
        spots, turns = [], []
        for solid in solids:
            body = (solid.one, solid.two)[side]
            turn = matrix_from_quat(xquat[body])
            spot = xpos[body]
            if side:
                spot, turn = spot + turn @ solid.align.pos, turn @ solid.align.mat
            spots.append(spot)
            turns.append(turn.ravel())
        for pair in sites:
            spots.append(data.site_xpos[pair[side]])
            turns.append(data.site_xmat[pair[side]])
        return np.array(spots).ravel(), np.array(turns).ravel()

    def _touching(self, side: int, data: Data) -> Touching:
        contacts, (say, keys) = data.contacts, self._names[side]
        found: Touching = {}
        for k, geoms in enumerate(contacts.geom.tolist()):
            # Of points that are apart only a force counts: an engine may push before they touch.
            depth = max(0.0, -float(contacts.dist[k]))
            force = contacts.frame[k].T @ contacts.force[k]
            if not depth and not force.any():
                continue
            one, two = (keys[geom] for geom in geoms)
            name = say(one, two)
            before = found.get(name, np.zeros(4))
            total = before[1:] + (-force if one > two else force)
            found[name] = np.array([max(depth, before[0]), *total])
        return found


# What says how a contact of two keys is called, and the key of each geom: of the two keys the
# larger one is that on which the force is counted, the same on both sides.
PairNames = tuple[Callable[[int, int], str], Sequence[int]]


def _contact_names(matched: Matched) -> tuple[PairNames, PairNames]:
    """By geoms, where both Models have the same; else by bodies, called as on the left."""
    one, two = matched.one, matched.two
    if one.geom_names == two.geom_names and np.array_equal(one.geom_bodyid, two.geom_bodyid):
        same: PairNames = ContactNames.of(one).geoms, range(one.ngeom)
        return same, same
    counterpart = {b: a for a, b in matched.bodies}
    # A body that only the right has comes after those of the left.
    extra = [b for b in range(two.nbody) if b not in counterpart]
    labels = [*one.body_names, *(two.body_names[b] or f"body {b} of the right" for b in extra)]
    counterpart |= {b: one.nbody + k for k, b in enumerate(extra)}
    parents = [*one.body_parentid.tolist(), *([0] * len(extra))]
    geoms = ["world", *([""] * (len(labels) - 1))]
    names = ContactNames(labels, geoms, range(len(labels)), parents)
    right = [counterpart[int(body)] for body in two.geom_bodyid]
    return (names.pair, one.geom_bodyid.tolist()), (names.pair, right)


def _dofs(model: Model, joints: Sequence[int]) -> tuple[Ints, list[str], NDArray[np.bool_]]:
    """The degrees of freedom of some joints, a name for each, and whether it turns."""
    dofs, names, turns = [], [], []
    for joint in joints:
        kind, start = JointType(int(model.jnt_type[joint])), int(model.jnt_dofadr[joint])
        dofs += range(start, start + kind.nv)
        names += [model.joint_names[joint] or f"joint {joint}"] * kind.nv
        free = [False] * 3 + [True] * 3
        turns += free if kind is JointType.FREE else [kind is not JointType.SLIDE] * kind.nv
    return np.array(dofs, dtype=np.int64), names, np.array(turns, dtype=bool)
