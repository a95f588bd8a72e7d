"""Solids: volumes and extents, of meshes too (STL and OBJ, read here)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..interface import Array
from ..models import mesh_file
from .records import CollisionShape

_LARGEST = 256 * 2**20  # bytes


def read_mesh(name: str, folder: Path) -> tuple[Array | None, str]:
    """Triangles (n, 3, 3) of a mesh, or None and what is the matter with it.

    Args:
        name: As a URDF names it; of package://… the folders above are tried.
        folder: That of the URDF.
    """
    path = mesh_file(name, folder)
    if path is None:
        return None, "is not there"
    try:
        if path.stat().st_size > _LARGEST:
            return None, f"is larger than {_LARGEST >> 20} MB"
        content = path.read_bytes()
        suffix = path.suffix.lower()
        if suffix == ".stl":
            triangles = _stl(content)
        elif suffix == ".obj":
            triangles = _obj(content.decode(errors="replace"))
        else:
            return None, f"is a {suffix or 'file without a suffix'}, which is not read here"
    except (OSError, ValueError, IndexError) as error:
        return None, f"cannot be read ({error})"
    if not len(triangles) or not np.isfinite(triangles).all():
        return None, "has no triangles" if not len(triangles) else "has figures that are no numbers"
    return triangles, ""


def _stl(content: bytes) -> Array:
    count = int.from_bytes(content[80:84], "little")
    if len(content) == 84 + 50 * count:
        layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
        return np.frombuffer(content, layout, count, 84)["corners"].astype(np.float64)
    if not content.lstrip().startswith(b"solid"):
        raise ValueError("no STL")
    lines = content.decode(errors="replace").split("\n")
    corners = [line.split()[1:4] for line in lines if line.lstrip().startswith("vertex")]
    return np.array(corners, dtype=np.float64).reshape(-1, 3, 3)


def _obj(text: str) -> Array:
    points: list[list[float]] = []
    faces: list[list[int]] = []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            points.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            corners = [int(word.split("/")[0]) for word in words[1:]]
            corners = [c - 1 if c > 0 else len(points) + c for c in corners]
            faces += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    return np.array(points, dtype=np.float64)[np.array(faces, dtype=int)]


def volume_of(kind: str, size: tuple[float, ...], triangles: Array | None = None) -> float | None:
    """Volume [m³] of a solid; of a mesh, what its triangles (n, 3, 3) enclose."""
    if kind == "box":
        return 8 * math.prod(size)
    if kind == "sphere":
        return 4 / 3 * math.pi * size[0] ** 3
    if kind == "ellipsoid":
        return 4 / 3 * math.pi * math.prod(size)
    if kind in ("cylinder", "capsule"):
        radius, half = size[:2]
        ends = 4 / 3 * math.pi * radius**3 if kind == "capsule" else 0.0
        return 2 * math.pi * radius**2 * half + ends
    if triangles is not None:
        a, b, c = np.moveaxis(triangles, 1, 0)
        return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6
    return None


def extent(shape: CollisionShape, direction: Array) -> float | None:
    """How far a shape reaches from its link's origin in a direction (3,) [m]; None: unknown."""
    own = shape.place.mat.T @ direction
    start = float(shape.place.pos @ direction)
    size = shape.size
    match shape.kind:
        case "box":
            return start + float(np.abs(own) @ size)
        case "sphere":
            return start + size[0]
        case "ellipsoid":
            return start + float(np.linalg.norm(own * size))
        case "cylinder":
            return start + size[0] * math.hypot(own[0], own[1]) + size[1] * abs(own[2])
        case "capsule":
            return start + size[0] + size[1] * abs(float(own[2]))
    return None if shape.points is None else start + float((shape.points @ own).max())


def with_capsules(shapes: Sequence[CollisionShape]) -> tuple[CollisionShape, ...]:
    """A cylinder with a sphere on each end is the capsule that the format has no word for."""
    found = list(shapes)
    for cylinder in shapes:
        if cylinder.kind != "cylinder":
            continue
        ends = list(_ends(cylinder, found))
        if len(ends) == 2:
            capsule = replace(cylinder, kind="capsule")
            capsule = replace(capsule, volume=volume_of("capsule", capsule.size))
            found = [capsule if each is cylinder else each for each in found if each not in ends]
    return tuple(found)


def _ends(cylinder: CollisionShape, shapes: Sequence[CollisionShape]) -> Iterator[CollisionShape]:
    radius, half = cylinder.size
    for sign in (-1, 1):
        end = cylinder.place.of(np.array([0.0, 0.0, sign * half]))
        for each in shapes:
            alike = each.kind == "sphere" and abs(each.size[0] - radius) <= 1e-6 * radius
            if alike and np.linalg.norm(each.place.pos - end) <= 1e-3 * radius:
                yield each
                break
