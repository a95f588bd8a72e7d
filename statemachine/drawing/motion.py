"""A scene in motion: what each side looks like, where its bodies are, and from where it is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..backends import on_default
from ..interface import Array, Model, forward, make_data
from ..rotations import matrix_from_quat
from ._drawing import Drawing
from .camera import Camera, framed

_MOMENTS = 60  # of a motion that a camera is chosen by, at most
# From the front, to the right or to the left of the arm, which reaches along x; and below them.
_AZIMUTHS, _ELEVATION = (140.0, 220.0, 110.0, 250.0), -20.0


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
        """Corners (n, 3) of boxes about all that belongs to a body, at some of the moments."""
        rows = np.unique(np.linspace(0, len(self.xpos) - 1, _MOMENTS).astype(int))
        xpos, turn = self.xpos[rows], matrix_from_quat(self.xquat[rows])
        parts = [part for part in self.drawing.parts if not part.endless]
        corners = [np.empty((0, 3))]
        for part in [part for part in parts if part.body] or parts:
            ends = np.stack([part.vertices.min(axis=0), part.vertices.max(axis=0)]).astype(float)
            box = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
            placed = np.einsum("nij,kj->nki", turn[:, part.body], box) + xpos[:, part.body, None]
            corners.append(placed.reshape(-1, 3))
        return np.concatenate(corners) if parts else xpos.reshape(-1, 3)


def poses_through(model: Model, qpos: Array) -> tuple[Array, Array]:
    """Xpos (n, nbody, 3) and xquat (n, nbody, 4) of qpos (n, nq), by MuJoCo's kinematics."""
    reader = on_default(model)
    xpos, xquat = np.empty((len(qpos), model.nbody, 3)), np.empty((len(qpos), model.nbody, 4))
    with make_data(reader) as data:
        for k, row in enumerate(qpos):
            data.qpos[:] = row
            forward(reader, data)
            xpos[k], xquat[k] = data.xpos, data.xquat
    return xpos, xquat


def camera_for(sides: Sequence[Motion], aspect: float) -> Camera:
    """A camera that has all bodies in its picture at every moment, on all sides.

    It stands where the bodies lie widest beside one another, on the mean of all moments.

    Args:
        sides: What is to be seen.
        aspect: Width of the picture by its height.
    """

    def width(azimuth: float) -> float:
        right = Camera((0, 0, 0), 1, azimuth, 0).axes[0]
        return sum(float((side.xpos[:, 1:] @ right).std(axis=1).sum()) for side in sides)

    widths = {azimuth: width(azimuth) for azimuth in _AZIMUTHS}
    # The first that is nearly as good as the best: a hair must not turn the camera.
    azimuth = next(a for a, width in widths.items() if width >= 0.9 * max(widths.values()))
    return framed(np.concatenate([side.corners() for side in sides]), aspect, azimuth, _ELEVATION)
