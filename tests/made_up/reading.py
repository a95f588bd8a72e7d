"""What it makes of a file is what MuJoCo makes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from statemachine.description.records import Robot
from statemachine.engines.mujoco import reading


def read(path: Path, name: str) -> Robot:
    """The description, under the engine's own name."""
    robot = reading.read(path, name)
    return replace(robot, reader=robot.reader.replace("mujoco", "hidden"))
