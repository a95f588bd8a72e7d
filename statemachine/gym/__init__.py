"""Any robot for reinforcement learning, as Gymnasium's Env and VectorEnv, on any backend.

    import statemachine as sm
    from statemachine.gym import WorldView, make_env, make_vec

    def reward(world: WorldView) -> float:
        return -abs(world.qpos[1])

    env = make_env("pole.xml", reward, backend="pybullet")
    envs = make_vec("pole.xml", 64, reward)

It needs the extra `gym`.
"""

from __future__ import annotations

from importlib.util import find_spec as _find_spec

from ..errors import MissingEngineError as _MissingEngineError
from ..installing import install_command as _install_command

if _find_spec("gymnasium") is None:
    raise _MissingEngineError(
        f"statemachine.gym needs Gymnasium: {_install_command('gym')}", engine="gymnasium"
    )

from .env import RobotEnv, make_env
from .task import Info, Observe, Reset, Reward, Start, Terminated, WorldView, joint_state
from .vector import RobotVectorEnv, make_vec

__all__ = [
    "Info",
    "Observe",
    "Reset",
    "Reward",
    "RobotEnv",
    "RobotVectorEnv",
    "Start",
    "Terminated",
    "WorldView",
    "joint_state",
    "make_env",
    "make_vec",
]
