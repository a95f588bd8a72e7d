"""What the deformable bodies (flexes) of two compiled models differ in, one by one.

How a flex touches and is damped are numbers of its own. How stiff it is are numbers of each of its
elements. Its vertices, edges and elements are built by the compiler: another number of them cannot
be brought over.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Array
from ..records import DifferingQuantity, Edit, ModelDifference
from ._quantities import same
from ._sides import Sides, name_of

_NO_FLEX = "a deformable body is built by the compiler, and cannot be added or taken away"
_OTHER_MESH = "its vertices and elements are built by the compiler, and cannot be brought over"
# What says which vertices, edges and elements there are.
_TOPOLOGY = (
    *("flex_dim", "flex_vertnum", "flex_edgenum", "flex_elemnum", "flex_nodenum", "flex_interp"),
    *("flex_cellnum", "flex_edgeequality", "flex_rigid", "flex_centered", "flex_plasticmode"),
)


@dataclass(frozen=True)
class _PartOfFlex:
    """A part of some arrays that is of one flex.

    Attributes:
        subject: What it is called.
        arrays: With a row of numbers, or a number, for each.
        start: The array that says where it begins; -1 of a flex without.
        count: The array that says how many it has; "" of what goes on to the next flex.
        unit: SI unit of the numbers.
    """

    subject: str
    arrays: tuple[str, ...]
    start: str
    count: str
    unit: str = ""


_PARTS = (
    _PartOfFlex("rest shape", ("flex_vert", "flex_vert0"), "flex_vertadr", "flex_vertnum", "m"),
    _PartOfFlex("rest shape", ("flex_node", "flex_node0"), "flex_nodeadr", "flex_nodenum", "m"),
    _PartOfFlex("stiffness", ("flex_stiffness",), "flex_stiffnessadr", ""),
    _PartOfFlex("bending stiffness", ("flex_bending",), "flex_bendingadr", ""),
)
_ELEMENTS = (
    _PartOfFlex("elements", ("flex_elem",), "flex_elemdataadr", ""),
    _PartOfFlex("elements", ("flex_edge", "flexedge_rigid"), "flex_edgeadr", "flex_edgenum"),
)


def flexes(sides: Sides) -> Iterator[ModelDifference]:
    """Yield what deformable bodies differ in, those of one name one by one."""
    pairs = list(sides.by_name("flex"))
    yield from sides.rows("flex", pairs)
    for a, b in pairs:
        yield from _of_mesh(sides, a, b)
    for side, raw in enumerate(sides.raws):
        for k in sorted({*range(raw.nflex)} - {pair[side] for pair in pairs}):
            ends = (None, "there") if side else ("there", None)
            value = DifferingQuantity("flex", *ends)
            name = name_of(raw, "flex", k)
            yield ModelDifference("extra flex", "flex", name, (value,), refused=_NO_FLEX)


def _of_mesh(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield what two flexes are made of, and how stiff that is."""
    left, right = sides.raws
    counts = [
        DifferingQuantity(name.removeprefix("flex_"), *_counts(sides, name, a, b))
        for name in _TOPOLOGY
        if not np.array_equal(getattr(left, name)[a], getattr(right, name)[b])
    ]
    for part in () if counts else _ELEMENTS:
        if any(not np.array_equal(*_numbers(sides, part, array, a, b)) for array in part.arrays):
            counts.append(DifferingQuantity(part.subject, "as they are", "others"))
    if counts:
        yield ModelDifference(
            "mesh", "flex", name_of(left, "flex", a), tuple(counts), refused=_OTHER_MESH
        )
        return
    for part in _PARTS:
        yield from _of_part(sides, part, a, b)


def _counts(sides: Sides, name: str, a: int, b: int) -> tuple[str, str]:
    """Return what two flexes have in an array of whole numbers, in words."""
    left, right = np.ravel(getattr(sides.left, name)[a]), np.ravel(getattr(sides.right, name)[b])
    return " ".join(map(str, left)), " ".join(map(str, right))


def _of_part(sides: Sides, part: _PartOfFlex, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield in what part two flexes with one mesh differ, by the number that is farthest off."""
    values: list[DifferingQuantity] = []
    edits: list[Edit] = []
    for array in part.arrays:
        ours, theirs = _numbers(sides, part, array, a, b)
        if ours.shape != theirs.shape:
            value = DifferingQuantity(array.removeprefix("flex_"), len(ours), len(theirs))
            name = name_of(sides.left, "flex", a)
            yield ModelDifference(part.subject, "flex", name, (value,), refused=_OTHER_MESH)
            return
        if same(ours, theirs):
            continue
        off = np.abs(ours - theirs)
        k = np.unravel_index(int(off.argmax()), off.shape)
        index = "".join(f"[{number}]" for number in k)
        called = f"{array.removeprefix('flex_')}{index}"
        values.append(DifferingQuantity(called, float(ours[k]), float(theirs[k]), part.unit))
        start = int(getattr(sides.right, part.start)[b])
        edits.append((array, (slice(start, start + len(ours)),), ours))
    if values:
        name = name_of(sides.left, "flex", a)
        yield ModelDifference(part.subject, "flex", name, tuple(values), tuple(edits))


def _numbers(sides: Sides, part: _PartOfFlex, array: str, a: int, b: int) -> tuple[Array, Array]:
    """Return what two flexes have of an array, each (n,) or (n, k)."""
    left, right = (_of_flex(raw, part, array, k) for raw, k in ((sides.left, a), (sides.right, b)))
    return left, right


def _of_flex(raw: Any, part: _PartOfFlex, array: str, k: int) -> Array:
    """Return what one flex has of an array."""
    starts, values = getattr(raw, part.start), np.array(getattr(raw, array))
    start = int(starts[k])
    if start < 0:
        return values[:0]
    if part.count:
        return values[start : start + int(getattr(raw, part.count)[k])]
    later = [int(other) for other in starts if other > start]
    return values[start : min(later, default=len(values))]
