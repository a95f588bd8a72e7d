"""Cells in processes of their own, one after the other: what may end its process is run here."""

from __future__ import annotations

import importlib
import os
import signal
from collections.abc import Generator, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from concurrent.futures import TimeoutError as WaitedTooLong
from contextlib import suppress
from itertools import islice
from queue import SimpleQueue
from typing import Any

from ..errors import WorkerEndedError
from ..installed import require_extra
from ..processes import ALONE
from .cell import timed_out
from .request import PreparedSweep, SweepCell
from .worker import Row, row_of, run_batch

Batch = Sequence[SweepCell]
Results = Generator[list[Row], None, None]
_GRACE = 30.0  # seconds beyond what a batch may take; its process ends itself before
_LOKY = "joblib.externals.loky.process_executor"
_TRACKERS = (
    "multiprocessing.resource_tracker",
    "joblib.externals.loky.backend.resource_tracker",
)


def _begin_trackers() -> None:
    """Begin the processes that remove what others leave, before any thread blocks Ctrl-C.

    They would take the block away when they begin. What a sweep that is stopped leaves they
    remove; they need not tell.
    """
    told = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = ",".join(filter(None, (told, "ignore:resource_tracker")))
    try:
        for name in _TRACKERS:
            importlib.import_module(name).ensure_running()
    finally:
        del os.environ["PYTHONWARNINGS"]
        os.environ.update({} if told is None else {"PYTHONWARNINGS": told})


def _block_sigint() -> None:
    """Processes that this thread begins never take a Ctrl-C: it is for the driver to answer it."""
    if hasattr(signal, "pthread_sigmask"):  # not on Windows
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


class _Process:
    """A process that runs batches; after its end, another one."""

    def __init__(self, ready: PreparedSweep) -> None:
        self._loky = require_extra(_LOKY, "a sweep", "joblib", "sweep")
        self._ready = ready
        self._pool: Any = None

    def rows(self, batch: Batch, alone: bool = False) -> list[Row]:
        """The rows of a batch; a cell that ends the process twice, the second time alone, fails."""
        if self._pool is None:
            self._pool = self._loky.ProcessPoolExecutor(max_workers=1, env=ALONE)
        future: Future[list[Row]] = self._pool.submit(run_batch, self._ready, batch, True)
        timeout = self._ready.sweep.timeout
        try:
            return future.result(timeout * len(batch) + _GRACE)
        except WaitedTooLong:
            failure: Exception = timed_out(timeout)
        except self._loky.BrokenProcessPool:
            failure = WorkerEndedError("its process ended before it was done, twice")
        self.close()
        if alone:
            return [row_of(self._ready, batch[0], failure)]
        return [row for cell in batch for row in self.rows([cell], alone=True)]

    def close(self) -> None:
        """End the process."""
        pool, self._pool = self._pool, None
        if pool is not None:
            with suppress(Exception):
                pool.shutdown(wait=True, kill_workers=True)


def apart(ready: PreparedSweep, batches: Iterable[Batch], jobs: int) -> Results:
    """The rows of each batch, as they are ready, in processes that nothing else depends on.

    Where one dies, what it was running is run again, cell by cell if need be; the others go on.
    """
    processes = [_Process(ready) for _ in range(jobs)]
    free = SimpleQueue[_Process]()
    for process in processes:
        free.put(process)

    def run(batch: Batch) -> list[Row]:
        process = free.get()
        try:
            return process.rows(batch)
        finally:
            free.put(process)

    if os.name != "nt":
        _begin_trackers()
    with ThreadPoolExecutor(jobs, initializer=_block_sigint) as threads:
        try:
            coming = iter(batches)
            waiting = {threads.submit(run, batch) for batch in islice(coming, jobs)}
            while waiting:
                done, waiting = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED)
                waiting |= {threads.submit(run, batch) for batch in islice(coming, len(done))}
                for future in done:
                    yield future.result()
        finally:
            for process in processes:
                process.close()
