"""Many worlds as a gymnasium.vector.VectorEnv, stepped together."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ..errors import BadInputError, DivergedWarning, check_name, shown
from ..interface import Array, Model
from ..interface.checks import as_count
from ..models import AnyPath
from ..show.drawing.scene import Camera
from ..worlds import forward, make_worlds, reset, step
from .pictures import Pictures
from .task import (
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
    unwritable,
)

Flags = NDArray[np.bool_]


class RobotVectorEnv(VectorEnv[Array, ArrayLike, NDArray[Any]]):
    """n worlds, from `make_vec`: world i is a `RobotEnv` with seed + i, bit for bit.

    Observations, actions, infos and the ways to start anew are those of Gymnasium's own
    `SyncVectorEnv`; what each world returns is in `RobotEnv`. A world that diverges is truncated
    and starts anew as any other that ends, and the others go on.

    Attributes:
        task: The user's functions and the spaces.
        model, worlds: The Model and the Worlds.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int,
        workers: int | None,
        autoreset_mode: str | AutoresetMode,
        render_mode: str | None,
        camera: Camera | None,
    ) -> None:
        """Make the worlds; `make_vec` has the arguments."""
        if not isinstance(autoreset_mode, AutoresetMode):
            check_name("autoreset mode", autoreset_mode, [mode.value for mode in AutoresetMode])
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.num_envs = n = as_count(num_envs, "num_envs")
        self.task, self.model = task, task.model
        self.worlds = make_worlds(task.model, n, workers=workers)
        self.render_mode = render_mode
        self._pictures = Pictures(task, render_mode, camera)
        self.metadata = {**task.metadata, "autoreset_mode": self.autoreset_mode}
        self.single_observation_space = task.observation_space
        self.single_action_space = task.action_space
        self.observation_space = batch_space(self.single_observation_space, n)
        self.action_space = batch_space(self.single_action_space, n)
        # One for each world: what `np_random` and `np_random_seed` of the base class give.
        generators, seeds = zip(*(seeding.np_random() for _ in range(n)), strict=True)
        self._np_random: Any = list(generators)
        self._np_random_seed: Any = list(seeds)
        self._goals = [np.empty(0)] * n
        self._observations = np.zeros((n, *self.single_observation_space.shape))
        self._poses = np.zeros((n, self.model.nbody, 3)), np.zeros((n, self.model.nbody, 4))
        self._steps = np.zeros(n, dtype=np.int64)
        self._ended = np.zeros(n, dtype=np.bool_)
        self._begun = np.zeros(n, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode in all worlds, or in those of options["reset_mask"].

        Args:
            seed: World i gets seed + i, or one of its own from a list; None goes on drawing.
            options: "reset_mask" is (n,) bools.

        Raises:
            BadInputError: There are not as many seeds, the mask is invalid, or a function of the
                user returned what cannot be.
        """
        mask = np.ones(self.num_envs, dtype=np.bool_)
        if options and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
                raise BadInputError(
                    f"reset_mask takes {self.num_envs} bools, one of them True; got {shown(mask)}"
                )
        seeds = self._seeds(seed)
        for i in _numbers(mask):
            if seeds[i] is not None:
                self._np_random[i], self._np_random_seed[i] = seeding.np_random(seeds[i])
        infos: dict[str, Any] = {}
        for i, info in self._start(mask).items():
            infos = self._add_info(infos, info, i)
        return self._observations.copy(), infos

    def step(
        self, actions: ArrayLike
    ) -> tuple[Array, Array, NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Hold a command in each world for `frame_skip` timesteps.

        Raises:
            BadInputError: The actions have another shape or an entry that is not finite, or a
                function of the user returned what cannot be.
            ResetNeeded: `reset` was never called, or not for a world that ended.
        """
        if not self._begun.all():
            raise ResetNeeded("call reset before step: no episode has begun")
        ctrl = self.task.ctrl(actions, (self.num_envs, self.model.nu))
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            ended = _numbers(self._ended)
            raise ResetNeeded(f"worlds {shown(ended)} have ended: reset them with a reset_mask")
        anew = self._ended  # none but in the mode NEXT_STEP
        rewards, terminated, truncated, facts = self._advance(~anew, ctrl)
        if anew.any():
            facts |= self._start(anew)
        ended = terminated | truncated
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            for i in _numbers(ended):
                final = {"final_obs": self._observations[i].copy(), "final_info": facts[i]}
                infos = self._add_info(infos, final, i)
            facts |= self._start(ended)
        else:
            self._ended = ended
        for i in range(self.num_envs):
            infos = self._add_info(infos, facts[i], i)
        return self._observations.copy(), rewards, terminated, truncated, infos

    def render(self) -> Any:
        """Return a picture (height, width, 3) uint8 of each world; None without a render mode.

        Raises:
            ResetNeeded: `reset` was never called.
        """
        if not self._pictures.wanted:
            return None
        if not self._begun.all():
            raise ResetNeeded("call reset before render: no episode has begun")
        return tuple(self._pictures.draw(poses) for poses in zip(*self._poses, strict=True))

    def close_extras(self, **kwargs: Any) -> None:
        """Give back threads, processes and memory."""
        self.worlds.close()
        self._pictures.close()

    def _advance(
        self, going: Flags, ctrl: Array
    ) -> tuple[Array, Flags, Flags, dict[int, dict[str, Any]]]:
        """Step some worlds: rewards, terminated, truncated (n,), and the info of each."""
        worlds, task = self.worlds, self.task
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros_like(going), np.zeros_like(going)
        facts: dict[int, dict[str, Any]] = {}
        worlds.ctrl = np.where(going[:, None], ctrl, worlds.ctrl)
        with warnings.catch_warnings():  # `infos` tell of it
            warnings.simplefilter("ignore", DivergedWarning)
            step(worlds, task.frame_skip, ids=going, forward=True)
        self._steps += going
        diverged = worlds.diverged
        world_at = self._worlds_of_now()
        for i in _numbers(going):
            if i not in diverged:
                world = world_at(i)
                observation = task.observation(world)
                if not outside(observation):
                    self._observations[i] = observation
                    rewards[i], terminated[i] = task.outcome(world)
                    truncated[i] = task.out_of_time(int(self._steps[i]))
                    facts[i] = task.facts(world)
                    continue
            truncated[i] = True
            facts[i] = {"diverged": True}
        self._keep_poses(i for i, info in facts.items() if not info["diverged"])
        return rewards, terminated, truncated, facts

    def _start(self, which: Flags) -> dict[int, dict[str, Any]]:
        """Start an episode in some worlds; the info of each."""
        worlds, task, numbers = self.worlds, self.task, _numbers(which)
        starts = [task.drawn_start(self._np_random[i]) for i in numbers]
        reset(worlds, ids=which, keyframe=task.keyframe)
        for i, start in zip(numbers, starts, strict=True):
            self._goals[i] = np.asarray(start.goal)
            if start.qpos is not None:
                worlds.qpos[i] = start.qpos
            if start.qvel is not None:
                worlds.qvel[i] = start.qvel
        forward(worlds, ids=which)
        world_at = self._worlds_of_now()
        facts: dict[int, dict[str, Any]] = {}
        for i in numbers:
            world = world_at(i)
            self._observations[i] = task.observation(world)
            facts[i] = task.facts(world)
        self._keep_poses(numbers)
        self._steps[which] = 0
        self._ended = self._ended & ~which
        self._begun |= which
        return facts

    def _worlds_of_now(self) -> Callable[[int], WorldView]:
        """Return a function from a world's number to what is read of it at this moment."""
        arrays: dict[str, Array] = {}

        def world_at(i: int) -> WorldView:
            def read(name: str) -> Array:
                if name not in arrays:
                    arrays[name] = unwritable(getattr(self.worlds, name))
                return arrays[name][i]

            return WorldView(self.model, self._goals[i], read)

        return world_at

    def _keep_poses(self, numbers: Iterable[int]) -> None:
        if self._pictures.wanted:
            rows = list(numbers)
            xpos, xquat = self._poses
            xpos[rows] = self.worlds.xpos[rows]
            xquat[rows] = self.worlds.xquat[rows]

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + world for world in range(self.num_envs)]
        listed = isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str)
        if not listed or len(seed) != self.num_envs:
            got = len(seed) if listed else shown(seed)
            raise BadInputError(f"seed takes {self.num_envs} seeds, or one; got {got}")
        return [int(own) if isinstance(own, np.integer) else own for own in seed]


def make_vec(
    model: Model | AnyPath,
    num_envs: int,
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
    workers: int | None = None,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    render_mode: str | None = None,
    camera: Camera | None = None,
) -> RobotVectorEnv:
    """Make a Gymnasium vector environment of many worlds of any robot, stepped together.

    World i is what `make_env` with the same arguments gives for seed + i, bit for bit. The
    functions are called for each world by itself, in this process.

    Args:
        model: As in `make_env`; so all that is not here.
        num_envs: Number of worlds, at least 1.
        reward: See `make_env`.
        observe: See `make_env`.
        backend: See `make_env`.
        reset: See `make_env`.
        terminated: See `make_env`.
        info: See `make_env`.
        keyframe: See `make_env`.
        frame_skip: See `make_env`.
        max_episode_steps: See `make_env`.
        ctrl_range: See `make_env`.
        workers: Threads at most, on MuJoCo; no result depends on it.
        autoreset_mode: When a world that ended starts anew: in the next step, in the same one, or
            when `reset` is called with options["reset_mask"].
        render_mode: See `make_env`.
        camera: See `make_env`.

    Raises:
        UnknownNameError: As in `make_env`, or there is no such mode to start anew.
        MissingEngineError: The engine is not installed here.
        BadInputError: As in `make_env`, or `num_envs` or `workers` is not at least 1.
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
    return RobotVectorEnv(task, num_envs, workers, autoreset_mode, render_mode, camera)


def _numbers(flags: Flags) -> list[int]:
    return np.flatnonzero(flags).tolist()
