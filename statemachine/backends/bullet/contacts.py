"""Contacts: MuJoCo's rules of what touches what, and how, in PyBullet's terms; and what touched.

MuJoCo decides by pairs of geoms, and takes the larger friction or that of the geom with
priority. PyBullet decides by pairs of links, and multiplies what each link has. It
reports contacts by links, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...interface import Array, Contacts
from ...rotations import cross, matrix_from_quat
from .. import dense
from ..compiled.flags import DisableFlag
from ..compiled.kinds import GeomKind
from ..contact_rules import bodies_meet, mixed

if TYPE_CHECKING:
    from ..compiled.types import MjModel

NO_CONTACT = int(DisableFlag.CONTACT | DisableFlag.CONSTRAINT)
_MOST = 10.0  # PyBullet's largest friction of a pair
_CLOSE = 0.01  # a friction is the model's if it is within this part of it


@dataclass(frozen=True)
class Solid:
    """Geoms of one body that meet the same others; PyBullet has one link for them.

    Attributes:
        body: MuJoCo's id of the body.
        geoms: MuJoCo's ids of the geoms.
        plane: Whether it is a plane, and not what touches as one.
        part: Its number among the solids of its body.
    """

    body: int
    geoms: tuple[int, ...]
    plane: bool = False
    part: int = 0


@dataclass(frozen=True, eq=False)
class BulletContact:
    """One contact, as `Contacts` has them.

    Attributes:
        geoms: The ids of both, the smaller first.
        distance: Between the surfaces [m]; negative is penetration.
        position: (3,) midpoint in world axes [m].
        frame: (3, 3) contact axes as rows, the first the normal.
        force: (3,) of the first geom on the second, along those axes [N].
    """

    geoms: tuple[int, int]
    distance: float
    position: Array
    frame: Array
    force: Array


class PairFriction(NamedTuple):
    """The largest friction of the contacts of two solids.

    Attributes:
        left, right: Places of the solids in `Surfaces.solids`.
        slide: Sliding friction.
        spin, roll: Torsional and rolling friction [m].
    """

    left: int
    right: int
    slide: float
    spin: float
    roll: float


class Surfaces:
    """The solids of a model.

    Attributes:
        solids: All that can touch; planes first.
        touching: (ngeom,) which geoms may touch any other.
        pairs: Whether two solids may touch, by their places.
        meeting: The pairs of geoms of solids that may touch.
        slide, spin, roll: (nsolid,) sliding, torsional and rolling friction of each solid.
        differences: Where friction is not the model's, in words.
    """

    def __init__(self, raw: MjModel) -> None:
        self._raw = raw
        meets = _meets(raw)
        touching = (raw.geom_contype | raw.geom_conaffinity).astype(bool)
        touching[[*raw.pair_geom1, *raw.pair_geom2]] = True
        self.touching = touching & (not raw.opt.disableflags & NO_CONTACT)
        self.solids = _solids(raw, meets, self.touching)
        inexact: list[str] = []
        self.pairs: dict[tuple[int, int], bool] = {}
        self.meeting: list[tuple[int, int]] = []
        pair_frictions: list[PairFriction] = []
        for (i, left), (j, right) in combinations(enumerate(self.solids), 2):
            meet = self.pairs[i, j] = bool(meets[left.geoms[0], right.geoms[0]])
            if meet:
                meeting = [(a, b) for a in left.geoms for b in right.geoms]
                self.meeting += meeting
                frictions = np.array([_friction(raw, a, b) for a, b in meeting])
                slide, spin, roll = frictions.max(axis=0)
                pair_frictions.append(PairFriction(i, j, slide, spin, roll))
                if np.ptp(frictions[:, 0]) > _CLOSE * frictions[:, 0].max():
                    inexact.append(
                        f"friction of {self._label(i, j)} is {frictions[:, 0].max():.3g} for all "
                        f"their geoms, not {frictions[:, 0].min():.3g} for some"
                    )
        self._solve(pair_frictions)
        self.differences += inexact

    def of_one_robot(self, whole: bool) -> list[tuple[int, int]]:
        """Give the pairs of solids that meet though both are of one robot.

        Args:
            whole: Whether all that is here is one robot, as in a URDF; else each tree is one.
        """
        roots = self._raw.body_rootid
        pairs = [pair for pair, meet in self.pairs.items() if meet]
        return [
            (i, j)
            for i, j in pairs
            if whole or 0 != roots[self.solids[i].body] == roots[self.solids[j].body]
        ]

    def _label(self, i: int, j: int) -> str:
        def name(solid: Solid) -> str:
            if solid.plane:
                return self._raw.geom(solid.geoms[0]).name or f"the plane (geom {solid.geoms[0]})"
            return self._raw.body(solid.body).name or f"body {solid.body}"

        return f"{name(self.solids[i])} and {name(self.solids[j])}"

    def _solve(self, pair_frictions: list[PairFriction]) -> None:
        """Find frictions of solids from those of pairs, by least squares."""
        count = len(self.solids)
        rows, right = [], []
        for pair in pair_frictions:
            if pair.slide > 0:
                both = np.isin(np.arange(count), (pair.left, pair.right))
                rows.append(both.astype(np.float64))
                right.append(math.log(pair.slide))
        self.slide = np.zeros(count)
        if rows and np.ptp(right) == 0 and len(rows) == len(pair_frictions):
            self.slide += math.exp(right[0] / 2)  # one friction for all: no need to solve
        elif rows:
            logs = np.linalg.lstsq(np.array(rows), np.array(right), rcond=None)[0]
            has_friction = np.any(rows, axis=0)  # what meets nothing with friction has none
            self.slide = np.where(has_friction, [math.exp(x) for x in np.round(logs, 12)], 0.0)
        self.spin = self._frictions_of_solids(
            pair_frictions, [pair.spin for pair in pair_frictions]
        )
        self.roll = self._frictions_of_solids(
            pair_frictions, [pair.roll for pair in pair_frictions]
        )
        self.differences: list[str] = []
        for i, j, slide, spin, roll in pair_frictions:
            sliding = min(self.slide[i] * self.slide[j], _MOST)
            spinning, rolling = self._combined(self.spin, i, j), self._combined(self.roll, i, j)
            self._compare("friction", i, j, sliding, slide)
            self._compare("spinning friction", i, j, spinning, spin)
            self._compare("rolling friction", i, j, rolling, roll)

    def _compare(self, what: str, i: int, j: int, ours: float, theirs: float) -> None:
        """Add a friction of two solids that differs from the model's to `differences`."""
        if abs(ours - theirs) > _CLOSE * max(theirs, 1e-6):
            pair = self._label(i, j)
            self.differences.append(f"{what} of {pair} is {ours:.3g}, not {theirs:.3g}")

    def _combined(self, frictions: Array, i: int, j: int) -> float:
        """Return PyBullet's combination of the spinning or rolling friction of two geoms."""
        return float(frictions[i] * self.slide[j] + frictions[j] * self.slide[i])

    def _frictions_of_solids(
        self, pair_frictions: list[PairFriction], of_pairs: list[float]
    ) -> Array:
        """Find the spinning or rolling friction of solids from that of each pair."""
        matrix = np.zeros((len(pair_frictions), len(self.solids)))
        for row, (i, j, *_) in enumerate(pair_frictions):
            matrix[row, i], matrix[row, j] = self.slide[j], self.slide[i]
        right = np.array(of_pairs)
        if not right.any():
            return np.zeros(len(self.solids))
        frictions = np.linalg.lstsq(matrix, right, rcond=None)[0]
        return np.maximum(np.round(frictions, 12), 0.0)


def _meets(raw: MjModel) -> NDArray[np.bool_]:
    """Return (ngeom, ngeom) of which geoms may touch."""
    if raw.opt.disableflags & NO_CONTACT:
        return np.zeros((raw.ngeom, raw.ngeom), dtype=bool)
    meets = (raw.geom_contype[:, None] & raw.geom_conaffinity) != 0
    meets |= meets.T
    bodies = {body: raw.geom_bodyid == body for body in np.unique(raw.geom_bodyid).tolist()}
    for (a, left), (b, right) in product(bodies.items(), repeat=2):
        if not bodies_meet(raw, a, b):
            meets[np.ix_(left, right)] = False
    meets[raw.pair_geom1, raw.pair_geom2] = meets[raw.pair_geom2, raw.pair_geom1] = True
    return meets


def _solids(raw: MjModel, meets: NDArray[np.bool_], touching: NDArray[np.bool_]) -> list[Solid]:
    """Return the solids of a model, planes first: geoms of a body that meet the same are one.

    Args:
        raw: The compiled model.
        meets: (ngeom, ngeom) which geoms may touch.
        touching: (ngeom,) which may touch any other.
    """
    planes = touching & (raw.geom_type == GeomKind.PLANE)
    solids = [
        Solid(int(raw.geom_bodyid[g]), (g,), plane=True) for g in np.flatnonzero(planes).tolist()
    ]
    for body in range(raw.nbody):
        alike: dict[bytes, list[int]] = {}
        for geom in np.flatnonzero(touching & ~planes & (raw.geom_bodyid == body)).tolist():
            alike.setdefault(meets[geom].tobytes(), []).append(geom)
        solids += [Solid(body, tuple(geoms), part=k) for k, geoms in enumerate(alike.values())]
    return solids


def _mixed(raw: MjModel, a: int, b: int) -> tuple[int, Array, Array]:
    """Return the condim, friction (3,) and solref (2,) of a contact of two geoms."""
    ends = np.sort([raw.pair_geom1, raw.pair_geom2], axis=0).T
    named = np.flatnonzero((ends == sorted((a, b))).all(axis=1))
    if len(named):
        (pair, *_) = named.tolist()
        friction = raw.pair_friction[pair, [0, 2, 3]]
        return int(raw.pair_dim[pair]), friction, raw.pair_solref[pair]
    return mixed(raw, a, b)[:3]


def _friction(raw: MjModel, a: int, b: int) -> Array:
    """Return the sliding, spinning and rolling friction of a pair, zero where its condim leaves
    it out.
    """
    condim, friction, _ = _mixed(raw, a, b)
    return friction * (condim > np.array([1, 3, 4]))


def damping_ratios(raw: MjModel, pairs: list[tuple[int, int]]) -> Array:
    """Return the damping ratios of contacts of geoms (n, 2), from their solref."""
    first, second = np.array([_mixed(raw, a, b)[2] for a, b in pairs]).T
    # Negated, they are stiffness and damping.
    return np.where(first <= 0, -second / (2 * np.sqrt(np.maximum(-first, 1e-15))), second)


def contacts_of(
    raw: MjModel,
    points: Iterable[Any],
    geoms: Mapping[tuple[int, int], tuple[int, tuple[int, ...]]],
    geom_rotations: Mapping[int, Array],
    read: Callable[[str], Any],
) -> Contacts:
    """Return the contacts that a world found at the beginning of its last step.

    PyBullet knows which links touch. A link may have several geoms: the one whose
    surface is nearest to the point is taken.

    Args:
        raw: The compiled model.
        points: As getContactPoints returns them; those that are apart and carry no force are left
            out.
        geoms: By PyBullet's body and link, MuJoCo's body and its geoms that touch.
        geom_rotations: By geom, the matrix (3, 3) from its body's axes into its own.
        read: Gives xpos and xquat of that moment by name; asked only where a link has several
            geoms.
    """
    rotations: dict[int, Array] = {}  # by body, into its own axes

    def geom_at(body: int, link: int, point: Array) -> int:
        b, candidates = geoms[body, link]
        if len(candidates) == 1:
            return candidates[0]
        if b not in rotations:
            rotations[b] = matrix_from_quat(read("xquat")[b]).T.copy()
        local = dense.times(rotations[b], point - read("xpos")[b])
        return min(candidates, key=lambda g: abs(_distance(raw, g, geom_rotations[g], local)))

    contacts: list[BulletContact] = []
    for point in points:
        _, body_a, body_b, link_a, link_b, on_a, on_b, normal, dist, push = point[:10]
        if dist > 0 and not push:
            continue
        on_a, on_b, normal = np.array(on_a), np.array(on_b), np.array(normal)
        pair = geom_at(body_b, link_b, on_b), geom_at(body_a, link_a, on_a)
        # The normal goes from B to A; friction is what A feels.
        force = push * normal
        for size, direction in (point[10:12], point[12:14]):
            force = force + size * np.array(direction)
        if pair[0] > pair[1]:
            pair, normal, force = (pair[1], pair[0]), -normal, -force
        frame = _axes(normal)
        contacts.append(
            BulletContact(pair, dist, (on_a + on_b) / 2, frame, dense.times(frame, force))
        )
    return _as_contacts(contacts)


def _as_contacts(contacts: list[BulletContact]) -> Contacts:
    """Return n contacts as arrays; PyBullet reports no torque."""
    n = len(contacts)
    geoms = np.array([contact.geoms for contact in contacts], dtype=np.int64)
    distances = np.array([contact.distance for contact in contacts], dtype=np.float64)
    positions = np.array([contact.position for contact in contacts], dtype=np.float64)
    frames = np.array([contact.frame for contact in contacts], dtype=np.float64)
    forces = np.array([contact.force for contact in contacts], dtype=np.float64)
    return Contacts(
        geom=geoms.reshape(n, 2),
        dist=distances,
        pos=positions.reshape(n, 3),
        frame=frames.reshape(n, 3, 3),
        force=forces.reshape(n, 3),
        torque=np.zeros((n, 3)),
    )


def _axes(normal: Array) -> Array:
    """Return the contact axes (3, 3) as rows, the first the normal."""
    other_axis = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.5 else np.array([0.0, 0.0, 1.0])
    first = other_axis - normal * dense.dot(normal, other_axis)
    first /= math.hypot(*first)
    return np.array([normal, first, cross(normal, first)])


def _distance(raw: MjModel, geom: int, turn: Array, point: Array) -> float:
    """Return the signed distance of a point, in the body's frame, from the surface of its geom [m].

    Args:
        raw: The compiled model.
        geom: Of the body.
        turn: (3, 3) from the body's axes into the geom's.
        point: (3,) [m].
    """
    local = dense.times(turn, point - raw.geom_pos[geom])
    size, kind, box = raw.geom_size[geom], int(raw.geom_type[geom]), raw.geom_aabb[geom]
    if kind in (GeomKind.SPHERE, GeomKind.CAPSULE):
        # From the middle, or the middle line; a sphere has no second size.
        return float(math.hypot(*local[:2], max(abs(local[2]) - size[1], 0.0)) - size[0])
    if kind == GeomKind.CYLINDER:
        beyond = np.array([np.hypot(local[0], local[1]) - size[0], abs(local[2]) - size[1]])
    else:  # a mesh by the box around it
        beyond = np.abs(local - box[:3]) - box[3:]
    return float(math.hypot(*np.maximum(beyond, 0)) + min(beyond.max(), 0.0))
