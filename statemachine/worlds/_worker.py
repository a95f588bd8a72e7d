"""A process that holds some of many worlds: `python -m statemachine.worlds._worker BLOCK SIZE`.

It reads commands from its standard input, and ends when that does: when the process that
started it closes it, or is no more. Ctrl-C is not for it.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import time
import traceback
import warnings
from _thread import interrupt_main
from collections.abc import Callable, Sequence
from contextlib import suppress
from queue import SimpleQueue
from typing import Any

import numpy as np

from .. import backends
from ..interface import INPUTS, Data, Model, forward, get_state, make_data, reset, set_state, step
from ..processes import resident_memory
from ._shared import (
    ANSWER,
    ANSWER_MOST,
    COMMAND,
    VERBS,
    arrays_in,
    open_block,
    packed,
    portable,
    portable_error,
)

_ENDS_IN = 1.0  # seconds in which Python code may clean up

Command = tuple[int, int, int, int, int]  # as `COMMAND` has it


class StepStopped(BaseException):
    """The process that asked no longer wants what is being done."""


class Inbox:
    """Reads the commands, in a thread, and interrupts what is being done if need be.

    Attributes:
        commands: Those to come; None is the end.
        number: Of the command that is being done.
        stoppable: Whether it may be interrupted just now.
    """

    def __init__(self) -> None:
        self.commands: SimpleQueue[Command | None] = SimpleQueue()
        self.number = 0
        self.stoppable = False
        self._stop = 0  # commands before this one are to end
        self._ended = False
        signal.signal(signal.SIGINT, self._interrupted)
        threading.Thread(target=self._read, daemon=True).start()

    @property
    def stopped(self) -> bool:
        """Whether the command that is being done is to end."""
        return self._ended or self.number < self._stop

    def _read(self) -> None:
        while len(frame := os.read(0, COMMAND.size)) == COMMAND.size:
            command = COMMAND.unpack(frame)
            if VERBS[command[1]] == "stop":
                self._stop = command[0]
                interrupt_main()
            self.commands.put(command)
        self._ended = True
        self.commands.put(None)
        interrupt_main()  # so that temporary files go
        time.sleep(_ENDS_IN)
        os._exit(1)

    def _interrupted(self, _signal: int, _frame: Any) -> None:
        """Called in the main thread, also for a Ctrl-C, which asks for nothing."""
        if self._ended:
            sys.exit()
        if self.stoppable and self.stopped:
            self.stoppable = False
            raise StepStopped


class Holder:
    """The worlds of one process, and what can be asked of them."""

    def __init__(self, inbox: Inbox, memory: Any, number: int) -> None:
        self._inbox, self._memory, self._number = inbox, memory, number
        self._models: list[Model] = []
        self._variants: dict[bytes, Model] = {}  # by the options that they differ in
        self._data: list[Data] = []
        self._warnings: list[tuple[type[Warning], str]] = []

    def answer(self, command: Command) -> dict[str, Any]:
        """Do what was asked; what came of it, without what is nothing."""
        _, verb, argument, size, of_ids = command
        self._errors: dict[int, Exception] = {}
        answer: dict[str, Any] = {}
        try:
            payload = pickle.loads(self._memory[:size]) if size else None
            places: Sequence[int] = range(len(self._data))
            if of_ids:
                places = np.flatnonzero(self._chosen[self._number :: self._stride]).tolist()
            value = getattr(self, f"_{VERBS[verb]}")(argument, payload, places)
            if value is not None:
                answer["value"] = value
        except StepStopped:
            pass
        except Exception as error:
            answer["error"] = portable_error(error)
        if self._errors:
            errors = self._errors.items()
            answer["errors"] = {self._world(k): portable_error(error) for k, error in errors}
        if self._warnings:
            answer["warnings"] = [
                (portable(kind, UserWarning), text) for kind, text in self._warnings
            ]
            self._warnings.clear()
        return answer

    def warn(self, message: Warning, kind: type[Warning], *_: Any, **__: Any) -> None:
        """Keep a warning for the answer; in place of `warnings.showwarning`."""
        self._warnings.append((kind, str(message)))

    def write(self, answer: dict[str, Any]) -> int:
        """Put an answer where it is looked for; how many bytes it has."""
        if not answer:
            return 0
        blob = packed(answer)
        self._memory[self._place : self._place + len(blob)] = blob
        return len(blob)

    def _world(self, place: int) -> int:
        return self._number + place * self._stride

    def _start(self, place: int, job: dict[str, Any], _: Any) -> dict[str, Any]:
        """Take the Model, and make the first two Data: what they take tells what all will."""
        self._place = place + self._number * ANSWER_MOST
        sys.path[:] = job["path"]
        for name, loader in job["loaders"].items():
            backends.register(name, loader)
        self._stride, self._n, self._options = job["workers"], job["n"], job["options"]
        self._model: Model = pickle.loads(job["model"])
        arrays = arrays_in(self._memory, job["layout"])
        self._qpos, self._qvel, self._ctrl = (arrays[name] for name in INPUTS)
        self._time, self._chosen, self._rows = arrays["time"], arrays["ids"], arrays["rows"]
        self._arrays = arrays
        self._make(1)
        first = resident_memory()
        self._make(2)
        of_one = resident_memory() - first if len(self._data) == 2 else 0
        return {"each": of_one, "left": self._all - len(self._data)}

    @property
    def _all(self) -> int:
        """How many worlds this process is to hold."""
        return len(range(self._number, self._n, self._stride))

    def _fill(self, _argument: int, _payload: Any, _places: Any) -> Any:
        self._make(self._all)
        return [data._state_layout() for data in self._data[: None if self._options else 1]]

    def _make(self, most: int) -> None:
        while len(self._data) < min(most, self._all):
            world = self._world(len(self._data))
            options = {name: values[world] for name, values in self._options.items()}
            key = pickle.dumps(options)
            if key not in self._variants:
                self._variants[key] = self._model.replace(**options) if options else self._model
            model = self._variants[key]
            self._data.append(make_data(model))
            self._models.append(model)
            self._take(len(self._data) - 1)

    def _put(self, place: int) -> None:
        """Copy what the arrays have into a Data, bit by bit: it sees itself what was written."""
        world, data = self._world(place), self._data[place]
        data.qpos[:], data.qvel[:] = self._qpos[world], self._qvel[world]
        data.ctrl[:] = self._ctrl[world]
        time = self._time.item(world)
        if time != data.time:
            data.time = time

    def _take(self, place: int) -> None:
        """What a Data has, into the arrays."""
        world, data = self._world(place), self._data[place]
        self._qpos[world], self._qvel[world] = data.qpos, data.qvel
        self._ctrl[world], self._time[world] = data.ctrl, data.time

    def _step(self, nstep: int, _: Any, places: Sequence[int]) -> None:
        self._for_all(places, lambda place: step(self._models[place], self._data[place], nstep))

    def _forward(self, _argument: int, _: Any, places: Sequence[int]) -> None:
        self._for_all(places, lambda place: forward(self._models[place], self._data[place]))

    def _for_all(self, places: Sequence[int], call: Callable[[int], None]) -> None:
        """Call something for each world that is meant; what it raises ends this world."""
        inbox = self._inbox
        for place in places:
            if inbox.stopped:
                return
            try:
                self._put(place)
                self._stoppable(call, place)
                self._take(place)
            except Exception as error:
                self._errors[place] = error
                with suppress(Exception):
                    self._take(place)

    def _stoppable(self, call: Callable[[int], None], place: int) -> None:
        inbox = self._inbox
        try:
            inbox.stoppable = True
            call(place)
            inbox.stoppable = False
        except StepStopped:  # the Data is where it was, or where it was to be
            self._take(place)
            raise
        finally:
            inbox.stoppable = False

    def _reset(self, key: int, _: Any, places: Sequence[int]) -> None:
        keyframe = None if key < 0 else key
        for place in places:
            if self._inbox.stopped:
                return
            self._stoppable(
                lambda place: reset(self._models[place], self._data[place], keyframe), place
            )
            self._take(place)

    def _get_state(self, world: int, _payload: Any, _places: Any) -> Any:
        place = world // self._stride
        self._put(place)
        return get_state(self._models[place], self._data[place])

    def _set_state(self, world: int, state: Any, _places: Any) -> None:
        place = world // self._stride
        set_state(self._models[place], self._data[place], state)
        self._take(place)

    def _record(self, every: int, layout: Any, places: Sequence[int]) -> None:
        arrays = arrays_in(self._memory, layout)
        commands = arrays.pop("commands", None)
        rows = next(iter(layout.values()))[1][1]

        def run(place: int) -> None:
            world, data, model = self._world(place), self._data[place], self._models[place]
            for row in range(rows):
                if commands is not None:
                    data.ctrl[:] = commands[world, row]
                step(model, data, every)
                for name, array in arrays.items():
                    array[world, row] = getattr(data, name)
                self._rows[world] = row + 1

        self._for_all(places, run)

    def _derive(self, _argument: int, name: str, places: Sequence[int]) -> None:
        rows = self._arrays[name]
        for place in places:
            if self._inbox.stopped:
                return
            rows[self._world(place)] = getattr(self._data[place], name)


def main(handle: str, size: str, number: str) -> None:
    """Do what is asked until there is nobody to ask."""
    out, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)  # engines greet there, and warn
    memory = open_block(handle, int(size))
    inbox = Inbox()
    holder = Holder(inbox, memory, int(number))
    warnings.simplefilter("always")
    warnings.showwarning = holder.warn
    while (command := inbox.commands.get()) is not None:
        inbox.number = command[0]
        answer = {} if VERBS[command[1]] == "stop" else holder.answer(command)
        os.write(out, ANSWER.pack(command[0], holder.write(answer)))
        if VERBS[command[1]] == "fill":
            os.dup2(nothing, 2)  # until now somebody read what was said there


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except Exception:
        traceback.print_exc()
    finally:
        os._exit(0)  # at once: there is nothing that the system does not take back
