"""A picture with its depths, what draws one, and two of them in one: a ghost where they part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..interface import Array

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
        """A picture.

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
        # Without the pixels at the edge; the frame of the picture is none.
        wide = np.pad(inside, 1, constant_values=True)
        inside &= wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:]
    rgb = solid.rgb.copy()
    mixed = (1 - _STRENGTH) * solid.rgb[seen] + _STRENGTH * ghost.rgb[seen]
    rgb[seen] = np.round(mixed).astype(np.uint8)
    rgb[seen & ~inside] = (0.6 * 255 * np.asarray(GHOST)).astype(np.uint8)
    return rgb


def smaller(rgb: Pixels, by: int) -> Pixels:
    """A picture at a fraction of its size; each pixel is the mean of those it stands for."""
    height, width = rgb.shape[0] // by, rgb.shape[1] // by
    blocks = rgb[: height * by, : width * by].reshape(height, by, width, by, 3)
    return (blocks.sum((1, 3), dtype=np.uint16) // (by * by)).astype(np.uint8)
