"""Many worlds of a task as a gymnasium.vector.VectorEnv, stepped together."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ..errors import BadInputError, DivergedWarning, check_name, shown
from ..installed import DEFAULT
from ..interface import Array
from ..interface.options import as_count
from ..worlds import forward, make_worlds, reset, step
from .env import FRAME_SKIP, TaskPictures, metadata_of
from .tasks import make_task, refuse_unknown

_SEEN = "site_xpos"
Flags = NDArray[np.bool_]


class ArmVectorEnv(VectorEnv[Array, ArrayLike, NDArray[Any]]):
    """n worlds of a task, on `statemachine.worlds`: world i is `ArmEnv` with seed + i, bit for bit.

    Observations, actions, infos and the ways to start anew are those of Gymnasium's own
    `SyncVectorEnv`; what each world returns is in `ArmEnv`. A world that diverges is truncated
    and starts anew as any other that ends, and the others go on.

    Attributes:
        task: What is observed and rewarded.
        model, worlds: The Model and the Worlds.
    """

    def __init__(
        self,
        num_envs: int,
        task: str,
        backend: str = DEFAULT,
        frame_skip: int = FRAME_SKIP,
        max_episode_steps: int | None = None,
        workers: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **unknown: Any,
    ) -> None:
        """Load the model and make the worlds.

        Args:
            num_envs: Number of worlds, at least 1.
            task: One of `TASKS`.
            backend: The engine to run it on.
            frame_skip: Timesteps of a control step.
            max_episode_steps: Control steps after which a world is truncated; None for no end.
            workers: Threads at most; no result depends on it.
            autoreset_mode: When a world that ended starts anew: in the next step, in the same
                one, or when `reset` is called with options["reset_mask"].
            render_mode: "rgb_array" or None.
            **unknown: Is refused: a task has no further options, and no other model.

        Raises:
            UnknownNameError: There is no such task, backend, mode of reset or of rendering, option.
            MissingEngineError: The engine is not installed here.
            BadInputError: A number is not a whole number of at least 1.
        """
        options = ("backend", "frame_skip", "workers", "autoreset_mode", "render_mode")
        refuse_unknown(unknown, options)
        modes = [mode.value for mode in AutoresetMode]
        if not isinstance(autoreset_mode, AutoresetMode):
            check_name("autoreset mode", autoreset_mode, modes)
        self.num_envs = as_count(num_envs, "num_envs")
        most = max_episode_steps
        self._most = np.inf if most is None else as_count(most, "max_episode_steps")
        self.task = make_task(task, backend, frame_skip)
        self.model = self.task.model
        self._pictures = TaskPictures(self.task, render_mode)
        self.worlds = make_worlds(self.model, self.num_envs, workers=workers, derived=(_SEEN,))
        self.render_mode = render_mode
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**metadata_of(self.task), "autoreset_mode": self.autoreset_mode}
        self.single_observation_space = Box(self.task.low, self.task.high, dtype=np.float64)
        self.single_action_space = Box(-1, 1, (self.model.nu,), dtype=np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        # One for each world: what `np_random` and `np_random_seed` of the base class give.
        generators, seeds = zip(*(seeding.np_random() for _ in range(self.num_envs)), strict=True)
        self._np_random: Any = list(generators)
        self._np_random_seed: Any = list(seeds)
        self._targets = np.zeros((self.num_envs, 3))
        self._seen = np.zeros((self.num_envs, len(self.task.low)))
        self._steps = np.zeros(self.num_envs, dtype=np.int64)
        self._ended = np.zeros(self.num_envs, dtype=np.bool_)
        self._begun = np.zeros(self.num_envs, dtype=np.bool_)

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
            BadInputError: There are not as many seeds, or the mask is invalid.
        """
        mask = np.ones(self.num_envs, dtype=np.bool_)
        if options and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.shape != (self.num_envs,) or mask.dtype != np.bool_ or not mask.any():
                raise BadInputError(
                    f"reset_mask wants {self.num_envs} bools, one of them True; got {shown(mask)}"
                )
        seeds = self._seeds(seed)
        for world in np.flatnonzero(mask).tolist():
            if seeds[world] is not None:
                self._np_random[world], self._np_random_seed[world] = seeding.np_random(
                    seeds[world]
                )
        self._start(mask)
        return self._seen.copy(), self._infos(mask, np.zeros_like(mask))

    def step(
        self, actions: ArrayLike
    ) -> tuple[Array, Array, NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Hold a command in each world for `frame_skip` timesteps.

        Raises:
            BadInputError: The actions have another shape or an entry that is not finite.
            ResetNeeded: `reset` was never called.
        """
        if not self._begun.all():
            raise ResetNeeded("call reset before step: no episode has begun")
        ctrl = self.task.ctrl(actions, (self.num_envs, self.model.nu))
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            ended = np.flatnonzero(self._ended).tolist()
            raise ResetNeeded(f"worlds {shown(ended)} have ended: reset them with a reset_mask")
        anew = self._ended
        diverged = self._advance(~anew, ctrl)
        if anew.any():  # as the mode NEXT_STEP has it
            self._start(anew)
        outcome = self.task.outcome(self._seen)
        rewards = np.where(anew, 0.0, outcome.reward)
        terminated = outcome.terminated & ~anew
        truncated = (diverged | (self._steps >= self._most)) & ~anew
        infos: dict[str, Any] = {}
        ended = terminated | truncated
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            final = self._infos(ended, diverged)
            infos = {"final_obs": np.full(self.num_envs, None, dtype=object), "final_info": final}
            for world in np.flatnonzero(ended).tolist():
                infos["final_obs"][world] = self._seen[world].copy()
            infos |= {"_final_obs": ended.copy(), "_final_info": ended.copy()}
            self._start(ended)
            diverged = diverged & ~ended
        else:
            self._ended = ended
        infos |= self._infos(np.ones(self.num_envs, dtype=np.bool_), diverged)
        return self._seen.copy(), rewards, terminated, truncated, infos

    def render(self) -> Any:
        """A picture (height, width, 3) uint8 of each world; None without a render mode.

        Raises:
            ResetNeeded: `reset` was never called.
        """
        targets = self._targets if self._begun.all() else None
        return self._pictures.of(self.worlds.qpos, targets)

    def close_extras(self, **kwargs: Any) -> None:
        """Give back threads, processes and memory."""
        self.worlds.close()
        self._pictures.close()

    def _advance(self, going: Flags, ctrl: Array) -> Flags:
        """Step worlds, and see where they are; which diverged. Of these the last is kept."""
        worlds = self.worlds
        worlds.ctrl = np.where(going[:, None], ctrl, worlds.ctrl)
        with warnings.catch_warnings():  # `infos` tell of it
            warnings.simplefilter("ignore", DivergedWarning)
            step(worlds, self.task.frame_skip, ids=going, forward=True)
        seen = self._observed()
        diverged = self.task.outside(seen)
        diverged[list(worlds.diverged)] = True
        diverged &= going
        np.copyto(self._seen, seen, where=(going & ~diverged)[:, None])
        self._steps += going
        return diverged

    def _start(self, which: Flags) -> None:
        """Start an episode in some worlds."""
        worlds, task = self.worlds, self.task
        reset(worlds, ids=which, keyframe=task.keyframe)
        for world in np.flatnonzero(which).tolist():
            qpos, self._targets[world] = task.start(self._np_random[world])
            if qpos is not None:
                worlds.qpos[world] = qpos
        forward(worlds, ids=which)
        np.copyto(self._seen, self._observed(), where=which[:, None])
        self._steps[which] = 0
        self._ended = self._ended & ~which
        self._begun |= which

    def _observed(self) -> Array:
        worlds = self.worlds
        tips = worlds.site_xpos[:, self.task.tip]
        return self.task.observed(worlds.qpos, worlds.qvel, tips, self._targets)

    def _infos(self, which: Flags, diverged: Flags) -> dict[str, Any]:
        """What `ArmEnv` has in its info, for some worlds, as Gymnasium batches it."""
        outcome = self.task.outcome(self._seen)
        facts = {
            "distance": np.where(which, outcome.distance, 0.0),
            "is_success": outcome.success & which,
            "diverged": diverged & which,
        }
        return {key: value for name, fact in facts.items()
                for key, value in ((name, fact), (f"_{name}", which.copy()))}  # fmt: skip

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + world for world in range(self.num_envs)]
        listed = isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str)
        if not listed or len(seed) != self.num_envs:
            got = len(seed) if listed else shown(seed)
            raise BadInputError(f"seed wants {self.num_envs} seeds, or one; got {got}")
        return [int(own) if isinstance(own, np.integer) else own for own in seed]
