"""Its own functions are MuJoCo's."""

from statemachine.engines.mujoco.audit import driver

__all__ = ["driver"]
