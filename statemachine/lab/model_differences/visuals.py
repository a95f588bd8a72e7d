"""What two files only draw: the shape, the mesh file, the size and the place of each visual.

Nothing of it changes a motion. That a picture is a thousand times too large, though, is seen by
everybody but a simulator.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np

from ...engines.description.lines import SourceLine
from ...engines.description.reading import ModelReading
from ...engines.description.records import Link, VisualShape
from ...interface import Array
from ...rotations import HERE, Placement
from ..compare.matching import MatchedTrees
from .effects import Meaning
from .listing import ElementPlace, Listing
from .records import ListedDifference, ModelsComparison, Value

_NEAR = 1e-6  # [m] within which two visuals are in one place: vertices are single precision
_GROSS = 0.9  # of the larger: ten times as large, and a unit must be wrong
_SAME = 1e-5  # of the extent


@dataclass(frozen=True)
class Box:
    """A box along the axes of a rigid part.

    Attributes:
        middle: (3,) its middle [m].
        extent: (3,) its length along each axis [m].
    """

    middle: tuple[float, ...]
    extent: tuple[float, ...]

    @classmethod
    def around(cls, corners: Array) -> Box:
        """Return the box around points (n, 3) [m]."""
        low, high = corners.min(axis=0), corners.max(axis=0)
        return cls(tuple(((low + high) / 2).tolist()), tuple((high - low).tolist()))


@dataclass(frozen=True, eq=False)
class PlacedVisual:
    """A visual shape on its rigid part.

    Attributes:
        shape: The shape.
        box: The box around it in the frame of the right's part; None where its mesh cannot be read.
    """

    shape: VisualShape
    box: Box | None

    @property
    def label(self) -> str:
        """What it is called: by the name of the shape, of its mesh, or its kind."""
        for name in (self.shape.name, PurePath(self.shape.mesh).stem):
            if name:
                return f"{name} on {self.shape.body}"
        return f"{self.shape.kind} on {self.shape.body}"


def enter_visuals(listing: Listing, readings: Sequence[ModelReading], trees: MatchedTrees) -> None:
    """Enter what two files draw otherwise, part by part.

    Args:
        listing: Where it is entered.
        readings: Both sides; what an engine made of a file has no visuals.
        trees: Their rigid parts.
    """
    if any(reading.format == "engine" for reading in readings):
        return
    for pair in trees.matching.pairs:
        left = list(_of_part(readings[0], pair.left.links, pair.align))
        right = list(_of_part(readings[1], pair.right.links, HERE))
        for ours, theirs in _paired(left, right):
            _enter(listing, readings, ours, theirs)


def gross_visuals(result: ModelsComparison) -> tuple[ListedDifference, ...]:
    """Return sizes and scales of what is drawn that are so far apart that a unit must be wrong."""
    rows = [row for row in result.differences if row.kind == "visual"]
    return tuple(row for row in rows if row.share >= _GROSS)


def _of_part(
    reading: ModelReading, links: Sequence[tuple[Link, Placement]], align: Placement
) -> Iterator[PlacedVisual]:
    """Yield the visual shapes of a rigid part.

    Args:
        reading: The side.
        links: Its links, each with its place in the frame of the part.
        align: The frame of the part in that of its counterpart.
    """
    raw = reading.model.compiled
    for link, place in links:
        body = link.body
        name = raw.body(body).name if body >= 0 else ""
        for shape in reading.visuals:
            if shape.body != name:
                continue
            box = None
            if shape.corners is not None:
                where = align @ place
                box = Box.around(where.pos + shape.corners @ where.mat.T)
            yield PlacedVisual(shape, box)


def _paired(
    left: Sequence[PlacedVisual], right: Sequence[PlacedVisual]
) -> Iterator[tuple[PlacedVisual | None, PlacedVisual | None]]:
    """Yield the visuals of two parts in pairs: of one name, of one mesh, then the likest."""
    rest = list(right)
    for ours in left:
        if not rest:
            yield ours, None
            continue
        theirs = min(rest, key=lambda other: _unlikeness(ours, other))
        rest.remove(theirs)
        yield ours, theirs
    for theirs in rest:
        yield None, theirs


def _unlikeness(left: PlacedVisual, right: PlacedVisual) -> tuple[int, float]:
    """Return how unlike two visuals are, as a key to sort by."""
    a, b = left.shape, right.shape
    far = 0.0
    if left.box is not None and right.box is not None:
        far = float(np.linalg.norm(np.subtract(left.box.middle, right.box.middle)))
    if a.name and a.name == b.name:
        return 0, far
    if a.mesh and _stem(a.mesh) == _stem(b.mesh):
        return 1, far
    return (2 if a.kind == b.kind else 3), far


def _stem(mesh: str) -> str:
    return PurePath(mesh).stem.lower()


def _enter(
    listing: Listing,
    readings: Sequence[ModelReading],
    left: PlacedVisual | None,
    right: PlacedVisual | None,
) -> None:
    """Enter what two visuals differ in, or that one of them is alone."""
    there = left if left is not None else right
    assert there is not None
    lines = _line(readings[0], left), _line(readings[1], right)
    element = ElementPlace("visual", there.label, *lines)
    if left is None or right is None:
        kinds = [visual.shape.kind if visual is not None else "nothing" for visual in (left, right)]
        rows = [_Quantity("visual", kinds[0], kinds[1])]
    else:
        rows = list(_quantities(left, right))
    for row in rows:
        meaning = Meaning(row.share, row.effect, matters=False)
        listing.enter("drawing", element, row.name, (row.left, row.right), meaning, row.unit)


def _line(reading: ModelReading, visual: PlacedVisual | None) -> SourceLine | None:
    """Return where a visual stands in a file; in an MJCF it is a geom."""
    if visual is None or reading.lines is None:
        return None
    shape = visual.shape
    line = reading.lines.find("visual", shape.name, shape.body, shape.place_on_body)
    if line is None and shape.name:
        line = reading.lines.find("geom", shape.name)
    return line


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


def _quantities(left: PlacedVisual, right: PlacedVisual) -> Iterator[_Quantity]:
    """Yield what two visuals differ in."""
    a, b = left.shape, right.shape
    if a.kind != b.kind:
        yield _Quantity("type", a.kind, b.kind)
    elif a.mesh != b.mesh:
        yield _Quantity("file", a.mesh, b.mesh)
    ours, theirs = left.box, right.box
    if ours is None or theirs is None:
        if a.scale != b.scale:
            effect, share = _times(a.scale, b.scale), _share(a.scale, b.scale)
            yield _Quantity("scale", a.scale, b.scale, effect, "", share)
    elif _are_apart(ours.extent, theirs.extent, _SAME * max(*ours.extent, *theirs.extent)):
        effect = _times(ours.extent, theirs.extent)
        share = _share(ours.extent, theirs.extent)
        yield _Quantity("size", ours.extent, theirs.extent, effect, "m", share)
    elif _are_apart(ours.middle, theirs.middle, _NEAR):
        yield _Quantity("place", ours.middle, theirs.middle, "", "m")


def _are_apart(left: Sequence[float], right: Sequence[float], most: float) -> bool:
    return float(np.abs(np.subtract(left, right)).max()) > most


def _times(left: Sequence[float], right: Sequence[float]) -> str:
    """Return how many times larger the larger of two extents is, in words."""
    ours, theirs = float(np.linalg.norm(left)), float(np.linalg.norm(right))
    least, most = min(ours, theirs), max(ours, theirs)
    if not least:
        return ""
    return f"the {'left' if ours > theirs else 'right'} is {most / least:.4g} times as large"


def _share(left: Sequence[float], right: Sequence[float]) -> float:
    """Return by how much the smaller of two extents is smaller, from 0 to 1."""
    ours, theirs = float(np.linalg.norm(left)), float(np.linalg.norm(right))
    most = max(ours, theirs)
    return 1 - min(ours, theirs) / most if most else 0.0
