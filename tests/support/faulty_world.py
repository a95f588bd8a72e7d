"""A backend whose steps can be told to fail: the first number of ctrl says how."""

from __future__ import annotations

import time
import weakref
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from statemachine.backends import HiddenModel, mujoco_backend
from statemachine.backends.mujoco_backend import MujocoModel
from statemachine.errors import EngineError

from .hidden_world import ExampleModel, ExampleWorld

RAISE, SLOW, DIVERGE = 0.101, 0.102, 0.103
MOST = 16  # worlds that a process can hold: those of Data, and of each Model one with a look-ahead


class FaultyError(Exception):
    """What the engine raises."""


class FaultyWorld(ExampleWorld):
    """An example that does what it is told."""

    engine = "Faulty"
    errors = (FaultyError,)
    alive: ClassVar = weakref.WeakSet[Any]()

    def __init__(self, model: MujocoModel) -> None:
        if len(FaultyWorld.alive) >= MOST:
            raise EngineError(f"{MOST} worlds at most")
        FaultyWorld.alive.add(self)
        super().__init__(model)

    def step(self) -> None:
        what = float(self._ctrl[0])
        if what == RAISE:
            raise FaultyError("it broke")
        if what == SLOW:
            time.sleep(0.001)
        elif what == DIVERGE:
            self.raw.qpos[1] = float("nan")
        super().step()

    def close(self) -> None:
        FaultyWorld.alive.discard(self)
        super().close()


def load(path: Any, defaults: str = "model") -> HiddenModel:
    """Compile a file."""
    return FaultyModel(mujoco_backend.load(Path(path)))


class FaultyModel(ExampleModel):
    """A Model of such worlds."""

    def __init__(self, inner: MujocoModel) -> None:
        super().__init__(inner)
        vars(self)["_open_world"] = partial(FaultyWorld, inner)

    def _replace(self, options: dict[str, Any]) -> FaultyModel:
        return FaultyModel(self.inner._replace(options))
