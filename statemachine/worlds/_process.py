"""One process that holds worlds, as the process that started it sees it."""

from __future__ import annotations

import os
import pickle
import select
import signal
import subprocess
import tempfile
import time
import weakref
from contextlib import suppress
from typing import Any

from ..errors import EngineError
from ..processes import fresh_python
from ._protocol import ANSWER, ANSWER_MOST, COMMAND, VERBS
from ._shared import SharedBlock

_ENDS_IN = 3.0  # seconds in which a process ends by itself when it is left alone
_AGAIN = 0.05  # seconds after which it is told once more to stop


class WorldsProcess:
    """A process, and the pipes to it.

    Attributes:
        worlds: Numbers of the worlds that it holds.
        lost: Whether it ended, though nobody closed it.
    """

    def __init__(self, number: int, worlds: range, block: SharedBlock, answers: int) -> None:
        """Start it.

        Args:
            number: Its number among those of these worlds.
            worlds: Numbers of the worlds that it is to hold.
            block: The memory that it shares with this process.
            answers: Where in that the answers of all processes are.
        """
        self.worlds, self.lost, self._why = worlds, False, ""
        self._block, self._place = block, answers + number * ANSWER_MOST
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (until it has started)
        command, environment = fresh_python(
            f"{__package__}._worker", block.handle, str(block.size), str(number)
        )
        self._process = subprocess.Popen(
            command,
            env=environment,
            bufsize=0,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            # No Ctrl-C of the terminal's reaches it.
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            **block.inherited,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin, self._process.stdout
        _LIVING.add(self)

    @property
    def pid(self) -> int:
        """Its number in the system."""
        return self._process.pid

    def send(
        self, number: int, verb: str, argument: int = 0, size: int = 0, of_ids: bool = False
    ) -> None:
        """Tell it something; one that has ended does not hear it."""
        if self.lost:
            return
        try:
            os.write(
                self._to.fileno(), COMMAND.pack(number, VERBS.index(verb), argument, size, of_ids)
            )
        except OSError:
            self.lost = True

    def receive(self, number: int) -> dict[str, Any] | None:
        """Wait for the answer to a command; None if the process ends without one."""
        while not self.lost:
            told, size = self._read()
            if told == number:
                place = self._place
                return pickle.loads(self._block.memory[place : place + size]) if size else {}
        return None

    def _read(self) -> tuple[int, int]:
        frame = os.read(self._from.fileno(), ANSWER.size)
        if len(frame) < ANSWER.size:
            self.lost = True
            return 0, 0
        return ANSWER.unpack(frame)

    def stop(self, number: int, deadline: float) -> None:
        """Wait until it has ended what it was at, as the command `number` told it to.

        One that has not done so at `deadline` (of `time.monotonic`) is killed.
        """
        while not self.lost:
            if self._told():
                if self._read()[0] == number:
                    return
            elif time.monotonic() > deadline:
                self.give_up("it did not end its step when it was interrupted")
            else:  # what it is at may have swallowed the interrupt
                self.send(number, "stop")

    def _told(self) -> bool:
        """Whether an answer is there, or comes soon; where that cannot be known, True."""
        if not hasattr(select, "poll"):
            return True
        poll = select.poll()
        poll.register(self._from.fileno(), select.POLLIN)
        return bool(poll.poll(1000 * _AGAIN))

    def started(self) -> None:
        """It has all its worlds: what it says from now on is noise."""
        self._said.close()

    def how_it_ended(self) -> str:
        """In a few words, of one that is lost."""
        if self._why:
            return self._why
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDS_IN)
        code = self._process.returncode
        if code is None or code == 0:
            how = "it ended"
        elif code < 0:
            with suppress(ValueError):
                return f"ended by {signal.Signals(-code).name}"
            how = f"ended by signal {-code}"
        else:
            how = f"exit code {code}"
        with suppress(OSError, ValueError):
            self._said.seek(0)
            lines = self._said.read().decode(errors="replace").strip().splitlines()
            return lines[-1] if lines else how
        return how

    def give_up(self, why: str) -> None:
        """Kill it: its worlds are lost."""
        self.lost, self._why = True, why
        self.kill()

    def leave(self) -> None:
        """Close the pipes: at their end it ends."""
        for pipe in (self._to, self._from):
            with suppress(OSError):
                pipe.close()

    def kill(self) -> None:
        """End it at once."""
        with suppress(OSError):
            self._process.kill()

    def wait(self) -> None:
        """Wait for its end, which is not to be long."""
        try:
            self._process.wait(_ENDS_IN)
        except BaseException:  # a second Ctrl-C, too
            self.kill()
            self._process.wait()
        self._said.close()


def end_all(processes: list[WorldsProcess], owner: int) -> None:
    """End processes; in a fork of the process that owns them, nothing is done."""
    if os.getpid() != owner:
        return
    for process in processes:
        process.leave()
    for process in processes:
        process.wait()


def lost_worlds(processes: list[WorldsProcess]) -> EngineError:
    """The error that tells which worlds are lost with some processes."""
    worlds = tuple(sorted(world for process in processes for world in process.worlds))
    hows = ", ".join(dict.fromkeys(process.how_it_ended() for process in processes))
    numbers = ", ".join(map(str, worlds[:8])) + (", …" if len(worlds) > 8 else "")
    named = f"world {numbers} is" if len(worlds) == 1 else f"{len(worlds)} worlds ({numbers}) are"
    return EngineError(
        f"{named} lost with the process that held them: {hows}. They are left out until reset "
        "or set_state, which make them anew; the others have gone on",
        worlds=worlds,
    )


_LIVING: weakref.WeakSet[WorldsProcess] = weakref.WeakSet()


def _let_go() -> None:
    """In the child of a fork: the pipes are the parent's, which alone decides when they end."""
    for process in _LIVING:
        process.leave()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)
