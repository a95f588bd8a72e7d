"""Run a command that may loop, crash, flood or leave processes behind, and come back from it.

On POSIX it gets a session and limits of its own; on Linux processes that left the session are
found too, and it ends when we do. With `writable`, and where Linux permits it to any user, it
is shut in (see `_launcher` and `shut_in`). On Windows only the process itself is ended.

Where it is not shut in it has the rights of whoever runs it, and this guards against what goes
wrong, not against an attacker. Where it is, it sees what its `view` shows (without one, all that
its user can read), and a fault of the kernel's lets it out.
"""

from __future__ import annotations

import faulthandler
import math
import os
import re
import secrets
import signal
import site
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Literal, cast

from . import signal_name
from .places import View, bare_python
from .process_tree import PATIENCE, TOKEN, cpu_of, end_all, reap, relatives, wait

GB = 1024**3
# Address space, of which engines reserve far more than they use.
MEMORY_MOST = 4 * GB
_FILE_MOST = GB // 2
FLOOD_BYTES = GB // 4  # bytes of output that only a loop without end writes
_NO_MEMORY = "MemoryError|bad_alloc|annot allocate memory"  # at the end of stderr
_LAUNCHER = str(Path(__file__).with_name("_launcher.py"))
# Where a process cannot limit its computing time, it is watched from outside.
WATCHED = sys.platform == "win32"


End = Literal["code", "signal", "memory", "cpu", "clock", "flood"]


@dataclass(frozen=True)
class ProcessOutcome:
    """How a command ended.

    Attributes:
        end: Whether it ended by itself ("code"), by a signal that was not ours ("signal"), since
            it got no more memory ("memory"), or by a limit: of computing ("cpu"), of the clock
            ("clock"; also when it was stopped), of what it writes ("flood").
        code: Its exit code, or the number of the signal that ended it; 0 where we did.
        started: Whether it got as far as `started` told, or was to.
        stdout, stderr: What it wrote, each up to `output_most` bytes.
        wall: How long it ran on the clock [s].
        cpu: How long it computed [s]; 0 where the system does not tell.
        how: The same in words that follow "it": "ended the process with code 1".
    """

    end: End
    code: int
    started: bool
    stdout: str
    stderr: str
    wall: float
    cpu: float
    how: str


@dataclass(frozen=True)
class Limits:
    """What a command may take.

    Attributes:
        cpu: Seconds that it may compute, on all processors together.
        wall: Seconds on the clock that it may take; at their end, on POSIX, it gets SIGPROF, so
            that a handler may tell where it is.
        start: Seconds on the clock that it may take until it is ready, and `wall` begins.
        start_cpu: Seconds of computing until then that are not counted: for a command that
            limits itself from there (`limit_cpu`).
        output_most: Bytes of stdout, and of stderr, to keep.
        memory_most: Bytes of address space of each process, where the system can limit it.
    """

    cpu: float
    wall: float
    start: float = 60.0
    start_cpu: float = 0.0
    output_most: int = 1_000_000
    memory_most: int = MEMORY_MOST


@dataclass(frozen=True)
class _Home:
    """What a command has of the files of this machine.

    Attributes:
        folder: The only folder in which it can write, where it is shut in; else "".
        view: The folder with what it sees beside, as `_launcher` reads it; "" for all.
        environment: Variables that lead it to its home.
    """

    folder: str
    view: str
    environment: dict[str, str]


def run(
    command: Sequence[str],
    limits: Limits,
    *,
    started: Callable[[], bool] = lambda: True,
    cwd: str | os.PathLike[str] | None = None,
    env: Mapping[str, str] | None = None,
    writable: str | os.PathLike[str] | None = None,
    view: View | None = None,
    stop: threading.Event | None = None,
) -> ProcessOutcome:
    """Run a command to its end, or to that of its time; nothing of it is left afterwards.

    Args:
        command: Program and arguments.
        limits: What it may take.
        started: Tells when it is ready, and the limits of time begin.
        cwd: Where it runs; None for here.
        env: Its environment; None for ours.
        writable: The folder in which it has its home and its temporary files; where it is
            `shut_in`, it can write nowhere else, and has no network and no other process in
            sight. None for none of this.
        view: With `writable`: all that it sees of the files of this machine, beside that folder,
            where it is `shut_in`. None for all.
        stop: Set by another thread, it ends the command as the time limit does.

    Raises:
        FileNotFoundError: `cwd` is not there, or on Windows the program.
    """
    token, stopped = secrets.token_hex(16), stop or threading.Event()
    with ExitStack() as stack:
        home = _Home("", "", {})
        if writable is not None:
            home = stack.enter_context(_home_in(writable, view))
        out, err = (stack.enter_context(tempfile.TemporaryFile()) for _ in range(2))
        environment = dict(os.environ if env is None else env) | home.environment
        began = time.monotonic()
        process = subprocess.Popen(
            [*_launched(limits, home), *command],
            cwd=cwd,
            env=environment | {TOKEN: token},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            start_new_session=True,  # without effect on Windows
        )
        before = 0.0

        def ready() -> str:
            return "ready" if started() else ""

        def exceeded() -> str:
            if WATCHED and cpu_of(process) - before > limits.cpu:
                return "cpu"
            flooded = any(os.fstat(file.fileno()).st_size > FLOOD_BYTES for file in (out, err))
            return "flood" if flooded else ""

        try:
            end = wait(process, began + limits.start, ready, stopped)
            if is_ready := end == "ready":
                before = cpu_of(process) if WATCHED else 0.0
                end = wait(process, time.monotonic() + limits.wall, exceeded, stopped)
            took = time.monotonic() - began
            if is_ready and end == "clock":
                _ask_where(process, token)
        finally:  # an interrupt too
            end_all(process, token)
            used = reap(process)
        for file in (out, err):
            file.seek(0)
        stdout, stderr = (file.read(limits.output_most) for file in (out, err))
    errors = stderr.decode("utf-8", "replace")
    end, code = _told_end(end, process.returncode, errors, used >= limits.cpu)
    return ProcessOutcome(
        end=end,
        code=code,
        started=is_ready or started(),
        stdout=stdout.decode("utf-8", "replace"),
        stderr=errors,
        wall=took,
        cpu=used,
        how=_how(end, code, used, limits.cpu, limits.wall if is_ready else limits.start),
    )


def _launched(limits: Limits, home: _Home) -> list[str]:
    """Return what begins a command, so that the system limits it."""
    if os.name != "posix":
        return []
    computing = math.ceil(limits.cpu + limits.start_cpu)
    words = os.getpid(), limits.memory_most, computing, _FILE_MOST, home.folder, home.view
    return [sys.executable, "-I", "-S", _LAUNCHER, *map(str, words)]


@contextmanager
def _home_in(writable: str | os.PathLike[str], view: View | None) -> Iterator[_Home]:
    """Give a command its home in a folder; with a view, where it is shut in, nothing else."""
    folder = str(Path(writable).resolve())
    environment: dict[str, str] = dict.fromkeys(
        ("HOME", "USERPROFILE", "TMPDIR", "TEMP", "TMP"), folder
    )
    if site.ENABLE_USER_SITE:  # what is installed in ours is found
        environment["PYTHONUSERBASE"] = site.getuserbase()
    if not shut_in():
        yield _Home("", "", environment)
    elif view is None:
        yield _Home(folder, "", environment)
    else:
        with _written(view) as seen:
            yield _Home(folder, seen, environment)


def _told_end(end: str, returncode: int, stderr: str, used_up: bool) -> tuple[End, int]:
    """Return what ended a command, and its exit code or the number of the signal that did.

    Args:
        end: What the waiting for it ended with.
        returncode: As `subprocess` has it.
        stderr: What it wrote.
        used_up: Whether it has computed as long as it may.
    """
    code = returncode if end == "code" else 0
    if code < 0:
        code = -code
        of_a_limit = code in (signal.SIGPROF, signal.SIGXCPU)
        end = "cpu" if of_a_limit or (code == signal.SIGKILL and used_up) else "signal"
    if end != "cpu" and code and re.search(_NO_MEMORY, stderr[-2000:]):
        end = "memory"
    return cast("End", end), code


def _how(end: End, code: int, used: float, most_cpu: float, most_clock: float) -> str:
    """Return how a command ended, in words that follow "it".

    Args:
        end: What ended it.
        code: Its exit code, or the number of the signal that ended it.
        used: How long it computed [s].
        most_cpu: How long it could compute [s].
        most_clock: How long it could take on the clock [s].
    """
    words: dict[End, str] = {
        "code": f"ended the process with code {code}",
        "signal": f"crashed the process ({signal_name(code)})",
        "memory": "asks for more memory than there is for it",
        "cpu": f"took longer than {most_cpu:g} s of computing",
        "clock": f"took longer than {most_clock:g} s on the clock, and computed for {used:.1f} s",
        "flood": f"prints more than {FLOOD_BYTES >> 20} MB, and was ended there",
    }
    return words[end]


_asked = threading.Lock()
shut_in_answers: dict[str, bool] = {}


def shut_in() -> bool:
    """Return whether this system lets us shut a command in; it is tried once.

    That needs Linux, user namespaces that any user may make, and mounts in them: some containers
    and distributions permit no such thing.
    """
    if sys.platform != "linux":
        return False
    with _asked:
        if "" not in shut_in_answers:
            shut_in_answers[""] = runs_shut_in()
        return shut_in_answers[""]


def runs_shut_in() -> bool:
    """Return whether a Python that is shut in, and sees nothing but Python, comes to its end."""
    with tempfile.TemporaryDirectory() as folder, _written(bare_python()) as view:
        command = [sys.executable, "-I", "-S", "-c", "import ctypes, json, os; os.listdir('.')"]
        limits = (os.getpid(), MEMORY_MOST, 60, _FILE_MOST, os.path.realpath(folder), view)
        tried = subprocess.run(
            [sys.executable, "-I", "-S", _LAUNCHER, *map(str, limits), *command],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
    return tried.returncode == 0


@contextmanager
def _written(view: View) -> Iterator[str]:
    """Write a view down as `_launcher` reads it; give the folder."""
    with tempfile.TemporaryDirectory(prefix="statemachine-") as folder:
        Path(folder, "root").mkdir()
        lines = "".join(f"{line}\0" for line in view.lines())
        Path(folder, "places").write_bytes(os.fsencode(lines))
        yield os.path.realpath(folder)


def limit_cpu(seconds: float, trace: IO[str]) -> None:
    """End this process after so much more computing; that, or `run`, has its line told.

    Where it cannot, the line is noted each second, and `run` ends the process.

    Args:
        seconds: Of computing, on all processors together.
        trace: Where the fault handler writes; it works while Python itself is not reached.
    """
    if sys.platform == "win32":
        faulthandler.dump_traceback_later(1.0, repeat=True, file=trace)
        return
    import resource

    faulthandler.register(signal.SIGPROF, file=trace, chain=True)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    last = math.ceil(time.process_time() + seconds) + 1  # where the signal was refused
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CPU, (last, last))


def _ask_where(process: subprocess.Popen[bytes], token: str) -> None:
    """Let it write down where it is, if it has a handler for that, and end."""
    if sys.platform == "win32":
        return
    inside = [process.pid]
    with suppress(OSError):  # any of them may end meanwhile
        inside = [
            int(entry.name)
            for entry in relatives(process.pid, token)
            if _LAUNCHER.encode() not in (entry / "cmdline").read_bytes()
        ] or inside
    for pid in inside:
        with suppress(OSError):
            os.kill(pid, signal.SIGPROF)
    wait(process, time.monotonic() + PATIENCE / 2, str, threading.Event())
