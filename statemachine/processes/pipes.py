"""A child that is told things by one pipe and answers by another."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from io import BufferedReader, BufferedWriter
from typing import Any, cast

from . import SERVERS
from .sandbox import signal_name

_SPIN = 50e-6  # [s] in which most calls are answered: to wake up takes longer
_ASLEEP = 20  # messages that are waited for asleep when one took longer
_ENDS_IN = 3.0  # seconds in which a process ends by itself when it is left alone


class PipedChild:
    """A process, and the pipes to it; it is to end at the end of its input.

    No Ctrl-C of the terminal's reaches it. In the child of a fork its pipes are closed: the
    process that started it alone decides when it ends.

    Attributes:
        to, out: Its standard input and output.
        pid: Its number in the system.
    """

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str], **options: Any
    ) -> None:
        """Start it; `options` are of `subprocess.Popen`."""
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (as long as it lives)
        self._process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            **options,
        )
        self.to = cast("BufferedWriter", self._process.stdin)
        self.out = cast("BufferedReader", self._process.stdout)
        self.pid = self._process.pid
        SERVERS.add(self)

    def how_it_ended(self, seconds: float = _ENDS_IN) -> str:
        """In a few words, of one that has ended, or does so in this time; "" of one that lives."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)
        code = self._process.returncode
        if code is None:
            return ""
        if code < 0:
            return f"ended by {signal_name(-code)}"
        self._said.seek(0)
        return last_line(self._said.read(), code)

    def leave(self) -> None:
        """Close the pipes: at their end it ends."""
        for pipe in (self.to, self.out):
            with suppress(OSError):
                pipe.close()

    def interrupt(self) -> None:
        """Send it what Ctrl-C sends, or on Windows Ctrl-Break."""
        self._process.send_signal(getattr(signal, "CTRL_BREAK_EVENT", signal.SIGINT))

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def close(self) -> None:
        """Wait for its end, which is not to be long. Idempotent."""
        self.leave()
        try:
            self._process.wait(_ENDS_IN)
        except BaseException:  # a second Ctrl-C, too
            self.kill()
            self._process.wait()
        self._said.close()


def await_message(pipe: int, asleep: int) -> int:
    """Look for a message for a short time, awake; who reads then sleeps until one is there.

    It does not yield the processor: where others wait for that, it would be gone for a whole
    time slice, which is longer than the calls that this is for. Where a message does not come in
    time (its sender needs this very processor, or has other things to do), the next ones are
    waited for asleep.

    Args:
        pipe: Its descriptor. On Windows no pipe can be looked at so.
        asleep: How many messages are to be waited for asleep: 0 first, then what this returned.
    """
    until = time.perf_counter() + _SPIN
    while os.name != "nt" and not asleep and not select.select([pipe], [], [], 0)[0]:
        if time.perf_counter() > until:
            asleep = _ASLEEP
    return max(0, asleep - 1)


def last_line(said: bytes, code: int) -> str:
    """The last thing that a process said, which may be its error; or its exit code."""
    lines = said.decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else f"exit code {code}"


def _let_go() -> None:
    for process in SERVERS:
        for pipe in (process.to, process.out):  # not `leave`: another thread may hold their locks
            pipe.raw.close()  # pyright: ignore[reportAttributeAccessIssue]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)
