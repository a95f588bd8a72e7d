"""A picture with its depths, and what draws one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..interface import Array

Pixels = NDArray[np.uint8]
GHOST = (0.42, 0.18, 0.62)  # violet: apart from orange to every eye, and dark without colour


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
