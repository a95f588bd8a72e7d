"""Triangles of a drawing, small enough to be carried by a page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...drawing import Drawing, Part, lathe
from ...interface import Array
from ...runs import Trace


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of all parts of a drawing, in the frames of their bodies.

    Attributes:
        vertices: (v, 3) [m].
        faces: (f, 3) numbers of vertices.
        parts: (body, first index, count of indices, colour) of each part.
        simplified: How many triangles there were before, if they were too many; else 0.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int64]
    parts: tuple[tuple[int, int, int, tuple[float, float, float]], ...]
    simplified: int


def mesh_of(drawing: Drawing, most: int = 24_000) -> Mesh:
    """All parts of a drawing but endless planes, with at most so many triangles.

    Too many triangles are made fewer by snapping points to a grid, as fine as will do.
    """
    parts = [part for part in drawing.parts if not part.endless]
    before = sum(len(part.faces) for part in parts)
    shapes = [(part.vertices, part.faces.astype(np.int64)) for part in parts]
    cell = max(drawing.extent, 1e-6) / 2000
    while sum(len(faces) for _, faces in shapes) > most:
        shapes = [_snapped(part, cell) for part in parts]
        cell *= 1.4
    vertices: list[Any] = []
    faces: list[Any] = []
    placed, corner, index = [], 0, 0
    for part, (points, triangles) in zip(parts, shapes, strict=True):
        if not len(triangles):
            continue
        vertices.append(points)
        faces.append(triangles + corner)
        placed.append((part.body, index, triangles.size, part.rgba[:3]))
        corner, index = corner + len(points), index + triangles.size
    none = np.empty((0, 3))
    return Mesh(
        np.concatenate([none, *vertices]).astype(np.float32),
        np.concatenate([none, *faces]).astype(np.int64),
        tuple(placed),
        before if before > most else 0,
    )


def _snapped(part: Part, cell: float) -> tuple[Any, Any]:
    """Points of one cell of a grid become their mean; faces of no area go."""
    cells = np.round(part.vertices / cell).astype(np.int64)
    _, number, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    means = np.zeros((len(count), 3))
    np.add.at(means, number, part.vertices)
    means /= count[:, None]
    faces = number[part.faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return means, faces[np.sort(first)]


def bones_of(trace: Trace) -> Drawing:
    """A stick figure of a trace whose model cannot be had: a bone to each body from its parent.

    It is what the trace itself tells: where the bodies are in the first row.
    """
    header = trace.header
    pos, quat = trace["xpos"][0], trace["xquat"][0]
    moving = [k for k, parent in enumerate(header.body_parentid) if k and parent]
    spans = [float(np.linalg.norm(pos[k] - pos[header.body_parentid[k]])) for k in moving]
    size = max([*spans, 0.05])
    parts = []
    grey = (0.6, 0.6, 0.6, 1.0)

    def add(body: int, end: Any) -> None:
        vertices, faces = _bone(np.asarray(end, dtype=np.float64), 0.12 * size)
        parts.append(Part(header.bodies[body], "bone", -1, body, vertices, faces, grey))

    for body in moving:
        parent = header.body_parentid[body]
        add(parent, _rotation(quat[parent]).T @ (pos[body] - pos[parent]))
    carried = {header.body_parentid[body] for body in moving}
    for body in range(1, len(header.bodies)):
        if body not in carried:  # the last of a chain, or one that is alone
            add(body, (0.0, 0.0, 0.12 * size))
    centre = pos[1:].mean(axis=0) if len(pos) > 1 else np.zeros(3)
    x, y, z = centre.tolist()
    extent = max(size, float(np.ptp(pos, axis=0).max()))
    return Drawing(tuple(parts), (x, y, z), extent, azimuth=-90.0, elevation=-15.0)


def _bone(end: Array, thick: float) -> tuple[Any, Any]:
    """Two pyramids on one square, near the thicker end."""
    length = float(np.linalg.norm(end))
    if length < 1e-6:
        end, length = np.array([0.0, 0.0, thick]), thick
    along = end / length
    aside = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    aside /= np.linalg.norm(aside)
    wide = min(0.5 * thick, 0.25 * length)
    shape = lathe([0.0, wide, 0.0], [0.0, 0.2 * length, length], around=4)
    turned = shape.vertices @ np.array([aside, np.cross(along, aside), along])
    return turned.astype(np.float32), shape.faces


def _rotation(quat: Array) -> Array:
    from ...rotations import matrix_from_quat

    length = float(np.linalg.norm(quat))
    return matrix_from_quat(quat / length if length > 0 else np.array([1.0, 0, 0, 0]))


def packed(array: Any, kind: str) -> str:
    """An array as base64 of little-endian numbers of a kind, as "u2" or "f4"."""
    return base64.b64encode(np.ascontiguousarray(array).astype(f"<{kind}").tobytes()).decode()


def quantised(values: Any, low: Any, span: Any) -> Any:
    """Values from `low` to `low + span` as whole numbers from 0 to 65535."""
    scaled = (np.asarray(values, dtype=np.float64) - low) / span
    return np.round(np.clip(scaled, 0.0, 1.0) * 65535)


def mesh_as_data(mesh: Mesh) -> dict[str, Any]:
    """A mesh as JSON."""
    low = mesh.vertices.min(axis=0) if len(mesh.vertices) else np.zeros(3)
    span = np.maximum(np.ptp(mesh.vertices, axis=0) if len(mesh.vertices) else 1.0, 1e-9)
    wide = len(mesh.vertices) > 65535
    return {
        "position": packed(quantised(mesh.vertices, low, span), "u2"),
        "index": packed(mesh.faces.reshape(-1), "u4" if wide else "u2"),
        "wide": wide,
        "low": _floats(low),
        "span": _floats(np.broadcast_to(span, 3)),
        "parts": [[b, first, n, *(round(c, 3) for c in rgb)] for b, first, n, rgb in mesh.parts],
    }


def _floats(values: Sequence[float] | Any) -> list[float]:
    return [float(f"{float(value):.9g}") for value in values]
