"""Worlds of engines that step one world at a time: processes that hold some Data each.

The arrays lie in memory that all of them share, so that a call passes a few bytes. The worlds
are dealt out like cards: world i is in process i modulo their number.
"""

from __future__ import annotations

import os
import pickle
import sys
import time
import warnings
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from .. import backends
from ..errors import BusyDataError, StateMachineError, UnsupportedError
from ..interface import Array, Ints, Model, State
from ..interface.turns import alone
from ..interface.worlds import Worlds, check_memory
from ._process import WorldsProcess, end_all, lost_worlds
from ._shared import ANSWER_MOST, SharedBlock, arrays_in, laid_out, shapes_of

_PATIENCE = 2.0  # seconds in which a process has to end a step that was interrupted
_SCRATCH = 1 << 24  # bytes for what belongs to a command, at least
_WORDS = 1 << 16  # of these, for what is no array of a record

Answers = list[dict[str, Any]]


class PoolWorlds(Worlds):
    """Worlds in processes of their own.

    A derived array is fetched from the processes when it is read for the first time after a
    call: what nobody reads is not computed.

    A process that ends by itself takes its worlds with it: the call raises EngineError, which
    names them, and these Worlds are closed. After Ctrl-C each world has done all of the call or
    nothing of it, as its `time` tells; where one does not end it in time, they are closed.
    """

    def __init__(
        self,
        model: Model,
        n: int,
        workers: int,
        derived: tuple[str, ...],
        options: Mapping[str, Sequence[Any]],
    ) -> None:
        """Start the processes, and have them make their Data.

        Args:
            model: The Model.
            n: Number of worlds.
            workers: Processes. There are more where one cannot hold its part of the worlds, and
                no more than worlds.
            derived: Names of the derived arrays.
            options: Checked options of `Model.replace`, each with a value for each world.

        Raises:
            EngineError: A process does not start, or there is not the memory for all worlds.
            UnsupportedError: The Model cannot be read in another process.
        """
        most = model.capabilities.data_per_process
        workers = max(min(workers, n), 1 if most is None else -(-n // most))
        job = {
            "path": [path or os.getcwd() for path in sys.path],
            "loaders": backends.loaders(),
            "workers": workers,
            "n": n,
            "options": dict(options),
            "model": _pickled(model),
        }
        shapes = shapes_of(model, n, derived)
        row = sum(8 * int(np.prod(shape)) for shape, _ in shapes.values())
        self._scratch = max(_SCRATCH, 2 * _WORDS + 2 * row, _WORDS + len(pickle.dumps(job)))
        self._answers = -(-self._scratch // _WORDS) * _WORDS
        job["layout"], end = laid_out(shapes, self._answers + workers * ANSWER_MOST)
        self._block = SharedBlock(end)
        arrays = arrays_in(self._block.memory, job["layout"])
        self._options, self._replaced = options, dict[int, Model]()
        self._chosen: Any = arrays.pop("ids")
        self._rows: Any = arrays.pop("rows")
        self._count, self._warned = 0, set[tuple[Any, str]]()
        self._processes: list[WorldsProcess] = []
        self._layouts: list[Any] = []  # of the States, by process
        self._end = weakref.finalize(self, end_all, self._processes, os.getpid())
        super().__init__(model, n, workers, derived, arrays)
        self._derived_arrays = {name: vars(self)[name] for name in derived}
        try:
            for number in range(workers):
                worlds = range(number, n, workers)
                process = WorldsProcess(number, worlds, self._block, self._answers)
                self._processes.append(process)
            begun = self._begun("start", self._answers, job)
            left = sum(process["left"] for process in begun)
            check_memory(n, max(process["each"] for process in begun), n - left)
            self._layouts = self._begun("fill")
        except BaseException:
            self._end()
            raise

    def _model_of(self, world: int) -> Model:
        if not self._options:
            return self.model
        if world not in self._replaced:
            options = {name: values[world] for name, values in self._options.items()}
            self._replaced[world] = self.model.replace(**options)
        return self._replaced[world]

    def _begun(self, verb: str, argument: int = 0, payload: Any = None) -> list[Any]:
        """What all processes say as they start, or raise what keeps one from it."""
        answers = self._exchange(self._processes, verb, argument, payload)
        for answer in answers:
            error = answer.get("error")
            if isinstance(error, StateMachineError):
                raise error
            if error is not None:
                raise _unreadable(self.model, error)
        return [answer["value"] for answer in answers]

    def _close(self) -> None:
        self._end()
        self._derived_arrays.clear()
        self._chosen = self._rows = np.zeros(0)
        self._block.close()

    def _exchange(
        self,
        processes: list[WorldsProcess],
        verb: str,
        argument: int = 0,
        payload: Any = None,
        of_ids: bool = False,
    ) -> Answers:
        """Tell processes something, and wait for their answers."""
        size = 0
        if payload is not None:
            blob = pickle.dumps(payload)
            size = len(blob)
            self._block.memory[:size] = blob
        self._count += 1
        number = self._count
        try:
            for process in processes:
                process.send(number, verb, argument, size, of_ids)
            return [process.receive(number) for process in processes]
        except EOFError:
            error = lost_worlds(processes)
            self._shut()
            raise error from None
        except BaseException:  # Ctrl-C, mostly
            if verb not in ("start", "fill"):  # who starts is closed
                self._halt(processes)
            raise

    def _halt(self, processes: list[WorldsProcess]) -> None:
        """Let processes end what they are at; close the Worlds where one does not."""
        deadline, ended = time.monotonic() + _PATIENCE, False
        self._count += 1
        try:
            with suppress(EOFError, TimeoutError):
                for process in processes:
                    process.send(self._count, "stop")
                for process in processes:
                    process.receive(self._count, deadline)
                ended = True
        finally:  # interrupted once more, too
            if not ended:
                for process in processes:
                    process.kill()
                self._shut()

    def _ask(
        self, ids: Ints, verb: str, argument: int = 0, payload: Any = None
    ) -> tuple[dict[int, Exception], Any]:
        """Let the processes of some worlds do something; the errors, and the last value."""
        processes, of_ids = self._processes, len(ids) < self.n
        if of_ids:
            self._chosen[:] = 0
            self._chosen[ids] = 1
            processes = [processes[k] for k in np.unique(ids % len(processes)).tolist()]
        answers = self._exchange(processes, verb, argument, payload, of_ids)
        errors: dict[int, Exception] = {}
        raised: Exception | None = None
        value: Any = None
        for answer in filter(None, answers):
            errors |= answer.get("errors", {})
            raised, value = raised or answer.get("error"), answer.get("value")
            for kind, text in answer.get("warnings", ()):
                if (kind, text) not in self._warned:  # once for all worlds
                    self._warned.add((kind, text))
                    warnings.warn(text, kind, stacklevel=7)
        if raised:
            self._errors.update(errors)
            raise raised
        return errors, value

    def _forget(self) -> None:
        """What is derived is another from now on."""
        own = vars(self)
        for name in self.derived:
            own.pop(name, None)

    def __getattr__(self, name: str) -> Any:  # only for what is not there
        own = vars(self)
        if name not in own.get("_derived_arrays", ()):
            return super().__getattr__(name)
        self._refuse_if_troubled()
        if self._process != os.getpid():
            raise BusyDataError(f"{name!r} of these Worlds is known to the process that made them")
        return alone(self, self._fetched, name)

    def _fetched(self, name: str) -> Array:
        """A derived array as it is now; the rows of worlds that have diverged stay."""
        ids = self._numbers
        if self._errors:
            ids = ids[~np.isin(ids, list(self._errors))]
        if len(ids):
            self._ask(ids, "derive", payload=name)
        vars(self)[name] = self._derived_arrays[name]
        return self._derived_arrays[name]

    def _step(self, ids: Ints, nstep: int) -> Mapping[int, Exception]:
        self._forget()
        return self._ask(ids, "step", nstep)[0]

    def _forward(self, ids: Ints) -> Mapping[int, Exception]:
        self._forget()
        return self._ask(ids, "forward")[0]

    def _reset(self, ids: Ints, key: int | None) -> None:
        self._forget()
        self._ask(ids, "reset", -1 if key is None else key)

    def _get_state(self, world: int) -> State:
        return self._ask(self._numbers[world : world + 1], "get_state", world)[1]

    def _set_state(self, world: int, state: State) -> None:
        self._forget()
        self._ask(self._numbers[world : world + 1], "set_state", world, state)

    def _state_layout(self, world: int) -> tuple[str, tuple[tuple[str, int], ...]]:
        own = self._layouts[world % len(self._processes)]
        return own[world // len(self._processes) if self._options else 0]

    def _record(
        self, ids: Ints, nstep: int, every: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Mapping[int, Exception]:
        self._forget()
        errors: dict[int, Exception] = {}
        rows, start = nstep // every, 0
        sources = {**arrays, **({} if ctrl is None else {"commands": ctrl})}
        row = sum(8 * int(np.prod(array.shape)) // rows for array in sources.values())
        most = max(1, (self._scratch - 2 * _WORDS) // max(1, row))
        while start < rows and len(ids):
            count = min(most, rows - start)
            sizes = {name: (self.n, count, *array.shape[2:]) for name, array in sources.items()}
            layout, _ = laid_out({name: (size, "f8") for name, size in sizes.items()}, _WORDS)
            shared = arrays_in(self._block.memory, layout)
            part = slice(start, start + count)
            if ctrl is not None:
                shared["commands"][:] = ctrl[:, part]
            self._rows[ids] = 0
            ended = self._ask(ids, "record", every, layout)[0]
            done = self._rows[ids]
            for name, array in arrays.items():
                array[ids[done == count], part] = shared[name][ids[done == count]]
                for world, k in zip(ids[done < count], done[done < count], strict=True):
                    array[world, start : start + k] = shared[name][world, :k]
            errors |= ended
            ids = ids[~np.isin(ids, list(ended))]
            start += count
        return errors


def _pickled(model: Model) -> bytes:
    try:
        return pickle.dumps(model)
    except Exception as error:
        raise _unreadable(model, error) from error


def _unreadable(model: Model, error: Exception) -> UnsupportedError:
    reason = f"{type(error).__name__}: {error}"
    return UnsupportedError(
        f"worlds of {model.backend} are in processes of their own, which cannot read this Model "
        f"({reason}): it has to pickle, and its class to be in a module that can be imported",
        backend=model.backend,
        feature="worlds",
        reason=reason,
    )
