"""Runs shared among forks of this process, which have its models and its controllers as they are.

Nothing has to be pickled but what a run gives. A fork keeps the number of threads by which NumPy
multiplies large matrices: with another number the last bits may be others. Threads of other
libraries do not come along, and code that waits for them would wait for ever: so each piece of work
has a limit.
"""

from __future__ import annotations

import faulthandler
import os
import sys
import threading
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, TypeVar

from . import checked_jobs, end_with_parent
from .parallel import sigint_blocked

T = TypeVar("T")

_PAYS = 0.1  # [s] of work that a fork takes over; for less it costs more than it saves
_LEAST, _LONGEST = 20.0, 50.0  # [s] without a result, or so many times what one takes
_work: Sequence[Callable[[], Any]] = ()  # of the forks that are made


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
    global _work  # noqa: PLW0603  (forks find it here, and nothing is pickled)
    _work = work
    limit = max(_LEAST, _LONGEST * seconds)
    outcomes = _shared(range(len(work)), jobs, ended, limit)
    for number, (error, _) in dict(outcomes).items():
        if isinstance(error, BrokenProcessPool):
            outcomes |= _shared([number], 1, ended, limit)
    results: list[T | None] = []
    for number, call in enumerate(work):
        error, result = outcomes.get(number, (NotImplementedError(), None))
        well = error is None or isinstance(error, BrokenProcessPool)
        results.append(result if well else call())
    return results


def _shared(
    numbers: Sequence[int], jobs: int, ended: Callable[[], None], limit: float
) -> dict[int, tuple[BaseException | None, Any]]:
    """The error or the result of what forks did, by number; until nothing comes for `limit` [s]."""
    if sys.platform == "win32":
        raise OSError("this system has no forks")
    pool = ProcessPoolExecutor(min(jobs, len(numbers)), get_context("fork"), _settle)
    futures: dict[Future[Any], int] = {}
    try:
        with sigint_blocked(), warnings.catch_warnings():
            # Python counts threads of libraries, too: that of OpenBLAS is made for forks.
            warnings.simplefilter("ignore", DeprecationWarning)
            for number in numbers:
                futures[pool.submit(_do, number)] = number
    except OSError:  # no more processes, or no more files
        return {}
    forks, waiting = list(pool._processes.values()), set(futures)
    outcomes: dict[int, tuple[BaseException | None, Any]] = {}
    try:
        while waiting:
            done, waiting = wait(waiting, limit, FIRST_COMPLETED)
            if not done:
                break
            for future in done:
                error = future.exception()
                outcomes[futures[future]] = error, None if error else future.result()
                if not error:
                    ended()
    finally:
        for fork in forks:
            fork.kill()
        pool.shutdown(cancel_futures=True)
    return outcomes


def _settle() -> None:
    """In a fork nothing is shown, and it ends with its parent."""
    faulthandler.disable()
    nothing = open(os.devnull, "r+", encoding="utf-8")  # noqa: SIM115  (until it ends)
    sys.stdout = sys.stderr = nothing
    for stream in range(3):
        os.dup2(nothing.fileno(), stream)
    end_with_parent()


def _do(number: int) -> Any:
    return _work[number]()
