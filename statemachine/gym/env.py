"""One world as a gymnasium.Env."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike

from ..errors import BadInputError, DivergedError, EngineError
from ..interface import Array, Model, forward, make_data, step
from ..models import AnyPath
from ..show.drawing.scene import Camera
from .pictures import Pictures, Poses
from .task import (
    RENDER_MODES,
    Info,
    Observe,
    Reset,
    Reward,
    Task,
    Terminated,
    WorldView,
    joint_state,
    no_end,
    no_facts,
    outside,
    unchanged_start,
    world_of,
)


class RobotEnv(gymnasium.Env[Array, ArrayLike]):
    """One world, from `make_env`; see `gymnasium.Env` for what each method returns.

    A simulation that breaks down, or an observation beyond the space, truncates the episode: the
    reward is 0, the observation the last one before, and info["diverged"] is True.

    Attributes:
        task: The user's functions and the spaces.
        model, data: The Model and the Data.
        world: What the functions read.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012
    world: WorldView

    def __init__(self, task: Task, render_mode: str | None, camera: Camera | None) -> None:
        """Make one Data; `make_env` has the arguments."""
        self.task, self.model = task, task.model
        self.data = make_data(task.model)
        self.render_mode = render_mode
        self.metadata = task.metadata
        self.observation_space, self.action_space = task.observation_space, task.action_space
        self._pictures = Pictures(task, render_mode, camera)
        self._poses: Poses | None = None
        self._steps = 0
        self._begun = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode; the seed decides it.

        Raises:
            BadInputError: A function of the user returned what cannot be.
        """
        super().reset(seed=seed)
        goal = self.task.begin(self.data, self.np_random)
        self.world = world_of(self.model, self.data, goal)
        self._observation = self.task.observation(self.world)
        self._keep_poses()
        self._steps = 0
        self._begun = True
        return self._observation.copy(), self.task.facts(self.world)

    def step(self, action: ArrayLike) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Hold a command for `frame_skip` timesteps.

        Raises:
            BadInputError: The action has another shape or an entry that is not finite, or a
                function of the user returned what cannot be.
            ResetNeeded: `reset` was never called.
        """
        if not self._begun:
            raise ResetNeeded("call reset before step: no episode has begun")
        task, world = self.task, self.world
        self.data.ctrl = task.ctrl(action, (self.model.nu,))
        self._steps += 1
        try:
            step(self.model, self.data, task.frame_skip)
            forward(self.model, self.data)
        except (DivergedError, EngineError, BadInputError):
            return self._diverged()
        observation = task.observation(world)
        if outside(observation):
            return self._diverged()
        self._observation = observation
        self._keep_poses()
        reward, terminated = task.outcome(world)
        truncated = task.out_of_time(self._steps)
        return observation.copy(), reward, terminated, truncated, task.facts(world)

    def render(self) -> Any:
        """Return a picture (height, width, 3) uint8; None without a render mode.

        Raises:
            ResetNeeded: `reset` was never called.
        """
        if not self._pictures.wanted:
            return None
        if self._poses is None:
            raise ResetNeeded("call reset before render: no episode has begun")
        return self._pictures.draw(self._poses)

    def close(self) -> None:
        """Give back what the engine holds. Idempotent."""
        self.data.close()
        self._pictures.close()

    def _diverged(self) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        return self._observation.copy(), 0.0, False, True, {"diverged": True}

    def _keep_poses(self) -> None:
        if self._pictures.wanted:
            self._poses = self.data.xpos.copy(), self.data.xquat.copy()


def make_env(
    model: Model | AnyPath,
    reward: Reward,
    observe: Observe = joint_state,
    *,
    backend: str | None = None,
    reset: Reset = unchanged_start,
    terminated: Terminated = no_end,
    info: Info = no_facts,
    keyframe: int | str | None = None,
    frame_skip: int = 1,
    max_episode_steps: int | None = None,
    ctrl_range: ArrayLike | None = None,
    render_mode: str | None = None,
    camera: Camera | None = None,
) -> RobotEnv:
    """Make a Gymnasium environment of any robot.

    An action (nu,) float32 in [-1, 1] is the command that is held for a control step: -1 and 1 are
    the ends of `ctrl_range`, beyond them the nearest counts. An observation is float64, the type of
    the state, so that no bit is lost. One seed gives the same bits on one engine.

    Args:
        model: A Model, or the name or path of one as `load` takes it.
        reward: From the world after a control step to a finite number.
        observe: From a world to finite numbers, always of one shape; by default qpos and qvel
            (nq + nv,), one after the other.
        backend: The engine, where `model` is a name or path; MuJoCo by default.
        reset: Draws where an episode starts, from the Model and NumPy's generator of the seed. By
            default it is the keyframe, or the default state, itself.
        terminated: Whether the episode ends in a world; by default it never does.
        info: Further facts about a world, by name. `diverged` is added.
        keyframe: Number or name of a keyframe that is put in before what `reset` draws.
        frame_skip: Timesteps of a control step.
        max_episode_steps: Control steps after which an episode is truncated; None for no end.
        ctrl_range: (nu, 2) the commands that the actions -1 and 1 stand for [unit of the
            actuator]; by default `actuator_ctrlrange`.
        render_mode: "rgb_array", 480 × 360 pixels, or None.
        camera: Where it is seen from; by default such that the start is in the picture.

    Raises:
        UnknownNameError: There is no such model, backend, keyframe or render mode.
        MissingEngineError: The engine is not installed here.
        BadInputError: A function returned what cannot be, or is none; the model has no actuators,
            or one without a `ctrlrange` and no `ctrl_range` is given; a number is invalid.
    """
    task = Task(
        model,
        reward,
        observe,
        backend=backend,
        reset=reset,
        terminated=terminated,
        info=info,
        keyframe=keyframe,
        frame_skip=frame_skip,
        max_episode_steps=max_episode_steps,
        ctrl_range=ctrl_range,
    )
    return RobotEnv(task, render_mode, camera)
