"""A process that holds some of many worlds, seen from both its ends.

The arrays lie in memory that all of the processes share: a file without a place in any folder,
which goes with the last process that holds it, however that ends. A process of ours inherits its
descriptor. (Windows has a mapping by name, which goes with its last holder, too.)

A command and an answer are a few bytes in a pipe, so that each is written and read whole or
not at all, also where a signal falls in between. All else lies in shared memory: the arrays,
what belongs to a command (the same for all processes), and a place for each one's answer.

`python -m statemachine.worlds._worker BLOCK SIZE NUMBER` reads commands from its standard input,
and ends when that does: when the process that started it closes it, or is no more. Ctrl-C is
not for it: who waits for it writes into the memory which commands are to end, and then signals.
"""

from __future__ import annotations

import mmap
import os
import pickle
import secrets
import select
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
import weakref
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeVar

from .. import backends
from ..errors import EngineError, shown
from ..interface.records import Errors
from ..processes import PipedChild, await_message, end_with_parent, fresh_python
from ._holder import Holder, StepStopped, arrays_in

T = TypeVar("T")

# Number of the command, place in `VERBS`, argument, bytes of the payload, whether it is for the
# worlds of `ids` only, and which derived arrays are read afterwards.
COMMAND = struct.Struct("<qqqqqq")
ANSWER = struct.Struct("<qq")  # number of the command, bytes
ANSWER_MOST = 1 << 22  # bytes of an answer
# What a process is asked for, by the methods of its `Holder`; to take the Model and begin; and to
# say that it has ended what was asked before.
VERBS = (
    "start", "fill", "step", "forward", "step_and_forward", "reset", "get_states", "set_states",
    "record", "derive", "stop",
)  # fmt: skip
# The value, what was raised, the error of each world that ended, and what was warned of.
Answer = tuple[Any, Exception | None, Errors, list[tuple[type[Warning], str]]]
NOTHING: Answer = (None, None, {}, [])
_ENDING = 0.3  # seconds in which one that closed its pipes has ended


class SharedBlock:
    """A block of memory, zero at first. What nobody has written to takes no memory.

    Attributes:
        handle: What `open_block` in another process wants: a descriptor that is to be
            inherited, or on Windows a name.
        size: Bytes.
        inherited: What `subprocess.Popen` is to be told.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        if sys.platform == "win32":
            self.handle = f"statemachine-{os.getpid()}-{secrets.token_hex(8)}"
            self.memory, self.inherited = mmap.mmap(-1, size, tagname=self.handle), {}
            return
        if hasattr(os, "memfd_create"):
            self._file = os.memfd_create("worlds")
        else:
            with tempfile.TemporaryFile() as file:
                self._file = os.dup(file.fileno())
        # Worlds may be collected without having been closed.
        self._end = weakref.finalize(self, os.close, self._file)
        os.ftruncate(self._file, size)
        self.handle, self.inherited = str(self._file), {"pass_fds": (self._file,)}
        self.memory = mmap.mmap(self._file, size)

    def close(self) -> None:
        """Let go of it; who still has an array of it keeps that."""
        if sys.platform != "win32":
            self._end()
        del self.memory


def open_block(handle: str, size: int) -> mmap.mmap:
    """The memory of another process's `SharedBlock`."""
    if sys.platform == "win32":
        return mmap.mmap(-1, size, tagname=handle)
    file = int(handle)
    memory = mmap.mmap(file, size)
    os.close(file)
    return memory


class WorldsProcess(PipedChild):
    """The process, for the one that started it.

    Attributes:
        worlds: Numbers of the worlds that it holds.
    """

    def __init__(self, number: int, worlds: range, block: SharedBlock, answers: int) -> None:
        """Start it.

        Args:
            number: Its number among those of these worlds.
            worlds: Numbers of the worlds that it is to hold.
            block: The memory that it shares with this process.
            answers: Where in that the answers of all processes are.
        """
        self.worlds, self._asleep = worlds, 0
        self._block, self._place = block, answers + number * ANSWER_MOST
        command, environment = fresh_python(
            f"{__name__}:main", block.handle, str(block.size), str(number)
        )
        super().__init__(command, environment, **block.inherited)

    def send(
        self, number: int, verb: str, argument: int, size: int, of_ids: bool, wanted: int
    ) -> None:
        """Tell it something; one that has ended does not hear it."""
        command = COMMAND.pack(number, VERBS.index(verb), argument, size, of_ids, wanted)
        with suppress(OSError):
            os.write(self.to.fileno(), command)

    def receive(self, number: int, deadline: float | None = None) -> Answer:
        """Wait for the answer to a command.

        Raises:
            EOFError: The process ends without one.
            TimeoutError: The deadline (of `time.monotonic`) is over, where that can be known.
        """
        while True:
            if deadline is not None and hasattr(select, "poll"):
                poll = select.poll()
                poll.register(self.out.fileno(), select.POLLIN)
                if not poll.poll(max(0.0, 1000 * (deadline - time.monotonic()))):
                    raise TimeoutError
            self._asleep = await_message(self.out.fileno(), self._asleep)
            frame = os.read(self.out.fileno(), ANSWER.size)
            if len(frame) < ANSWER.size:
                raise EOFError
            answered, size = ANSWER.unpack(frame)
            if answered == number:
                place = self._place
                return pickle.loads(self._block.memory[place : place + size]) if size else NOTHING


def end_all(processes: list[WorldsProcess], owner: int) -> None:
    """End processes; in a fork of the process that owns them, nothing is done."""
    if os.getpid() != owner:
        return
    for process in processes:
        process.leave()
    for process in processes:
        process.close()


def lost_worlds(processes: list[WorldsProcess]) -> EngineError:
    """The error that tells which worlds are lost with those of the processes that have ended."""
    time.sleep(_ENDING)
    hows = {process: how for process in processes if (how := process.how_it_ended(0.0))}
    worlds = tuple(sorted(world for process in hows for world in process.worlds))
    numbers = ", ".join(map(str, worlds[:8])) + (", …" if len(worlds) > 8 else "")
    named = f"world {numbers} is" if len(worlds) == 1 else f"{len(worlds)} worlds ({numbers}) are"
    return EngineError(
        f"{named} lost with the process that held them: {', '.join(dict.fromkeys(hows.values()))}. "
        "These Worlds are closed: make others with make_worlds",
        worlds=worlds,
    )


class _Apart(Holder):
    """The worlds of this process, for another one."""

    def __init__(self, memory: mmap.mmap, number: int) -> None:
        super().__init__(memory, number, None)  # the Model comes with the first command
        self._command = 0  # the number of what is being done
        self._warnings: list[tuple[type[Warning], str]] = []
        warnings.simplefilter("always")
        # Warnings are kept for the answer.
        warnings.showwarning = lambda message, kind, *_, **__: self._warnings.append(
            (kind, str(message))
        )
        for name in ("SIGINT", "SIGBREAK"):  # the second on Windows
            if hasattr(signal, name):
                signal.signal(getattr(signal, name), self._signalled)

    def stopped(self) -> bool:
        return self._command < self._stop.item()

    def _signalled(self, *_: Any) -> None:
        if self.running and self.stopped():
            raise StepStopped

    def _start(self, place: int, job: Mapping[str, Any], places: Any) -> dict[str, Any]:
        self._place = place + self._number * ANSWER_MOST
        sys.path[:] = job["path"]
        for name, loader in job["loaders"].items():
            backends.register(name, loader)
        self._model = pickle.loads(job["model"])
        self._stop = arrays_in(self._memory, job["layout"])["stop"]
        return super()._start(0, job, places)

    def obey(self, command: tuple[int, int, int, int, int, int]) -> int:
        """Do what is asked, and leave the answer where it is looked for; how many bytes it has."""
        self._command, verb, argument, size, of_ids, wanted = command
        payload = pickle.loads(self._memory[:size]) if size else None
        value, raised, errors = self.answer(VERBS[verb], argument, payload, bool(of_ids), wanted)
        warned = {(_portable(kind, UserWarning), text): None for kind, text in self._warnings}
        self._warnings.clear()
        ended = {world: _portable_error(error) for world, error in errors.items()}
        answer = value, raised and _portable_error(raised), ended, list(warned)
        if answer == NOTHING:
            return 0
        blob = pickle.dumps(answer)
        if len(blob) > ANSWER_MOST:
            error = EngineError(f"an answer of {len(blob)} bytes is too large")
            blob = pickle.dumps((None, error, {}, []))
        self._memory[self._place : self._place + len(blob)] = blob
        return len(blob)


def _portable(value: T, otherwise: T) -> T:
    """A value that another process can read; if it cannot, the other."""
    try:
        return pickle.loads(pickle.dumps(value))
    except Exception:
        return otherwise


def _portable_error(error: Exception) -> Exception:
    """An error that another process can read: itself, or its text."""
    return _portable(error, EngineError(f"{type(error).__name__}: {shown(str(error))}"))


def main(handle: str, size: str, number: str) -> None:
    """Do what is asked until there is nobody to ask; then end the process."""
    try:
        _serve(handle, size, number)
    except Exception:
        traceback.print_exc()
    finally:
        os._exit(0)  # at once: there is nothing that the system does not take back


def _serve(handle: str, size: str, number: str) -> None:
    end_with_parent()  # also in the midst of a long step
    out, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)  # engines greet there, and warn
    holder = _Apart(open_block(handle, int(size)), int(number))
    asleep = 0
    while True:
        asleep = await_message(0, asleep)
        frame = os.read(0, COMMAND.size)
        if len(frame) < COMMAND.size:
            return
        command = COMMAND.unpack(frame)
        answered = 0 if VERBS[command[1]] == "stop" else holder.obey(command)
        os.write(out, ANSWER.pack(command[0], answered))
        if VERBS[command[1]] == "fill":
            os.dup2(nothing, 2)  # until now somebody read what was said there
