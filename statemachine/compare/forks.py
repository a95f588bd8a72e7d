"""Runs shared among forks of this process, which have its models and its controllers as they are.

Nothing has to be pickled but what a run gives. A fork keeps the number of threads by which NumPy
multiplies large matrices: with another number the last bits may be others. Threads of other
libraries do not come along, and code that waits for them would wait for ever: so each piece of work
has a limit.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, Pipe, wait
from typing import Any, TypeVar

from ..processes import checked_jobs

T = TypeVar("T")

_PAYS = 0.1  # [s] of work that a fork takes over; for less it costs more than it saves
_LEAST, _LONGEST = 20.0, 50.0  # [s] without a result, or so many times what one takes
_NONE = "this system has no forks"
_MANY = 1000  # whose numbers fit into a pipe


def forks_for(number: int, seconds: float, jobs: int | None) -> int:
    """How many forks are to share some runs; 1 means that this process makes them itself.

    There are none on Windows and macOS, nor, unless asked for, beside other threads or for work
    that is done sooner than shared.

    Args:
        number: Of runs.
        seconds: What one takes, by the clock.
        jobs: How many at most; None for as many as there are processors.

    Raises:
        BadInputError: `jobs` is less than 1.
    """
    most = min(checked_jobs(jobs), number)
    if not hasattr(os, "fork") or sys.platform == "darwin":
        return 1
    if jobs is None:
        most = 1 if threading.active_count() > 1 else min(most, int(number * seconds / _PAYS))
    return max(1, most)


def in_forks(
    work: Sequence[Callable[[], T]], jobs: int, ended: Callable[[], None], seconds: float = 0.0
) -> list[T | None]:
    """Do pieces of work in forks of this process. An interrupt ends them all.

    What raises in a fork is done again here, so that it is raised here; so is all where the system
    makes no forks now, and what takes longer than its limit. Where a fork ends before its work is
    done, killed or by a fault of the engine, that is tried again in a fork of its own.

    Args:
        work: What to call; what it returns can be pickled, and is not None.
        jobs: How many forks there are at once.
        ended: Called as each piece of work ends.
        seconds: What one takes here, by the clock: the measure of its limit.

    Returns:
        What each returned; None where two forks have ended in it.
    """
    found: dict[int, tuple[bool, T | None]] = {}
    limit = max(_LEAST, _LONGEST * seconds)
    for start in range(0, len(work), _MANY):
        numbers = range(start, min(start + _MANY, len(work)))
        _shared(work, numbers, jobs, found, ended, limit)
    for number in range(len(work)):
        if number not in found:
            _shared(work, [number], 1, found, ended, limit)
    results: list[T | None] = []
    for number, call in enumerate(work):
        well, result = found.get(number, (True, None))
        results.append(result if well else call())
    return results


def _shared(
    work: Sequence[Callable[[], T]],
    numbers: Sequence[int],
    jobs: int,
    found: dict[int, tuple[bool, T | None]],
    ended: Callable[[], None],
    limit: float,
) -> None:
    """Fill in what forks return, which take one number after the other from a pipe."""
    if sys.platform == "win32":
        raise OSError(_NONE)
    waiting, put = os.pipe()
    os.write(put, b"".join(number.to_bytes(4, "little") for number in numbers))
    os.close(put)
    forks: list[int] = []
    results: list[Connection[Any, Any]] = []
    try:
        for _ in range(min(jobs, len(numbers))):
            try:
                with _uninterrupted():
                    here, there = Pipe(duplex=False)
                    results.append(here)
                    with there:
                        forks.append(_fork(work, waiting, results, there))
            except OSError:  # no more processes, or no more files: those that are there do it
                break
        open_ = results[: len(forks)]
        while open_:
            ready = wait(open_, limit)
            if not ready:
                break
            for one in ready:
                assert isinstance(one, Connection)
                try:
                    number, *result = one.recv()
                except (EOFError, OSError):  # it has ended
                    open_.remove(one)
                    continue
                found[number] = result[0], result[1]
                ended()
        if open_ or not forks:  # what they did not do is done in this process
            found.update((n, (False, None)) for n in numbers if n not in found)
    finally:
        with _uninterrupted():
            os.close(waiting)
            for one in results:
                one.close()
            for fork in forks:
                with suppress(ProcessLookupError, ChildProcessError):
                    os.kill(fork, signal.SIGKILL)
                    os.waitpid(fork, 0)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """A Ctrl-C comes only afterwards; in a fork never, since this process answers it for all."""
    if sys.platform == "win32":
        raise OSError(_NONE)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _fork(
    work: Sequence[Callable[[], T]],
    waiting: int,
    parents: Sequence[Connection[Any, Any]],
    results: Connection[Any, Any],
) -> int:
    """Begin a fork; in it nothing is shown, and this does not return."""
    if sys.platform == "win32":
        raise OSError(_NONE)
    with warnings.catch_warnings():
        # Python counts threads of libraries, too: that of OpenBLAS is made for forks.
        warnings.simplefilter("ignore", DeprecationWarning)
        fork = os.fork()
    if fork:
        return fork
    try:
        faulthandler.disable()
        for one in parents:  # so that it ends with its parent
            one.close()
        nothing = open(os.devnull, "r+", encoding="utf-8")  # noqa: SIM115  (until it ends)
        sys.stdout = sys.stderr = nothing
        for stream in range(3):
            os.dup2(nothing.fileno(), stream)
        while word := os.read(waiting, 4):
            number = int.from_bytes(word, "little")
            try:
                result = True, work[number]()
            except BaseException:
                result = False, None
            results.send((number, *result))
    finally:
        os._exit(0)
