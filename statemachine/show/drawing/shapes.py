"""From a Model to its visual geoms as triangles, each in the frame of its body.

Every face is wound so that its normal, by the right hand, points outward. Sizes are
MuJoCo's: half of a box's edges, half of a cylinder's length (XML reference, `geom/size`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ... import rotations
from ...backends import on_default
from ...interface import Model

AROUND = 32  # corners of a circle
_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
_BOX = np.array(
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
)


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of triangles; read-only.

    Attributes:
        vertices: (v, 3) float32 [m].
        faces: (f, 3) int32, numbers of vertices.
    """

    vertices: NDArray[Any]
    faces: NDArray[Any]

    def __post_init__(self) -> None:
        for name, kind in (("vertices", np.float32), ("faces", np.int32)):
            array = np.array(getattr(self, name), dtype=kind).reshape(-1, 3)
            array.setflags(write=False)
            vars(self)[name] = array


def box(size: Sequence[float]) -> Surface:
    """Return a box; `size` are half of its edges."""
    return Surface(_CORNERS * np.asarray(size)[:3], _BOX[:, [(0, 1, 2), (0, 2, 3)]].reshape(-1, 3))


def rectangle(half_x: float, half_y: float) -> Surface:
    """Return a rectangle in the plane z = 0, seen from above."""
    return terrain(np.zeros((2, 2)), half_x, half_y)


def ellipsoid(size: Sequence[float], around: int = AROUND) -> Surface:
    """Return an ellipsoid; `size` are its semi-axes. A sphere has three equal ones."""
    turn = np.linspace(0, np.pi, around // 2 + 1)
    unit = lathe(np.sin(turn), -np.cos(turn), around)
    return Surface(unit.vertices * np.asarray(size)[:3], unit.faces)


def cylinder(radius: float, half: float, around: int = AROUND) -> Surface:
    """Return a cylinder along z of length 2·`half`."""
    return lathe([0, radius, radius, 0], [-half, -half, half, half], around)


def capsule(radius: float, half: float, around: int = AROUND) -> Surface:
    """Return a cylinder along z of length 2·`half`, with half a ball at each end."""
    turn = np.linspace(0, np.pi / 2, max(around // 4, 2) + 1)
    out, up = radius * np.sin(turn), radius * np.cos(turn) + half
    return lathe([*out, *out[::-1]], [*-up, *up[::-1]], around)


def lathe(radii: ArrayLike, heights: ArrayLike, around: int = AROUND) -> Surface:
    """Return a profile turned about z, from its lower end on the axis to its upper one.

    Args:
        radii: (n,) distances from the axis [m]; the first and the last are the poles.
        heights: (n,) heights [m].
        around: Corners of a full turn.
    """
    radius, height = np.array(radii, dtype=float), np.asarray(heights)
    radius[[0, -1]] = 0  # exactly: each pole is one point
    angle = 2 * np.pi * np.arange(around) / around
    rings = np.empty((len(radius), around, 3))
    rings[..., 0] = radius[:, None] * np.cos(angle)
    rings[..., 1] = radius[:, None] * np.sin(angle)
    rings[..., 2] = height[:, None]
    number = np.arange(len(radius) * around).reshape(-1, around)
    return welded(rings, _triangles(np.column_stack([number, number[:, 0]])))


def terrain(heights: ArrayLike, half_x: float, half_y: float) -> Surface:
    """Return the upper side of a height field.

    Args:
        heights: (rows, columns) [m]; columns go along x, rows along y.
        half_x: Half of its extent in x [m].
        half_y: Half of its extent in y [m].
    """
    z = np.asarray(heights)
    rows, columns = z.shape
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    return Surface(np.stack([x, y, z], axis=-1), _triangles(np.arange(z.size).reshape(z.shape)))


def _triangles(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return two triangles for each square of a grid of numbered points (rows, columns)."""
    first, second = number[:-1], number[1:]
    a, b = first[:, :-1], first[:, 1:]
    d, c = second[:, :-1], second[:, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


def welded(vertices: ArrayLike, faces: ArrayLike) -> Surface:
    """Return the same surface with every point there once, and without faces of no area.

    Args:
        vertices: (v, 3) [m]; points that are equal as float32 become one.
        faces: (f, 3) numbers of vertices.
    """
    points = np.asarray(vertices, dtype=np.float32).reshape(-1, 3) + np.float32(0)  # no -0
    unique, number = np.unique(points, axis=0, return_inverse=True)
    triangles = number.reshape(-1)[np.asarray(faces).reshape(-1, 3)]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Surface(unique[used], renumbered.reshape(-1, 3).astype(np.int32))


# MuJoCo's mjtGeom, in its order.
_KINDS = ["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"]
_SEEN_GROUPS = 3  # MuJoCo's viewer shows groups 0 to 2; 3 to 5 are for what only touches
_UNSET = np.array([0.5, 0.5, 0.5, 1], dtype=np.float32)  # the rgba of a geom that names none
_WIDE = 4  # half an endless plane is so many times the model's extent


Colour = tuple[float, float, float, float]  # red, green, blue and opacity, 0 to 1


@dataclass(frozen=True, eq=False)
class Part:
    """A visual geom.

    Attributes:
        kind: MuJoCo's word: plane, hfield, sphere, capsule, ellipsoid, cylinder, box, mesh.
        geom: Id of the geom.
        body: Id of the body that carries it; body 0 is the world.
        vertices: (v, 3) float32, in the frame of the body [m].
        faces: (f, 3) int32; the normals, by the right hand, point outward.
        rgba: Red, green, blue and opacity, 0 to 1; of a texture, its mean.
        endless: Whether it is a plane without an end, of which a piece is drawn.
    """

    kind: str
    geom: int
    body: int
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    rgba: Colour
    endless: bool = False

    @property
    def is_ground(self) -> bool:
        """Tell whether it is an endless level plane of the world."""
        return self.endless and self.body == 0 and bool(np.ptp(self.vertices[:, 2]) < 1e-6)


@dataclass(frozen=True, eq=False)
class Drawing:
    """What is to be seen of a model.

    Attributes:
        parts: Its visual geoms.
        center: (3,) middle of the model [m], and extent: its size [m], as the file has them.
        azimuth: Where MuJoCo's viewer looks from at first, about z [degrees]: 0 looks along x,
            90 along y. elevation: the same above the horizontal; below 0 looks down.
        file: The model's; an engine that draws reads it again. Not there for a stick figure.
        left_out: What it has and is not drawn, in words.
    """

    parts: tuple[Part, ...]
    center: tuple[float, float, float]
    extent: float
    azimuth: float
    elevation: float
    file: Path = Path()
    left_out: tuple[str, ...] = ()

    @property
    def bodies(self) -> tuple[int, ...]:
        """Return the ids of the bodies that have a part."""
        return tuple(sorted({part.body for part in self.parts}))


def drawing_of(model: Model) -> Drawing:
    """Return the visual geoms of a model, on whichever backend it is.

    It is drawn from what MuJoCo made of the same file, whatever the engine. Geoms of groups 3
    to 5, by convention what touches and is not seen, are drawn only where nothing but the
    world would be seen without them.

    Raises:
        MissingEngineError: MuJoCo is not installed here.
        ModelError: MuJoCo cannot read the file.
    """
    raw = model.compiled if model.compiled is not None else on_default(model).raw
    seen = raw.geom_group < _SEEN_GROUPS
    if not raw.geom_bodyid[seen].any():
        seen[:] = True
    left_out = [f"{what}: {n}" for what, n in (("flex", raw.nflex), ("skin", raw.nskin)) if n]
    parts = []
    for geom in np.flatnonzero(seen).tolist():
        rgba = _colour(raw, geom)
        if rgba[3] == 0:
            continue
        kind = _KINDS[int(raw.geom_type[geom])]
        shape = _shape(raw, geom, kind)
        if shape is None:
            left_out.append(f"geom {geom}, a {kind}")
            continue
        parts.append(_part(raw, geom, kind, shape, rgba))
    x, y, z = raw.stat.center.tolist()
    view = raw.vis.global_
    return Drawing(
        parts=tuple(parts),
        center=(x, y, z),
        extent=float(raw.stat.extent),
        azimuth=float(view.azimuth),
        elevation=float(view.elevation),
        file=model.path,
        left_out=tuple(left_out),
    )


def _part(raw: Any, geom: int, kind: str, shape: Surface, rgba: Colour) -> Part:
    """Return a geom with its shape, which is in its own frame, in the frame of its body."""
    turn = rotations.matrix_from_quat(raw.geom_quat[geom])
    placed = welded(shape.vertices @ turn.T + raw.geom_pos[geom], shape.faces)
    has_end = (raw.geom_size[geom, :2] > 0).all()
    return Part(
        kind="mesh" if kind == "sdf" else kind,
        geom=geom,
        body=int(raw.geom_bodyid[geom]),
        vertices=placed.vertices,
        faces=placed.faces,
        rgba=rgba,
        endless=kind == "plane" and not has_end,
    )


def _shape(raw: Any, geom: int, kind: str) -> Surface | None:
    """Return a geom in its own frame; None if there are no triangles to be had of it."""
    size, data = raw.geom_size[geom].tolist(), int(raw.geom_dataid[geom])
    if kind == "plane":
        wide = _WIDE * float(raw.stat.extent)
        return rectangle(size[0] if size[0] else wide, size[1] if size[1] else wide)
    if kind == "hfield":
        return _height_field(raw, data)
    if kind in ("mesh", "sdf"):
        return _mesh(raw, data) if data >= 0 else None
    return _primitive(kind, size)


def _primitive(kind: str, size: Sequence[float]) -> Surface | None:
    """Return a geom that is made of its `geom_size` alone; None for other kinds."""
    match kind:
        case "sphere":
            return ellipsoid([size[0]] * 3)
        case "ellipsoid":
            return ellipsoid(size)
        case "capsule":
            return capsule(size[0], size[1])
        case "cylinder":
            return cylinder(size[0], size[1])
        case "box":
            return box(size)
    return None


def _height_field(raw: Any, number: int) -> Surface:
    """Return a height field of a compiled model."""
    rows, columns = int(raw.hfield_nrow[number]), int(raw.hfield_ncol[number])
    half_x, half_y, top, _ = raw.hfield_size[number].tolist()
    start = int(raw.hfield_adr[number])
    heights = raw.hfield_data[start : start + rows * columns].reshape(rows, columns)
    return terrain(top * heights, half_x, half_y)


def _mesh(raw: Any, number: int) -> Surface:
    """Return a mesh of a compiled model."""
    first_vertex, first_face = int(raw.mesh_vertadr[number]), int(raw.mesh_faceadr[number])
    last_vertex = first_vertex + int(raw.mesh_vertnum[number])
    last_face = first_face + int(raw.mesh_facenum[number])
    vertices = raw.mesh_vert[first_vertex:last_vertex]
    return Surface(vertices, raw.mesh_face[first_face:last_face])


def _colour(raw: Any, geom: int) -> Colour:
    """Return the colour as MuJoCo's viewer takes it: the geom's own rgba before its material's."""
    rgba, material = raw.geom_rgba[geom], int(raw.geom_matid[geom])
    if material >= 0 and np.array_equal(rgba, _UNSET):
        rgba = raw.mat_rgba[material].copy()
        textures = raw.mat_texid[material]
        for texture in textures[textures >= 0].tolist()[:1]:
            channels = int(raw.tex_nchannel[texture])
            start = int(raw.tex_adr[texture])
            pixels = int(raw.tex_height[texture]) * int(raw.tex_width[texture])
            colours = raw.tex_data[start : start + pixels * channels].reshape(pixels, channels)
            if channels >= 3:
                rgba[:3] *= colours[:, :3].mean(axis=0) / 255
    r, g, b, a = (round(float(value), 6) for value in rgba)  # float32 in the file
    return r, g, b, a
