"""Several pieces of work at once; a signal to end leaves nothing running."""

from __future__ import annotations

import importlib
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from functools import partial
from types import FrameType
from typing import Any, TypeVar

from . import ALONE

T = TypeVar("T")

_LOKY = "joblib.externals.loky.process_executor"
_TRACKERS = (
    "multiprocessing.resource_tracker",
    "joblib.externals.loky.backend.resource_tracker",
)


def in_parallel(
    work: Mapping[str, Callable[[], T]],
    jobs: int,
    ended: Callable[[str, T], None],
    stop: Callable[[], object],
    progress: Callable[[int], None] = lambda _: None,
) -> None:
    """Do all of it, in threads that wait for processes.

    Args:
        work: What to call, by name, in the order in which it is begun.
        jobs: How many are called at once.
        ended: Called here with the name and the result of each as it ends.
        stop: Called once at the end, or when something is raised: what still runs must end then.
        progress: Told every moment how many are still waited for.
    """
    with ThreadPoolExecutor(jobs) as pool:
        try:
            waiting = {pool.submit(call): name for name, call in work.items()}
            while waiting:
                for future in wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED).done:
                    ended(waiting.pop(future), future.result())
                progress(len(waiting))
        finally:
            stop()
            pool.shutdown(wait=False, cancel_futures=True)


@contextmanager
def worker_processes(jobs: int) -> Iterator[list[Callable[..., Future[Any]]]]:
    """A function for each of several processes, which submits a call to it.

    The processes end with the context. They are joblib's, which need no `if __name__ ==
    "__main__"` of the user. Each computes on one processor. Where one ends, what was submitted to
    it fails with BrokenProcessPool, nothing that others do is lost, and what is submitted to it
    next has a new process.
    """
    _begin_trackers()
    loky: Any = importlib.import_module(_LOKY)
    # An executor of several processes would lose the work of all with any one of them.
    new = partial(loky.ProcessPoolExecutor, 1, env=ALONE)
    executors = [new() for _ in range(jobs)]

    def submit(worker: int, *call: Any) -> Future[Any]:
        with sigint_blocked():
            try:
                return executors[worker].submit(*call)
            except BrokenProcessPool:
                executors[worker] = new()
                return executors[worker].submit(*call)

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


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """A Ctrl-C comes only afterwards, and never to what is started inside: this process answers."""
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Ended(BaseException):
    """A signal to end came; `args` has its number."""


@contextmanager
def unwinding(at_once: bool = True) -> Iterator[Callable[[], None]]:
    """SIGTERM, SIGHUP and SIGINT let what is inside clean up, and then end the process as ever.

    A second one does not disturb the cleaning up. One that is ignored (nohup) stays so. Only in
    the main thread, where Python takes signals.

    Args:
        at_once: Whether a signal raises wherever it comes; else where the function that is given
            is called, so that it never comes while the lock of a future is held.
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

    names = ("SIGTERM", "SIGHUP", "SIGINT")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {
        number: handler
        for number in numbers
        if (handler := signal.getsignal(number)) not in (signal.SIG_IGN, None)
    }
    ended = 0
    try:
        for number in before:
            signal.signal(number, end)
        yield raise_if_ended
        raise_if_ended()  # one that came last
    except _Ended as error:
        (ended,) = error.args
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if ended:
        signal.raise_signal(ended)
        raise SystemExit(128 + ended)  # where somebody else takes the signal, and goes on
