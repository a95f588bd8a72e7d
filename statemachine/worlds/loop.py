"""Worlds of engines that step one world at a time: a Data for each, stepped one after the other."""

from __future__ import annotations

import os
import pickle
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import BusyDataError
from ..interface import (
    INPUTS,
    MOCAP,
    Array,
    Data,
    Ints,
    Model,
    State,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ..interface.exclusive_access import with_exclusive_access
from ..interface.records import Errors, StateLayout
from ..interface.worlds import WRITABLE, Worlds, check_memory, without
from ..processes import resident_memory


class LoopWorlds(Worlds):
    """Worlds in a loop of this process.

    A derived array is computed when it is read for the first time after a call: what nobody
    reads is not. After Ctrl-C each world has done all of the call or nothing of it, as its `time`
    tells.
    """

    def __init__(
        self,
        model: Model,
        n: int,
        derived: tuple[str, ...],
        options: Mapping[str, Sequence[Any]],
    ) -> None:
        """Make a Data for each world.

        Args:
            model: The Model.
            n: Number of worlds.
            derived: Names of the derived arrays.
            options: Checked options of `Model.replace`, each with a value for each world.

        Raises:
            EngineError: There is not the memory, or the engine's own place, for all worlds.
        """
        arrays = _arrays_of(model, n, derived)
        self._data: list[Data] = []
        self._inputs: list[list[tuple[Array, Array]]] = []  # of a Data, and its row of all
        super().__init__(model, n, 1, derived, arrays)
        # `__getattr__` is asked for them, until they are as they are to be: zero now.
        self._derived_arrays = {name: vars(self).pop(name) for name in derived}
        self._writable = {name: arrays[name] for name in derived}  # the same memory
        self._fresh = list(derived)
        try:
            with warnings.catch_warnings(action="ignore"):  # of each variant of a Model that told
                self._make(options)
        except BaseException:
            self._close()
            raise

    def _make(self, options: Mapping[str, Sequence[Any]]) -> None:
        """Make all Data; what one takes predicts what the rest will."""
        each = 0  # bytes: the most that one took, for it may be given what others gave back
        variants: dict[bytes, Model] = {}  # by the options that they differ in
        for world in range(self.n):
            before = resident_memory()
            own = {name: values[world] for name, values in options.items()}
            key = pickle.dumps(own)
            if key not in variants:
                variants[key] = self.model.replace(**own) if own else self.model
            data = make_data(variants[key])
            self._data.append(data)
            names = (*INPUTS, *MOCAP)
            self._inputs.append([(getattr(data, k), getattr(self, k)[world]) for k in names])
            self._take(world)
            grown = resident_memory() - before
            if world and grown > each:  # the first pays for what all share
                each = grown
                check_memory(self.n, each, made=world + 1)

    def _model_of(self, world: int) -> Model:
        return self._data[world].model

    def _close(self) -> None:
        for data in self._data:
            data.close()
        self._derived_arrays.clear()
        self._writable.clear()

    def _put(self, world: int) -> None:
        """Copy what the arrays have into a Data, bit by bit: it sees itself what was written."""
        data, time = self._data[world], self.time.item(world)
        for own, row in self._inputs[world]:
            own[:] = row
        if time != data.time:
            data.time = time

    def _take(self, world: int) -> None:
        """Copy what a Data has into the arrays: in a line without a call, where no signal comes."""
        time, all_times = self._data[world].time, self.time
        (qpos, q), (qvel, v), (ctrl, u), (where, w), (turn, t) = self._inputs[world]
        q[:], v[:], u[:], w[:], t[:], all_times[world] = qpos, qvel, ctrl, where, turn, time

    def _run(self, ids: Ints, call: Callable[[int, Model, Data], object]) -> Errors:
        """Call something that lets time pass, or reads the inputs, for each of these worlds.

        Returns:
            By the number of its world, what was raised: that ends this world.
        """
        errors: Errors = {}
        self._forget_derived()
        for world in ids.tolist():
            data, begun = self._data[world], False
            try:
                self._put(world)
                begun = True
                call(world, data.model, data)
            except Exception as error:
                errors[world] = error
            finally:
                if begun:  # interrupted or not: the Data is where it was, or where it was to be
                    self._take(world)
        return errors

    def _overwrite(self, ids: Ints, call: Callable[[int, Model, Data], object]) -> None:
        """Call something for which it does not matter what is in the arrays."""
        self._forget_derived()
        for world in ids.tolist():
            data = self._data[world]
            try:
                call(world, data.model, data)
            finally:
                self._take(world)

    def _forget_derived(self) -> None:
        """Forget the derived arrays that were read: they belong to a state that has passed."""
        self._fresh = []
        for name in self.derived:
            vars(self).pop(name, None)

    def __getattr__(self, name: str) -> Any:  # only for what is not there
        if name not in vars(self).get("_derived_arrays", ()):
            return super().__getattr__(name)
        self._refuse_if_unusable()
        if self._process != os.getpid():
            raise BusyDataError(f"{name!r} of these Worlds is known to the process that made them")
        return with_exclusive_access(self, self._fetched, name)

    def _fetched(self, name: str) -> Array:
        """Return a derived array as it is now; the rows of worlds that have diverged stay."""
        if name not in self._fresh:
            for world in without(self._numbers, self._errors).tolist():
                self._writable[name][world] = getattr(self._data[world], name)
        return vars(self).setdefault(name, self._derived_arrays[name])

    def _step(self, ids: Ints, nstep: int, forward: bool) -> Errors:
        errors = self._run(ids, lambda _, model, data: step(model, data, nstep))
        if forward:
            errors |= self._forward(without(ids, errors))
        return errors

    def _forward(self, ids: Ints) -> Errors:
        return self._run(ids, lambda _, model, data: forward(model, data))

    def _reset(self, ids: Ints, key: int | None) -> None:
        self._overwrite(ids, lambda _, model, data: reset(model, data, keyframe=key))

    def _get_states(self, ids: Ints) -> list[State]:
        states = []
        for world in ids.tolist():
            self._put(world)
            states.append(get_state(self._data[world].model, self._data[world]))
        return states

    def _set_states(self, ids: Ints, states: Sequence[State]) -> None:
        by_world = dict(zip(ids.tolist(), states, strict=True))
        self._overwrite(ids, lambda world, model, data: set_state(model, data, by_world[world]))

    def _state_layout(self, world: int) -> StateLayout:
        return self._data[world]._layout

    def _record(
        self, ids: Ints, nstep: int, every: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Errors:
        def run(world: int, model: Model, data: Data) -> None:
            for row in range(nstep // every):
                if ctrl is not None:
                    data.ctrl[:] = ctrl[world, row]
                step(model, data, every)
                for name, array in arrays.items():
                    array[world, row] = getattr(data, name)

        return self._run(ids, run)


def _arrays_of(model: Model, n: int, derived: Sequence[str]) -> dict[str, Array]:
    """Return zeros for the inputs, the time and the derived arrays of n worlds."""
    sizes = {
        **{"qpos": (model.nq,), "ctrl": (model.nu,), "time": ()},
        **{"mocap_pos": (model.nmocap, 3), "mocap_quat": (model.nmocap, 4)},
        **{"xpos": (model.nbody, 3), "xquat": (model.nbody, 4)},
        **{"site_xpos": (model.nsite, 3), "site_xmat": (model.nsite, 9)},
    }
    return {name: np.zeros((n, *sizes.get(name, (model.nv,)))) for name in (*WRITABLE, *derived)}
