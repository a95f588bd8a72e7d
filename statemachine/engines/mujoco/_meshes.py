"""Meshes and height fields of two compiled models: whether they act alike, and how to copy one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ...interface import Array
from ..records import Edit, ModelDifference
from ._figures import same

VERTEX = 1e-6  # [m]: vertices are single precision
_CHUNK = 256

# Arrays of a mesh: where its part begins, and how long it is.
_PARTS = {
    "mesh_vert": ("mesh_vertadr", "mesh_vertnum"),
    "mesh_normal": ("mesh_normaladr", "mesh_normalnum"),
    "mesh_face": ("mesh_faceadr", "mesh_facenum"),
    "mesh_facenormal": ("mesh_faceadr", "mesh_facenum"),
    "mesh_polynormal": ("mesh_polyadr", "mesh_polynum"),
    "mesh_polyvertnum": ("mesh_polyadr", "mesh_polynum"),
    "mesh_polyvertadr": ("mesh_polyadr", "mesh_polynum"),
    "mesh_polymapnum": ("mesh_vertadr", "mesh_vertnum"),
    "mesh_polymapadr": ("mesh_vertadr", "mesh_vertnum"),
    "bvh_child": ("mesh_bvhadr", "mesh_bvhnum"),
    "bvh_nodeid": ("mesh_bvhadr", "mesh_bvhnum"),
    "bvh_depth": ("mesh_bvhadr", "mesh_bvhnum"),
    "bvh_aabb": ("mesh_bvhadr", "mesh_bvhnum"),
}
# Addresses in another array, which begin elsewhere in another model.
_LISTS = {
    "mesh_polyvert": ("mesh_polyvertadr", "mesh_polyvertnum"),
    "mesh_polymap": ("mesh_polymapadr", "mesh_polymapnum"),
}
_OF_A_MESH = ("mesh_extrema", "mesh_pos", "mesh_quat", "mesh_scale")
_OF_A_GEOM = ("geom_size", "geom_rbound", "geom_aabb")


def vertices(raw: Any, geom: int) -> Array:
    """Those (n, 3) of a mesh geom [m], in its own frame."""
    part = _span(raw, "mesh_vert", int(raw.geom_dataid[geom]))
    return np.asarray(raw.mesh_vert[part], dtype=float)


def corners(raw: Any, geom: int, points: Array) -> Array:
    """Those of its vertices (n, 3) by which a mesh touches: of its hull, if it has one."""
    start = int(raw.mesh_graphadr[raw.geom_dataid[geom]])
    if start < 0:
        return points
    number = int(raw.mesh_graph[start])
    # The number of corners and of faces, the edges' starts, then which vertices the corners are.
    return points[raw.mesh_graph[start + 2 + number : start + 2 + 2 * number]]


def apart(one: Array, two: Array) -> float:
    """How far a point of either set (n, 3) is from all of the other, at most [m]."""
    return max(_farthest(one, two), _farthest(two, one))


def _farthest(one: Array, two: Array) -> float:
    most = 0.0
    for start in range(0, len(one), _CHUNK):
        away = np.linalg.norm(one[start : start + _CHUNK, None] - two[None], axis=2)
        most = max(most, float(away.min(axis=1).max()))
    return most


def copied(one: Any, two: Any, ours: int, theirs: int) -> tuple[tuple[Edit, ...], str]:
    """Edits that make a mesh of the second model one of the first.

    Returns:
        The edits, without those of its geoms; and why there are none.
    """
    edits: list[Edit] = []
    for name in _PARTS:
        here, there = _span(one, name, ours), _span(two, name, theirs)
        if _length(here) != _length(there):
            return (), "it is a mesh of another size"
        values = np.array(getattr(one, name)[here])
        if name.endswith("adr") and len(values):
            values += int(getattr(two, name)[there][0]) - int(values[0])
        edits.append((name, (there,), values))
    for name in _LISTS:
        here, there = _list(one, name, ours), _list(two, name, theirs)
        if _length(here) != _length(there):
            return (), "it is a mesh of another size"
        edits.append((name, (there,), np.array(getattr(one, name)[here])))
    graphs = _graph(one, ours), _graph(two, theirs)
    if _length(graphs[0]) != _length(graphs[1]):
        return (), "it has a convex hull of another size"
    edits.append(("mesh_graph", (graphs[1],), np.array(one.mesh_graph[graphs[0]])))
    edits += [(name, (theirs,), np.array(getattr(one, name)[ours])) for name in _OF_A_MESH]
    return tuple(edits), ""


def chosen(one: Any, two: Any, pairs: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Meshes of the second model that its geoms can take to have those of the first.

    A mesh into which another one has to be copied, since no other has that, is nobody's choice.

    Args:
        one: A compiled model.
        two: Another.
        pairs: Pairs of mesh geoms.

    Returns:
        The mesh, by geom of the second.
    """
    own = {b: int(two.geom_dataid[b]) for _, b in pairs}
    found = {b: _counterpart(one, int(one.geom_dataid[a]), two, own[b]) for a, b in pairs}
    while True:
        kept = {mesh for b, mesh in found.items() if mesh == own[b]}
        overwritten = {own[b] for b, mesh in found.items() if mesh is None} - kept
        lost = [b for b, mesh in found.items() if mesh in overwritten]
        if not lost:
            return {b: mesh for b, mesh in found.items() if mesh is not None}
        found |= dict.fromkeys(lost)


def _counterpart(one: Any, ours: int, two: Any, first: int) -> int | None:
    """A mesh of the second model that is identical to one of the first; `first` if it is."""
    meshes = (first, *range(two.nmesh))
    return next((mesh for mesh in meshes if identical(one, ours, two, mesh)), None)


def identical(one: Any, ours: int, two: Any, theirs: int) -> bool:
    """Whether two meshes have the same vertices, faces and hull, in the same order."""
    if one is two and ours == theirs:
        return True
    edits, why = copied(one, two, ours, theirs)
    return not why and all(same(getattr(two, name)[index], value) for name, index, value in edits)


def bounds(one: Any, a: int, b: int) -> tuple[Edit, ...]:
    """Edits that give a geom of the second model the size and bounds of one of the first."""
    return tuple((name, (b,), np.array(getattr(one, name)[a])) for name in _OF_A_GEOM)


def heights(one: Any, two: Any, a: int, b: int, name: str) -> Iterator[ModelDifference]:
    """What two height fields differ in."""
    ours, theirs = int(one.geom_dataid[a]), int(two.geom_dataid[b])
    grids = [
        (int(raw.hfield_nrow[h]), int(raw.hfield_ncol[h]))
        for raw, h in ((one, ours), (two, theirs))
    ]
    spans = [
        slice(int(raw.hfield_adr[h]), int(raw.hfield_adr[h]) + rows * columns)
        for (raw, h), (rows, columns) in zip(((one, ours), (two, theirs)), grids, strict=True)
    ]
    if grids[0] != grids[1]:
        values = (("points", f"{grids[0][0]} x {grids[0][1]}", f"{grids[1][0]} x {grids[1][1]}"),)
        why = "it is a height field of another size"
        yield ModelDifference("heights", "geom", name, values, refused=why)
        return
    data = one.hfield_data[spans[0]], two.hfield_data[spans[1]]
    sizes = one.hfield_size[ours], two.hfield_size[theirs]
    if same(*data) and same(*sizes):
        return
    # The heights of a field are from 0 to 1 of its largest.
    levels = [values * size[2] for values, size in zip(data, sizes, strict=True)]
    values = (("farthest point", 0.0, float(np.abs(levels[0] - levels[1]).max())),)
    edits: tuple[Edit, ...] = (
        ("hfield_data", (spans[1],), np.array(data[0])),
        ("hfield_size", (theirs,), np.array(sizes[0])),
        *((name, (b,), np.array(getattr(one, name)[a])) for name in _OF_A_GEOM),
    )
    users = (two.geom_type == two.geom_type[b]) & (two.geom_dataid == theirs)
    if users.sum() > 1:
        why = "another geom has this height field, too"
        yield ModelDifference("heights", "geom", name, values, "m", refused=why)
        return
    yield ModelDifference("heights", "geom", name, values, "m", edits)


def _span(raw: Any, name: str, mesh: int) -> slice:
    start, number = (int(getattr(raw, each)[mesh]) for each in _PARTS[name])
    return slice(start, start + number)


def _list(raw: Any, name: str, mesh: int) -> slice:
    """The part of a list that the addresses of a mesh point to."""
    address, number = (getattr(raw, each) for each in _LISTS[name])
    part = _span(raw, _LISTS[name][0], mesh)
    if part.start == part.stop:
        return slice(0, 0)
    start = int(address[part][0])
    return slice(start, start + int(number[part].sum()))


def _graph(raw: Any, mesh: int) -> slice:
    start = int(raw.mesh_graphadr[mesh])
    if start < 0:
        return slice(0, 0)
    number, faces = raw.mesh_graph[start : start + 2].tolist()
    return slice(start, start + 2 + 3 * number + 6 * faces)


def _length(part: slice) -> int:
    return part.stop - part.start
