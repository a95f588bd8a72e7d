"""What two files only draw: the shape, the mesh file, the size and the place of each visual.

Nothing of it changes a motion. That a picture is a thousand times too large, though, is seen by
everybody but a simulator.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np

from ...engines.description.lines import SourceLine
from ...engines.description.reading import ModelReading
from ...engines.description.records import CollisionShape, Link, VisualShape
from ...engines.description.shapes import laid_on, one_to_one
from ...engines.records import TURNED
from ...interface import Array
from ...rotations import HERE, Placement
from ..compare.matching import MatchedTrees
from .effects import Meaning
from .listing import ElementPlace, Listing
from .locating import Locator
from .records import ListedDifference, ModelsComparison, Value

_POSITION_TOLERANCE = (
    1e-6  # [m] within which two visuals are in one place: vertices are single precision
)
_ANGLE_TOLERANCE = 1e-6  # [rad] within which two visuals are turned alike
_UNIT_MISTAKE_SHARE = 0.9  # of the larger: ten times as large, and a unit must be wrong
_SIZE_TOLERANCE = 1e-5  # of the extent


@dataclass(frozen=True, eq=False)
class PlacedVisual:
    """A visual shape on its rigid part.

    Attributes:
        shape: The shape.
        solid: The same in the frame of the right's part; None where its mesh cannot be read.
    """

    shape: VisualShape
    solid: CollisionShape | None

    @property
    def label(self) -> str:
        """Return its label: the name of the shape, of its mesh, or its kind."""
        for name in (self.shape.name, PurePath(self.shape.mesh).stem):
            if name:
                return f"{name} on {self.shape.body}"
        return f"{self.shape.kind} on {self.shape.body}"

    @property
    def drawing(self) -> str:
        """Return what is drawn: the mesh file, or the kind of another shape."""
        return self.shape.mesh if self.shape.mesh else self.shape.kind


def enter_visuals(
    listing: Listing, readings: Sequence[ModelReading], trees: MatchedTrees, locator: Locator
) -> None:
    """Enter what two files draw otherwise, part by part.

    Args:
        listing: Where it is entered.
        readings: Both sides; what an engine made of a file has no visuals.
        trees: Their rigid parts.
        locator: Where elements stand in the files.
    """
    if any(reading.format == "engine" for reading in readings):
        return
    for pair in trees.matching.pairs:
        left = list(_visuals_of_link(readings[0], pair.left.links, pair.align))
        right = list(_visuals_of_link(readings[1], pair.right.links, HERE))
        for ours, theirs in _paired(left, right):
            there = ours if ours is not None else theirs
            assert there is not None
            lines = _line(readings, locator, 0, ours), _line(readings, locator, 1, theirs)
            element = ElementPlace("visual", there.label, *lines)
            for row in _quantities(ours, theirs):
                meaning = Meaning(row.share, row.effect, matters=False)
                values = (row.left, row.right)
                listing.enter("drawing", element, row.name, values, meaning, row.unit)


def gross_visuals(result: ModelsComparison) -> tuple[ListedDifference, ...]:
    """Return sizes and scales of what is drawn that are so far apart that a unit must be wrong."""
    rows = [row for row in result.differences if row.kind == "visual"]
    return tuple(row for row in rows if row.share >= _UNIT_MISTAKE_SHARE)


def _visuals_of_link(
    reading: ModelReading, links: Sequence[tuple[Link, Placement]], align: Placement
) -> Iterator[PlacedVisual]:
    """Yield the visual shapes of a rigid part.

    Args:
        reading: The side.
        links: Its links, each with its place in the frame of the part.
        align: The frame of the part in that of its counterpart.
    """
    for link, place in links:
        for shape in reading.visuals:
            if shape.body_number != link.body:
                continue
            solid = shape.solid
            if solid is not None:
                solid = replace(solid, place=align @ place @ solid.place)
            yield PlacedVisual(shape, solid)


def _paired(
    left: Sequence[PlacedVisual], right: Sequence[PlacedVisual]
) -> Iterator[tuple[PlacedVisual | None, PlacedVisual | None]]:
    """Yield the visuals of two parts in pairs, and those that are alone.

    Of one name, of one mesh file, of one kind; then by their sizes, and then by their places.
    """
    costs: list[tuple[_Dissimilarity, int, int]] = []
    for k, ours in enumerate(left):
        costs += [(_dissimilarity(ours, theirs), k, i) for i, theirs in enumerate(right)]
    costs.sort()
    pairs = one_to_one((k, i) for _, k, i in costs)
    for k, ours in enumerate(left):
        yield ours, right[pairs[k]] if k in pairs else None
    for i, theirs in enumerate(right):
        if i not in pairs.values():
            yield None, theirs


# How unlike two visuals are: in what they are, in their sizes (of the larger one), and how far they
# are apart [m].
_Dissimilarity = tuple[int, float, float]


def _dissimilarity(left: PlacedVisual, right: PlacedVisual) -> _Dissimilarity:
    """Return how unlike two visuals are, as a key to sort by."""
    ours, theirs = left.solid, right.solid
    size, far = _relative(left.shape.scale, right.shape.scale), 0.0
    if ours is not None and theirs is not None:
        box, other = _box_around(ours), _box_around(theirs)
        size = _relative(sorted(box.size), sorted(other.size))
        far = box.place.distance(other.place)
    return _rank(left.shape, right.shape), size if size > _SIZE_TOLERANCE else 0.0, far


_ONE_MESH = 2  # the most that two are of one mesh at


def _rank(left: VisualShape, right: VisualShape) -> int:
    """Return how unlike two visuals are in what they are: 0 of one name, most of other kinds."""
    if left.name and left.name == right.name:
        return 0
    if left.mesh and left.mesh == right.mesh:
        return 1
    if left.mesh and _stem(left.mesh) == _stem(right.mesh):
        return 2
    return 3 if left.kind == right.kind else 4


def _stem(mesh: str) -> str:
    return PurePath(mesh).stem.lower()


def _relative(left: Sequence[float] | Array, right: Sequence[float] | Array) -> float:
    """Return how far two sets of numbers are apart, as a part of the larger one."""
    largest = float(max(np.linalg.norm(left), np.linalg.norm(right)))
    return float(np.linalg.norm(np.subtract(left, right))) / largest if largest else 0.0


def _box_around(solid: CollisionShape) -> CollisionShape:
    """Return the box around a shape, along the axes of its own frame; of a plane an empty one."""
    if solid.points is not None:
        low, high = solid.points.min(axis=0), solid.points.max(axis=0)
        place = Placement(solid.place.of((low + high) / 2), solid.place.mat)
        return CollisionShape("box", place, tuple(((high - low) / 2).tolist()))
    match solid.kind, solid.size:
        case "sphere", (radius,):
            size = (radius, radius, radius)
        case "cylinder", (radius, half):
            size = (radius, radius, half)
        case "capsule", (radius, half):
            size = (radius, radius, half + radius)
        case "box" | "ellipsoid", (_, _, _):
            size = solid.size
        case _:
            size = (0.0, 0.0, 0.0)
    return CollisionShape("box", solid.place, size)


def _line(
    readings: Sequence[ModelReading], locator: Locator, side: int, visual: PlacedVisual | None
) -> SourceLine | None:
    """Return where a visual stands in a file; in an MJCF it is a geom."""
    lines = readings[side].lines
    if visual is None or lines is None:
        return None
    shape = visual.shape
    if readings[side].format == "URDF":
        return lines.find("visual", shape.name, shape.body, shape.place_on_body)
    return locator.line(side, "geom", shape.geom)


@dataclass(frozen=True)
class _Quantity:
    """What of two visuals differs.

    Attributes:
        name: What it is.
        left, right: Its values, in `unit`.
        effect: What it means.
        unit: SI unit of each number.
        share: Of a size or a scale, by how much the smaller one is smaller, from 0 to 1.
    """

    name: str
    left: Value
    right: Value
    effect: str = ""
    unit: str = ""
    share: float = 0.0


def _quantities(left: PlacedVisual | None, right: PlacedVisual | None) -> Iterator[_Quantity]:
    """Yield what two visuals differ in, or that one of them is alone."""
    if left is None or right is None:
        drawings = [visual.drawing if visual is not None else "nothing" for visual in (left, right)]
        yield _Quantity("visual", drawings[0], drawings[1])
        return
    a, b = left.shape, right.shape
    if a.kind != b.kind:
        yield _Quantity("type", a.kind, b.kind)
    elif a.mesh != b.mesh:
        yield _Quantity("file", a.mesh, b.mesh)
    ours, theirs = left.solid, right.solid
    if ours is None or theirs is None:
        if a.scale != b.scale:
            yield _of_sizes("scale", a.scale, b.scale, "")
    elif a.mesh and b.mesh and _have_same_vertices(left, right):
        yield from _of_one_mesh(left, right)
    elif a.kind == b.kind != "mesh":
        yield from _of_solids(ours, theirs)
    else:
        rows = _of_solids(_box_around(ours), _box_around(theirs), factor=2)
        # The frames of two meshes say nothing of each other.
        yield from (row for row in rows if _rank(a, b) <= _ONE_MESH or row.name != TURNED)


def _have_same_vertices(left: PlacedVisual, right: PlacedVisual) -> bool:
    """Tell whether two meshes are one, but for their scales: so many vertices, in one order."""
    points: list[Array] = []
    for visual in (left, right):
        assert visual.solid is not None
        assert visual.solid.points is not None
        points.append(visual.solid.points / visual.shape.scale)
    if points[0].shape != points[1].shape:
        return False
    return _relative(points[0].ravel(), points[1].ravel()) <= _SIZE_TOLERANCE


def _of_one_mesh(left: PlacedVisual, right: PlacedVisual) -> Iterator[_Quantity]:
    """Yield what two visuals with one mesh differ in: its scale, and the place of its frame."""
    ours, theirs = left.solid, right.solid
    assert ours is not None
    assert theirs is not None
    sizes = _times(2, _box_around(ours).size), _times(2, _box_around(theirs).size)
    scales = left.shape.scale, right.shape.scale
    if _relative(*sizes) > _SIZE_TOLERANCE:
        yield _of_sizes("size", sizes[0], sizes[1], "m")
    elif _relative(*scales) > _SIZE_TOLERANCE:  # one of them is mirrored
        yield _Quantity("scale", *scales)
    yield from _of_places(ours.place, theirs.place)


def _of_solids(
    left: CollisionShape, right: CollisionShape, factor: float = 1
) -> Iterator[_Quantity]:
    """Yield what two shapes of one kind differ in; sizes are multiplied by a factor."""
    laid = laid_on(left, right)
    if _relative(left.size, laid.size) > _SIZE_TOLERANCE:
        yield _of_sizes("size", _times(factor, left.size), _times(factor, laid.size), "m")
    yield from _of_places(left.place, laid.place)


def _times(factor: float, size: Sequence[float]) -> tuple[float, ...]:
    return tuple(factor * entry for entry in size)


def _of_places(left: Placement, right: Placement) -> Iterator[_Quantity]:
    """Yield how two frames lie to each other."""
    if left.distance(right) > _POSITION_TOLERANCE:
        values = tuple(left.pos.tolist()), tuple(right.pos.tolist())
        yield _Quantity("place", *values, "", "m")
    angle = left.angle(right)
    if angle > _ANGLE_TOLERANCE:
        yield _Quantity(TURNED, 0.0, angle, "", "rad")


def _of_sizes(name: str, left: Sequence[float], right: Sequence[float], unit: str) -> _Quantity:
    """Return two sizes, or scales, and how many times larger the larger one is."""
    ours, theirs = float(np.linalg.norm(left)), float(np.linalg.norm(right))
    least, most = min(ours, theirs), max(ours, theirs)
    effect = ""
    if least:
        effect = f"the {'left' if ours > theirs else 'right'} is {most / least:.4g} times as large"
    share = 1 - least / most if most else 0.0
    return _Quantity(name, tuple(left), tuple(right), effect, unit, share)
