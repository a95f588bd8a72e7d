"""Moving pictures of traces: one side solid, the other a ghost over it.

    for picture in frames(one, two, size=(640, 480)):   # (height, width, 3) uint8
        ...

Bodies are put where the traces say they were, so that any engine's run is drawn, and one
that was recorded elsewhere. An engine draws, without a screen: the `drawer`
of its room, in a process of its own, which an OpenGL library that is missing takes down.
"""

from __future__ import annotations

from .motion import Motion, models_of, motion_of, motion_through
from .pictures import LONGEST, LivePictures, Timing, camera_for, drawn, frames, timing_of
from .probe import Renderer, renderer_here, renderers

__all__ = [
    "LONGEST",
    "LivePictures",
    "Motion",
    "Renderer",
    "Timing",
    "camera_for",
    "drawn",
    "frames",
    "models_of",
    "motion_of",
    "motion_through",
    "renderer_here",
    "renderers",
    "timing_of",
]
