"""Geoms of a compiled model as shapes; how meshes and height fields are compared and copied."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ..description.meshes import volume_of
from ..description.records import CollisionShape
from ..records import Edit, ModelDifference
from ._sides import Sides, copies, name_of, placed, same

MESH = 7  # mjtGeom
PRIMITIVES = {"sphere": 1, "capsule": 2, "ellipsoid": 3, "cylinder": 2, "box": 3}  # sizes of each
_CONTACT = ("condim", "priority", "solref", "solimp", "solmix", "margin", "gap")
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
    """What a geom is: "box", "mesh"."""
    return require("mujoco").mjtGeom(int(raw.geom_type[geom])).name.removeprefix("mjGEOM_").lower()


def of(raw: Any, geom: int) -> CollisionShape:
    """A geom, in the frame of its body."""
    word = kind(raw, geom)
    points = volume = None
    if word == "mesh":
        parts = _parts(raw, int(raw.geom_dataid[geom]))
        points = np.array(raw.mesh_vert[parts["mesh_vert"]], dtype=np.float64)
        volume = volume_of(points[raw.mesh_face[parts["mesh_face"]]])
    touch = touch_of(raw, geom)
    return CollisionShape(
        kind=word,
        place=placed(raw.geom_pos[geom], raw.geom_quat[geom]),
        size=tuple(map(float, raw.geom_size[geom][: PRIMITIVES.get(word, 0)])),
        points=points,
        volume=volume,
        name=raw.geom(geom).name,
        label=name_of(raw, "geom", geom),
        friction=touch.pop("friction"),
        contact=touch,
    )


def touch_of(raw: Any, geom: int) -> dict[str, tuple[float, ...]]:
    """Settings of a geom's contacts."""
    return {
        name: tuple(map(float, np.atleast_1d(getattr(raw, f"geom_{name}")[geom])))
        for name in ("friction", *_CONTACT)
    }


def hull(raw: Any, geom: int, points: Any) -> Array:
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
    here, there = _parts(one, ours), _parts(two, theirs)
    for name, part in here.items():
        values, old = np.array(getattr(one, name)[part]), getattr(two, name)[there[name]]
        if len(values) != len(old):
            what = "has a convex hull" if name == "mesh_graph" else "is a mesh"
            return (), f"it {what} of another size"
        if name.endswith("adr") and len(values):  # in another array, where it begins elsewhere
            values += old[0] - values[0]
        edits.append((name, (there[name],), values))
    return (*edits, *copies(_OF_A_MESH, one, ours, theirs)), ""


def _parts(raw: Any, mesh: int) -> dict[str, slice]:
    """Where a mesh is in the arrays of a compiled model; its convex hull last."""

    def part(start: Any, number: Any) -> slice:
        return slice(int(start), int(start) + int(number))

    found: dict[str, slice] = {}
    for word, names in _PARTS.items():
        start, number = (getattr(raw, f"mesh_{word}{of}")[mesh] for of in ("adr", "num"))
        found |= dict.fromkeys(names, part(start, number))
    for name in ("mesh_polyvert", "mesh_polymap"):  # as long as the lists of all its parts
        starts, numbers = (
            getattr(raw, f"{name}{of}")[found[f"{name}{of}"]] for of in ("adr", "num")
        )
        found[name] = part(starts[0] if len(starts) else 0, numbers.sum())
    start = raw.mesh_graphadr[mesh]
    number, faces = raw.mesh_graph[start : start + 2] if start >= 0 else (0, 0)
    found["mesh_graph"] = part(start, 2 + 3 * number + 6 * faces) if start >= 0 else slice(0, 0)
    return found


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
    found = {
        b: next(
            # Its own, if that will do.
            (m for m in (own[b], *range(two.nmesh)) if identical(one, one.geom_dataid[a], two, m)),
            None,
        )
        for a, b in pairs
    }
    while True:
        kept = {mesh for b, mesh in found.items() if mesh == own[b]}
        overwritten = {own[b] for b, mesh in found.items() if mesh is None} - kept
        lost = [b for b, mesh in found.items() if mesh in overwritten]
        if not lost:
            return {b: mesh for b, mesh in found.items() if mesh is not None}
        found |= dict.fromkeys(lost)


def identical(one: Any, ours: int, two: Any, theirs: int) -> bool:
    """Whether two meshes have the same vertices, faces and hull, in the same order."""
    if one is two and ours == theirs:
        return True
    edits, why = copied(one, two, ours, theirs)
    return not why and all(same(getattr(two, name)[index], value) for name, index, value in edits)


def heights(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """What two height fields differ in."""
    one, two = sides.one, sides.two
    ours, theirs = int(one.geom_dataid[a]), int(two.geom_dataid[b])
    fields = (one, ours), (two, theirs)
    grids = [(int(raw.hfield_nrow[h]), int(raw.hfield_ncol[h])) for raw, h in fields]
    if grids[0] != grids[1]:
        values = (("points", *(f"{rows} x {columns}" for rows, columns in grids)),)
        why = "it is a height field of another size"
        yield sides.tell("heights", "geom", a, values, refused=why)
        return
    starts = [int(raw.hfield_adr[h]) for raw, h in fields]
    spans = [slice(start, start + grids[0][0] * grids[0][1]) for start in starts]
    data = one.hfield_data[spans[0]], two.hfield_data[spans[1]]
    sizes = one.hfield_size[ours], two.hfield_size[theirs]
    if same(*data) and same(*sizes):
        return
    # The heights of a field are from 0 to 1 of its largest.
    far = np.abs(data[0] * sizes[0][2] - data[1] * sizes[1][2]).max()
    edits: tuple[Edit, ...] = (
        ("hfield_data", (spans[1],), np.array(data[0])),
        ("hfield_size", (theirs,), np.array(sizes[0])),
        *copies(("geom_size", "geom_rbound", "geom_aabb"), one, a, b),
    )
    users = (two.geom_type == two.geom_type[b]) & (two.geom_dataid == theirs)
    why = "another geom has this height field, too" if users.sum() > 1 else ""
    values = (("farthest point", 0.0, float(far)),)
    yield sides.tell("heights", "geom", a, values, "m", () if why else edits, refused=why)
