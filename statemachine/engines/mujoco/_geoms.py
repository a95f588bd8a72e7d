"""Which geoms of two compiled models are one, and what their shapes and places differ in."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...interface import Array
from ...measures.text import few
from ...rotations import Placement
from ..description.records import CollisionShape
from ..description.shapes import LaidShape, laid_on, most_alike
from ..records import DifferingQuantity, Edit, ModelDifference
from . import _shapes as shapes
from ._quantities import quantity_of, same
from ._rigid_parts import apart
from ._sides import NEAR, Pairs, Sides, copies, name_of, zeros

NO_TOUCH = -1e3  # [m] a margin at which nothing touches
_VERTEX = 1e-6  # [m]: vertices are single precision
# How a medium flows around a geom: by its ellipsoid or not, and the coefficients for that. What
# follows from its shape stands behind these.
_FLUID_SHAPES = ("none", "ellipsoid")
_FLUID_COEFFICIENTS = slice(1, 6)
_BOUNDS = ("geom_size", "geom_rbound", "geom_aabb")
# Arrays of a geom in which there are three numbers for its axes, and where these begin. The middle
# of the box around a primitive is its own.
_OF_AXES = {"geom_size": (0,), "geom_aabb": (3,), "geom_fluid": (6, 9)}
_WRAPPED = (4, 5)  # mjtWrap: a sphere, a cylinder


class Geoms:
    """The geoms that act on the motion.

    Attributes:
        pairs: Pairs of ids.
    """

    def __init__(self, sides: Sides) -> None:
        self._sides = sides
        self._acting = acting_geoms(sides.left), acting_geoms(sides.right)
        # By id, for each model: the shape on the rigid part, both in the frame of the second's.
        self._shapes: tuple[dict[int, CollisionShape], dict[int, CollisionShape]] = {}, {}
        self._copied = set[int]()  # meshes of the second model, whose geoms change together
        self.pairs: Pairs = sorted(self._match())
        sides.ids["geom"] = dict(self.pairs)

    def _match(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of geoms, by name, then by likeness, within each rigid part."""
        for pair in self._sides.pairs.solids:
            ours, theirs = self._on(0, pair.left), self._on(1, pair.right)
            for g, shape in ours.items():
                ours[g] = replace(shape, place=pair.align @ shape.place)
            self._shapes[0].update(ours)
            self._shapes[1].update(theirs)
            for k, i in most_alike([*ours.values()], [*theirs.values()]).items():
                yield [*ours][k], [*theirs][i]

    def _on(self, side: int, head: int) -> dict[int, CollisionShape]:
        """Return the shapes of a rigid part, in its frame."""
        solids = self._sides.solids[side]
        on = [g for g in self._acting[side] if solids.head(solids.raw.geom_bodyid[g]) == head]
        return {g: replace(shapes.of(solids.raw, g), place=solids.on("geom", g)) for g in on}

    def differences(self) -> Iterator[ModelDifference]:
        """Yield the differences of two geoms."""
        for a, b in self.pairs:
            yield from self._shape(a, b)
        yield from self._sides.extras("geom", self.pairs, self._without, "shape", shapes.kind)

    def _without(self, raw: Any, g: int) -> tuple[Edit, ...]:
        """Return the edits that switch a geom off, if it acts."""
        if g not in self._acting[raw is self._sides.right]:
            return ()
        pairs = np.flatnonzero((raw.pair_geom1 == g) | (raw.pair_geom2 == g)).tolist()
        edits = zeros(("geom_contype", "geom_conaffinity", "geom_fluid"), raw, g)
        return (*edits, *(("pair_margin", (k,), NO_TOUCH) for k in pairs))

    def _shape(self, a: int, b: int) -> Iterator[ModelDifference]:
        sides, left, right = self._sides, self._sides.left, self._sides.right
        ours, theirs = self._shapes[0][a], self._shapes[1][b]
        kinds = ours.kind, theirs.kind
        if kinds == ("mesh", "mesh"):
            yield from self._mesh(a, b)
            return
        values: list[DifferingQuantity] = []
        if kinds[0] != kinds[1]:
            values.append(DifferingQuantity("type", *kinds))
        if values and not {*kinds} <= shapes.PRIMITIVES.keys():
            yield sides.tell(
                "shape",
                "geom",
                a,
                values,
                refused="one of them is no primitive: give both files the same type of geom",
            )
            return
        if kinds[0] == "hfield":
            yield from shapes.heights(sides, a, b)
        laid = laid_on(ours, theirs)
        if not same(ours.size, laid.size):
            values.append(DifferingQuantity("size", ours.size, laid.size, "m"))
        values += _of_fluids(left.geom_fluid[a], right.geom_fluid[b])
        if values:
            edits = copies(("geom_type", *_BOUNDS, "geom_fluid"), left, a, b)
            if laid.is_reordered:
                edits = tuple(_in_own_order(laid, edit) for edit in edits)
            yield sides.tell("shape", "geom", a, values, edits)
        if max(apart(ours.place, laid.place)) > NEAR:
            moved = sides.elsewhere("geom", a, b, ours.place, laid.place)
            if laid.is_reordered:  # which stay in the order of the second's file
                own = Placement(ours.place.pos, ours.place.mat @ laid.axes.T)
                moved = replace(moved, edits=sides.placing("geom", a, b, own))
            yield moved

    def _moved(self, a: int, b: int) -> ModelDifference:
        places = self._shapes[0][a].place, self._shapes[1][b].place
        return self._sides.elsewhere("geom", a, b, *places)

    def _mesh(self, a: int, b: int) -> Iterator[ModelDifference]:
        """Yield the difference of a mesh, which acts by its convex hull, whatever the order of
        its vertices.
        """
        left, right = self._sides.left, self._sides.right
        ours, theirs = self._shapes[0][a], self._shapes[1][b]
        points = ours.corners, theirs.corners
        corners = shapes.hull(left, a, points[0]), shapes.hull(right, b, points[1])
        off = shapes.apart(*corners)
        if off <= _VERTEX:
            return
        if (
            shapes.apart(shapes.hull(left, a, ours.points), shapes.hull(right, b, theirs.points))
            <= _VERTEX
        ):
            yield self._moved(a, b)
            return
        subject = "hull" if shapes.apart(*points) <= _VERTEX else "shape"
        mesh, together, why = int(right.geom_dataid[b]), [(a, b)], ""
        edits: tuple[Edit, ...] = ()
        if b in self._choices:
            edits = (("geom_dataid", (b,), self._choices[b]),)
        elif mesh in self._copied:
            return  # its geoms change together
        elif pairs := self._together(a, b):
            together = pairs
            edits, why = shapes.copied(left, right, int(left.geom_dataid[a]), mesh)
            self._copied.add(mesh)
        else:
            why = "another geom has this mesh, too: give each of them a mesh of its own"
        for pair in together if edits else ():
            edits += (*copies(_BOUNDS, left, *pair), *self._moved(*pair).edits)
        name = few([name_of(left, "geom", geom) for geom, _ in together])
        counts = [len(geom) for geom in corners]
        value = DifferingQuantity("corners of its hull", counts[0], counts[1])
        if counts[0] == counts[1]:
            value = DifferingQuantity("farthest corner", 0.0, off, "m")
        yield ModelDifference(subject, "geom", name, (value,), edits, refused=why)

    @cached_property
    def _choices(self) -> dict[int, int]:
        """Return, by geom of the second model, the mesh there that its counterpart has."""
        kinds = self._sides.left.geom_type, self._sides.right.geom_type
        pairs = [(a, b) for a, b in self.pairs if kinds[0][a] == kinds[1][b] == shapes.MESH]
        return shapes.chosen(self._sides.left, self._sides.right, pairs)

    def _together(self, a: int, b: int) -> list[tuple[int, int]]:
        """Return the pairs that share the mesh of `b`, if those of the first model share one."""
        left, right = self._sides.left, self._sides.right
        sharing = (right.geom_type == shapes.MESH) & (right.geom_dataid == right.geom_dataid[b])
        pairs = [pair for pair in self.pairs if sharing[pair[1]]]
        if len(pairs) != sum(sharing[geom] for geom in self._acting[1]):
            return []
        mesh = int(left.geom_dataid[a])
        for geom, _ in pairs:
            if left.geom_type[geom] != shapes.MESH:
                return []
            if not shapes.identical(left, mesh, left, int(left.geom_dataid[geom])):
                return []
        return pairs


def _of_fluids(left: Array, right: Array) -> Iterator[DifferingQuantity]:
    """Yield what two geoms (12,) differ in as a medium flows around them."""
    shapes_of_fluid = [_FLUID_SHAPES[int(fluid[0] > 0)] for fluid in (left, right)]
    if shapes_of_fluid[0] != shapes_of_fluid[1]:
        yield DifferingQuantity("fluidshape", *shapes_of_fluid)
        return
    ours, theirs = left[_FLUID_COEFFICIENTS], right[_FLUID_COEFFICIENTS]
    if not same(ours, theirs):
        yield quantity_of("fluidcoef", ours, theirs)


def touches(raw: Any) -> Any:
    """Return (ngeom,) of which geoms can touch: by their masks, or in an explicit pair."""
    touching = (raw.geom_contype != 0) | (raw.geom_conaffinity != 0)
    touching[raw.pair_geom1] = touching[raw.pair_geom2] = True
    return touching


def acting_geoms(raw: Any) -> list[int]:
    """Return the geoms that can touch, that a tendon wraps, or that a medium flows around by
    their shape.
    """
    acting = touches(raw) | (raw.geom_fluid[:, 0] > 0)
    acting[raw.wrap_objid[np.isin(raw.wrap_type, _WRAPPED)]] = True
    return np.flatnonzero(acting).tolist()


def _in_own_order(laid: LaidShape, edit: Edit) -> Edit:
    """Return an edit of what a shape has of each axis, as one in the order of its own axes."""
    name, index, value = edit
    if name not in _OF_AXES:
        return edit
    values = np.array(value)
    for start in _OF_AXES[name]:
        values[start : start + 3] = laid.in_own_order(values[start : start + 3])
    return name, index, values
