"""Two pictures into one: a solid side, and a ghost of the other where they part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..drawing.shots import GHOST, Pixels, Shot

_STRENGTH = 0.6  # of the ghost over what is behind it


def compose(solid: Shot, ghost: Shot | None, bias: float, line: int) -> Pixels:
    """Put a ghost over a solid picture.

    It is seen where it is nearer than the solid side by more than `bias` [m]: where the two
    are in one place the solid side is drawn alone. The ghost's outline, `line` pixels wide,
    is drawn at full strength, so that it is told apart without colour.
    """
    if ghost is None:
        return solid.rgb
    seen = ghost.depth < solid.depth - bias
    if not seen.any():
        return solid.rgb
    there = np.isfinite(ghost.depth)
    inside = there.copy()
    for _ in range(line):
        inside = _shrunk(inside)
    rgb = solid.rgb.copy()
    mixed = (1 - _STRENGTH) * solid.rgb[seen] + _STRENGTH * ghost.rgb[seen]
    rgb[seen] = np.round(mixed).astype(np.uint8)
    rgb[seen & ~inside] = (0.6 * 255 * np.asarray(GHOST)).astype(np.uint8)
    return rgb


def halved(rgb: Pixels, by: int) -> Pixels:
    """A picture at a fraction of its size; each pixel is the mean of those it stands for."""
    height, width = rgb.shape[0] // by, rgb.shape[1] // by
    blocks = rgb[: height * by, : width * by].reshape(height, by, width, by, 3)
    return (blocks.sum((1, 3), dtype=np.uint16) // (by * by)).astype(np.uint8)


def _shrunk(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Without the pixels at the edge; the frame of the picture is none."""
    wide = np.pad(mask, 1, constant_values=True)
    return mask & wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:]
