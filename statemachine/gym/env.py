"""One world of a task as a gymnasium.Env, and pictures of worlds of a task with their targets."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from ..drawing.scene import Camera, poses_through
from ..engines.pictures import LivePictures, renderer_here
from ..errors import BadInputError, ClosedDataError, DivergedError, EngineError, check_name
from ..installed import DEFAULT
from ..interface import Array, forward, make_data, reset, step
from .tasks import Task, make_task, refuse_unknown

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


FRAME_SKIP = 4  # timesteps of 5 ms: 50 commands a second


class ArmEnv(gymnasium.Env[Array, ArrayLike]):
    """One world of a task; see `gymnasium.Env` for what each method returns.

    An action (nu,) in [-1, 1] is the command of the servos, -1 and 1 the ends of `ctrlrange`.
    It is float32, as in Gymnasium's own MuJoCo tasks. An observation is float64, the type of
    the state: no bit is lost. It is of the present moment: after the last timestep `forward`
    is called, once a control step.

    `info` has distance [m], is_success, and diverged: whether the simulation broke down, or the
    state left the observation space. Then the episode is truncated, as the task did not end,
    and the observation is the last one before.

    Attributes:
        task: What is observed and rewarded.
        model, data: The Model and the Data.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012

    def __init__(
        self,
        task: str,
        backend: str = DEFAULT,
        frame_skip: int = FRAME_SKIP,
        render_mode: str | None = None,
        **unknown: Any,
    ) -> None:
        """Load the model and make one Data.

        Args:
            task: One of `TASKS`.
            backend: The engine to run it on.
            frame_skip: Timesteps of a control step.
            render_mode: "rgb_array" or None.
            **unknown: Is refused: a task has no further options, and no other model.

        Raises:
            UnknownNameError: There is no such task, backend, render mode or option.
            MissingEngineError: The engine is not installed here.
            BadInputError: `frame_skip` is not a whole number of at least 1.
        """
        refuse_unknown(unknown, ("backend", "frame_skip", "render_mode"))
        self.task = make_task(task, backend, frame_skip)
        self.model, self.data = self.task.model, make_data(self.task.model)
        self.render_mode = render_mode
        self.metadata = metadata_of(self.task)
        self.observation_space = Box(self.task.low, self.task.high, dtype=np.float64)
        self.action_space = Box(-1, 1, (self.model.nu,), dtype=np.float32)
        self._pictures = TaskPictures(self.task, render_mode)
        self._target: Array | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode; the seed decides it, on every backend in the same way."""
        super().reset(seed=seed)
        qpos, target = self.task.start(self.np_random)
        self._target = target[None]
        reset(self.model, self.data, keyframe=self.task.keyframe)
        if qpos is not None:
            self.data.qpos[:] = qpos
        forward(self.model, self.data)
        self._seen = self.task.observed(*self._rows())
        return self._seen[0].copy(), self._judged()[1]

    def step(self, action: ArrayLike) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold a command for `frame_skip` timesteps.

        Raises:
            BadInputError: The action has another shape or an entry that is not finite.
            ResetNeeded: `reset` was never called.
        """
        if self._target is None:
            raise ResetNeeded("call reset before step: no episode has begun")
        self.data.ctrl = self.task.ctrl(action, (self.model.nu,))
        try:
            step(self.model, self.data, self.task.frame_skip)
            forward(self.model, self.data)
        except (DivergedError, EngineError, BadInputError):
            diverged = True
        else:
            seen = self.task.observed(*self._rows())
            diverged = bool(self.task.outside(seen)[0])
            self._seen = self._seen if diverged else seen
        (reward, terminated), info = self._judged(diverged)
        return self._seen[0].copy(), reward, terminated, diverged, info

    def render(self) -> Any:
        """A picture (height, width, 3) uint8 of the present moment; None without a render mode."""
        pictures = self._pictures.of(self.data.qpos[None], self._target)
        return None if pictures is None else pictures[0]

    def close(self) -> None:
        """Give back what the engine holds. Idempotent."""
        self.data.close()
        self._pictures.close()

    def _rows(self) -> tuple[Array, Array, Array, Array]:
        assert self._target is not None
        tip = self.data.site_xpos[self.task.tip]
        return self.data.qpos[None], self.data.qvel[None], tip[None], self._target

    def _judged(self, diverged: bool = False) -> tuple[tuple[float, bool], dict[str, Any]]:
        outcome = self.task.outcome(self._seen)
        info = {
            "distance": float(outcome.distance[0]),
            "is_success": bool(outcome.success[0]),
            "diverged": diverged,
        }
        return (float(outcome.reward[0]), bool(outcome.terminated[0])), info


def metadata_of(task: Task) -> dict[str, Any]:
    """What Gymnasium is told of a task: as many pictures a second as commands."""
    control_step = task.model.timestep * task.frame_skip  # s
    return {"render_modes": list(RENDER_MODES), "render_fps": round(1 / control_step)}
