"""Which geoms of two compiled models are one, and what their shapes and places differ in."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ...measures.text import few
from ...rotations import HERE, Placement
from ..records import BodyPair, Counterparts, Edit, ModelDifference
from . import _meshes as meshes
from ._element_pairs import switched_off
from ._figures import plain, same
from ._meshes import VERTEX
from ._solid import NEAR, SolidPairs, apart, name_of, quat_of

_PLANE, _HFIELD, _SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = range(8)  # mjtGeom
_SIZES = {_SPHERE: 1, _CAPSULE: 2, _ELLIPSOID: 3, _CYLINDER: 2, _BOX: 3}
_ROUND = (_CAPSULE, _CYLINDER)
_WRAPPED = (4, 5)  # mjtWrap: a sphere, a cylinder


class Geoms(SolidPairs):
    """The geoms that act on the motion.

    Attributes:
        geoms: Pairs of ids.
        only: For each model those that have no counterpart.
    """

    def __init__(self, one: Any, two: Any, pairs: Counterparts) -> None:
        super().__init__(one, two, pairs)
        self._told = set[int]()  # meshes of the second model, whose geoms change together
        self.geoms: tuple[tuple[int, int], ...] = tuple(sorted(self._match_geoms()))
        self.only = tuple(
            [g for g in _acting(raw) if g not in {pair[k] for pair in self.geoms}]
            for k, raw in enumerate((one, two))
        )

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        self._told.clear()
        for pair in self.geoms:
            yield from self._shape(*pair)
        yield from self._extra()

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
        if kinds[0] == _HFIELD:
            yield from meshes.heights(one, two, a, b, name)
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
            pos, quat = inner.pos, quat_of(inner.mat)
        values = [("place", plain(wanted.pos), plain(theirs.pos))]
        if wanted.distance(theirs) <= NEAR:
            values = [("turned by [rad]", 0.0, wanted.angle(theirs))]
        edits: tuple[Edit, ...] = (("geom_pos", (b,), pos), ("geom_quat", (b,), quat))
        return ModelDifference("place", "geom", name, tuple(values), "m", edits)

    def _mesh(self, pair: BodyPair, a: int, b: int, name: str) -> Iterator[ModelDifference]:
        """A mesh acts by its convex hull, whatever the order of its vertices and faces."""
        one, two = self._one, self._two
        ours = pair.align.pos + self._solids[0].vertices(a) @ pair.align.mat.T
        theirs = self._solids[1].vertices(b)
        corners = meshes.corners(one, a, ours), meshes.corners(two, b, theirs)
        off = meshes.apart(*corners)
        if off <= VERTEX:
            return
        own = [meshes.corners(raw, g, meshes.vertices(raw, g)) for raw, g in ((one, a), (two, b))]
        if meshes.apart(*own) <= VERTEX:
            wanted, there = pair.align @ self._solids[0].geom(a), self._solids[1].geom(b)
            yield self._moved(pair, a, b, wanted, there, name)
            return
        values: tuple[tuple[str, Any, Any], ...] = (("farthest corner", 0.0, off),)
        if len(corners[0]) != len(corners[1]):
            values = (("corners of its hull", len(corners[0]), len(corners[1])),)
        subject = "hull" if meshes.apart(ours, theirs) <= VERTEX else "shape"
        together, why = ((a, b),), ""
        edits: tuple[Edit, ...] = ()
        if b in self._choices:
            edits = (("geom_dataid", (b,), self._choices[b]),)
        else:
            mesh = int(two.geom_dataid[b])
            if mesh in self._told:
                return  # its geoms change together
            together, why = self._together(a, b), "another geom keeps this mesh, or gets a third"
            if together:
                edits, why = meshes.copied(one, two, int(one.geom_dataid[a]), mesh)
                self._told.add(mesh)
        if edits:
            edits += tuple(edit for each in together for edit in self._as_there(*each))
        name = few([name_of(one, "geom", each) for each, _ in together]) or name
        unit = "m" if values[0][0] == "farthest corner" else ""
        yield ModelDifference(subject, "geom", name, values, unit, edits, (), why)

    @cached_property
    def _choices(self) -> dict[int, int]:
        """By geom of the second model the mesh there that its counterpart has."""
        one, two = self._one, self._two
        pairs = [(a, b) for a, b in self.geoms if one.geom_type[a] == two.geom_type[b] == _MESH]
        return meshes.chosen(one, two, pairs)

    def _as_there(self, a: int, b: int) -> tuple[Edit, ...]:
        """Edits that give a mesh geom the place and the bounds of its counterpart."""
        pair = self._pair_of(int(self._one.geom_bodyid[a]))
        assert pair is not None
        wanted, there = pair.align @ self._solids[0].geom(a), self._solids[1].geom(b)
        moved = self._moved(pair, a, b, wanted, there, "").edits
        return (*meshes.bounds(self._one, a, b), *moved)

    def _together(self, a: int, b: int) -> tuple[tuple[int, int], ...]:
        """The pairs that share the mesh of `b`, if those of the first model share one, too."""
        one, two = self._one, self._two
        sharing = (two.geom_type == _MESH) & (two.geom_dataid == two.geom_dataid[b])
        pairs = tuple(pair for pair in self.geoms if sharing[pair[1]])
        alike = len(pairs) == sum(sharing[g] for g in _acting(two)) and all(
            one.geom_type[each] == _MESH
            and meshes.identical(one, int(one.geom_dataid[a]), one, int(one.geom_dataid[each]))
            for each, _ in pairs
        )
        return pairs if alike else ()

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
                yield switched_off(side, raw, "geom", g, edits, called="shape", what=kind)


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
        return far > NEAR
    if kind == _PLANE:
        tilt, depth = np.abs(z - other).max(), abs(z @ (one.pos - two.pos))
        return bool(max(tilt, depth) > NEAR)
    if kind in _ROUND:
        across = min(np.abs(z - other).max(), np.abs(z + other).max())
        return far > NEAR or bool(across > NEAR)
    return far > NEAR or turn > NEAR


def _size(raw: Any, geom: int) -> Array:
    return np.array(raw.geom_size[geom][: _SIZES.get(int(raw.geom_type[geom]), 0)])


def _kind(kind: int) -> str:
    return require("mujoco").mjtGeom(kind).name.removeprefix("mjGEOM_").lower()


def _copied(raw: Any, field: str, index: int) -> Any:
    return np.array(getattr(raw, field)[index])
