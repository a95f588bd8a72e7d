"""The room of the made-up engine "hidden": two methods, and of all others none."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from statemachine import Model
from statemachine.engines import RawEngine, room
from statemachine.engines.description.records import Robot
from statemachine.interface import Array


class MyEngine(RawEngine):
    """Its own functions are MuJoCo's."""

    def stepper(
        self, model: Model, qpos: Array, qvel: Array, ctrl: Array
    ) -> AbstractContextManager[Callable[[int], object]]:
        return room("mujoco").stepper(model, qpos, qvel, ctrl)

    def read(self, path: Path, name: str) -> Robot:
        """The description, under the engine's own name."""
        robot = room("mujoco").read(path, name)
        return replace(robot, reader=robot.reader.replace("mujoco", self.name))
