"""Which geoms of two compiled models are one, and what their shapes and places differ in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...measures.text import few
from ...rotations import HERE
from ..description.meshes import likest
from ..description.records import CollisionShape
from ..records import BodyPair, Edit, ModelDifference
from . import _shapes as shapes
from ._sides import NEAR, Pairs, Sides, apart, copies, name_of, same, zeros

NO_TOUCH = -1e3  # [m] a margin at which nothing touches
_VERTEX = 1e-6  # [m]: vertices are single precision
# How a medium flows around a geom; what follows from its shape stands behind these.
_FLUID = ("fluidshape", *(f"fluidcoef[{k}]" for k in range(5)))
_BOUNDS = ("geom_size", "geom_rbound", "geom_aabb")
_WRAPPED = (4, 5)  # mjtWrap: a sphere, a cylinder


class Geoms:
    """The geoms that act on the motion.

    Attributes:
        pairs: Pairs of ids.
        only: For each model those that have no counterpart.
    """

    def __init__(self, sides: Sides) -> None:
        self._sides = sides
        self._acting = _acting(sides.one), _acting(sides.two)
        # By id, for each model: the shape on the rigid part, both in the frame of the second's.
        self._shapes: tuple[dict[int, CollisionShape], dict[int, CollisionShape]] = {}, {}
        self._copied = set[int]()  # meshes of the second model, whose geoms change together
        self.pairs: Pairs = sorted(self._match())
        sides.ids["geom"] = dict(self.pairs)
        matched = [{pair[k] for pair in self.pairs} for k in (0, 1)]
        self.only = tuple([g for g in self._acting[k] if g not in matched[k]] for k in (0, 1))

    def _match(self) -> Iterator[tuple[int, int]]:
        """By name, then by likeness, within each rigid part."""
        for pair in self._sides.pairs.solids:
            ours, theirs = self._on(0, pair.one), self._on(1, pair.two)
            for g, shape in ours.items():
                ours[g] = replace(shape, place=pair.align @ shape.place)
            self._shapes[0].update(ours)
            self._shapes[1].update(theirs)
            for k, i in likest([*ours.values()], [*theirs.values()]).items():
                yield [*ours][k], [*theirs][i]

    def _on(self, side: int, head: int) -> dict[int, CollisionShape]:
        """The shapes of a rigid part, in its frame."""
        solids = self._sides.solids[side]
        on = [g for g in self._acting[side] if solids.head(solids.raw.geom_bodyid[g]) == head]
        return {g: replace(shapes.of(solids.raw, g), place=solids.on("geom", g)) for g in on}

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        for a, b in self.pairs:
            yield from self._shape(a, b)
        for side, raw in enumerate((self._sides.one, self._sides.two)):
            for g in self.only[side]:  # is switched off there
                edits = zeros(("geom_contype", "geom_conaffinity", "geom_fluid"), raw, g)
                pairs = np.flatnonzero((raw.pair_geom1 == g) | (raw.pair_geom2 == g)).tolist()
                edits += tuple(("pair_margin", (k,), NO_TOUCH) for k in pairs)
                yield self._sides.alone(side, "geom", g, edits, "shape", shapes.kind(raw, g))

    def _shape(self, a: int, b: int) -> Iterator[ModelDifference]:
        sides, one, two = self._sides, self._sides.one, self._sides.two
        ours, theirs = self._shapes[0][a], self._shapes[1][b]
        kinds = ours.kind, theirs.kind
        if kinds == ("mesh", "mesh"):
            yield from self._mesh(a, b)
            return
        values: list[tuple[Any, ...]] = [("type", *kinds)] if kinds[0] != kinds[1] else []
        if values and not {*kinds} <= shapes.PRIMITIVES.keys():
            why = "one of them is no primitive, and cannot become the other"
            yield sides.tell("shape", "geom", a, values, refused=why)
            return
        if kinds[0] == "hfield":
            yield from shapes.heights(sides, a, b)
        if not same(ours.size, theirs.size):
            values.append(("size", ours.size, theirs.size))
        values += [
            (name, *map(float, fluid))
            for name, *fluid in zip(_FLUID, one.geom_fluid[a], two.geom_fluid[b], strict=False)
            if not same(*fluid)
        ]
        if values:
            edits = copies(("geom_type", *_BOUNDS, "geom_fluid"), one, a, b)
            yield sides.tell("shape", "geom", a, values, "m", edits)
        if _off(ours, theirs):
            yield self._moved(a, b)

    def _moved(self, a: int, b: int) -> ModelDifference:
        sides, pair = self._sides, self._part(a)
        bodies = sides.one.geom_bodyid[a], sides.two.geom_bodyid[b]
        exact = pair.align is HERE and bodies == (pair.one, pair.two)
        places = self._shapes[0][a].place, self._shapes[1][b].place
        return sides.elsewhere("geom", a, b, *places, exact)

    def _part(self, a: int) -> BodyPair:
        pair = self._sides.part(int(self._sides.one.geom_bodyid[a]))
        assert pair is not None  # geoms are matched within a pair
        return pair

    def _mesh(self, a: int, b: int) -> Iterator[ModelDifference]:
        """A mesh acts by its convex hull, whatever the order of its vertices and faces."""
        one, two = self._sides.one, self._sides.two
        ours, theirs = self._shapes[0][a], self._shapes[1][b]
        points = ours.corners, theirs.corners
        corners = shapes.hull(one, a, points[0]), shapes.hull(two, b, points[1])
        off = shapes.apart(*corners)
        if off <= _VERTEX:
            return
        if (
            shapes.apart(shapes.hull(one, a, ours.points), shapes.hull(two, b, theirs.points))
            <= _VERTEX
        ):
            yield self._moved(a, b)
            return
        subject = "hull" if shapes.apart(*points) <= _VERTEX else "shape"
        mesh, together, why = int(two.geom_dataid[b]), [(a, b)], ""
        edits: tuple[Edit, ...] = ()
        if b in self._choices:
            edits = (("geom_dataid", (b,), self._choices[b]),)
        elif mesh in self._copied:
            return  # its geoms change together
        elif pairs := self._together(a, b):
            together = pairs
            edits, why = shapes.copied(one, two, int(one.geom_dataid[a]), mesh)
            self._copied.add(mesh)
        else:
            why = "another geom keeps this mesh, or gets a third"
        for pair in together if edits else ():
            edits += (*copies(_BOUNDS, one, *pair), *self._moved(*pair).edits)
        name = few([name_of(one, "geom", each) for each, _ in together])
        counts, unit = [len(each) for each in corners], ""
        value = ("corners of its hull", *counts)
        if counts[0] == counts[1]:
            value, unit = ("farthest corner", 0.0, off), "m"
        yield ModelDifference(subject, "geom", name, (value,), unit, edits, (), why)

    @cached_property
    def _choices(self) -> dict[int, int]:
        """By geom of the second model the mesh there that its counterpart has."""
        kinds = self._sides.one.geom_type, self._sides.two.geom_type
        pairs = [(a, b) for a, b in self.pairs if kinds[0][a] == kinds[1][b] == shapes.MESH]
        return shapes.chosen(self._sides.one, self._sides.two, pairs)

    def _together(self, a: int, b: int) -> list[tuple[int, int]]:
        """The pairs that share the mesh of `b`, if those of the first model share one, too."""
        one, two = self._sides.one, self._sides.two
        sharing = (two.geom_type == shapes.MESH) & (two.geom_dataid == two.geom_dataid[b])
        pairs = [pair for pair in self.pairs if sharing[pair[1]]]
        alike = len(pairs) == sum(sharing[g] for g in self._acting[1]) and all(
            one.geom_type[each] == shapes.MESH
            and shapes.identical(one, int(one.geom_dataid[a]), one, int(one.geom_dataid[each]))
            for each, _ in pairs
        )
        return pairs if alike else []


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


def _off(one: CollisionShape, two: CollisionShape) -> bool:
    """Whether a shape is elsewhere; some look alike when they are turned."""
    far, turn = apart(one.place, two.place)
    z, other = one.place.mat[:, 2], two.place.mat[:, 2]
    if one.kind == "sphere":
        turn = 0.0
    elif one.kind == "plane":
        far, turn = abs(z @ (one.place.pos - two.place.pos)), np.abs(z - other).max()
    elif one.kind in ("capsule", "cylinder"):
        turn = min(np.abs(z - other).max(), np.abs(z + other).max())
    return bool(max(far, turn) > NEAR)
