"""Worlds of engines that step one world at a time: processes that hold some Data each.

The worlds are dealt out like cards: world i is in process i modulo their number. Where each has few
of them, this process is the first: nothing is to be woken for its share, and where it is the
only one, a call costs what a loop over Data costs. No result depends on it.
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
from ..interface.records import Errors, StateLayout
from ..interface.turns import alone
from ..interface.worlds import WRITABLE, Worlds, check_memory, without
from ..processes import checked_jobs
from ._holder import Holder, Layout, arrays_in
from ._worker import ANSWER_MOST, Answer, SharedBlock, WorldsProcess, end_all, lost_worlds

_PATIENCE = 2.0  # seconds in which a process has to end a step that was interrupted
_SCRATCH = 1 << 24  # bytes for what belongs to a command, at least
_WORDS = 1 << 16  # of these, for what is not an array of a record
_STATES = ANSWER_MOST // 4  # bytes of States in an exchange
_PAGE = 4096
# Worlds that pay for a process, where the number of these is not given: to wake one takes as long
# as to step two or three worlds once.
_PAYS = 4
# Worlds that this process holds at most: each is of the engine's, which has places for few
# hundred in a process, and those that the caller makes beside them are here, too.
_HERE = 32


class PoolWorlds(Worlds):
    """Worlds in this process and in others.

    A derived array is computed when it is read for the first time after a call: what nobody
    reads is not. One that was read between the last two calls comes with the answer to the next,
    so that a control loop has one exchange a step.

    A process that ends by itself takes its worlds with it: the call raises EngineError, which
    names them, and these Worlds are closed. After Ctrl-C each world has done all of the call or
    nothing of it, as its `time` tells; where one does not end it in time, they are closed.
    """

    def __init__(
        self,
        model: Model,
        n: int,
        workers: int | None,
        derived: tuple[str, ...],
        options: Mapping[str, Sequence[Any]],
    ) -> None:
        """Start the processes, and have them make their Data.

        Args:
            model: The Model.
            n: Number of worlds.
            workers: Processes, this one included; None for one for each processor, if each has
                four worlds or more. There are more where one cannot hold its part of the worlds,
                and no more than worlds.
            derived: Names of the derived arrays.
            options: Checked options of `Model.replace`, each with a value for each world.

        Raises:
            EngineError: A process does not start, or there is not the memory for all worlds.
            UnsupportedError: The Model cannot be read in another process.
        """
        most = model.capabilities.data_per_process
        workers = min(checked_jobs(None), max(1, n // _PAYS)) if workers is None else workers
        workers = max(min(workers, n), 1 if most is None else -(-n // most))
        is_here = -(-n // workers) <= _HERE
        job = {
            "workers": workers,
            "n": n,
            "options": dict(options),
            "derived": derived,
            "path": [path or os.getcwd() for path in sys.path],
            "loaders": backends.loaders(),
            "model": _pickled(model) if workers > is_here else b"",
        }
        shapes = _shapes_of(model, n, derived)
        row = sum(8 * int(np.prod(shape)) for shape, _ in shapes.values())
        self._scratch = max(_SCRATCH, 2 * _WORDS + 2 * row, _WORDS + len(pickle.dumps(job)))
        self._answers = -(-self._scratch // _WORDS) * _WORDS
        layout, end = _laid_out(shapes, self._answers + workers * ANSWER_MOST)
        self._block = SharedBlock(end)
        arrays = arrays_in(self._block.memory, layout)
        self._options = options
        self._chosen, self._rows, self._stop = (
            arrays.pop(name) for name in ("ids", "rows", "stop")
        )
        self._count, self._warned = 0, set[tuple[Any, str]]()
        self._here = Holder(self._block.memory, 0, model) if is_here else None
        self._processes: list[WorldsProcess] = []
        self._layouts: list[Any] = []  # of the States, by process
        self._fresh = list(derived)  # derived arrays that are as they are to be: zero now
        self._end = weakref.finalize(self, end_all, self._processes, os.getpid())
        super().__init__(model, n, workers, derived, arrays)
        self._derived_arrays = {name: vars(self).pop(name) for name in derived}
        try:
            for number in range(int(is_here), workers):
                worlds = range(number, n, workers)
                process = WorldsProcess(number, worlds, self._block, self._answers)
                self._processes.append(process)
            begun = self._begun("start", self._answers, {**job, "layout": layout})
            left = sum(process["left"] for process in begun)
            # What this process and its children hold grows as the children do.
            apart = begun[-len(self._processes) :]
            check_memory(n, max(process["each"] for process in apart), n - left)
            self._layouts = self._begun("fill")
        except BaseException:
            self._close()
            raise

    def _model_of(self, world: int) -> Model:
        if not self._options:
            return self.model
        options = {name: values[world] for name, values in self._options.items()}
        return self.model.replace(**options)

    def _begun(self, verb: str, argument: int = 0, payload: Any = None) -> list[Any]:
        """What all processes say as they start, or raise what keeps one from it."""
        with warnings.catch_warnings(action="ignore"):  # of each variant of a Model that has told
            answers = self._exchange(range(self.workers), verb, argument, payload)
        for _, error, *_ in answers:
            if error is not None:
                known = isinstance(error, StateMachineError)
                raise error if known else _unreadable(self.model, error)
        return [value for value, *_ in answers]

    def _close(self) -> None:
        self._end()
        if self._here:
            self._here.close()
        self._here = None
        self._derived_arrays.clear()
        self._chosen = self._rows = self._stop = np.zeros(0)
        self._block.close()

    def _exchange(
        self,
        numbers: Sequence[int],
        verb: str,
        argument: int = 0,
        payload: Any = None,
        of_ids: bool = False,
        wanted: int = 0,
    ) -> list[Answer]:
        """Ask some processes something, by their numbers; their answers.

        Args:
            numbers: Of the processes.
            verb: Of `_worker.VERBS`.
            argument: A whole number.
            payload: What can be pickled.
            of_ids: Whether it is for the worlds of `ids` only.
            wanted: The derived arrays that are to be written afterwards, as bits.
        """
        first = int(self._here is not None)
        processes = [self._processes[number - first] for number in numbers if number >= first]
        size = 0
        if payload is not None and processes:
            blob = pickle.dumps(payload)
            size = len(blob)
            self._block.memory[:size] = blob
        self._count += 1
        count = self._count
        try:
            for process in processes:
                process.send(count, verb, argument, size, of_ids, wanted)
            answers: list[Answer] = []
            if self._here and 0 in numbers:
                answers.append((*self._here.answer(verb, argument, payload, of_ids, wanted), []))
            return answers + [process.receive(count) for process in processes]
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
        self._stop[:] = self._count
        try:
            with suppress(EOFError, TimeoutError):
                for process in processes:
                    process.interrupt()
                    process.send(self._count, "stop", 0, 0, False, 0)
                for process in processes:
                    process.receive(self._count, deadline)
                ended = True
        finally:  # interrupted once more, too
            if not ended:
                for process in processes:
                    process.kill()
                self._shut()

    def _ask(
        self, ids: Ints, verb: str, argument: int = 0, payload: Any = None, wanted: int = 0
    ) -> tuple[Errors, list[Any]]:
        """Let the processes of some worlds do something; the errors by world, and the values."""
        numbers, of_ids = range(self.workers), len(ids) < self.n
        if of_ids:
            self._chosen[:] = 0
            self._chosen[ids] = 1
            numbers = np.unique(ids % self.workers).tolist()
        answers = self._exchange(numbers, verb, argument, payload, of_ids, wanted)
        errors: Errors = {}
        raised: Exception | None = None
        for _, error, ended, warned in answers:
            errors |= ended
            raised = raised or error
            for kind, text in warned:
                if (kind, text) not in self._warned:  # once for all worlds
                    self._warned.add((kind, text))
                    warnings.warn(text, kind, stacklevel=8)
        if raised:
            self._errors.update(errors)
            raise raised
        return errors, [value for value, *_ in answers]

    def _change(self, ids: Ints, verb: str, argument: int = 0, payload: Any = None) -> Errors:
        """Ask for what changes worlds, and with it for what was read since the last change."""
        own = vars(self)
        read = [name for name in self.derived if own.pop(name, None) is not None]
        self._fresh = []
        wanted = sum(1 << self.derived.index(name) for name in read)
        errors, _ = self._ask(ids, verb, argument, payload, wanted)
        self._fresh = read
        return errors

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
        if name not in self._fresh:
            ids = without(self._numbers, self._errors)
            if len(ids):
                self._ask(ids, "derive", 1 << self.derived.index(name))
        return vars(self).setdefault(name, self._derived_arrays[name])

    def _step(self, ids: Ints, nstep: int, forward: bool) -> Errors:
        return self._change(ids, "step_and_forward" if forward else "step", nstep)

    def _forward(self, ids: Ints) -> Errors:
        return self._change(ids, "forward")

    def _reset(self, ids: Ints, key: int | None) -> None:
        self._change(ids, "reset", -1 if key is None else key)

    def _get_states(self, ids: Ints) -> list[State]:
        about, blobs = (self.model.backend, self.model.engine_version), dict[int, bytes]()
        for some in self._parts(ids):
            for answered in self._ask(some, "get_states")[1]:
                blobs |= answered
        return [State(*about, *self._state_layout(k), blobs[k]) for k in ids.tolist()]

    def _set_states(self, ids: Ints, states: Sequence[State]) -> None:
        by_world = dict(zip(ids.tolist(), states, strict=True))
        for some in self._parts(ids):
            self._change(some, "set_states", 0, {world: by_world[world] for world in some.tolist()})

    def _parts(self, ids: Ints) -> list[Ints]:
        """Worlds whose States fit into a command, or an answer, together."""
        sizes = [sum(size for _, size in layout) for own in self._layouts for _, layout in own]
        most = max(1, _STATES // (8 * max(sizes)))
        return [ids[start : start + most] for start in range(0, len(ids), most)]

    def _state_layout(self, world: int) -> StateLayout:
        place = world // self.workers if self._options else 0
        return self._layouts[world % self.workers][place]

    def _record(
        self, ids: Ints, nstep: int, every: int, arrays: Mapping[str, Array], ctrl: Array | None
    ) -> Errors:
        errors: Errors = {}
        rows, start = nstep // every, 0
        sources = {**arrays, **({} if ctrl is None else {"commands": ctrl})}
        row = sum(8 * int(np.prod(array.shape)) // rows for array in sources.values())
        most = max(1, (self._scratch - 2 * _WORDS) // max(1, row))
        while start < rows and len(ids):
            count = min(most, rows - start)
            sizes = {name: (self.n, count, *array.shape[2:]) for name, array in sources.items()}
            layout, _ = _laid_out({name: (size, "f8") for name, size in sizes.items()}, _WORDS)
            shared = arrays_in(self._block.memory, layout)
            part = slice(start, start + count)
            if ctrl is not None:
                shared["commands"][:] = ctrl[:, part]
            self._rows[ids] = 0
            ended = self._change(ids, "record", every, layout)
            done = self._rows[ids]
            for name, array in arrays.items():
                array[ids[done == count], part] = shared[name][ids[done == count]]
                for world, k in zip(ids[done < count], done[done < count], strict=True):
                    array[world, start : start + k] = shared[name][world, :k]
            errors |= ended
            ids = without(ids, ended)
            start += count
        return errors


def _shapes_of(
    model: Model, n: int, derived: Sequence[str]
) -> dict[str, tuple[tuple[int, ...], str]]:
    """Shape and type of the arrays of n worlds; of three more `_holder` and `_worker` tell."""
    sizes = {
        **{"qpos": (model.nq,), "ctrl": (model.nu,), "time": ()},
        **{"mocap_pos": (model.nmocap, 3), "mocap_quat": (model.nmocap, 4)},
        **{"xpos": (model.nbody, 3), "xquat": (model.nbody, 4)},
        **{"site_xpos": (model.nsite, 3), "site_xmat": (model.nsite, 9)},
    }
    floats = {name: (n, *sizes.get(name, (model.nv,))) for name in (*WRITABLE, *derived)}
    shapes = {name: (shape, "f8") for name, shape in floats.items()}
    return {**shapes, "ids": ((n,), "u1"), "rows": ((n,), "i8"), "stop": ((1,), "i8")}


def _laid_out(shapes: Mapping[str, tuple[tuple[int, ...], str]], start: int) -> tuple[Layout, int]:
    """Places for arrays one after the other, each on a page of its own, and where they end."""
    layout: Layout = {}
    for name, (shape, kind) in shapes.items():
        layout[name] = (start, shape, kind)
        size = int(np.prod(shape)) * np.dtype(kind).itemsize
        start += -(-size // _PAGE) * _PAGE
    return layout, start


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
