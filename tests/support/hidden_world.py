"""A backend for an engine that keeps a world of its own: the template for one of your own.

The engine is MuJoCo, used as if only functions reached its world. A backend is three things:

- a world (`ExampleWorld`): what the engine does, in the hooks of `HiddenWorld`. `place` puts a
  state, `command` passes ctrl on, `step` takes one engine step, `read` tells where it is,
  `derive` what follows from the moment that the step started from, `close` gives it back. The
  base does the rest: it sees writes, undoes an interrupted step, finds what diverged, keeps
  derived values apart from writes, takes and restores States.
- a Model (`ExampleModel`): the facts, and how a world is opened;
- `load`: from a file to a Model. `statemachine.backends.register` makes it known.

`statemachine.conformance.run` then says what of the contract it keeps.
"""

from __future__ import annotations

import os
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from statemachine.backends import HiddenModel, HiddenWorld, Moment, mujoco_backend
from statemachine.backends.compiled.model import facts
from statemachine.backends.mujoco_backend import MujocoModel
from statemachine.interface import DERIVED, Array, forward, make_data, reset, step


class ExampleWorld(HiddenWorld):
    """A world that `step` alone moves."""

    engine = "MuJoCo"

    def __init__(self, model: MujocoModel) -> None:
        self._model, self._data = model, make_data(model)
        self.raw, self.timestep, self.qpos0 = self._data.raw, model.timestep, model.raw.qpos0
        # What decides the future beside the inputs: where the solver of contacts starts.
        self.memory_layout = (("warmstart", model.nv),)
        self._ctrl = np.zeros(model.nu)

    def place(self, qpos: Array, qvel: Array, memory: Any) -> None:
        """Reset, so that nothing of before is left; the command stays."""
        reset(self._model, self._data)
        self._data.qpos, self._data.qvel, self._data.ctrl = qpos, qvel, self._ctrl
        (self.raw.qacc_warmstart[:],) = memory

    def command(self, ctrl: Array) -> None:
        """Take the command once for all steps until the next one."""
        self._ctrl = self._data.ctrl = ctrl.copy()

    def step(self) -> None:
        """Advance the engine by one step."""
        step(self._model, self._data)

    def read(self) -> tuple[Array, Array]:
        """Return copies: the engine's memory changes with the next step."""
        return self._data.qpos.copy(), self._data.qvel.copy()

    def look(self, moment: Moment) -> None:
        """Compute nothing: this engine can compute what is derived without a step."""
        self.place(moment.qpos, moment.qvel, moment.memory)
        self.command(moment.ctrl)
        forward(self._model, self._data)

    def derive(self, name: str, moment: Moment, read: Any) -> dict[str, Any]:
        """Compute everything at once; a dearer engine computes what was asked for."""
        values = {name: np.array(getattr(self._data, name)) for name in DERIVED}
        return {**values, "contacts": self._data.contacts}

    def close(self) -> None:
        """Free the world; more often than once does no harm."""
        self._data.close()

    @property
    def memory(self) -> tuple[Array]:
        """Of the last step."""
        return (self.raw.qacc_warmstart.copy(),)


class ExampleModel(HiddenModel):
    """Facts of a compiled model, for worlds of the example."""

    inner: MujocoModel

    def __init__(self, inner: MujocoModel) -> None:
        timestep = float(inner.raw.opt.timestep)  # of the engine, not of our step
        engine = inner
        if inner.substeps > 1 or inner.actuator_delay.any():
            # A HiddenData delays commands itself; the world gets those that act.
            engine = cast("MujocoModel", inner.replace(substeps=1, timestep=timestep, latency=0))
        names = ("engine_version", "path", "raw", "capabilities", "timestep", "substeps")
        super().__init__(
            partial(ExampleWorld, engine),
            backend="hidden",
            **facts(inner.raw),
            **{name: getattr(inner, name) for name in names},
            inner=inner,
        )

    def _replace(self, options: dict[str, Any]) -> ExampleModel:
        return ExampleModel(self.inner._replace(options))


def load(path: str | os.PathLike[str], defaults: str = "model") -> ExampleModel:
    """Compile a file."""
    return ExampleModel(mujoco_backend.load(Path(path)))
