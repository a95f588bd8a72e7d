"""Many worlds on MuJoCo: its own `mujoco.batch`, behind the contract of `Worlds`.

A world is a row of mjSTATE_INTEGRATION; a few MjData, one a thread, serve all rows. The engine
counts the warnings of each world, as it does those of an MjData. What ended a world is found
by running it once more alone, from where the call began.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError

from ...errors import StateMachineError, one_line
from ...interface import Array, Ints, Model, State
from ...interface.checks import check_vector, engine_steps, unsupported
from ...interface.records import Errors, StateLayout
from ...interface.worlds import WRITABLE, Worlds, check_memory, without
from ..compiled.spec_files import ENGINE_ERRORS
from ..delays import hold, places_of, with_room_of
from .alarms import (
    FATAL,
    AlarmError,
    Alarms,
    end_error,
    gave_up,
    listen,
    listen_for,
    pass_on,
    resets_itself,
)

_STATE = mujoco.mjtState
_NO_STAGE = int(mujoco.mjtStage.mjSTAGE_NONE)
_SLEEP = int(mujoco.mjtEnableBit.mjENBL_SLEEP)
# What a step may change behind ctrl in a row; what else is there only the caller writes.
_LATE = (_STATE.mjSTATE_PLUGIN, _STATE.mjSTATE_PLASTIC)


class MujocoWorlds(Worlds):
    """Rows of a Batch. Inputs and derived arrays are views of its memory."""

    _batch: Any  # Batch; None once closed
    _history: Any  # (n, nhistory), or None
    _pending_warnings: Any  # (n, kinds, 2) the engine's counters: last index, number
    _seen_warnings: Any  # what they were when they were last looked at

    def __init__(
        self,
        model: Model,
        base: Model,
        size: tuple[int, int],
        derived: tuple[str, ...],
        varied: tuple[Mapping[str, Any], bool],
        layout: Callable[[int], StateLayout],
    ) -> None:
        """Make the worlds.

        Args:
            model: The Model, of this engine.
            base: What the worlds share: `model`, with what is the same for all.
            size: Number of worlds and of threads.
            derived: Names of derived arrays.
            varied: Arrays (n, ...) of the compiled model that each world has of its own, by
                name, and whether constants of it follow from them.
            layout: Of the States, after their fingerprint, by the size of the buffers of a Data.
        """
        raw = base.raw
        try:
            self._check_memory(size[0], raw, derived, varied[0])
            batch = Batch(raw, *size, persistent=bool(raw.opt.enableflags & _SLEEP))
            for name, value in varied[0].items():
                batch.expand(name)[:] = value
            if varied[1]:
                batch.set_const()
            if varied[0] and raw.nhistory:  # the times in it are by each world's own timestep
                batch.reset(None, -1, _NO_STAGE)
            arrays = {name: batch.bind(name) for name in (*WRITABLE, *derived)}
        except StateMachineError:
            raise
        except ENGINE_ERRORS as error:
            raise gave_up(error) from error
        except ValueError as error:  # what a Batch cannot do
            raise unsupported(model, "worlds", one_line(error)) from error
        self._batch, self._base = batch, base
        self._varied = bool(varied[0])
        # (n, nactuator) commands that each world keeps; None where all keep as many.
        history = varied[0].get("actuator_history")
        self._kept = None if history is None else history[:, :, 0]
        self._layout = cache(layout)
        self._history = batch.bind("history") if raw.nhistory else None
        self._pending_warnings, self._seen_warnings = batch.warning, batch.warning.copy()
        # A copy of what a step changes in a row, to run a world again from there.
        all_of_it = resets_itself(raw) or any(mujoco.mj_stateSize(raw, int(part)) for part in _LATE)
        end = batch.nstate if all_of_it else batch._component(_STATE.mjSTATE_CTRL)[0]
        self._changing = batch.state[:, :end]
        self._before = np.empty_like(self._changing)
        super().__init__(model, *size, derived, arrays)
        listen_for(self)

    @staticmethod
    def _check_memory(
        n: int, raw: mujoco.MjModel, derived: tuple[str, ...], varied: Mapping[str, Any]
    ) -> None:
        """Raise EngineError where the rows of so many worlds do not fit into memory."""
        data = mujoco.MjData(raw)
        state = mujoco.mj_stateSize(raw, int(_STATE.mjSTATE_INTEGRATION))
        size = 16.0 * state + sum(getattr(data, name).nbytes for name in derived)  # with a copy
        size += sum(array.nbytes for array in varied.values()) / n
        if raw.opt.enableflags & _SLEEP:
            size += data.nbuffer
        late = 16 * raw.nhistory
        commands = raw.actuator_history[:, 0].max(initial=0)
        of_which = f"most of it for the {commands} commands that its latency keeps on their way"
        check_memory(n, size, of_which=of_which if late > size / 2 else "")

    def _model_of(self, world: int) -> Model:
        if not self._varied:
            return self._base
        compiled = self._batch.get_model(world)
        if self._kept is not None:
            compiled = with_room_of(compiled, self.model.raw, self._kept[world])
        return self._base.with_compiled(compiled)

    def _close(self) -> None:
        for name in (
            "_changing",
            "_before",
            "_pending_warnings",
            "_seen_warnings",
            "_history",
            "_batch",
        ):
            setattr(self, name, None)

    def _step(self, ids: Ints, nstep: int, forward: bool) -> Errors:
        count = engine_steps(nstep, self._base.substeps)
        errors: Errors = {}
        if self.model._quaternions:
            qpos = self.qpos if len(ids) == self.n else self.qpos[ids]
            errors.update(self._zero_quaternions(qpos, ids))
            ids = without(ids, errors)
        self._before[:] = self._changing
        errors |= self._call(ids, count, lambda some: self._batch.step(some, count))
        if forward:
            errors |= self._forward(without(ids, errors))
        return errors

    def _forward(self, ids: Ints) -> Errors:
        self._before[:] = self._changing
        return self._call(ids, 0, self._batch.forward)

    def _call(self, ids: Ints, count: int, call: Callable[[Ints | None], object]) -> Errors:
        """Run some worlds and look at what the engine warned of.

        Args:
            ids: The worlds.
            count: Engine steps of the call, 0 for none.
            call: Runs the worlds that it is given, None for all.

        Returns:
            The error of each world that ended.
        """
        errors: Errors = {}
        if not len(ids):
            return errors
        try:
            call(None if len(ids) == self.n else ids)
        except SimulationError as error:  # the others ran to their end
            for world in error.ids.tolist():
                errors[world] = gave_up(self._batch.error(world))
        except ValueError as error:  # a callback in Python
            raise unsupported(self.model, "worlds", one_line(error)) from error
        if (self._pending_warnings != self._seen_warnings).any():
            errors.update(self._raise_pending_warnings(count))
        return errors

    def _raise_pending_warnings(self, count: int) -> Errors:
        """Look at the counters that differ: the errors, and what else was warned of."""
        listen()
        counts = (self._pending_warnings - self._seen_warnings)[:, :, 1]
        worlds = np.flatnonzero((counts > 0).any(axis=1))
        fatal = worlds[(counts[worlds][:, list(FATAL.values())] > 0).any(axis=1)]
        errors = self._causes(fatal, count)
        # MuJoCo says a thing only the first time after a reset, and so do we.
        texts: dict[str, None] = {}
        for world in np.setdiff1d(worlds, fatal).tolist():
            first = (counts[world] == self._pending_warnings[world, :, 1]) & (counts[world] != 0)
            for kind in np.flatnonzero(first).tolist():
                texts[mujoco.mju_warningText(kind, int(self._pending_warnings[world, kind, 0]))] = (
                    None
                )
        self._seen_warnings[:] = self._pending_warnings
        pass_on(list(texts), stacklevel=7)
        return errors

    def _causes(self, worlds: Ints, count: int) -> Errors:
        """Return the error of each of these worlds, from running it again by itself."""
        errors: Errors = {}
        raw = data = None
        for world in worlds.tolist():
            raw = self._batch.get_model(world, raw)
            if data is None:
                data = mujoco.MjData(raw)
            mujoco.mj_resetData(raw, data)
            alarms = Alarms(raw, data)
            row = self._batch.state[world].copy()
            row[: self._before.shape[1]] = self._before[world]
            mujoco.mj_setState(raw, data, row, int(_STATE.mjSTATE_INTEGRATION))
            try:
                if count:
                    mujoco.mj_step(raw, data, count)
                else:
                    mujoco.mj_forward(raw, data)
                alarms.raise_pending()
                raise AlarmError("qpos", 0, float(self.time[world]))  # it did not happen again
            except AlarmError as alarm:
                errors[world] = end_error(self.model, alarm, f"World {world}")
        return errors

    def _reset(self, ids: Ints, key: int | None) -> None:
        if len(ids):
            self._batch.reset(ids, -1 if key is None else key, _NO_STAGE)
            if self._history is not None and self._base._holds_start:  # as of a Data
                history = self._history[ids]
                counts = None if self._kept is None else self._kept[ids]
                hold(self._base.raw, history, self.ctrl[ids], counts)
                self._history[ids] = history
            self._seen_warnings[ids] = self._pending_warnings[ids]
        listen()

    def _get_states(self, ids: Ints) -> list[State]:
        states = []
        for world, row in zip(ids.tolist(), self._batch.state[ids], strict=True):
            fingerprint, layout = self._state_layout(world)
            vector = row[self._places(world)]
            check_vector(vector, layout, self.model)
            states.append(
                State("mujoco", mujoco.__version__, fingerprint, layout, vector.tobytes())
            )
        return states

    def _set_states(self, ids: Ints, states: Sequence[State]) -> None:
        self._reset(ids, None)
        for world, state in zip(ids.tolist(), states, strict=True):
            self._batch.state[world, self._places(world)] = state.vector

    def _state_layout(self, world: int) -> StateLayout:
        nhistory = self._base.raw.nhistory
        if self._kept is not None:
            nhistory = len(places_of(self.model.raw, self._base.raw, self._kept[world]))
        return self._layout(nhistory)

    def _places(self, world: int) -> Any:
        """Return the slices of a row of the worlds' state that hold the numbers of a State."""
        if self._kept is None:
            return slice(None)
        start, size = self._batch._component(_STATE.mjSTATE_HISTORY)
        own = places_of(self.model.raw, self._base.raw, self._kept[world])
        end = np.arange(start + size, self._batch.nstate)
        return np.concatenate([np.arange(start), start + own, end])

    def _record(
        self, ids: Ints, nstep: int, every: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Errors:
        errors: Errors = {}
        if engine_steps(every, self._base.substeps) == 1 and len(ids):
            ids = self._roll_out(ids, nstep, arrays, ctrl)
        for k in range(nstep // every if len(ids) else 0):
            if ctrl is not None:
                self.ctrl[ids] = ctrl[ids, k]
            errors.update(self._step(ids, every, False))
            ids = without(ids, errors)
            for name, array in arrays.items():
                array[ids, k] = getattr(self, name)[ids]
        return errors

    def _roll_out(
        self, ids: Ints, nstep: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Ints:
        """Advance and record in one call of the engine.

        Returns:
            The worlds that it did not do: the engine stops each at its first warning, whatever
            it is of. These are back where they were.
        """
        zero = list(self._zero_quaternions(self.qpos[ids], ids))
        able = without(ids, zero)
        if not len(able):
            return ids
        every_one = len(able) == self.n
        rows = arrays if every_one else {name: array[able] for name, array in arrays.items()}
        out: dict[Any, Array] = {name: array for name, array in rows.items() if name != "time"}
        if "time" in rows:  # no array of an MjData: it is asked for as a part of the state
            out[_STATE.mjSTATE_TIME] = rows["time"][..., None]
        self._before[:] = self._changing
        ctrl_before = None if ctrl is None else self.ctrl.copy()
        commands = None if ctrl is None else ctrl[able]
        redo = np.zeros(self.n, dtype=bool)
        redo[zero] = True
        try:
            some = None if every_one else able
            self._batch.rollout(nstep, commands, record=list(out), ids=some, out=out)
        except SimulationError as error:
            redo[error.ids] = True
        except ValueError as error:  # a callback in Python
            raise unsupported(self.model, "worlds", one_line(error)) from error
        redo |= (self._pending_warnings != self._seen_warnings).any(axis=(1, 2))
        if not every_one:
            for name, array in arrays.items():
                array[able] = rows[name]
        again = np.flatnonzero(redo)
        if len(again):
            self._changing[again] = self._before[again]
            self._pending_warnings[again] = self._seen_warnings[again]
            if ctrl_before is not None:
                self.ctrl[again] = ctrl_before[again]
            for array in arrays.values():
                array[again] = np.nan
        return again
