"""What two readings touch with: shapes, where they are, and how they touch."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...engines.description.match import Pair
from ...engines.description.records import CollisionShape
from ...engines.description.shapes import angle_between, bounds_of, laid_on, likest
from ...engines.description.tree import GroupTree
from .ledger import Figure, Key, Ledger, Value, plain

_SIDES = ("-x", "-y", "-z", "+x", "+y", "+z")
# Settings of a contact, and what the compiled models call them.
_CONTACT = {
    "friction": "friction",
    "condim": "friction dimensions",
    "priority": "priority",
    "margin": "margin",
    "gap": "margin",
    "solref": "softness",
    "solimp": "softness",
    "solmix": "softness",
}


def of_shapes(book: Ledger, pair: Pair, left: GroupTree, right: GroupTree, reach: float) -> None:
    """Enter what touches, shape by shape.

    The share of a figure is that of how far the shapes stand out, against the robot's reach.
    """
    ours = [replace(s, place=pair.align @ s.place) for s in pair.left.shapes]
    theirs = list(pair.right.shapes)
    usual = left.robot.touch or right.robot.touch
    for shape, other in _paired(ours, theirs):
        if shape is not None and other is not None:
            label = f"{pair.left.name}: {shape.name or other.name or shape.kind}"
            _of_shape(book, label, shape, other, reach)
            _of_contact(book, label, shape, other, usual)
            continue
        alone = shape or other
        assert alone is not None
        label = f"{pair.left.name}: {alone.name or alone.kind}"
        kinds = [side.kind if side else "nothing" for side in (shape, other)]
        keys = [("geom", alone.label, "extra shape")]
        share = 0.5 if ours and theirs else 1.0
        book.differ(Figure("shapes", label, "shape", keys=keys), kinds, share=share)


def _of_contact(
    book: Ledger,
    label: str,
    shape: CollisionShape,
    other: CollisionShape,
    usual: Mapping[str, tuple[float, ...]],
) -> None:
    """Enter how a shape touches, where that is said by both or is not what is usual."""
    for name, called in _CONTACT.items():
        values = shape.contact.get(name), other.contact.get(name)
        if None not in values or usual.get(name, ()) not in values:
            book.enter(Figure("contact", label, name, keys=[("geom", shape.label, called)]), values)


def _of_shape(
    book: Ledger, label: str, shape: CollisionShape, other: CollisionShape, reach: float
) -> None:
    """Enter what a shape is, how large, and where."""
    same: list[Key] = [("geom", shape.label, "shape"), ("geom", shape.label, "hull")]
    keys: list[Key] = [*same, ("geom", shape.label, "place")]
    book.enter(Figure("shapes", label, "type", keys=same), (shape.kind, other.kind), share=0.5)
    if shape.kind != other.kind:
        return
    if shape.size and other.size:
        figure = Figure("shapes", label, "size", "m", keys=same)
        book.enter(figure, (shape.size, other.size), slack=2, against=reach)
    bounds, other_bounds = bounds_of(shape), bounds_of(other)
    if len(bounds) == len(other_bounds) == 6:
        middle, other_middle = (plain((ends[:3] + ends[3:]) / 2) for ends in (bounds, other_bounds))
        figures: dict[str, Sequence[Value]] = {"middle": (middle, other_middle)}
        if shape.kind == "mesh":
            figure = Figure("shapes", label, "volume", "m³", keys=same)
            book.enter(figure, (shape.volume, other.volume), slack=16)
            ends = zip(_SIDES, plain(bounds), plain(other_bounds), strict=True)
            figures |= {f"ends at {side}": (end, other_end) for side, end, other_end in ends}
        for name, values in figures.items():
            figure = Figure("shapes", label, name, "m", keys=keys)
            book.enter(figure, values, scale=reach, slack=4, against=reach)
    # The ends of a mesh tell how it is turned.
    turn = 0.0 if shape.kind == "mesh" else angle_between(shape, other)
    figure = Figure("shapes", label, "turned", "rad", keys=keys)
    book.measure(figure, turn, math.pi, slack=8, share=turn / math.pi / 10)


def _paired(
    ours: Sequence[CollisionShape], theirs: Sequence[CollisionShape]
) -> list[tuple[CollisionShape | None, CollisionShape | None]]:
    """Pair each shape with that of its name, the rest by kind and place.

    The second ones are in the axes of the first.
    """
    pairs = likest(ours, theirs)
    rest = [other for i, other in enumerate(theirs) if i not in pairs.values()]
    paired = [
        (shape, laid_on(shape, theirs[pairs[k]]) if k in pairs else None)
        for k, shape in enumerate(ours)
    ]
    return [*paired, *((None, other) for other in rest)]
