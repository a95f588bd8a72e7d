"""Pictures of an environment, drawn in a process of their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..engines.pictures import LivePictures, renderer_here
from ..errors import ClosedDataError, check_name
from ..interface import Array
from ..show.drawing import drawing_of
from ..show.drawing.scene import Camera, Motion, camera_for
from .task import RENDER_MODES, Task

SIZE = (480, 360)  # width and height in pixels
_MARGIN = 1.5  # farther away than where the start fills the picture: a robot moves

Poses = tuple[Array, Array]  # xpos (nbody, 3) and xquat (nbody, 4) of a world


class Pictures:
    """Draws a task's model; the process is started with the first picture."""

    def __init__(self, task: Task, render_mode: str | None, camera: Camera | None) -> None:
        """Draw in a render mode; None for no pictures.

        Raises:
            UnknownNameError: There is no such render mode.
        """
        if render_mode is not None:
            check_name("render mode", render_mode, RENDER_MODES)
        self.wanted = render_mode is not None
        self._task, self._camera = task, camera
        self._process: LivePictures | None = None
        self._closed = False

    def draw(self, poses: Poses) -> NDArray[np.uint8]:
        """Return a picture (height, width, 3) of one world.

        Raises:
            ClosedDataError: The environment is closed.
            MissingEngineError: Nothing here can draw.
        """
        if self._closed:
            raise ClosedDataError("this environment is closed: make another")
        if self._process is None:
            camera = self._camera
            if camera is None:
                camera = self._camera_at_start()
            files = [self._task.model.path]
            self._process = LivePictures(files, SIZE, camera, renderer_here())
        self._process.ask([poses])
        return self._process.take().copy()

    def close(self) -> None:
        """End the process. Idempotent."""
        if self._process is not None:
            self._process.close()
        self._process = None
        self._closed = True

    def _camera_at_start(self) -> Camera:
        xpos, xquat = self._task.start_poses
        start = Motion(drawing_of(self._task.model), xpos[None], xquat[None])
        near = camera_for([start], SIZE[0] / SIZE[1])
        return Camera(near.target, _MARGIN * near.distance, near.azimuth, near.elevation)
