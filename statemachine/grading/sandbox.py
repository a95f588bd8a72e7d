"""Run a command that may loop, crash, flood or leave processes behind, and come back from it.

On POSIX it gets a session and limits of its own; on Linux processes that left the session are
found too, and it ends when we do. With `writable`, and where Linux permits it to any user, it
is shut in (see `_launcher`). On Windows only the process itself is ended.

Where it is not shut in it has the rights of whoever runs it, and this guards against what goes
wrong, not against an attacker. Where it is, it still reads what its user can read, and a fault
of the kernel's lets it out.
"""

from __future__ import annotations

import math
import os
import secrets
import signal
import site
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from .limits import WATCHED, cpu_of, ended_by_cpu

GB = 1024**3
# Address space, of which engines reserve far more than they use.
MEMORY_MOST = 4 * GB
_FILE_MOST = GB // 4
_FLOOD = GB // 4  # bytes of output that only a loop without end writes
_TOKEN = "STATEMACHINE_SANDBOX"
_PATIENCE = 2.0  # seconds to end what a command left behind
_CHUNK = 65536
_LOOK = 0.1  # seconds between two looks at what it does
_LAUNCHER = str(Path(__file__).with_name("_launcher.py"))


@dataclass(frozen=True)
class ProcessOutcome:
    """How a command ended.

    Attributes:
        returncode: Its exit code; None if a signal or a limit of time ended it.
        signal: The number of the signal that ended it, unless that was ours.
        started: Whether it got as far as `started` told, or was to.
        timed_out: Whether time on the clock ended it, or time asleep.
        out_of_cpu: Whether computing time ended it.
        flooded: Whether it was ended since it wrote without end.
        out_of_memory: Whether what it wrote last speaks of memory that it did not get.
        stdout, stderr: What it wrote, each up to `output_most` bytes.
        wall: How long it ran on the clock [s].
        cpu: How long it computed [s]; 0 where the system does not tell.
        asleep: How long it neither computed nor waited for a processor or a disk [s]; 0 where
            the system does not tell.
    """

    returncode: int | None
    signal: int | None
    started: bool
    timed_out: bool
    out_of_cpu: bool
    flooded: bool
    out_of_memory: bool
    stdout: str
    stderr: str
    wall: float
    cpu: float
    asleep: float


def run(
    command: Sequence[str],
    *,
    cpu: float,
    wall: float,
    asleep: float = math.inf,
    started: Callable[[], bool] | None = None,
    start: float = 60.0,
    start_cpu: float = 0.0,
    cwd: str | os.PathLike[str] | None = None,
    env: Mapping[str, str] | None = None,
    writable: str | os.PathLike[str] | None = None,
    output_most: int = 1_000_000,
    memory_most: int = MEMORY_MOST,
    stop: threading.Event | None = None,
) -> ProcessOutcome:
    """Run a command to its end, or to that of its time; nothing of it is left afterwards.

    Args:
        command: Program and arguments.
        cpu: Seconds that it may compute, on all processors together.
        wall: Seconds on the clock that it may take; at their end, on POSIX, it gets SIGPROF, so
            that a handler may tell where it is.
        asleep: Seconds of these in which it may do nothing and want nothing of the machine,
            where the system tells.
        started: Tells when it is ready, and `wall` begins; None for at once.
        start: Seconds on the clock that it may take until then.
        start_cpu: Seconds of computing until then that are not counted: for a command that
            limits itself from there (`limits.limit_cpu`).
        cwd: Where it runs; None for here.
        env: Its environment; None for ours.
        writable: The folder in which it has its home and its temporary files; where the system
            permits it, it can write nowhere else, and has no network and no other process in
            sight. None for none of this.
        output_most: Bytes of stdout, and of stderr, to keep; the rest is read and dropped.
        memory_most: Bytes of address space of each process, where the system can limit it.
        stop: Set by another thread, it ends the command as the time limit does.

    Raises:
        FileNotFoundError: `cwd` is not there, or on Windows the program.
    """
    token = secrets.token_hex(16)
    began = time.monotonic()
    process = subprocess.Popen(
        _limited(command, cpu + start_cpu, memory_most, writable),
        cwd=cwd,
        env={**(os.environ if env is None else env), **_home(writable), _TOKEN: token},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,  # without effect on Windows
    )
    readers = [_Reader(pipe, output_most) for pipe in (process.stdout, process.stderr)]
    waiting = _Waiting(process, readers, cpu, wall, asleep, token, stop or threading.Event())
    try:
        ready = started is None or waiting.until(started, began + start)
        if ready:
            waiting.to_the_end()
        timed_out = not (waiting.ended or waiting.out_of_cpu or waiting.flooded)
        took = time.monotonic() - began
        if timed_out and ready:
            waiting.ask_where()
    finally:  # an interrupt too
        _end_all(process, token)
        used = _reap(process)
    out, err = (reader.finish() for reader in readers)
    code = None if timed_out or not waiting.ended else process.returncode
    number = -code if code is not None and code < 0 else None
    out_of_cpu = waiting.out_of_cpu or ended_by_cpu(number, used, cpu)
    return ProcessOutcome(
        returncode=code if code is not None and code >= 0 else None,
        signal=None if out_of_cpu else number,
        started=ready or (started is not None and started()),
        timed_out=timed_out and not out_of_cpu,
        out_of_cpu=out_of_cpu,
        flooded=waiting.flooded,
        out_of_memory=waiting.ended and code != 0 and _speaks_of_memory(err),
        stdout=out,
        stderr=err,
        wall=took,
        cpu=used,
        asleep=waiting.asleep,
    )


def signal_name(number: int) -> str:
    """The name of the signal that ended a process."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _limited(
    command: Sequence[str],
    cpu: float,
    memory_most: int,
    writable: str | os.PathLike[str] | None,
) -> list[str]:
    if os.name != "posix":
        return list(command)
    limits = [str(limit) for limit in (os.getpid(), memory_most, math.ceil(cpu), _FILE_MOST)]
    place = "" if writable is None else str(Path(writable).resolve())
    return [sys.executable, "-I", "-S", _LAUNCHER, *limits, place, *command]


def _home(writable: str | os.PathLike[str] | None) -> dict[str, str]:
    """A home and a place for temporary files; what is installed in ours is found."""
    if writable is None:
        return {}
    place = str(Path(writable).resolve())
    names = ("HOME", "USERPROFILE", "TMPDIR", "TEMP", "TMP")
    return {**dict.fromkeys(names, place), "PYTHONUSERBASE": site.getuserbase()}


class _Waiting:
    """Waits for a process. On POSIX it is not reaped yet when it has ended.

    So that its number, and that of its group, is nobody else's when the group is killed.

    Attributes:
        ended: Whether it ended by itself.
        out_of_cpu: Whether it computed for too long, as seen from outside.
        flooded: Whether it wrote too much.
        asleep: How long it did nothing [s].
    """

    def __init__(
        self,
        process: subprocess.Popen[bytes],
        readers: Sequence[_Reader],
        cpu: float,
        wall: float,
        asleep_most: float,
        token: str,
        stop: threading.Event,
    ) -> None:
        self.ended = False
        self.out_of_cpu = False
        self.flooded = False
        self._process, self._readers = process, readers
        self._cpu, self._wall, self._stop = cpu, wall, stop
        self._asleep_most, self._token = asleep_most, token
        self.asleep = 0.0
        self._looked = time.monotonic()
        self._inside: list[Path] = []  # in /proc, without those that only launched it

    def until(self, ready: Callable[[], bool], deadline: float) -> bool:
        """Whether `ready` said so before the end, and before the deadline."""
        return self._wait(deadline, ready)

    def to_the_end(self) -> None:
        """Wait for the end, or that of one of its times."""
        before = cpu_of(self._process) if WATCHED else 0.0

        def exhausted() -> bool:
            self.out_of_cpu = WATCHED and cpu_of(self._process) - before > self._cpu
            self.flooded = any(reader.total > _FLOOD for reader in self._readers)
            self._look()
            return self.out_of_cpu or self.flooded or self.asleep > self._asleep_most

        self._wait(time.monotonic() + self._wall, exhausted)

    def _look(self) -> None:
        """Add to the time asleep, if no thread of it computes or waits for the machine."""
        if self._asleep_most == math.inf or (now := time.monotonic()) < self._looked + _LOOK:
            return
        self._looked = now  # if we were late ourselves, most of that is not known
        fields: list[list[bytes]] = []
        with suppress(OSError):  # any of them may end meanwhile
            self._inside = self._inside or [
                entry
                for entry in _relatives(self._process.pid, self._token)
                if _LAUNCHER.encode() not in (entry / "cmdline").read_bytes()
            ]
            fields = [_fields(task) for entry in self._inside for task in entry.glob("task/*")]
        self.asleep += _LOOK * (bool(fields) and not any(each[0] in b"RD" for each in fields))

    def ask_where(self) -> None:
        """Let it write down where it is, if it has a handler for that, and end."""
        if sys.platform == "win32":
            return
        for pid in [int(entry.name) for entry in self._inside] or [self._process.pid]:
            with suppress(OSError):
                os.kill(pid, signal.SIGPROF)
        self._wait(time.monotonic() + _PATIENCE / 2, lambda: False)

    def _wait(self, deadline: float, enough: Callable[[], bool]) -> bool:
        pause = 0.001
        while True:
            self.ended = _has_ended(self._process)
            if enough():
                return True
            remaining = deadline - time.monotonic()
            if self.ended or remaining <= 0 or self._stop.wait(min(pause, remaining)):
                return False
            pause = min(pause * 2, 0.02)


def _has_ended(process: subprocess.Popen[bytes]) -> bool:
    if sys.platform == "win32" or not hasattr(os, "waitid"):
        return process.poll() is not None
    options = os.WEXITED | os.WNOHANG | os.WNOWAIT
    return os.waitid(os.P_PID, process.pid, options) is not None


def _reap(process: subprocess.Popen[bytes]) -> float:
    """Wait for a process that was ended; how long it had computed [s]."""
    if sys.platform == "win32" or process.returncode is not None:
        process.wait()
        return 0.0
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def _end_all(process: subprocess.Popen[bytes], token: str) -> None:
    """Kill the command and all that it started."""
    if sys.platform == "win32":
        process.kill()
        return
    deadline = time.monotonic() + _PATIENCE
    first = True
    while True:
        found = {each for each in _relatives(process.pid, token) if int(each.name) != process.pid}
        if process.returncode is None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
        for entry in found:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(int(entry.name), signal.SIGKILL)
        if time.monotonic() > deadline or not (found or first):
            return
        first = False  # what was being forked meanwhile shows in the next round
        time.sleep(0.002)


def _relatives(leader: int, token: str) -> set[Path]:
    """Living processes of the session, or that carry the token, in /proc; without it, none."""
    mark = f"{_TOKEN}={token}".encode()
    found = set()
    for entry in Path("/proc").glob("[0-9]*"):
        state, _parent, _group, session = _fields(entry)
        with suppress(OSError):  # it ended meanwhile, or is another user's
            if state not in b"ZX" and (
                int(session) == leader or mark in (entry / "environ").read_bytes()
            ):
                found.add(entry)
    return found


def _fields(entry: Path) -> list[bytes]:
    """State, parent, group and session of a process or thread in /proc; it may have ended."""
    with suppress(OSError):
        # After the name in brackets, which may hold anything.
        return (entry / "stat").read_bytes().rpartition(b")")[2].split()[:4]
    return [b"X", b"0", b"0", b"0"]


def _speaks_of_memory(stderr: str) -> bool:
    tail = stderr[-2000:]
    return any(word in tail for word in ("MemoryError", "bad_alloc", "annot allocate memory"))


class _Reader:
    """Reads a pipe to its end in a thread, so that the writer never waits for us."""

    def __init__(self, pipe: IO[bytes] | None, most: int) -> None:
        assert pipe is not None
        self._pipe: Any = pipe
        self._most = most
        self._kept = bytearray()
        self.total = 0
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        with suppress(OSError, ValueError):
            while chunk := os.read(self._pipe.fileno(), _CHUNK):
                self.total += len(chunk)
                self._kept += chunk[: self._most - len(self._kept)]

    def finish(self) -> str:
        """What was read. Someone whom we could not end may hold the pipe open: not waited for."""
        self._thread.join(_PATIENCE)
        if not self._thread.is_alive():
            self._pipe.close()
        return bytes(self._kept).decode("utf-8", "replace")
