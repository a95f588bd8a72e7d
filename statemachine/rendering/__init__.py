"""Moving pictures of traces: one side solid, the other a ghost over it.

    for picture in frames(one, two, size=(640, 480)):   # (height, width, 3) uint8
        ...

Bodies are put where the traces say they were, so that any engine's run is drawn, and one
that was recorded elsewhere. MuJoCo draws, without a screen; where there is no OpenGL,
PyBullet's software does. Either runs in a process of its own: an OpenGL library that is
missing takes its process down.
"""

from __future__ import annotations

from .camera import Camera, framed
from .motion import Motion, models_of, motion_of
from .pictures import LONGEST, Timing, camera_for, frames, timing_of
from .probe import RENDERERS, Renderer, offscreen_opengl, renderer_here

__all__ = [
    "LONGEST",
    "RENDERERS",
    "Camera",
    "Motion",
    "Renderer",
    "Timing",
    "camera_for",
    "framed",
    "frames",
    "models_of",
    "motion_of",
    "offscreen_opengl",
    "renderer_here",
    "timing_of",
]
