"""A scene: what each side looks like, where its bodies are, whence it is seen; what draws it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...backends import on_default
from ...interface import Array, Data, Model, forward, make_data
from ...rotations import matrix_from_quat
from .shapes import Drawing

FOVY = 30.0  # [°] a long lens: near and far parts of an arm are drawn alike in size
_MARGIN = 0.90  # of half the picture that what is framed may take
_NEAREST = 1e-3  # [m] of a camera to what it frames
_MOMENTS = 60  # of a motion that a camera is chosen by, at most
# From the front, to the right or to the left of the arm, which reaches along x; and below them.
_AZIMUTHS, _ELEVATION = (140.0, 220.0, 110.0, 250.0), -20.0


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a point; MuJoCo's angles.

    Attributes:
        target: (3,) what it looks at [m].
        distance: From there to the camera [m].
        azimuth: Direction of view about z [°]: 0 looks along +x, 90 along +y.
        elevation: Of the direction of view [°]: -90 looks straight down.
        fovy: Angle of view, from top to bottom [°].
    """

    target: tuple[float, float, float]
    distance: float
    azimuth: float
    elevation: float
    fovy: float = FOVY

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Return unit vectors (3,): right, up and forward in the picture."""
        a, e = math.radians(self.azimuth), math.radians(self.elevation)
        right = np.array([math.sin(a), -math.cos(a), 0.0])
        forward = np.array([math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)])
        return right, np.cross(right, forward), forward

    @property
    def eye(self) -> Array:
        """Return where it stands (3,) [m]."""
        return np.asarray(self.target) - self.distance * self.axes[2]

    @property
    def near(self) -> float:
        """Return the nearest that is drawn [m]."""
        return 0.05 * self.distance

    @property
    def far(self) -> float:
        """Return the farthest that is drawn [m]."""
        return 20.0 * self.distance


def framed(points: ArrayLike, aspect: float, azimuth: float, elevation: float) -> Camera:
    """Return the nearest camera in a direction that has all points in its picture.

    A point at p from the target is seen within the picture if |p·right| ≤ tan(half the
    angle of view)·(distance + p·forward), and so for up: of these distances the largest.

    Args:
        points: (n, 3) [m].
        aspect: Width of the picture by its height.
        azimuth: As in `Camera`; so elevation.
        elevation: See azimuth.
    """
    cloud = np.asarray(points, dtype=float).reshape(-1, 3)
    right, up, forward = Camera((0, 0, 0), 1, azimuth, elevation).axes
    tangent = math.tan(math.radians(FOVY) / 2) * _MARGIN
    target = (cloud.min(axis=0) + cloud.max(axis=0)) / 2
    distance = 0.0
    for k in range(9):
        offset = cloud - target
        x, y, depth = offset @ right, offset @ up, offset @ forward
        needed = np.maximum(np.abs(x) / (tangent * aspect), np.abs(y) / tangent)
        distance = max(float((needed - depth).max()), _NEAREST)
        ahead = np.maximum(distance + depth, _NEAREST)  # a point may be where the camera stands
        if k < 8:  # the middle of a box is not the middle of its picture: centre that
            for axis, along in ((right, x / ahead), (up, y / ahead)):
                target = target + distance * ((along.min() + along.max()) / 2 * axis)
    x, y, z = target.tolist()
    return Camera((x, y, z), distance, azimuth, elevation)


@dataclass(frozen=True, eq=False)
class Motion:
    """One side of a scene, moment by moment.

    Attributes:
        drawing: What it looks like.
        xpos: (n, nbody, 3) origins of the bodies [m].
        xquat: (n, nbody, 4) their rotations, wxyz.
    """

    drawing: Drawing
    xpos: Array
    xquat: Array

    def corners(self) -> Array:
        """Return corners (n, 3) of boxes about all that belongs to a body, at some moments."""
        rows = np.unique(np.linspace(0, len(self.xpos) - 1, _MOMENTS).astype(int))
        xpos, turn = self.xpos[rows], matrix_from_quat(self.xquat[rows])
        finite = [part for part in self.drawing.parts if not part.endless]
        moving = [part for part in finite if part.body]
        parts = moving if moving else finite
        corners = [np.empty((0, 3))]
        for part in parts:
            ends = np.stack([part.vertices.min(axis=0), part.vertices.max(axis=0)]).astype(float)
            box = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
            placed = np.einsum("nij,kj->nki", turn[:, part.body], box) + xpos[:, part.body, None]
            corners.append(placed.reshape(-1, 3))
        return np.concatenate(corners) if parts else xpos.reshape(-1, 3)


def posed(model: Model, qpos: Array) -> Iterator[Data]:
    """Return a Data in each pose of some (n, nq), after `forward`; it is the same one each time."""
    with make_data(model) as data:
        for row in qpos:
            data.qpos = row
            forward(model, data)
            yield data


def poses_through(model: Model, qpos: Array) -> tuple[Array, Array]:
    """Return xpos (n, nbody, 3) and xquat (n, nbody, 4) of qpos (n, nq), by MuJoCo."""
    xpos, xquat = (np.empty((len(qpos), model.nbody, size)) for size in (3, 4))
    for k, data in enumerate(posed(on_default(model), qpos)):
        xpos[k], xquat[k] = data.xpos, data.xquat
    return xpos, xquat


def camera_for(
    sides: Sequence[Motion], aspect: float, reach: float = np.inf, at: int | None = None
) -> Camera:
    """Return a camera that has all bodies in its picture at every moment, on all sides.

    It stands where the bodies lie widest beside one another, on the mean of all moments.

    Args:
        sides: What is to be seen.
        aspect: Width of the picture by its height.
        reach: What is farther from the median of all along an axis may be outside [m].
        at: A moment at which nothing may be outside, by its row; None for none.
    """

    def width(azimuth: float) -> float:
        right = Camera((0, 0, 0), 1, azimuth, 0).axes[0]
        return sum(float((side.xpos[:, 1:] @ right).std(axis=1).sum()) for side in sides)

    widths = {azimuth: width(azimuth) for azimuth in _AZIMUTHS}
    # The first that is nearly as good as the best: a hair must not turn the camera.
    azimuth = next(a for a, width in widths.items() if width >= 0.9 * max(widths.values()))
    points = np.concatenate([side.corners() for side in sides])
    near = points[(np.abs(points - np.median(points, axis=0)) <= reach).all(axis=1)]
    framed_points = [near if len(near) else points]
    if at is not None:
        now = [replace(s, xpos=s.xpos[at : at + 1], xquat=s.xquat[at : at + 1]) for s in sides]
        framed_points += [side.corners() for side in now]
    return framed(np.concatenate(framed_points), aspect, azimuth, _ELEVATION)


Pixels = NDArray[np.uint8]
GHOST = (0.42, 0.18, 0.62)  # violet: apart from orange to every eye, and dark without colour
_STRENGTH = 0.6  # of the ghost over what is behind it


@dataclass(frozen=True, eq=False)
class Shot:
    """One picture and how far away everything in it is.

    Attributes:
        rgb: (height, width, 3).
        depth: (height, width) along the direction of view [m]; infinite where nothing is.
    """

    rgb: Pixels
    depth: Array


class Drawer(Protocol):
    """Draws the bodies of one model wherever they are told to be, until its process ends."""

    def shot(self, xpos: Array, xquat: Array) -> Shot:
        """Return a picture.

        Args:
            xpos: (nbody, 3) origins of the bodies [m].
            xquat: (nbody, 4) their rotations, wxyz.
        """
        ...


def compose(solid: Shot, ghost: Shot | None, bias: float, line: int) -> Pixels:
    """Put a ghost over a solid picture.

    It is seen where it is nearer than the solid side by more than `bias` [m]: where the two
    are in one place the solid side is drawn alone. The ghost's outline, `line` pixels wide,
    is drawn at full strength, so that it is told apart without colour.
    """
    if ghost is None:
        return solid.rgb
    seen = ghost.depth < solid.depth - bias
    inside = np.isfinite(ghost.depth)
    for _ in range(line):
        inside = _without_edge(inside)
    rgb = solid.rgb.copy()
    mixed = (1 - _STRENGTH) * solid.rgb[seen] + _STRENGTH * ghost.rgb[seen]
    rgb[seen] = np.round(mixed).astype(np.uint8)
    rgb[seen & ~inside] = (0.6 * 255 * np.asarray(GHOST)).astype(np.uint8)
    return rgb


def _without_edge(region: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a region of a picture without the pixels at its edge; the picture's frame is none."""
    wide = np.pad(region, 1, constant_values=True)
    above_and_below = wide[:-2, 1:-1] & wide[2:, 1:-1]
    beside = wide[1:-1, :-2] & wide[1:-1, 2:]
    return region & above_and_below & beside


def smaller(rgb: Pixels, by: int) -> Pixels:
    """Return a picture at a fraction of its size; each pixel is the mean of those it stands for."""
    height, width = rgb.shape[0] // by, rgb.shape[1] // by
    blocks = rgb[: height * by, : width * by].reshape(height, by, width, by, 3)
    return (blocks.sum((1, 3), dtype=np.uint16) // (by * by)).astype(np.uint8)
