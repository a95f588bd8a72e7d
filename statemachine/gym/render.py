"""Pictures of the worlds of a task, each with its target."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from ..drawing.scene import Camera, poses_through
from ..engines.pictures import LivePictures, renderer_here
from ..errors import ClosedDataError, check_name
from ..interface import Array
from .tasks import Task

RENDER_MODES = ("rgb_array",)
SIZE = (480, 360)  # pixels
CAMERA = Camera((0.16, 0.0, 0.16), 1.15, 140.0, -20.0)
_BALL = """
<mujoco><visual><headlight ambient=".8 .8 .8" diffuse=".6 .6 .6" specular="0 0 0"/></visual>
<worldbody><body name="target"><freejoint/><geom size="{}"/></body></worldbody></mujoco>
"""
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)


class TaskPictures:
    """Draws a task's model, in a process that is started with the first picture.

    The target is drawn as a ghost is: a violet ball, as large as what is near enough for a
    success. What stands in front of it hides it.
    """

    def __init__(self, task: Task, mode: str | None) -> None:
        """Draw in a render mode; None for no pictures.

        Raises:
            UnknownNameError: There is no such render mode.
        """
        if mode is not None:
            check_name("render mode", mode, RENDER_MODES)
        self._model, self._radius, self._mode = task.model, task.near, mode
        self._closed = False
        self._live: LivePictures | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def of(self, qpos: Array, targets: Array | None) -> tuple[NDArray[np.uint8], ...] | None:
        """Pictures (height, width, 3) uint8; None without a render mode.

        Args:
            qpos: (n, nq), of each world.
            targets: (n, 3) [m]; None where no episode has begun.

        Raises:
            ResetNeeded: No episode has begun.
            ClosedDataError: They are closed.
        """
        if self._mode is None:
            return None
        if targets is None:
            raise ResetNeeded("call reset before render: no episode has begun")
        if self._closed:
            raise ClosedDataError("this environment is closed: make another")
        poses = poses_through(self._model, qpos)
        if self._live is None:
            renderer = renderer_here()
            self._folder = tempfile.TemporaryDirectory()
            ball = Path(self._folder.name) / "target.xml"
            ball.write_text(_BALL.format(self._radius), encoding="utf-8")
            self._live = LivePictures([self._model.path, ball], SIZE, CAMERA, renderer)
        pictures = []
        for xpos, xquat, target in zip(*poses, targets, strict=True):
            ball_at = np.stack([np.zeros(3), target]), np.array([_UPRIGHT, _UPRIGHT])
            self._live.ask([(xpos, xquat), ball_at])
            pictures.append(self._live.take().copy())
        return tuple(pictures)

    def close(self) -> None:
        """End the process. Idempotent."""
        if self._live is not None:
            self._live.close()
        if self._folder is not None:
            self._folder.cleanup()
        self._live = self._folder = None
        self._closed = True
