"""The room of the made-up engine "hidden": two methods, and of all others none."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from statemachine import Model
from statemachine.engines import RawEngine, raw_engine_of
from statemachine.engines.description.reading import ModelReading
from statemachine.interface import Array


class MyEngine(RawEngine):
    """Its own functions are MuJoCo's."""

    def stepper(
        self, model: Model, qpos: Array, qvel: Array, ctrl: Array
    ) -> AbstractContextManager[Callable[[int], object]]:
        return raw_engine_of("mujoco").stepper(model, qpos, qvel, ctrl)

    def read(self, path: Path) -> ModelReading:
        """Return what the engine makes of a file, under its own name."""
        reading = raw_engine_of("mujoco").read(path)
        return replace(reading, reader=reading.reader.replace("mujoco", self.name))
