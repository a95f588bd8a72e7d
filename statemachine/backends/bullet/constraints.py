"""MuJoCo's soft constraints of one tree of joints, as rows that its `JointDynamics` solve.

Those of joints are in `JointDynamics`. Here are tendons and equality constraints: of joints, of
tendons, and of two places, one of which may be where no joint moves it [MuJoCo's manual, chapter
Computation, section Constraint model].
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...interface import Array
from ...rotations import INVERSE, cross, matrix_from_quat, times
from .. import dense
from ..compiled.kinds import SITE, EqualityKind
from ..compiled.stages import compute_tendons
from .soft import Soft, SoftRow, bounds_of, shortest_time, soft, soft_row
from .ties import PLACES, ends_of, linear_sum, movers, moving
from .world import Tree, World

if TYPE_CHECKING:
    from ..compiled.types import MjModel


def _related(raw: MjModel, dofs: Any) -> Any:
    """Return (n, n) of which pairs of degrees of freedom one carries the other."""
    carriers = np.eye(raw.nv, dtype=bool)
    for dof, parent in enumerate(raw.dof_parentid.tolist()):  # what carries comes first
        if parent >= 0:
            carriers[dof] |= carriers[parent]
    return (carriers | carriers.T)[np.ix_(dofs, dofs)]


class Tendons:
    """The tendons of a tree.

    Some are linear sums of its joints. The path of one that goes through space is MuJoCo's own
    function of the positions: its length and moment change with each step.

    Attributes:
        ids: MuJoCo's numbers of them.
        spatial: Places of those that go through space.
        moments: By number, the moment (n,) of each.
        armature, damping: (t,), of those that are linear sums.
        lengths: (t,) at the positions of the last `take`.
        near: (n, n) the pairs of degrees of freedom of which one carries the other: MuJoCo's
            matrices have no room for others.
        stiff, limited, has_friction: Whether any has a spring, a limit, dry friction.
    """

    def __init__(self, raw: MjModel, world: World, tree: Tree, off: Mapping[str, bool]) -> None:
        self._raw, self._world, self._tree = raw, world, tree
        self.ids = ids = [
            tendon
            for tendon in range(raw.ntendon)
            if (bodies := movers(raw, tendon)) and tree.links.keys() >= set(bodies)
        ]
        self._moment = np.zeros((len(ids), len(tree.dofs)))
        self.moments = dict(zip(ids, self._moment, strict=True))
        self.spatial = list[int]()
        for place, (tendon, moment) in enumerate(self.moments.items()):
            joints, factors = linear_sum(raw, tendon)
            for dof, factor in zip(raw.jnt_dofadr[joints], factors, strict=True):
                moment[tree.dofs == dof] += factor
            if not len(joints):
                self.spatial.append(place)
        self._across = self._moment.T.copy()
        self.near = _related(raw, tree.dofs)
        self.armature = raw.tendon_armature[ids]
        self.damping = raw.tendon_damping[ids] * (not off["damper"])
        self._spatial_damping = np.zeros(len(ids))
        self._spatial_damping[self.spatial] = self.damping[self.spatial]
        self.damping[self.spatial] = 0
        self._stiffness = raw.tendon_stiffness[ids] * (not off["spring"])
        self._slack = raw.tendon_lengthspring[ids].T
        self.stiff = bool(self._stiffness.any())
        shortest = shortest_time(raw, off)
        weight, on = raw.tendon_invweight0[ids], not off["constraint"]
        self._friction = raw.tendon_frictionloss[ids] * (on and not off["friction"])
        self.has_friction = bool(self._friction.any())
        self._friction_softness = soft(
            raw.tendon_solref_fri[ids], raw.tendon_solimp_fri[ids], weight, shortest
        )
        fenced = raw.tendon_limited[ids].astype(bool) & (on and not off["limit"])
        self.limited = bool(fenced.any())
        margin = raw.tendon_margin[ids][:, None] * [1.0, -1.0]
        self._range = bounds_of(raw.tendon_range[ids] + margin, fenced)
        self._stop = soft(raw.tendon_solref_lim[ids], raw.tendon_solimp_lim[ids], weight, shortest)

    def take(self, q: Sequence[float], angles: Array) -> Array | None:
        """Take the lengths and paths, where the tree's qpos are q and its angles (n,).

        Returns:
            What those damp that go through space (n, n); None if none does.
        """
        self.lengths = dense.times(self._moment, angles)
        if not self.spatial:
            return None
        raw, data = self._raw, self._world.still
        data.qpos[self._tree.qpos] = q
        compute_tendons(raw, data)
        for place in self.spatial:
            start, count = raw.ten_J_rowadr[self.ids[place]], raw.ten_J_rownnz[self.ids[place]]
            row = np.zeros(raw.nv)
            row[raw.ten_J_colind[start : start + count]] = data.ten_J[start : start + count]
            self._moment[place] = row[self._tree.dofs]
            self.lengths[place] = data.ten_length[self.ids[place]]
        self._across = self._moment.T.copy()
        return self.squared(self._spatial_damping)

    def squared(self, weight: Array) -> Array:
        """Return Jᵀ·W·J (n, n) of weights (t,)."""
        return dense.product(self._across * weight, self._moment)

    def spring_force(self) -> Array:
        """Return the forces (n,) of springs where they are beyond their slack."""
        slack = np.minimum(np.maximum(self.lengths, self._slack[0]), self._slack[1])
        return dense.times(self._across, self._stiffness * (slack - self.lengths))

    def limit_rows(self, speed: Array) -> list[SoftRow]:
        """Return the rows of the limits that tendons are beyond."""
        rows, rate, length = [], dense.times(self._moment, speed), self.lengths
        for k, (low, high) in enumerate(zip(*self._range, strict=True)):
            for side, gap in ((1.0, length[k] - low), (-1.0, high - length[k])):
                if gap < 0:
                    rows.append(
                        soft_row(self._stop[k], side * self._moment[k], gap, side * rate[k])
                    )
        return rows

    def friction_rows(self, speed: Array) -> list[SoftRow]:
        """Return the rows of dry friction."""
        if not self.has_friction:
            return []
        rate = dense.times(self._moment, speed)
        return [
            soft_row(self._friction_softness[k], self._moment[k], 0.0, rate[k], (-most, most))
            for k, most in enumerate(self._friction.tolist())
            if most
        ]


class TiedLengths(NamedTuple):
    """An equality of a joint or tendon with a constant, or with a polynomial of another one.

    Attributes:
        kind: What the constraint is like.
        moments: J (n,) of the one, and of the other if there is one.
        zero: Their lengths in the default state [rad or m].
        factors: (5,) of the polynomial, from the constant on.
    """

    kind: Soft
    moments: list[Array]
    zero: list[float]
    factors: list[float]


class TiedPlaces(NamedTuple):
    """A connect or a weld.

    Attributes:
        eq: MuJoCo's id of the equality.
        kinds: What each of its constraints is like: 3 of a connect, 6 of a weld.
        places: The two sides.
    """

    eq: int
    kinds: list[Soft]
    places: list[TiedPlace]


class Equalities:
    """The equality constraints of a tree that are in force."""

    def __init__(
        self,
        raw: MjModel,
        world: World,
        tree: Tree,
        tendons: Tendons,
        off: Mapping[str, bool],
    ) -> None:
        self._raw, self._world, self._tree = raw, world, tree
        self._sums: list[TiedLengths] = []
        self._places: list[TiedPlaces] = []
        shortest = shortest_time(raw, off)
        active = raw.eq_active0 & (not (off["equality"] or off["constraint"]))
        for eq in np.flatnonzero(active).tolist():
            bodies = ends_of(raw, eq)
            if tree.links.keys().isdisjoint(moving(raw, bodies)):
                continue
            kind, ends = EqualityKind(int(raw.eq_type[eq])), [raw.eq_obj1id[eq], raw.eq_obj2id[eq]]
            style = raw.eq_solref[[eq]], raw.eq_solimp[[eq]]
            if kind in PLACES:
                weights = raw.body_invweight0[bodies].sum(axis=0)
                move, turn = (soft(*style, weights[[k]], shortest) for k in (0, 1))
                kinds = move * 3
                if kind == EqualityKind.WELD:
                    kinds += turn * 3
                places = [TiedPlace(raw, eq, side, body) for side, body in enumerate(bodies)]
                self._places.append(TiedPlaces(eq, kinds, places))
                continue
            ends = [int(end) for end in ends if end >= 0]
            if kind == EqualityKind.JOINT:
                dofs = raw.jnt_dofadr[ends]
                moments = [(tree.dofs == dof).astype(np.float64) for dof in dofs]
                zero, weight = raw.qpos0[raw.jnt_qposadr[ends]], raw.dof_invweight0[dofs]
            else:
                moments = [tendons.moments[end] for end in ends]
                zero, weight = raw.tendon_length0[ends], raw.tendon_invweight0[ends]
            (own,) = soft(*style, weight.sum(keepdims=True), shortest)
            factors = raw.eq_data[eq, :5].tolist()
            self._sums.append(TiedLengths(own, moments, zero.tolist(), factors))

    def __bool__(self) -> bool:
        return bool(self._sums or self._places)

    def rows(self, q: Sequence[float], angles: Array, speed: Array) -> list[SoftRow]:
        """Return their rows, where the tree's qpos are q, its angles and velocities (n,)."""
        rows, free = [], (-math.inf, math.inf)
        for kind, moments, zero, factors in self._sums:
            lengths = [
                dense.dot(moment, angles) - at for moment, at in zip(moments, zero, strict=True)
            ]
            jacobian, gap = moments[0], lengths[0] - factors[0]
            if len(moments) > 1:
                gap -= sum(factors[k] * lengths[1] ** k for k in range(1, 5))
                slope = sum(k * factors[k] * lengths[1] ** (k - 1) for k in range(1, 5))
                jacobian = jacobian - slope * moments[1]
            rows.append(soft_row(kind, jacobian, gap, dense.dot(jacobian, speed), free))
        for eq, kinds, places in self._places:
            gaps, jacobian, drift = self._apart(eq, places, q, speed)
            distance = math.hypot(*gaps[: len(kinds)])
            rates = dense.times(jacobian, speed)
            for k, kind in enumerate(kinds):
                row = soft_row(kind, jacobian[k], float(gaps[k]), float(rates[k]), free, distance)
                rows.append(row._replace(reference=row.reference - float(drift[k])))
        return rows

    def _apart(
        self, eq: int, places: list[TiedPlace], q: Sequence[float], speed: Array
    ) -> tuple[Array, Array, Array]:
        """Return the difference of two poses (6,), its Jacobian (6, n), and the Jacobian's change
        times qvel (6,).

        Three numbers are of their positions, three of their axes.
        """
        tree, n = self._tree, len(speed)
        points, quats = [], []
        moves, spins, drifts = np.zeros((2, 6, n)), np.zeros((2, 4)), np.zeros((2, 6))
        for k, place in enumerate(places):
            if place.still:
                still = self._world.still
                where, quat = still.xpos[place.body], still.xquat[place.body]
            else:
                (where,), (quat,) = self._world.body_poses(tree, [place.body])
            turn = matrix_from_quat(quat)
            point = where + dense.times(turn, place.offset)
            points.append(point)
            quats.append(times(quat, place.quat))
            if not place.still:
                moves[k] = self._world.jacobian(tree, q, place.body, (where, turn), point)
                spins[k, 1:], drifts[k] = self._drift(moves[k], speed)
        jacobian, drift = moves[0] - moves[1], drifts[0] - drifts[1]
        scale, back = 0.5 * float(self._raw.eq_data[eq, 10]), quats[1] * INVERSE

        def turned(spin: Array) -> Array:
            """Return the change of the quaternion (…, 3) from one place to the other under a
            spin (…, 3).
            """
            pure = np.concatenate([np.zeros((*spin.shape[:-1], 1)), spin], axis=-1)
            return times(times(back, pure), quats[0])

        apart = spins[0] - spins[1]
        moving = times(times(apart, spins[0]) - times(spins[1], apart), quats[0])
        drift[3:] = scale * (turned(drift[3:]) + 0.5 * times(back, moving))[1:]
        jacobian[3:] = scale * turned(jacobian[3:].T)[:, 1:].T
        gaps = np.concatenate([points[0] - points[1], 2 * scale * times(back, quats[0])[1:]])
        return gaps, jacobian, drift

    def _drift(self, jacobian: Array, speed: Array) -> tuple[Array, Array]:
        """Return the angular velocity (3,) of a place, and its acceleration (6,) without any qacc.

        The axis of each joint is a screw about the place, and moves with the body that carries
        it: its rate is the motion cross product with that body's velocity [Featherstone, Rigid
        Body Dynamics Algorithms, chapter 2].
        """
        order = np.argsort(self._tree.dofs)  # what carries comes before what is carried
        moving, turning = jacobian[:3, order].T, jacobian[3:, order].T
        move, turn = moving * speed[order, None], turning * speed[order, None]
        # The velocity of what carries each axis; those of a free joint turn with its body.
        carried = np.stack([move, turn]).cumsum(axis=1)
        if self._tree.free:
            carried[:, 3:6] = carried[:, 5:6]
        (lift, spin), (velocity, whole) = carried, carried[:, -1]
        rise = np.cross(spin, move) + np.cross(lift, turn)
        faster = np.concatenate([rise.sum(axis=0), np.cross(spin, turn).sum(axis=0)])
        faster[:3] += cross(whole, velocity)
        return whole, faster


class TiedPlace:
    """What one side of a connect or a weld holds.

    Attributes:
        body: MuJoCo's id of the body.
        offset, quat: (3,) and (4,) where in the body.
        still: Whether no joint moves the body.
    """

    def __init__(self, raw: MjModel, eq: int, side: int, body: int) -> None:
        number, data = int((raw.eq_obj1id, raw.eq_obj2id)[side][eq]), raw.eq_data[eq]
        weld = raw.eq_type[eq] == EqualityKind.WELD
        self.body, self.quat = body, np.array([1.0, 0.0, 0.0, 0.0])
        if raw.eq_objtype[eq] == SITE:
            self.offset, self.quat = raw.site_pos[number], raw.site_quat[number]
        else:
            first = 3 * (side != weld)  # a weld has the anchor of its second body first
            self.offset = data[first : first + 3]
            if weld and not side:
                self.quat = data[6:10]
        self.still = bool(raw.body_treeid[body] < 0)
