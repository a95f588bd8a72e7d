"""Pictures of the worlds of a task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..drawing.camera import Camera
from ..interface import Array
from ..rendering import LivePictures, motion_through, renderer_here
from .tasks import Task

SIZE = (480, 360)  # pixels
_CAMERA = Camera((0.16, 0.0, 0.16), 1.15, 140.0, -20.0)


class TaskPictures:
    """Draws the poses of a task's model, in a process that is started with the first."""

    def __init__(self, task: Task) -> None:
        self._model = task.model
        self._live: LivePictures | None = None

    def of(self, qpos: Array) -> tuple[NDArray[np.uint8], ...]:
        """Pictures (height, width, 3) uint8 of rows of qpos (n, nq)."""
        motion = motion_through(self._model, qpos)
        if self._live is None:
            bodies = [self._model.nbody]
            self._live = LivePictures([motion.file], bodies, SIZE, _CAMERA, renderer_here())
        pictures = []
        for xpos, xquat in zip(motion.xpos, motion.xquat, strict=True):
            self._live.ask([(xpos, xquat)])
            pictures.append(self._live.take().copy())
        return tuple(pictures)

    def close(self) -> None:
        """End the process. Idempotent."""
        if self._live is not None:
            self._live.close()
        self._live = None
