"""A backend whose engine hides its world, to show that the interface fits such an engine.

Its Data owns arrays that are no memory of the engine's. It moves values in before a step
and out after it, keeps copies of what was derived, and converts nothing in place. The
engine behind it is MuJoCo, used as if only functions could reach it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from statemachine.backends import mujoco_backend
from statemachine.backends._mjcf import facts
from statemachine.backends.mujoco_backend import MujocoModel
from statemachine.errors import DivergedError
from statemachine.interface import DERIVED, INPUTS, Contacts, Data, Model, State
from statemachine.interface.checks import check_entries


class HiddenModel(Model):
    """A Model that compiles with MuJoCo, and gives every Data a world of its own."""

    def __init__(self, inner: MujocoModel) -> None:
        names = ("engine_version", "path", "raw", "capabilities", "timestep", "substeps")
        super().__init__(
            backend="hidden", **facts(inner.raw), **{name: getattr(inner, name) for name in names}
        )
        object.__setattr__(self, "inner", inner)

    inner: MujocoModel

    def _make_data(self) -> HiddenData:
        return HiddenData(self)

    def _replace(self, options: dict[str, Any]) -> HiddenModel:
        return HiddenModel(self.inner._replace(options))


class HiddenData(Data):
    """Arrays beside a world that only `_push` and `_pull` reach."""

    __slots__ = ("_derived", "_world")

    _world: Any
    _derived: dict[str, Any]

    def __init__(self, model: HiddenModel) -> None:
        sizes = {"qpos": model.nq, "qvel": model.nv, "ctrl": model.nu}
        object.__setattr__(self, "_world", model.inner._make_data())
        object.__setattr__(self, "_derived", {})
        inputs = {name: np.zeros(size) for name, size in sizes.items()}
        super().__init__(model, self._run, inputs)
        self._pull()
        self._keep()

    @property
    def raw(self) -> Any:
        self._refuse_if_troubled()
        return self._world.raw

    @property
    def time(self) -> float:
        if self._trouble == "closed":
            self._refuse_if_troubled()
        return self._world.time

    def _derive(self, name: str) -> Any:
        self._refuse_if_troubled()
        return self._derived[name]

    def _find_contacts(self) -> Contacts:
        return self._derived["contacts"]

    def _push(self) -> None:
        for name in INPUTS:
            getattr(self._world, name)[:] = getattr(self, name)

    def _pull(self) -> None:
        for name in INPUTS:
            getattr(self, name)[:] = getattr(self._world, name)

    def _keep(self) -> None:
        for name in (*DERIVED, "contacts"):
            value = getattr(self._world, name)
            if isinstance(value, np.ndarray):
                value = value.copy()
                value.setflags(write=False)
            self._derived[name] = value

    def _run(self, nstep: int = 1) -> None:
        # Array contents are checked before such an engine sees them.
        for name in INPUTS:
            check_entries(np.clip(getattr(self, name), -1e9, 1e9), name)
        self._home._check_quaternions(self.qpos)
        self._push()
        try:
            try:
                self._world._advance(nstep)
                self._world._attend()
            except Exception as error:
                self._world._failed(error)
                raise
        except DivergedError as error:
            self._give_up(str(error))
            raise
        self._pull()
        self._keep()

    def _recompute(self) -> None:
        self._push()
        self._world._recompute()
        self._keep()

    def _reset(self, key: int | None) -> None:
        self._world._reset(key)
        self._world._recover()
        self._pull()
        self._keep()

    def _get_state(self) -> State:
        self._push()
        inner = self._world._get_state()
        fingerprint, layout = self._state_layout()
        return State("hidden", inner.engine_version, fingerprint, layout, inner.blob)

    def _set_state(self, state: State) -> None:
        self._world._set_state(state)
        self._world._recover()
        self._pull()
        self._keep()

    def _state_layout(self) -> tuple[str, tuple[tuple[str, int], ...]]:
        fingerprint, layout = self._world._state_layout()
        return f"hidden {fingerprint}", layout

    def _set_time(self, time: float) -> None:
        self._world._set_time(time)

    def _close(self) -> None:
        self._world.close()
        object.__setattr__(self, "_world", None)


def load(path: str | os.PathLike[str], defaults: str = "model") -> HiddenModel:
    """Compile a file."""
    return HiddenModel(mujoco_backend.load(Path(path)))
