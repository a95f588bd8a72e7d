"""Children that do work: a fresh Python, how many at once, and how much memory is left for them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from io import BufferedReader, BufferedWriter
from pathlib import Path
from typing import Any, cast

from ..errors import BadInputError

if sys.platform != "win32":
    import resource

# The environment of several processes that run at once, each on one processor.
ALONE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# Processes that live and answer this one.
SERVERS = weakref.WeakSet[Any]()
_WATCH = 1.0  # seconds between two looks at whether the parent is still there


def fresh_python(function: str, *arguments: str) -> tuple[list[str], dict[str, str]]:
    """Return the command and environment that call a function in a fresh Python with the same
    import paths.

    Args:
        function: "package.module:function", by full name.
        *arguments: What it is called with.
    """
    code = f"import sys; from {function.replace(':', ' import ')} as call; call(*sys.argv[1:])"
    paths = [
        os.fspath(Path(__file__).resolve().parents[2]),
        *(path or os.getcwd() for path in sys.path),
    ]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(dict.fromkeys(paths))}
    return [sys.executable, "-P", "-c", code, *arguments], environment


def end_with_parent() -> None:
    """Let this process end, within a second, with the one that started it."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_WATCH)
        os._exit(1)

    if os.name != "nt":
        threading.Thread(target=watch, daemon=True).start()


def checked_jobs(jobs: int | None, processors: int = 1) -> int:
    """Return how many processes run at once: as asked for, or one for each processor that may be
    used.

    Raises:
        BadInputError: It is less than 1.
    """
    if jobs is None:
        usable = getattr(os, "sched_getaffinity", lambda _: range(os.cpu_count() or 1))(0)
        return max(1, len(usable) // processors)
    if jobs < 1:
        raise BadInputError(f"jobs must be at least 1; got {jobs}")
    return jobs


def free_memory() -> int | None:
    """Return the bytes that processes may still take before the kernel ends one; None where
    unknown.

    What Linux calls available, what is left to the control groups (containers) of this process,
    and what its own limit of addresses (`ulimit -v`) leaves it.
    """
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            lines = dict(line.split(":", 1) for line in file)
        free = int(lines["MemAvailable"].split()[0]) << 10
    except (OSError, KeyError):  # not Linux
        return None
    return max(min([free, *_left_to_groups(), *_left_of_addresses()]), 0)


def _left_of_addresses() -> Iterator[int]:
    """Yield the bytes that this process may still map, where it has a limit of its own."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        yield limit - pages * resource.getpagesize()


# Of a control group: where it is mounted, its limit, what it uses, and what of that the kernel
# gives up first; of the first and the second version.
_VERSIONS = {
    "memory": ("memory", "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    "": ("", "memory.max", "memory.current", "inactive_file"),
}


def _left_to_groups() -> Iterator[int]:
    """Yield the bytes that each control group with a limit, of those that this process is in,
    has left.
    """
    try:
        lines = Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, group = line.split(":", 2)
        if controllers not in _VERSIONS:
            continue
        mount, limit, used, inactive = _VERSIONS[controllers]
        root = Path("/sys/fs/cgroup") / mount
        place = root / group.strip("/")
        for folder in (place, *place.parents[: len(place.parts) - len(root.parts)]):
            with suppress(OSError, ValueError):  # no such file, or no limit: "max"
                most, now = (
                    int((folder / name).read_text(encoding="ascii")) for name in (limit, used)
                )
                stat = (folder / "memory.stat").read_text(encoding="ascii").split()
                yield most - now + int(stat[stat.index(inactive) + 1])


def resident_memory() -> int:
    """Return the bytes of memory that this process and its `SERVERS` hold; 0 where that is
    unknown.
    """
    pids = ["self", *(server.pid for server in SERVERS)]
    try:
        pages = [int(Path(f"/proc/{pid}/statm").read_text("ascii").split()[1]) for pid in pids]
        return sum(pages) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, AttributeError):  # not Linux
        return 0


# A child that is told things by one pipe and answers by another.

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
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  (as long as it lives)
        self._process = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._output,
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
            **options,
        )
        self.to = cast("BufferedWriter", self._process.stdin)
        self.out = cast("BufferedReader", self._process.stdout)
        self.pid = self._process.pid
        SERVERS.add(self)

    def how_it_ended(self, seconds: float = _ENDS_IN) -> str:
        """Return in a few words how a process ended, now or within this time; "" of one that
        lives.
        """
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)
        code = self._process.returncode
        if code is None:
            return ""
        if code < 0:
            return f"ended by {signal_name(-code)}"
        self._output.seek(0)
        return last_line(self._output.read(), code)

    def leave(self) -> None:
        """Close the pipes: at their end it ends."""
        for pipe in (self.to, self.out):
            with suppress(OSError):
                pipe.close()

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
        self._output.close()


def signal_name(number: int) -> str:
    """Return the name of the signal that ended a process."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def last_line(said: bytes, code: int) -> str:
    """Return the last line that a process printed, which may be its error, or its exit code."""
    lines = said.decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else f"exit code {code}"


def _let_go() -> None:
    for process in SERVERS:
        for pipe in (process.to, process.out):  # not `leave`: another thread may hold their locks
            pipe.raw.close()  # pyright: ignore[reportAttributeAccessIssue]


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go)
