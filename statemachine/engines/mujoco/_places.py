"""Where the parts of two compiled models are, what they weigh, and which geoms are one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...description.records import HERE, Inertial, Placement, rotation
from ...installed import require
from ...interface import Array
from ..parts import BodyPair, Counterparts, Edit, ModelDifference
from ._figures import plain, same
from ._solid import HINGE, SLIDE, Solids, apart

_NEAR = 1e-10  # [m], and of entries of matrices: less is rounding
_FREE, _BALL = 0, 1
_PLANE, _HFIELD, _SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(8)  # mjtGeom
_SIZES = {_SPHERE: 1, _CAPSULE: 2, _ELLIPSOID: 3, _CYLINDER: 2, _BOX: 3}
_ROUND = (_CAPSULE, _CYLINDER)
_WRAPPED = (4, 5)  # mjtWrap: a sphere, a cylinder
_VERTEX = 1e-6  # [m]: vertices are single precision


class Places:
    """Rigid parts, joints, geoms and sites of two models, in the frames of the second.

    Attributes:
        geoms: Pairs of ids of geoms that act on the motion.
        only: For each model those that have no counterpart.
    """

    def __init__(self, one: Any, two: Any, pairs: Counterparts) -> None:
        self._one, self._two, self._pairs = one, two, pairs
        self._solids = Solids(one), Solids(two)
        self._by_one = {pair.one: pair for pair in pairs.solids}
        self.geoms: tuple[tuple[int, int], ...] = tuple(sorted(self._match_geoms()))
        self.only = tuple(
            [g for g in _acting(raw) if g not in {pair[k] for pair in self.geoms}]
            for k, raw in enumerate((one, two))
        )

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        for pair in self._pairs.solids:
            if pair.one and pair.two:
                if self._one.body_mocapid[pair.one] < 0:  # what no force moves has no weight
                    yield from self._inertial(pair)
                yield from self._hangs(pair)
        for pair in self.geoms:
            yield from self._shape(*pair)
        yield from self._extra()
        for a, b in self._pairs.sites:
            yield from self._site(a, b)

    def _pair_of(self, body: int) -> BodyPair | None:
        return self._by_one.get(self._solids[0].head(body))

    def _inertial(self, pair: BodyPair) -> Iterator[ModelDifference]:
        """Body by body where the part is made alike; else as one solid."""
        ours, theirs = (
            solids.massive(head)
            for solids, head in zip(self._solids, (pair.one, pair.two), strict=True)
        )
        whole = self._weighed(self._solids[0].inertial(pair.one), pair.align)
        alike = self._alike(whole, self._solids[1].inertial(pair.two))
        if all(alike.values()) or not (ours or theirs):
            return
        if len(theirs) == 1:
            yield from self._weights(pair, theirs[0], whole, alike, ours)
        elif self._made_alike(pair, ours, theirs):
            for a, b in zip(ours, theirs, strict=True):
                one, two = self._solids[0].inertial_of(a), self._solids[1].inertial_of(b)
                yield from self._weights(replace(pair, one=a), b, one, self._alike(one, two), [a])
        else:
            edits, why = self._lumped(pair, whole, theirs)
            mass = self._solids[1].inertial(pair.two).mass
            name = name_of(self._one, "body", pair.one)
            values = (("mass", whole.mass, mass), ("bodies", len(ours), len(theirs)))
            yield ModelDifference("mass", "body", name, values, "kg", edits, (), why)

    def _made_alike(self, pair: BodyPair, ours: list[int], theirs: list[int]) -> bool:
        """Whether the bodies of a part are the same ones in the same places."""
        if pair.align is not HERE or len(ours) != len(theirs):
            return False
        for a, b in zip(ours, theirs, strict=True):
            far, turn = apart(self._solids[0].place(a), self._solids[1].place(b))
            if far > _NEAR or turn > _NEAR or self._one.body(a).name != self._two.body(b).name:
                return False
        return True

    @staticmethod
    def _weighed(inertial: Inertial, align: Placement) -> Inertial:
        """An inertia in the frame of the other's part."""
        tensor = align.mat @ inertial.tensor @ align.mat.T
        return Inertial(inertial.mass, align.of(inertial.com), tensor)

    @staticmethod
    def _alike(one: Inertial, two: Inertial) -> dict[str, bool]:
        size = max(np.abs(one.tensor).max(), np.abs(two.tensor).max())
        return {
            "mass": same(one.mass, two.mass),
            "centre of mass": float(np.linalg.norm(one.com - two.com)) <= _NEAR,
            "inertia": bool(np.abs(one.tensor - two.tensor).max() <= 1e-9 * size),
        }

    def _weights(
        self,
        pair: BodyPair,
        target: int,
        there: Inertial,
        alike: dict[str, bool],
        bodies: list[int],
    ) -> Iterator[ModelDifference]:
        """What the one body is to weigh that has the mass of a part."""
        theirs = self._solids[1].inertial_of(target)
        name = name_of(self._one, "body", pair.one)
        told = {
            "mass": (("mass", there.mass, theirs.mass), "kg"),
            "centre of mass": (("com", plain(there.com), plain(theirs.com)), "m"),
            "inertia": (("moments", _moments(there.tensor), _moments(theirs.tensor)), "kg m²"),
        }
        raw_copy = pair.align is HERE and bodies == [pair.one]
        for subject, equal in alike.items():
            if equal:
                continue
            values, unit = told[subject]
            if subject == "mass" or self._stays_simple(pair, target):
                edits = self._weight(subject, pair, target, there, raw_copy)
                yield ModelDifference(subject, "body", name, (values,), unit, edits)
                continue
            back = self._back(subject, pair)
            why = "" if back else "its mass matrix is stored as a diagonal"
            yield ModelDifference(subject, "body", name, (values,), unit, (), back, why)

    def _weight(
        self, subject: str, pair: BodyPair, target: int, there: Inertial, raw_copy: bool
    ) -> tuple[Edit, ...]:
        one, body = self._one, (target,)
        if subject == "mass":
            return (("body_mass", body, there.mass),)
        inner = self._solids[1].place(target).inverse
        if subject == "centre of mass":
            com = one.body_ipos[pair.one].copy() if raw_copy else inner.of(there.com)
            return (("body_ipos", body, com),)
        if raw_copy:
            moments, quat = one.body_inertia[pair.one].copy(), one.body_iquat[pair.one].copy()
        else:
            moments, quat = _principal(inner.mat @ there.tensor @ inner.mat.T)
        return ("body_inertia", body, moments), ("body_iquat", body, quat)

    def _lumped(
        self, pair: BodyPair, there: Inertial, bodies: list[int]
    ) -> tuple[tuple[Edit, ...], str]:
        """All of a part's inertia in its first body, none in those fixed to it."""
        if self._two.body_simple[pair.two]:
            return (), "its mass matrix is stored as a diagonal"
        moments, quat = _principal(there.tensor)
        edits: list[Edit] = []
        for body in bodies:
            if body != pair.two:
                edits += [("body_mass", (body,), 0.0), ("body_inertia", (body,), np.zeros(3))]
        at = (pair.two,)
        edits += [("body_mass", at, there.mass), ("body_ipos", at, there.com)]
        return (*edits, ("body_inertia", at, moments), ("body_iquat", at, quat)), ""

    def _stays_simple(self, pair: BodyPair, target: int) -> bool:
        """Whether the second's mass matrix has a place for what the first has.

        The engine stores that of a body which turns about its centre of mass as a diagonal.
        """
        simple = bool(self._two.body_simple[target])
        return not simple or bool(self._one.body_simple[pair.one])

    def _back(self, subject: str, pair: BodyPair) -> tuple[Edit, ...]:
        """Edits of the first model instead, where it is the one that can be changed."""
        one, two = self._one, self._two
        if one.body_simple[pair.one] or pair.align is not HERE:
            return ()
        if subject == "centre of mass":
            return (("body_ipos", (pair.one,), two.body_ipos[pair.two].copy()),)
        return (
            ("body_inertia", (pair.one,), two.body_inertia[pair.two].copy()),
            ("body_iquat", (pair.one,), two.body_iquat[pair.two].copy()),
        )

    def _hangs(self, pair: BodyPair) -> Iterator[ModelDifference]:
        """Where a part is on the one that carries it, and what it turns about."""
        one, two = self._one, self._two
        name = name_of(one, "body", pair.one)
        joints = [(a, b) for a, b in self._pairs.joints if one.jnt_bodyid[a] == pair.one]
        if any(one.jnt_type[a] == _FREE for a, _ in joints):
            return  # where it starts is a matter of the state
        parent = self._by_one.get(self._solids[0].head(int(one.body_parentid[pair.one])))
        if pair.moved or parent is None:
            why = "it hangs on another part"
            yield ModelDifference("parent", "body", name, (), refused=why)
            return
        numbers = [int(one.body_jntnum[pair.one]), int(two.body_jntnum[pair.two])]
        if numbers != [len(joints)] * 2:
            values = (("joints", numbers[0], numbers[1]),)
            yield ModelDifference("joints", "body", name, values, refused="it has other joints")
            return
        yield from self._axes(pair, joints)
        yield from self._place(pair, parent, joints, name)

    def _axes(self, pair: BodyPair, joints: list[tuple[int, int]]) -> Iterator[ModelDifference]:
        one, two, align = self._one, self._two, pair.align
        for a, b in joints:
            name, kind = name_of(one, "joint", a), int(one.jnt_type[a])
            axis, anchor = align.mat @ one.jnt_axis[a], align.of(one.jnt_pos[a])
            if align is HERE:
                axis, anchor = one.jnt_axis[a].copy(), one.jnt_pos[a].copy()
            if kind in (SLIDE, HINGE) and np.abs(axis - two.jnt_axis[b]).max() > _NEAR:
                values = (("axis", plain(axis), plain(two.jnt_axis[b])),)
                edits: tuple[Edit, ...] = (("jnt_axis", (b,), axis),)
                yield ModelDifference("axis", "joint", name, values, "", edits)
            off = anchor - two.jnt_pos[b]
            if kind == HINGE:  # a point along the axis is as good
                off = off - axis * (off @ axis)
            if kind in (HINGE, _BALL) and np.linalg.norm(off) > _NEAR:
                values = (("anchor", plain(anchor), plain(two.jnt_pos[b])),)
                edits = (("jnt_pos", (b,), anchor),)
                yield ModelDifference("anchor", "joint", name, values, "m", edits)

    def _place(
        self, pair: BodyPair, parent: BodyPair, joints: list[tuple[int, int]], name: str
    ) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        refs = [(_ref(one, a), _ref(two, b)) for a, b in joints]
        ours, theirs = self._solids[0].hangs(pair.one), self._solids[1].hangs(pair.two)
        alike = all(same(a, b) for a, b in refs)
        kept = any(_is_kept(one, a) or _is_kept(two, b) for a, b in joints)
        if not alike and (len(joints) > 1 or kept):  # an equality counts from the reference, too
            values = (("ref", tuple(a for a, _ in refs), tuple(b for _, b in refs)),)
            zeros: tuple[Edit, ...] = tuple(
                ("qpos0", (int(two.jnt_qposadr[b]),), ref)
                for (_, b), (ref, other) in zip(joints, refs, strict=True)
                if not same(ref, other)
            )
            yield ModelDifference("zero", "body", name, values, "", zeros)
            alike = True
        wanted = parent.align @ ours @ pair.align.inverse
        if not alike:  # the same zero, another reference: turn back by ours, on by theirs
            (a, _), (ref, other) = joints[0], refs[0]
            axis, anchor = pair.align.mat @ one.jnt_axis[a], pair.align.of(one.jnt_pos[a])
            turned = _motion(int(one.jnt_type[a]), axis, anchor, other - ref)
            wanted = wanted @ turned
        far, turn = apart(wanted, theirs)
        if far <= _NEAR and turn <= _NEAR:
            return
        raw_copy = (
            alike
            and parent.align is HERE
            and pair.align is HERE
            and one.body_parentid[pair.one] == parent.one
            and two.body_parentid[pair.two] == parent.two
        )
        if raw_copy:
            pos, quat = one.body_pos[pair.one].copy(), one.body_quat[pair.one].copy()
        else:
            above = self._solids[1].place(int(two.body_parentid[pair.two]))
            inner = above.inverse @ wanted
            pos, quat = inner.pos, _quat(inner.mat)
        values = []
        if far > _NEAR:
            values.append(("place", plain(wanted.pos), plain(theirs.pos)))
        if turn > _NEAR:
            values.append(("turned by [rad]", 0.0, wanted.angle(theirs)))
        edits: tuple[Edit, ...] = (
            ("body_pos", (pair.two,), pos),
            ("body_quat", (pair.two,), quat),
        )
        yield ModelDifference("place", "body", name, tuple(values), "m", edits)

    def _match_geoms(self) -> Iterator[tuple[int, int]]:
        """By name, then by likeness, within each rigid part."""
        for pair in self._pairs.solids:
            ours = [g for g in _acting(self._one) if self._head(0, g) == pair.one]
            theirs = [g for g in _acting(self._two) if self._head(1, g) == pair.two]
            names = {self._two.geom(g).name: g for g in theirs if self._two.geom(g).name}
            for g in list(ours):
                other = names.get(self._one.geom(g).name)
                if other is not None:
                    yield g, other
                    ours.remove(g)
                    theirs.remove(other)
            costs = sorted((self._cost(pair, a, b), a, b) for a in ours for b in theirs)
            for _, a, b in costs:
                if a in ours and b in theirs:
                    yield a, b
                    ours.remove(a)
                    theirs.remove(b)

    def _head(self, side: int, geom: int) -> int:
        solids = self._solids[side]
        return solids.head(int(solids.raw.geom_bodyid[geom]))

    def _cost(self, pair: BodyPair, a: int, b: int) -> float:
        """How unlike two geoms are: of other types is worse than far apart."""
        ours, theirs = pair.align @ self._solids[0].geom(a), self._solids[1].geom(b)
        cost = ours.distance(theirs)
        if self._one.geom_type[a] != self._two.geom_type[b]:
            return cost + 100.0
        return cost + float(np.abs(_size(self._one, a) - _size(self._two, b)).sum())

    def _shape(self, a: int, b: int) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        pair = self._pair_of(int(one.geom_bodyid[a]))
        assert pair is not None  # geoms are matched within a pair
        name = name_of(one, "geom", a)
        kinds = int(one.geom_type[a]), int(two.geom_type[b])
        if kinds == (_MESH, _MESH):
            yield from self._mesh(pair, a, b, name)
            return
        if kinds[0] != kinds[1] and not {*kinds} <= _SIZES.keys():
            values = (("type", _kind(kinds[0]), _kind(kinds[1])),)
            why = "one of them is no primitive, and cannot become the other"
            yield ModelDifference("shape", "geom", name, values, refused=why)
            return
        if kinds[0] == _HFIELD and not _same_hfield(one, two, a, b):
            yield ModelDifference("heights", "geom", name, (), refused="another height field")
        copied = ("geom_type", "geom_size", "geom_rbound", "geom_aabb", "geom_fluid")
        values = []
        if kinds[0] != kinds[1]:
            values.append(("type", _kind(kinds[0]), _kind(kinds[1])))
        if kinds[0] in _SIZES and not same(_size(one, a), _size(two, b)):
            values.append(("size", plain(_size(one, a)), plain(_size(two, b))))
        if not same(one.geom_fluid[a], two.geom_fluid[b]):
            values.append(("fluid", "as given", "as given"))
        if values:
            edits = tuple((field, (b,), _copied(one, field, a)) for field in copied)
            yield ModelDifference("shape", "geom", name, tuple(values), "m", edits)
        wanted, theirs = pair.align @ self._solids[0].geom(a), self._solids[1].geom(b)
        if _off(kinds[0], wanted, theirs):
            yield self._moved(pair, a, b, wanted, theirs, name)

    def _moved(
        self, pair: BodyPair, a: int, b: int, wanted: Placement, theirs: Placement, name: str
    ) -> ModelDifference:
        one, two = self._one, self._two
        bodies = int(one.geom_bodyid[a]), int(two.geom_bodyid[b])
        if pair.align is HERE and bodies == (pair.one, pair.two):
            pos, quat = one.geom_pos[a].copy(), one.geom_quat[a].copy()
        else:
            inner = self._solids[1].place(bodies[1]).inverse @ wanted
            pos, quat = inner.pos, _quat(inner.mat)
        values = [("place", plain(wanted.pos), plain(theirs.pos))]
        if wanted.distance(theirs) <= _NEAR:
            values = [("turned by [rad]", 0.0, wanted.angle(theirs))]
        edits: tuple[Edit, ...] = (("geom_pos", (b,), pos), ("geom_quat", (b,), quat))
        return ModelDifference("place", "geom", name, tuple(values), "m", edits)

    def _mesh(self, pair: BodyPair, a: int, b: int, name: str) -> Iterator[ModelDifference]:
        ours = pair.align.pos + self._solids[0].vertices(a) @ pair.align.mat.T
        theirs = self._solids[1].vertices(b)
        if ours.shape != theirs.shape:
            values = (("vertices", len(ours), len(theirs)),)
            yield ModelDifference("shape", "geom", name, values, refused="it is another mesh")
            return
        hulls = _hull(self._one, a), _hull(self._two, b)
        if all(each is not None for each in hulls) and not same(*hulls):
            values = (("corners of its hull", int(hulls[0][0]), int(hulls[1][0])),)
            why = "it has another convex hull"
            yield ModelDifference("hull", "geom", name, values, refused=why)
        if np.abs(ours - theirs).max() <= _VERTEX:
            return
        meshes = [int(raw.geom_dataid[g]) for raw, g in ((self._one, a), (self._two, b))]
        own = [_own_vertices(*each) for each in ((self._one, meshes[0]), (self._two, meshes[1]))]
        if np.abs(own[0] - own[1]).max() <= _VERTEX:
            wanted, there = pair.align @ self._solids[0].geom(a), self._solids[1].geom(b)
            yield self._moved(pair, a, b, wanted, there, name)
            return
        values = (("farthest vertex", 0.0, float(np.abs(ours - theirs).max())),)
        yield ModelDifference("shape", "geom", name, values, "m", refused="it is another mesh")

    def _extra(self) -> Iterator[ModelDifference]:
        """Geoms that only one has are switched off there."""
        for side, raw in enumerate((self._one, self._two)):
            for g in self.only[side]:
                kind = _kind(int(raw.geom_type[g]))
                edits: tuple[Edit, ...] = (("geom_contype", (g,), 0), ("geom_conaffinity", (g,), 0))
                edits += (("geom_fluid", (g,), np.zeros(raw.geom_fluid.shape[1])),)
                edits += tuple(
                    ("pair_margin", (k,), -1e3)
                    for k in range(raw.npair)
                    if g in (raw.pair_geom1[k], raw.pair_geom2[k])
                )
                values = (("geom", kind, None) if side == 0 else ("geom", None, kind),)
                name = name_of(raw, "geom", g)
                yield ModelDifference(
                    "extra shape",
                    "geom",
                    name,
                    values,
                    edits=() if side == 0 else edits,
                    edits_one=edits if side == 0 else (),
                )

    def _site(self, a: int, b: int) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        name = name_of(one, "site", a)
        pair = self._pair_of(int(one.site_bodyid[a]))
        if pair is None or self._solids[1].head(int(two.site_bodyid[b])) != pair.two:
            yield ModelDifference("owner", "site", name, (), refused="it is on another part")
            return
        wanted, theirs = pair.align @ self._solids[0].site(a), self._solids[1].site(b)
        far, turn = apart(wanted, theirs)
        if far <= _NEAR and turn <= _NEAR:
            return
        inner = self._solids[1].place(int(two.site_bodyid[b])).inverse @ wanted
        values = [("place", plain(wanted.pos), plain(theirs.pos))]
        if far <= _NEAR:
            values = [("turned by [rad]", 0.0, wanted.angle(theirs))]
        edits: tuple[Edit, ...] = (
            ("site_pos", (b,), inner.pos),
            ("site_quat", (b,), _quat(inner.mat)),
        )
        yield ModelDifference("place", "site", name, tuple(values), "m", edits)


def touches(raw: Any) -> Any:
    """Which geoms (ngeom,) can touch: by their masks, or in a pair of their own."""
    found = (raw.geom_contype != 0) | (raw.geom_conaffinity != 0)
    found[raw.pair_geom1] = found[raw.pair_geom2] = True
    return found


def _acting(raw: Any) -> list[int]:
    """Geoms that can touch, that a tendon wraps, or that a medium flows around by their shape."""
    found = touches(raw) | (raw.geom_fluid[:, 0] > 0)
    found[raw.wrap_objid[np.isin(raw.wrap_type, _WRAPPED)]] = True
    return np.flatnonzero(found).tolist()


def _off(kind: int, one: Placement, two: Placement) -> bool:
    """Whether a shape is elsewhere; some look alike when they are turned."""
    far, turn = apart(one, two)
    z, other = one.mat[:, 2], two.mat[:, 2]
    if kind == _SPHERE:
        return far > _NEAR
    if kind == _PLANE:
        tilt, depth = np.abs(z - other).max(), abs(z @ (one.pos - two.pos))
        return bool(max(tilt, depth) > _NEAR)
    if kind in _ROUND:
        across = min(np.abs(z - other).max(), np.abs(z + other).max())
        return far > _NEAR or bool(across > _NEAR)
    return far > _NEAR or turn > _NEAR


def _size(raw: Any, geom: int) -> Array:
    return np.array(raw.geom_size[geom][: _SIZES.get(int(raw.geom_type[geom]), 0)])


def _kind(kind: int) -> str:
    return require("mujoco").mjtGeom(kind).name.removeprefix("mjGEOM_").lower()


def _copied(raw: Any, field: str, index: int) -> Any:
    return np.array(getattr(raw, field)[index])


def _own_vertices(raw: Any, mesh: int) -> Array:
    start = int(raw.mesh_vertadr[mesh])
    return np.asarray(raw.mesh_vert[start : start + int(raw.mesh_vertnum[mesh])], dtype=float)


def _hull(raw: Any, geom: int) -> Any:
    """What the compiler made of the convex hull of a mesh geom; None without one."""
    start = int(raw.mesh_graphadr[raw.geom_dataid[geom]])
    if start < 0:
        return None
    corners, faces = raw.mesh_graph[start : start + 2].tolist()
    return raw.mesh_graph[start : start + 2 + 3 * corners + 6 * faces]


def _same_hfield(one: Any, two: Any, a: int, b: int) -> bool:
    parts = []
    for raw, geom in ((one, a), (two, b)):
        h = int(raw.geom_dataid[geom])
        start, size = int(raw.hfield_adr[h]), int(raw.hfield_nrow[h]) * int(raw.hfield_ncol[h])
        parts.append((raw.hfield_size[h], raw.hfield_data[start : start + size]))
    return all(same(x, y) for x, y in zip(*parts, strict=True))


def _ref(raw: Any, joint: int) -> float:
    """The position of a joint in which the body lies as its frame says; 0 of a ball."""
    scalar = int(raw.jnt_type[joint]) in (SLIDE, HINGE)
    return float(raw.qpos0[raw.jnt_qposadr[joint]]) if scalar else 0.0


def _is_kept(raw: Any, joint: int) -> bool:
    """Whether an equality of joints holds a joint."""
    of_joints = raw.eq_type == int(require("mujoco").mjtEq.mjEQ_JOINT)
    return bool((of_joints & ((raw.eq_obj1id == joint) | (raw.eq_obj2id == joint))).any())


def _motion(kind: int, axis: Array, anchor: Array, amount: float) -> Placement:
    if kind == SLIDE:
        return Placement(axis * amount, np.eye(3))
    mat = rotation(axis, amount)
    return Placement(anchor - mat @ anchor, mat)


def _moments(tensor: Array) -> tuple[float, ...]:
    return tuple(np.linalg.eigvalsh(tensor)[::-1].tolist())


def _principal(tensor: Array) -> tuple[Array, Array]:
    """Moments (3,) of inertia, and the quaternion of their axes."""
    moments, axes = np.linalg.eigh(tensor)
    moments, axes = moments[::-1], axes[:, ::-1]
    if np.linalg.det(axes) < 0:
        axes = axes * [1.0, 1.0, -1.0]
    return moments, _quat(axes)


def _quat(mat: Array) -> Array:
    quat = np.empty(4)
    require("mujoco").mju_mat2Quat(quat, np.ascontiguousarray(mat).reshape(9))
    return quat


def name_of(raw: Any, kind: str, index: int) -> str:
    """The name of an element; without one, its kind, number and owner."""
    name = getattr(raw, {"equality": "eq"}.get(kind, kind))(index).name
    if name:
        return name
    owner = {"geom": "geom_bodyid", "site": "site_bodyid", "joint": "jnt_bodyid"}.get(kind)
    on = raw.body(int(getattr(raw, owner)[index])).name if owner else ""
    return f"{kind} {index}" + (f" on {on}" if on else "")


__all__ = ["Places", "name_of", "touches"]
