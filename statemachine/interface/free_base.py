"""Where a base that floats starts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FreeBase:
    """A base that floats, and where it is in the default state: what `load` takes for "free".

    Attributes:
        pos: (3,) its place in world axes [m].
        quat: (4,) its rotation, (w, x, y, z).
    """

    pos: tuple[float, float, float]
    quat: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
