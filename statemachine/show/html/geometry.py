"""Triangles of a drawing, small enough to be carried by a page."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..drawing import Drawing, Part


@dataclass(frozen=True)
class MeshPart:
    """A part of a mesh: one body's, of one colour.

    Attributes:
        body: Id of the body that carries it.
        first: Its first index among those of the mesh, of which each face has three.
        count: How many indices it has.
        rgb: Red, green and blue, 0 to 1.
    """

    body: int
    first: int
    count: int
    rgb: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Mesh:
    """The triangles of a drawing.

    Attributes:
        vertices: (v, 3) float32 [m], in the frames of their bodies.
        faces: (f, 3) int64, numbers of vertices.
        parts: One after the other.
        simplified: How many triangles there were before, if they were too many; else 0.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int64]
    parts: tuple[MeshPart, ...]
    simplified: int


def mesh_of(drawing: Drawing, most: int = 24_000) -> Mesh:
    """Return all parts of a drawing but endless planes, with at most so many triangles.

    Too many triangles are made fewer by snapping points to a grid, as fine as will do.
    """
    drawn = [part for part in drawing.parts if not part.endless]
    before = sum(len(part.faces) for part in drawn)
    shapes: list[tuple[Any, Any]] = [(part.vertices, part.faces.astype(np.int64)) for part in drawn]
    cell = max(drawing.extent, 1e-6) / 2000
    while sum(len(faces) for _, faces in shapes) > most:
        shapes = [_snapped(part, cell) for part in drawn]
        cell *= 1.4
    vertices, faces = [np.empty((0, 3))], [np.empty((0, 3))]
    parts: list[MeshPart] = []
    corner = index = 0
    for part, (points, triangles) in zip(drawn, shapes, strict=True):
        red, green, blue = (round(share, 3) for share in part.rgba[:3])
        parts.append(MeshPart(part.body, index, triangles.size, (red, green, blue)))
        vertices.append(points)
        faces.append(triangles + corner)
        corner += len(points)
        index += triangles.size
    return Mesh(
        vertices=np.concatenate(vertices).astype(np.float32),
        faces=np.concatenate(faces).astype(np.int64),
        parts=tuple(parts),
        simplified=before if before > most else 0,
    )


def _snapped(part: Part, cell: float) -> tuple[Any, Any]:
    """Make points of one cell of a grid their mean, and leave out faces of no area."""
    _, number, count = np.unique(
        np.round(part.vertices / cell).astype(np.int64),
        axis=0,
        return_inverse=True,
        return_counts=True,
    )
    number = number.reshape(-1)
    means = np.zeros((len(count), 3))
    np.add.at(means, number, part.vertices)
    faces = number[part.faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return means / count[:, None], faces[np.sort(first)]


def packed(array: Any, kind: str) -> str:
    """Return an array as base64 of little-endian numbers of a kind, as "u2" or "f4"."""
    return base64.b64encode(np.ascontiguousarray(array).astype(f"<{kind}").tobytes()).decode()


def quantised(values: Any, low: Any, span: Any) -> Any:
    """Return values from `low` to `low + span` as whole numbers from 0 to 65535."""
    scaled = (np.asarray(values, dtype=np.float64) - low) / span
    return np.round(np.clip(scaled, 0.0, 1.0) * 65535)


def mesh_as_data(mesh: Mesh) -> dict[str, Any]:
    """Return a mesh as JSON."""
    points = mesh.vertices.astype(np.float64) if len(mesh.vertices) else np.zeros((1, 3))
    low, span = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-9)
    wide = len(points) > 65535
    parts = [(part.body, part.first, part.count, *part.rgb) for part in mesh.parts]
    return {
        "position": packed(quantised(points, low, span), "u2"),
        "index": packed(mesh.faces.reshape(-1), "u4" if wide else "u2"),
        "wide": wide,
        "low": low.tolist(),
        "span": span.tolist(),
        "parts": parts,
    }
