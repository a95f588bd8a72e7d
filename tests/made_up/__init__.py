"""The room of the made-up engine "hidden": two methods, and of all others none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from statemachine import Model
from statemachine.engines import RawEngine, room
from statemachine.engines.auditing import Driver
from statemachine.engines.description.records import Robot


class MyEngine(RawEngine):
    """Its own functions are MuJoCo's."""

    def driver(self, model: Model, seed: int) -> Driver | None:
        return room("mujoco").driver(model, seed)

    def read(self, path: Path, name: str) -> Robot:
        """The description, under the engine's own name."""
        robot = room("mujoco").read(path, name)
        return replace(robot, reader=robot.reader.replace("mujoco", self.name))
