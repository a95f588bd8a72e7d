"""Surfaces as triangles."""

from __future__ import annotations

from typing import Any

import numpy as np


def area_of(shape: Any) -> float:
    """Return the sum of the areas of all triangles [m²]."""
    a, b, c = (shape.vertices[shape.faces[:, k]].astype(float) for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
