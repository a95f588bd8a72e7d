"""A stick figure of a run whose model cannot be had."""

from __future__ import annotations

from typing import Any

import numpy as np

from ....interface import Array
from ....rotations import matrix_from_quat
from ....show.drawing import Drawing, Part, lathe
from ...recordings import Trace
from .poses import unit_quat

_GREY = (0.6, 0.6, 0.6, 1.0)


def bones_of(trace: Trace) -> Drawing:
    """Draw a trace whose model cannot be had as sticks: a bone to each body from its parent.

    It is what the trace itself tells: where the bodies are in the first row.
    """
    header, pos = trace.header, trace["xpos"][0]
    turn = matrix_from_quat(unit_quat(trace["xquat"][0]))
    moving = [(k, parent) for k, parent in enumerate(header.body_parentid) if k and parent]
    bones = [(parent, turn[parent].T @ (pos[body] - pos[parent])) for body, parent in moving]
    size = max([0.05, *(float(np.linalg.norm(end)) for _, end in bones)])
    # The last of a chain, or one that is alone, has a knob.
    knobs = sorted(set(range(1, len(header.bodies))) - {parent for _, parent in moving})
    bones += [(body, np.array([0.0, 0.0, 0.12 * size])) for body in knobs]
    parts = tuple(Part("bone", -1, body, *_bone(end, 0.12 * size), _GREY) for body, end in bones)
    x, y, z = pos[1:].mean(axis=0).tolist() if len(pos) > 1 else (0.0, 0.0, 0.0)
    extent = max(size, float(np.ptp(pos, axis=0).max()))
    return Drawing(parts, (x, y, z), extent, azimuth=-90.0, elevation=-15.0)


def _bone(end: Array, thick: float) -> tuple[Any, Any]:
    """Return two pyramids on one square, near the thicker end."""
    length = float(np.linalg.norm(end))
    if length < 1e-6:
        end, length = np.array([0.0, 0.0, thick]), thick
    along = end / length
    aside = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    aside /= np.linalg.norm(aside)
    wide = min(0.5 * thick, 0.25 * length)
    shape = lathe([0.0, wide, 0.0], [0.0, 0.2 * length, length], around=4)
    turned = shape.vertices @ np.array([aside, np.cross(along, aside), along])
    return turned.astype(np.float32), shape.faces
