"""Drawn by PyBullet's software renderer, which needs no OpenGL; slower, and plainer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...backends import load
from ...backends.bullet.client import connect, pb
from ...interface import Array
from ...rotations import xyzw_from_wxyz
from ...show.drawing import Part, drawing_of
from ...show.drawing.scene import GHOST, Camera, Shot

_MOST = 20_000  # faces of one shape; PyBullet takes 131072 vertices
_TILE = 0.1  # [m] of a floor without an end, laid out so that its perspective is seen
_TILES = 12  # each way from the middle
_LIGHT = (0.4, -0.6, 1.5)
_SKY = np.array([[196.0, 208.0, 220.0], [240.0, 243.0, 246.0]])  # above, and at the horizon


class PybulletDrawer:
    """Draws the bodies of a model wherever they are told to be."""

    def __init__(self, file: Path, size: tuple[int, int], camera: Camera, ghost: bool) -> None:
        """Connect to a world; the arguments are those of `RawEngine.drawer`."""
        self._size, self._camera, self._ghost = size, camera, ghost
        self._client = connect()
        parts = [part for part in drawing_of(load(file)).parts if part.body or not ghost]
        self._placed = [
            (self._made(shape, colour), part.body)
            for part in parts
            for shape, colour in _shapes(part, (*GHOST, 1.0) if ghost else part.rgba)
        ]
        self._view = pb.computeViewMatrix(
            camera.eye.tolist(), list(camera.target), camera.axes[1].tolist()
        )
        self._lens = pb.computeProjectionMatrixFOV(
            camera.fovy, size[0] / size[1], camera.near, camera.far
        )

    def shot(self, xpos: Array, xquat: Array) -> Shot:
        """Return a picture with the bodies at xpos (nbody, 3) and xquat (nbody, 4)."""
        turned = xyzw_from_wxyz(xquat)
        for number, body in self._placed:
            pb.resetBasePositionAndOrientation(
                number, xpos[body].tolist(), turned[body].tolist(), physicsClientId=self._client
            )
        width, height = self._size
        _, _, rgba, window, _ = pb.getCameraImage(
            width,
            height,
            self._view,
            self._lens,
            lightDirection=_LIGHT,
            shadow=not self._ghost,
            renderer=pb.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        rgb = np.array(rgba, dtype=np.uint8).reshape(height, width, 4)[..., :3].copy()
        window = np.array(window, dtype=float).reshape(height, width)
        near, far = self._camera.near, self._camera.far
        depth = far * near / (far - (far - near) * window)
        # Nothing drawn is beyond; the last float32 before 1 is.
        depth[window >= 1 - 1e-6] = np.inf
        nothing = ~np.isfinite(depth)
        fade = np.linspace(0, 1, height)[:, None]
        sky = ((1 - fade) * _SKY[0] + fade * _SKY[1]).astype(np.uint8)
        rgb[nothing] = np.broadcast_to(sky[:, None], rgb.shape)[nothing]
        return Shot(rgb, depth)

    def _made(self, shape: tuple[Any, Any], rgba: Sequence[float]) -> int:
        """Make a body that is only seen, and return its number."""
        vertices, faces = shape
        look = pb.createVisualShape(
            pb.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=faces.ravel().tolist(),
            rgbaColor=list(rgba),
            specularColor=[0.1, 0.1, 0.1],
            physicsClientId=self._client,
        )
        return pb.createMultiBody(0, -1, look, physicsClientId=self._client)


def _shapes(
    part: Part, rgba: Sequence[float]
) -> Iterator[tuple[tuple[NDArray[Any], NDArray[Any]], Sequence[float]]]:
    """Yield a part in pieces that PyBullet takes, each face with its own corners: flat shading."""
    if part.endless:
        yield _tiles(part, 0), (*rgba[:3], 1.0)
        yield _tiles(part, 1), (*(0.93 * c for c in rgba[:3]), 1.0)
        return
    for start in range(0, len(part.faces), _MOST):
        corners = part.vertices[part.faces[start : start + _MOST]].reshape(-1, 3)
        yield (corners, np.arange(len(corners))), rgba


def _tiles(plane: Part, dark: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return every other square of a chessboard about the middle of a plane."""
    a, b, c = plane.vertices[plane.faces[0]].astype(float)
    x = (b - a) / np.linalg.norm(b - a)
    normal = np.cross(b - a, c - a)
    y = np.cross(normal / np.linalg.norm(normal), x)
    around = range(-_TILES, _TILES)
    squares = np.array([(i, j) for i in around for j in around if (i + j) % 2 == dark])
    corner = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    flat = _TILE * (squares[:, None] + corner).reshape(-1, 2)
    vertices = plane.vertices.mean(axis=0) + flat @ np.stack([x, y])
    first = 4 * np.arange(len(squares))[:, None, None]
    return vertices, (first + np.array([(0, 1, 2), (0, 2, 3)])).reshape(-1, 3)
