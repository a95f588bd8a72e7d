"""Tasks for reinforcement learning, as Gymnasium has them, on any backend.

    import gymnasium
    import statemachine.gym

    env = gymnasium.make("statemachine/Reach-v0", backend="pybullet")
    envs = gymnasium.make_vec("statemachine/HeldBox-v0", num_envs=64)

Importing this package registers the tasks. It wants the extra `gym`.
"""

from __future__ import annotations

from importlib.util import find_spec as _find_spec

from ..errors import MissingEngineError as _MissingEngineError

if _find_spec("gymnasium") is None:
    raise _MissingEngineError(
        "the tasks need Gymnasium: pip install 'statemachine-sim[gym]'", engine="gymnasium"
    )

import gymnasium as _gymnasium  # (where it is missing, the sentence above comes first)

from .env import ArmEnv
from .tasks import TASKS, Task
from .vector import ArmVectorEnv

__all__ = ["TASKS", "ArmEnv", "ArmVectorEnv", "Task"]

for _task in TASKS.values():
    _gymnasium.register(
        id=_task.id,
        entry_point=f"{__name__}.env:ArmEnv",
        vector_entry_point=f"{__name__}.vector:ArmVectorEnv",
        max_episode_steps=_task.episode,
        kwargs={"task": _task.name},
    )
