"""Convex hulls for PyBullet, as texts of OBJ files: meshes, and shapes that URDF has not.

MuJoCo collides a mesh as its convex hull, which the compiled model has. So PyBullet gets
that hull, whatever file the mesh came from, if any. An ellipsoid becomes a hull as well.

PyBullet puts a margin of 1 mm around each hull, and takes it off again (`collisionMargin=0`) only
where the hull is all that a free body has, and is not turned in it. So hulls are made smaller by
it: their faces are then where they belong, and their edges are rounded.
"""

from __future__ import annotations

from functools import cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from ..interface import Array

Faces = NDArray[np.int64]  # (m, 3) numbers of vertices

_MESH, ELLIPSOID = int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)
HULLS = (_MESH, ELLIPSOID)
MARGIN = 1e-3  # [m] PyBullet's, around each hull that it reads from a file
_THINNEST = 0.25  # a hull is made smaller by this part of its smallest width at most
_FINENESS = 3  # an icosahedron is divided so often; 642 vertices


class Hull:
    """The hull of a mesh or an ellipsoid, in the geom's own frame.

    Attributes:
        allowance: How much smaller it can be made [m]: the margin, or what its thickness allows.
    """

    def __init__(self, raw: mujoco.MjModel, geom: int) -> None:
        self._vertices, self._faces = _solid(raw, geom)
        self._planes = normals, offsets = _planes(self._vertices, self._faces)
        widths = offsets - (self._vertices @ normals.T).min(axis=0)
        self.allowance = min(MARGIN, round(_THINNEST * float(widths.min()), 10))

    def obj(self, smaller: bool) -> str:
        """OBJ of it [m].

        Args:
            smaller: Whether to take PyBullet's margin off.
        """
        vertices = self._vertices
        if smaller:
            vertices = _inset(vertices, *self._planes, self.allowance)
        # Rounded: the last bits of NumPy's sums are those of the processor.
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in (np.round(vertices, 10) + 0.0).tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (self._faces + 1).tolist()]
        return "\n".join([*lines, ""])


def roughness(size: Array) -> float:
    """How far the hull of an ellipsoid of semi-axes (3,) is from it at most [m]."""
    ball, _ = _sphere()
    return float((np.linalg.norm(ball, axis=1).max() - 1) * size.max())


def _solid(raw: mujoco.MjModel, geom: int) -> tuple[Array, Faces]:
    """Vertices (n, 3) [m] and triangles (m, 3), which turn outwards."""
    if raw.geom_type[geom] == ELLIPSOID:
        ball, faces = _sphere()
        return ball * raw.geom_size[geom], faces
    mesh = int(raw.geom_dataid[geom])
    start, count = int(raw.mesh_vertadr[mesh]), int(raw.mesh_vertnum[mesh])
    vertices = np.array(raw.mesh_vert[start : start + count], dtype=np.float64)
    # Vertices, triangles, two tables of vertices, one of edges, and the triangles by vertex.
    graph = raw.mesh_graph[raw.mesh_graphadr[mesh] :]
    corners, triangles = int(graph[0]), int(graph[1])
    kept = graph[2 + corners : 2 + 2 * corners]
    end = 2 + 3 * corners + 6 * triangles
    faces = graph[end - 3 * triangles : end].reshape(-1, 3)
    places = np.zeros(count, dtype=int)
    places[kept] = np.arange(corners)
    return vertices[kept], places[faces]


def _planes(vertices: Array, faces: Faces) -> tuple[Array, Array]:
    """Outward normals (m, 3) of the faces, and how far along them the faces are [m]."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    flat = length < 1e-12 * length.max()  # a sliver, which has no direction
    normals = normals[~flat] / length[~flat, None]
    normals *= np.sign(np.einsum("ij,ij->i", normals, a[~flat] - vertices.mean(axis=0)))[:, None]
    return normals, np.einsum("ij,ij->i", normals, a[~flat])


def _inset(vertices: Array, normals: Array, offsets: Array, distance: float) -> Array:
    """Vertices of a hull whose planes are a distance [m] further in, as well as they allow."""
    scale = float(np.abs(vertices).max())
    moved = vertices.copy()
    for k, vertex in enumerate(vertices):
        meeting = normals[np.abs(normals @ vertex - offsets) < 1e-9 * scale + 1e-12]
        if len(meeting):  # where more than three planes meet, as near to all as it goes
            step = np.linalg.lstsq(meeting, np.full(len(meeting), -distance), rcond=1e-6)[0]
            moved[k] += step * min(1.0, 4 * distance / max(float(np.linalg.norm(step)), 1e-300))
    return moved


@cache
def _sphere() -> tuple[Array, Faces]:
    """Vertices (n, 3) and triangles (m, 3) about a unit sphere, as far in as out of it."""
    golden = (1 + 5**0.5) / 2
    corners = [[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0]]
    points = np.array([np.roll(corner, k) for k in range(3) for corner in corners], dtype=float)
    points /= np.linalg.norm(points, axis=1)[:, None]
    edge = np.linalg.norm(points[:, None] - points, axis=2)
    near = (edge > 0) & (edge < 1.06)
    triangles = [
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[a, c]
    ]
    for _ in range(_FINENESS):
        points, triangles = _divided(points, triangles)
    faces = np.array(triangles)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    depth = np.linalg.norm(points[faces].mean(axis=1), axis=1).min()
    return points * (2 / (1 + depth)), faces


def _divided(
    points: Array, triangles: list[tuple[int, int, int]]
) -> tuple[Array, list[tuple[int, int, int]]]:
    """Each triangle as four, with their new corners on the unit sphere."""
    places: dict[tuple[int, int], int] = {}
    grown = points.tolist()

    def middle(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in places:
            point = points[a] + points[b]
            places[key] = len(grown)
            grown.append((point / np.linalg.norm(point)).tolist())
        return places[key]

    found: list[tuple[int, int, int]] = []
    for a, b, c in triangles:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        found += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.array(grown), found
