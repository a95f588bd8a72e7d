"""One world of a task as a gymnasium.Env."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from numpy.typing import ArrayLike

from ..errors import BadInputError, DivergedError, EngineError
from ..installed import DEFAULT
from ..interface import Array, forward, make_data, reset, step
from .render import RENDER_MODES, TaskPictures
from .tasks import Task, make_task

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
    ) -> None:
        """Load the model and make one Data.

        Args:
            task: One of `TASKS`.
            backend: The engine to run it on.
            frame_skip: Timesteps of a control step.
            render_mode: "rgb_array" or None.

        Raises:
            UnknownNameError: There is no such task, backend or render mode.
            MissingEngineError: The engine is not installed here.
            BadInputError: `frame_skip` is no whole number of at least 1.
        """
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
        start = self.task.start(self.np_random)
        self._target = start.target[None]
        reset(self.model, self.data, keyframe=self.task.keyframe)
        if start.qpos is not None:
            self.data.qpos[:] = start.qpos
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
