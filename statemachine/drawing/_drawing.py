"""From a Model to its visual geoms as triangles, each in the frame of its body."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import rotations
from ..backends import on_default
from ..interface import Model
from . import _shapes
from ._shapes import Surface

# MuJoCo's mjtGeom, in its order.
_KINDS = ["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"]
_PRIMITIVES: dict[str, Callable[[list[float]], Surface]] = {  # of their sizes
    "sphere": lambda size: _shapes.ellipsoid([size[0]] * 3),
    "ellipsoid": _shapes.ellipsoid,
    "capsule": lambda size: _shapes.capsule(size[0], size[1]),
    "cylinder": lambda size: _shapes.cylinder(size[0], size[1]),
    "box": _shapes.box,
}
_SEEN_GROUPS = 3  # MuJoCo's viewer shows groups 0 to 2; 3 to 5 are for what only touches
_UNSET = np.array([0.5, 0.5, 0.5, 1], dtype=np.float32)  # the rgba of a geom that names none
_WIDE = 4  # half an endless plane is so many times the model's extent


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
    rgba: tuple[float, float, float, float]
    endless: bool = False

    @property
    def is_ground(self) -> bool:
        """Whether it is an endless level plane of the world."""
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
        """Ids of the bodies that have a part."""
        return tuple(sorted({part.body for part in self.parts}))


def drawing_of(model: Model) -> Drawing:
    """The visual geoms of a model, on whichever backend it is.

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
        turn = rotations.matrix_from_quat(raw.geom_quat[geom])
        placed = _shapes.welded(shape.vertices @ turn.T + raw.geom_pos[geom], shape.faces)
        parts.append(
            Part(
                kind="mesh" if kind == "sdf" else kind,
                geom=geom,
                body=int(raw.geom_bodyid[geom]),
                vertices=placed.vertices,
                faces=placed.faces,
                rgba=rgba,
                endless=kind == "plane" and not (raw.geom_size[geom, :2] > 0).all(),
            )
        )
    x, y, z = raw.stat.center.tolist()
    at = raw.vis.global_
    return Drawing(
        parts=tuple(parts),
        center=(x, y, z),
        extent=float(raw.stat.extent),
        azimuth=float(at.azimuth),
        elevation=float(at.elevation),
        file=model.path,
        left_out=tuple(left_out),
    )


def _shape(raw: Any, geom: int, kind: str) -> Surface | None:
    """A geom in its own frame; None if there are no triangles to be had of it."""
    size, data = raw.geom_size[geom].tolist(), int(raw.geom_dataid[geom])
    if kind == "plane":
        wide = _WIDE * float(raw.stat.extent)
        return _shapes.rectangle(size[0] or wide, size[1] or wide)
    if kind in _PRIMITIVES:
        return _PRIMITIVES[kind](size)
    if kind == "hfield":
        rows, columns = int(raw.hfield_nrow[data]), int(raw.hfield_ncol[data])
        half_x, half_y, top, _ = raw.hfield_size[data].tolist()
        start = int(raw.hfield_adr[data])
        heights = raw.hfield_data[start : start + rows * columns].reshape(rows, columns)
        return _shapes.terrain(top * heights, half_x, half_y)
    if kind in ("mesh", "sdf") and data >= 0:
        vert, face = int(raw.mesh_vertadr[data]), int(raw.mesh_faceadr[data])
        return Surface(
            raw.mesh_vert[vert : vert + int(raw.mesh_vertnum[data])],
            raw.mesh_face[face : face + int(raw.mesh_facenum[data])],
        )
    return None


def _colour(raw: Any, geom: int) -> tuple[float, float, float, float]:
    """As MuJoCo's viewer takes it: the geom's own rgba before its material's."""
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
