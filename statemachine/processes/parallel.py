"""Several pieces of work at once; a signal to end leaves nothing running.

In threads that wait for processes; in processes that stay; or in forks of this process, which have
its models and its controllers as they are: nothing has to be pickled but what a run gives. A
fork keeps the number of threads by which NumPy multiplies large matrices: with another number the
last bits may be others. Threads of other libraries do not come along, and code that waits for them
would wait for ever: so each piece of work has a limit.
"""

from __future__ import annotations

import faulthandler
import importlib
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import get_context
from types import FrameType, MappingProxyType
from typing import Any, TypeVar

from . import ALONE, checked_jobs, end_with_parent
from .signals import sigint_blocked

T = TypeVar("T")

_LOKY = "joblib.externals.loky.process_executor"
_TRACKERS = (
    "multiprocessing.resource_tracker",
    "joblib.externals.loky.backend.resource_tracker",
)
WORTH_A_FORK = 0.1  # [s] of work that a fork takes over; for less it costs more than it saves
_LOOK = 0.2  # [s] between two looks at whether all is to end
LEAST_WAIT, _LONGEST = 20.0, 50.0  # [s] without a result, or so many times what one takes
_work: Sequence[Callable[[], Any]] = ()  # of the forks that are made


def in_parallel(
    work: Mapping[str, Callable[[], T]],
    jobs: int,
    stop: Callable[[], object],
    progress: Callable[[int], None] = lambda _left: None,
    ended: Callable[[dict[str, T]], object] = lambda _results: None,
    known: Mapping[str, T] = MappingProxyType({}),
) -> dict[str, T]:
    """Do all of it, in threads that wait for processes.

    Args:
        work: What to call, by name, in the order in which it is begun.
        jobs: How many are called at once.
        stop: Called once at the end, or when something is raised: what still runs must end then.
        progress: Told every moment how many are still waited for.
        ended: Called here as each ends, with the results so far.
        known: Results that are there already, of what is done anew or not at all.

    Returns:
        The results by name, in the order in which they came.
    """
    results = dict(known)
    with ThreadPoolExecutor(jobs) as pool:
        try:
            waiting = {pool.submit(call): name for name, call in work.items()}
            while waiting:
                for future in wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED).done:
                    results[waiting.pop(future)] = future.result()
                    ended(results)
                progress(len(waiting))
        finally:
            stop()
            pool.shutdown(wait=False, cancel_futures=True)
    return results


@contextmanager
def worker_processes(jobs: int) -> Iterator[list[Callable[..., Future[Any]]]]:
    """Yield a function for each of several processes, which submits a call to it.

    The processes end with the context. They are joblib's, which need no `if __name__ ==
    "__main__"` of the user. Each computes on one processor. Where one ends, what was submitted to
    it fails with BrokenProcessPool, nothing that others do is lost, and what is submitted to it
    next has a new process.
    """
    _begin_trackers()
    # An executor of several processes would lose the work of all with any one of them.
    new = partial(importlib.import_module(_LOKY).ProcessPoolExecutor, 1, env=ALONE)
    executors = [new() for _ in range(jobs)]

    def submit(worker: int, *call: Any) -> Future[Any]:
        with sigint_blocked():
            try:
                return executors[worker].submit(*call)
            except BrokenProcessPool:
                executors[worker] = new()
                return executors[worker].submit(*call)

    with warnings.catch_warnings():
        # joblib replaces a process that has grown by 300 MB, as one does with many models.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
        try:
            yield [partial(submit, worker) for worker in range(jobs)]
        finally:
            for executor in executors:
                with suppress(Exception):
                    executor.shutdown(wait=True, kill_workers=True)


def _begin_trackers() -> None:
    """Begin the processes that remove what others leave: they unblock SIGINT when they begin.

    What is left where work is stopped they remove; they need not tell.
    """
    before = os.environ.get("PYTHONWARNINGS", "")
    os.environ["PYTHONWARNINGS"] = f"{before},ignore:resource_tracker".lstrip(",")
    try:
        for name in _TRACKERS if os.name != "nt" else ():
            importlib.import_module(name).ensure_running()
    finally:
        os.environ["PYTHONWARNINGS"] = before  # "" is as if it were not there


class _Ended(BaseException):
    """A signal to end came; `args` has its number."""


def _handlers_to_end() -> dict[int, Any]:
    """Return the handlers of the signals to end that are not ignored, by their numbers."""
    handlers: dict[int, Any] = {}
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", None), signal.SIGINT):
        if number is not None:
            handler = signal.getsignal(number)
            if handler not in (signal.SIG_IGN, None):
                handlers[number] = handler
    return handlers


def _restore(handlers: dict[int, Any]) -> None:
    for number, handler in handlers.items():
        signal.signal(number, handler)


@contextmanager
def unwinding(at_once: bool = True) -> Iterator[Callable[[], None]]:
    """Let SIGTERM, SIGHUP and SIGINT first unwind what is inside, and then end the process as
    usual.

    A second one does not disturb the cleaning up. One that is ignored (nohup) stays so. Only in
    the main thread, where Python takes signals.

    Args:
        at_once: Whether a signal raises wherever it comes; else where the function that is given
            is called, so that it never comes while the lock of a future is held.

    Raises:
        KeyboardInterrupt: SIGINT came.
        SystemExit: SIGTERM or SIGHUP came.
    """
    came: list[int] = []

    def raise_if_ended() -> None:
        if came:
            raise KeyboardInterrupt if came[0] == signal.SIGINT else _Ended(came[0])

    if threading.current_thread() is not threading.main_thread():
        yield raise_if_ended
        return

    def end(number: int, _frame: FrameType | None) -> None:
        for other in before:
            signal.signal(other, signal.SIG_IGN)
        came.append(number)
        if at_once:
            raise_if_ended()

    before = _handlers_to_end()
    ended = 0
    try:
        for number in before:
            signal.signal(number, end)
        yield raise_if_ended
        raise_if_ended()  # one that came last
    except _Ended as error:
        (ended,) = error.args
    finally:
        _restore(before)
    if ended:
        signal.raise_signal(ended)
        raise SystemExit(128 + ended)  # where somebody else takes the signal, and goes on


def forks_for(number: int, seconds: float, jobs: int | None, can_fork: bool = True) -> int:
    """Return how many forks are to share some runs; 1 means that this process makes them itself.

    There are none on Windows and macOS, nor where an engine does not survive one, nor, unless
    asked for, beside other threads or for work that is done sooner than shared.

    Args:
        number: Of runs.
        seconds: What one takes, by the clock.
        jobs: How many at most; None for as many as there are processors.
        can_fork: Whether all that runs may run in a fork of this process.

    Raises:
        BadInputError: `jobs` is less than 1.
    """
    most = min(checked_jobs(jobs), number)
    if not can_fork or not hasattr(os, "fork") or sys.platform == "darwin":
        return 1
    if jobs is None:
        most = (
            1 if threading.active_count() > 1 else min(most, int(number * seconds / WORTH_A_FORK))
        )
    return max(1, most)


def _nothing() -> None:
    """Do nothing."""


def in_forks(
    work: Sequence[Callable[[], T]],
    jobs: int,
    ended: Callable[[int, T], None],
    seconds: float = 0.0,
    meanwhile: Callable[[], None] = _nothing,
) -> list[T | None]:
    """Do pieces of work in forks of this process. An interrupt ends them all.

    What raises in a fork is done again here, so that it is raised here; so is all where the system
    makes no forks now, and what takes longer than its limit. Where a fork ends before its work is
    done, killed or by a fault of the engine, that is tried again in a fork of its own.

    Args:
        work: What to call; what it returns can be pickled, and is not None.
        jobs: How many forks there are at once.
        ended: Called as each piece of work ends well, with its number and what it returned.
        seconds: What one takes here, by the clock: the measure of its limit.
        meanwhile: Called every moment while forks work; what it raises ends them all.

    Returns:
        What each returned; None where two forks have ended in it.
    """
    global _work  # noqa: PLW0603  (forks find it here, and nothing is pickled)
    _work = work
    limit = max(LEAST_WAIT, _LONGEST * seconds)
    outcomes = _shared(range(len(work)), jobs, ended, limit, meanwhile)
    for number, (error, _) in dict(outcomes).items():
        if isinstance(error, BrokenProcessPool):
            outcomes |= _shared([number], 1, ended, limit, meanwhile)
    results: list[T | None] = []
    for number, call in enumerate(work):
        error, result = outcomes.get(number, (NotImplementedError(), None))
        if error is not None and not isinstance(error, BrokenProcessPool):
            meanwhile()
            result = call()
            ended(number, result)
        results.append(result)
    return results


def _shared(
    numbers: Sequence[int],
    jobs: int,
    ended: Callable[[int, Any], None],
    limit: float,
    meanwhile: Callable[[], None],
) -> dict[int, tuple[BaseException | None, Any]]:
    """Yield the error or the result of each run of the forks, by number; until none comes for
    `limit` [s].
    """
    pool = ProcessPoolExecutor(min(jobs, len(numbers)), get_context("fork"), silence_child)
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
    silent_since = time.monotonic()
    try:
        while waiting:
            done, waiting = wait(waiting, min(_LOOK, limit), FIRST_COMPLETED)
            for future in done:
                number, error = futures[future], future.exception()
                outcomes[number] = error, None if error else future.result()
                if not error:
                    ended(number, outcomes[number][1])
            meanwhile()
            if done:
                silent_since = time.monotonic()
            elif time.monotonic() - silent_since > limit:
                break
    finally:
        for fork in forks:
            fork.kill()
        pool.shutdown(cancel_futures=True)
    return outcomes


def silence_child() -> None:
    """Silence a child process of ours, and let it end with its parent."""
    faulthandler.disable()
    nothing = open(os.devnull, "r+", encoding="utf-8")  # noqa: SIM115  (until it ends)
    sys.stdout = sys.stderr = nothing
    for stream in range(3):
        os.dup2(nothing.fileno(), stream)
    end_with_parent()


def _do(number: int) -> Any:
    return _work[number]()
