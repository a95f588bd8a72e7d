"""Geoms of a compiled model as shapes; how meshes and height fields are compared and copied."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ..description.records import CollisionShape
from ..records import DifferingQuantity, Edit, ModelDifference
from ._quantities import same
from ._rigid_parts import placed
from ._sides import Sides, copies

MESH = 7  # mjtGeom
PRIMITIVES = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}  # sizes of each
_CHUNK = 256

# Arrays of which a part is a mesh's, by what it has of them.
_PARTS = {
    "vert": ("mesh_vert", "mesh_polymapnum", "mesh_polymapadr"),
    "normal": ("mesh_normal",),
    "face": ("mesh_face", "mesh_facenormal"),
    "poly": ("mesh_polynormal", "mesh_polyvertnum", "mesh_polyvertadr"),
    "bvh": ("bvh_child", "bvh_nodeid", "bvh_depth", "bvh_aabb"),
}
_OF_A_MESH = ("mesh_extrema", "mesh_pos", "mesh_quat", "mesh_scale")


def kind(raw: Any, geom: int) -> str:
    """Return the type of a geom in words: "box", "mesh"."""
    return require("mujoco").mjtGeom(int(raw.geom_type[geom])).name.removeprefix("mjGEOM_").lower()


def of(raw: Any, geom: int) -> CollisionShape:
    """Return a geom as a shape, in the frame of its body."""
    word = kind(raw, geom)
    points = None
    if word == "mesh":
        parts = _parts(raw, int(raw.geom_dataid[geom]))
        points = np.array(raw.mesh_vert[parts["mesh_vert"]], dtype=np.float64)
    sizes = raw.geom_size[geom][: PRIMITIVES.get(word, 0)]
    place = placed(raw.geom_pos[geom], raw.geom_quat[geom])
    size = tuple(sizes.tolist())
    return CollisionShape(word, place, size, points, name=raw.geom(geom).name)


def hull(raw: Any, geom: int, points: Any) -> Array:
    """Return the vertices (n, 3) by which a mesh touches: of its hull, if it has one."""
    start = int(raw.mesh_graphadr[raw.geom_dataid[geom]])
    if start < 0:
        return points
    number = int(raw.mesh_graph[start])
    # The number of corners and of faces, the edges' starts, then which vertices the corners are.
    return points[raw.mesh_graph[start + 2 + number : start + 2 + 2 * number]]


def apart(left: Array, right: Array) -> float:
    """Return how far a point of either set (n, 3) is from all of the other, at most [m]."""
    return max(_farthest(left, right), _farthest(right, left))


def _farthest(points: Array, others: Array) -> float:
    """Return how far a point (n, 3) is from all others at most [m]; 0 of none."""
    farthest = 0.0
    for start in range(0, len(points), _CHUNK):
        chunk = points[start : start + _CHUNK, None]
        nearest = np.linalg.norm(chunk - others, axis=2).min(axis=1)
        farthest = max(farthest, float(nearest.max()))
    return farthest


def copied(left: Any, right: Any, ours: int, theirs: int) -> tuple[tuple[Edit, ...], str]:
    """Return the edits that make a mesh of the second model one of the first.

    Returns:
        The edits, without those of its geoms; and why there are none.
    """
    edits: list[Edit] = []
    here, there = _parts(left, ours), _parts(right, theirs)
    for name, part in here.items():
        values, old = np.array(getattr(left, name)[part]), getattr(right, name)[there[name]]
        if len(values) != len(old):
            return (), "its mesh has another number of vertices or faces: give both files one mesh"
        if name.endswith("adr") and len(values):  # in another array, where it begins elsewhere
            values += old[0] - values[0]
        edits.append((name, (there[name],), values))
    return (*edits, *copies(_OF_A_MESH, left, ours, theirs)), ""


def _parts(raw: Any, mesh: int) -> dict[str, slice]:
    """Return where a mesh is in the arrays of a compiled model; its convex hull last."""

    def part(start: Any, number: Any) -> slice:
        return slice(int(start), int(start) + int(number))

    parts: dict[str, slice] = {}
    for word, names in _PARTS.items():
        start, number = (getattr(raw, f"mesh_{word}{of}")[mesh] for of in ("adr", "num"))
        parts |= dict.fromkeys(names, part(start, number))
    for name in ("mesh_polyvert", "mesh_polymap"):  # as long as the lists of all its parts
        starts, numbers = (
            getattr(raw, f"{name}{of}")[parts[f"{name}{of}"]] for of in ("adr", "num")
        )
        parts[name] = part(starts[0] if len(starts) else 0, numbers.sum())
    start = raw.mesh_graphadr[mesh]
    number, faces = raw.mesh_graph[start : start + 2] if start >= 0 else (0, 0)
    parts["mesh_graph"] = part(start, 2 + 3 * number + 6 * faces) if start >= 0 else slice(0, 0)
    return parts


def chosen(left: Any, right: Any, pairs: Iterable[tuple[int, int]]) -> dict[int, int]:
    """Return the meshes of the second model that its geoms can take to have those of the first.

    A mesh into which another one has to be copied, since no other has that, is nobody's choice.

    Args:
        left: A compiled model.
        right: Another.
        pairs: Pairs of mesh geoms.

    Returns:
        The mesh, by geom of the second.
    """
    own = {b: int(right.geom_dataid[b]) for _, b in pairs}
    choices = {b: _identical_mesh(left, left.geom_dataid[a], right, own[b]) for a, b in pairs}
    while True:
        own_choices = {mesh for b, mesh in choices.items() if mesh == own[b]}
        overwritten = {own[b] for b, mesh in choices.items() if mesh is None} - own_choices
        lost = [b for b, mesh in choices.items() if mesh in overwritten]
        if not lost:
            return {b: mesh for b, mesh in choices.items() if mesh is not None}
        choices |= dict.fromkeys(lost)


def _identical_mesh(left: Any, mesh: int, right: Any, own: int) -> int | None:
    """Return the mesh of the second model that is one of the first: `own`, if that will do."""
    for candidate in (own, *range(right.nmesh)):
        if identical(left, mesh, right, candidate):
            return candidate
    return None


def identical(left: Any, ours: int, right: Any, theirs: int) -> bool:
    """Tell whether two meshes have the same vertices, faces and hull, in the same order."""
    if left is right and ours == theirs:
        return True
    edits, why = copied(left, right, ours, theirs)
    return not why and all(same(getattr(right, name)[index], value) for name, index, value in edits)


def heights(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield the differences of two height fields."""
    left, right = sides.raws
    (ours, grid, here), (theirs, other, there) = _field(left, a), _field(right, b)
    if grid != other:
        words = (f"{rows} x {columns}" for rows, columns in (grid, other))
        why = "its height field has other rows or columns: give both files one height field"
        yield sides.tell("heights", "geom", a, (DifferingQuantity("points", *words),), refused=why)
        return
    data = left.hfield_data[here], right.hfield_data[there]
    sizes = left.hfield_size[ours], right.hfield_size[theirs]
    if same(*data) and same(*sizes):
        return
    # The heights of a field are from 0 to 1 of its largest.
    far = np.abs(data[0] * sizes[0][2] - data[1] * sizes[1][2]).max()
    edits: list[Edit] = [
        ("hfield_data", (there,), np.array(data[0])),
        ("hfield_size", (theirs,), np.array(sizes[0])),
    ]
    edits += copies(("geom_size", "geom_rbound", "geom_aabb"), left, a, b)
    users = (right.geom_type == right.geom_type[b]) & (right.geom_dataid == theirs)
    why = ""
    if users.sum() > 1:
        why = "another geom has this height field, too: give each of them one of its own"
    value = DifferingQuantity("farthest point", 0.0, float(far), "m")
    yield sides.tell("heights", "geom", a, (value,), () if why else edits, refused=why)


def _field(raw: Any, geom: int) -> tuple[int, tuple[int, int], slice]:
    """Return the height field of a geom: its id, its rows and columns, and where its data are."""
    field = int(raw.geom_dataid[geom])
    rows, columns, start = (
        int(getattr(raw, f"hfield_{name}")[field]) for name in ("nrow", "ncol", "adr")
    )
    return field, (rows, columns), slice(start, start + rows * columns)
