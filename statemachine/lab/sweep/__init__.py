"""Sweeps: one experiment at many settings, from many starts, on every engine, as a dataset.

    from statemachine.lab.sweep import Sweep, read_cells, run_sweep

    sweep = Sweep("hold", vary=("timestep=0.001,0.005", "damping=0.5x:2x:5"), seeds=10)
    summary = run_sweep(sweep, "damping")
    table = read_cells("damping")  # a pyarrow Table, a row a cell

A cell is one point of the design, one seed and one backend. A cell that fails is a row with its
error. Called again, `run_sweep` runs what is missing.
"""

from __future__ import annotations

import itertools
import math
import os
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ... import __version__
from ...backends import parse_backend
from ...errors import BadInputError, WorkerEndedError
from ...installed import require_extra
from ...processes import checked_jobs
from ...processes.parallel import unwinding, worker_processes
from ..runs.drive import Progress, no_progress
from .design import Design, DesignPoint, Vary
from .folder import check_folder, design_of, locked, read_manifest, write_or_check_manifest
from .prepare import prepare_sweep
from .request import PreparedSweep, Sweep, SweepCell
from .rows import (
    CELLS,
    COLUMNS,
    DONE,
    RowWriter,
    iter_cell_outcomes,
    outcome_of,
    read_cells,
    remove_failed,
)
from .summary import SweepSummary
from .worker import Row, environment_difference, row_of, run_batch

__all__ = [
    "COLUMNS",
    "Design",
    "DesignPoint",
    "PreparedSweep",
    "Sweep",
    "SweepSummary",
    "Vary",
    "design_of",
    "prepare_sweep",
    "read_cells",
    "read_manifest",
    "run_sweep",
]


# The driver of a sweep: hands out what is missing, and keeps what comes back.

Batch = Sequence[SweepCell]
Results = Generator[list[Row], None, None]
Submit = Callable[[PreparedSweep, Batch], Future[list[Row]]]  # to a worker

_BATCH_SECONDS, _MAX_BATCH_CELLS = (
    1.0,
    500,
)  # a task takes about so many seconds, and has at most so many cells
_TASKS_PER_JOB = 4  # at least so many for each job, so that none is idle at the end
SCHEDULER_TIMEOUT = 10.0  # seconds for a scheduler to answer
_RUN_BATCH_IN_CHILD = partial(run_batch, is_dedicated=True)


def run_sweep(
    sweep: Sweep | PreparedSweep,
    out: str | Path,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    extend: bool = False,
    retry_failed: bool = False,
    progress: Progress = no_progress,
) -> SweepSummary:
    """Run what is missing of a sweep.

    Args:
        sweep: What is asked for.
        out: The folder of its dataset; what it has of the same sweep is not run again.
        jobs: How many processes here; by default one for each processor.
        scheduler: Address of a Dask scheduler, whose workers run it instead.
        extend: Whether the design may be larger than that of the folder.
        retry_failed: Whether cells that failed are run again; their rows are replaced.
        progress: Told the fraction of what is missing that is done.

    Raises:
        BadInputError: The folder is of another sweep, or in use; see `prepare_sweep` for the rest.
        OSError: A file cannot be written; what was written is kept.
        MissingEngineError: An engine or a package is missing.
        KeyboardInterrupt: It was interrupted; what was done is in the folder.
    """
    began = time.monotonic()
    jobs, folder = checked_jobs(jobs), Path(out)
    ready = sweep if isinstance(sweep, PreparedSweep) else prepare_sweep(sweep)
    check_folder(folder)
    with locked(folder), ExitStack() as stack:
        client = stack.enter_context(_connected(scheduler, ready)) if scheduler else None
        outcomes = dict(iter_cell_outcomes(folder))
        if extend and outcomes:
            _check_grows(folder, ready, outcomes)
        write_or_check_manifest(folder, ready.manifest(), extend)
        if retry_failed:
            remove_failed(folder)
            outcomes = {cell: kind for cell, kind in outcomes.items() if kind == DONE}
        ran, cost, total_cost = 0, 0.0, _cost_of_missing(ready, outcomes)
        kinds = Counter(outcomes.values())
        writer = RowWriter(folder, ready.design.factors, ready.provenance())
        workers = max(1, sum(client.nthreads().values())) if client else jobs
        batches = _batches(ready, outcomes, workers)
        with unwinding(at_once=False) as raise_if_ended:
            if client:
                run = _run_on_dask(ready, batches, workers, client, raise_if_ended)
            else:
                run = _run_apart(ready, batches, workers, raise_if_ended)
            try:
                with closing(run) as results:
                    for rows in results:
                        writer.add(rows)
                        kinds.update(outcome_of(row) for row in rows)
                        ran += len(rows)
                        cost += sum(_cost_of_cell(ready, row["backend"]) for row in rows)
                        progress(cost / total_cost)
            finally:
                writer.flush()
    return _summary(ready, folder, kinds, ran, time.monotonic() - began)


def _check_grows(folder: Path, ready: PreparedSweep, outcomes: Mapping[str, str]) -> None:
    """Check that all that a folder has is of a design.

    Args:
        folder: Of the dataset.
        ready: The sweep.
        outcomes: What became of each cell that is there, by its id.

    Raises:
        BadInputError: It has cells that are not of this design.
    """
    shared = 0
    for backend in ready.backends:
        shared += sum(cell.id in outcomes for cell in ready.cells(backend))
    if shared < len(outcomes):
        raise BadInputError(
            f"{folder} has {len(outcomes) - shared} cells that are not of this design: a "
            "sweep grows by values, seeds and backends that are added"
        )


def _summary(
    ready: PreparedSweep, folder: Path, kinds: Counter[str], ran: int, seconds: float
) -> SweepSummary:
    """Return the summary of a folder.

    Args:
        ready: The sweep.
        folder: Of its dataset.
        kinds: How many cells are done, and how many failed by the class of the error.
        ran: How many cells were run this time.
        seconds: What this time took [s].
    """
    place = (folder / CELLS).as_posix()
    failed = Counter(kinds)
    done = failed.pop(DONE, 0)
    return SweepSummary(
        folder=os.fspath(folder),
        cells=len(ready),
        points=ready.design.size,
        done=done,
        failed=dict(failed.most_common()),
        ran=ran,
        seconds=seconds,
        notes=ready.notes,
        read=f'pyarrow.dataset.dataset("{place}", partitioning="hive").to_table()',
        missing=len(ready) - kinds.total(),
        what=ready.sweep.what.rpartition("/")[2],
        vary=tuple(ready.sweep.vary),
        seeds=ready.sweep.seeds,
        backends=ready.backends,
        versions=ready.versions,
    )


def _cost_of_cell(ready: PreparedSweep, backend: str) -> float:
    """Return roughly what a cell takes on a backend, by the clock [s]."""
    return max(1e-6, ready.cost.get(parse_backend(backend).name, _BATCH_SECONDS))


def _cost_of_missing(ready: PreparedSweep, outcomes: Mapping[str, str]) -> float:
    """Return roughly what all cells take that are not known, one after the other [s]."""
    cost = 0.0
    for backend in ready.backends:
        cells = sum(cell.id not in outcomes for cell in ready.cells(backend))
        cost += cells * _cost_of_cell(ready, backend)
    return cost


def _batches(ready: PreparedSweep, outcomes: Mapping[str, str], jobs: int) -> Iterator[Batch]:
    """Yield what is missing, in tasks of about a second, from all backends in turn."""
    missing = len(ready) - len(outcomes)
    most = max(1, math.ceil(missing / (_TASKS_PER_JOB * jobs * len(ready.backends))))

    def of(backend: str) -> Iterator[Batch]:
        size = min(
            _MAX_BATCH_CELLS, max(1, int(_BATCH_SECONDS / _cost_of_cell(ready, backend))), most
        )
        cells = (cell for cell in ready.cells(backend) if cell.id not in outcomes)
        while batch := list(itertools.islice(cells, size)):
            yield batch

    for turn in itertools.zip_longest(*(of(name) for name in ready.backends)):
        for batch in turn:
            if batch is not None:
                yield batch


def _run_apart(
    ready: PreparedSweep,
    batches: Iterable[Batch],
    jobs: int,
    look: Callable[[], None],
) -> Results:
    """Yield the rows of each batch, as they are ready, from processes of this machine.

    `look` is called between any two waits, and may raise.
    """
    with worker_processes(jobs) as workers:
        submitters = [partial(submit, _RUN_BATCH_IN_CHILD) for submit in workers]
        yield from _results(ready, batches, submitters, submitters, look)


def _run_on_dask(
    ready: PreparedSweep,
    batches: Iterable[Batch],
    workers: int,
    client: Any,
    look: Callable[[], None],
) -> Results:
    """Yield the same from the workers of Dask; what they do not survive is run here.

    Raises:
        BadInputError: The scheduler went away.
    """
    submit = partial(client.get_executor(pure=False).submit, partial(run_batch, is_dedicated=False))
    with worker_processes(1) as (worker,):

        def submit_here(ready: PreparedSweep, batch: Batch) -> Future[list[Row]]:
            if client.status != "running":
                raise BadInputError("the scheduler went away; what was done is kept")
            return worker(_RUN_BATCH_IN_CHILD, ready, batch)

        # Some batches always wait, so that no worker is idle.
        yield from _results(ready, batches, 2 * workers * [submit], [submit_here], look)


@dataclass(frozen=True)
class _Submitted:
    """A batch that a worker has.

    Attributes:
        batch: Its cells.
        is_again: Whether it is run again, alone, after its process ended.
        idle: Where the worker is put back when it is done.
        submit: Submits a batch to the worker.
    """

    batch: Batch
    is_again: bool
    idle: list[Submit]
    submit: Submit


def _results(
    ready: PreparedSweep,
    batches: Iterable[Batch],
    workers: list[Submit],
    retry_workers: list[Submit],
    look: Callable[[], None],
) -> Results:
    """Yield the rows of each batch, as they are ready.

    The cells of a batch that was lost with a process are run again one by one, each by a worker
    of `retry_workers`; one that ends that process, too, fails.

    Args:
        ready: The sweep.
        batches: What is to run.
        workers: Each submits one batch at a time; those that are idle.
        retry_workers: The same for cells that are run again; it may be the same list.
        look: Called between any two waits.
    """
    coming, again, ended = iter(batches), deque[SweepCell](), list[list[Row]]()
    waiting: dict[Future[list[Row]], _Submitted] = {}

    def begin(batch: Batch, is_again: bool, idle: list[Submit]) -> None:
        submit = idle.pop()
        waiting[submit(ready, batch)] = _Submitted(batch, is_again, idle, submit)

    while True:
        while again and retry_workers:
            begin([again.popleft()], True, retry_workers)
        for batch in itertools.islice(coming, len(workers)):
            begin(batch, False, workers)
        yield from ended  # while every worker has something to do: rows may be written now
        if not waiting:
            return
        done = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED).done
        look()
        ended.clear()
        for future in done:
            submitted = waiting.pop(future)
            submitted.idle.append(submitted.submit)
            try:
                ended.append(future.result())
            except Exception:  # its process ended
                if not submitted.is_again:
                    again += submitted.batch
                    continue
                error = WorkerEndedError("its process ended before it was done, twice")
                ended.append([row_of(ready, cell, error) for cell in submitted.batch])


@contextmanager
def _connected(address: str, ready: PreparedSweep) -> Iterator[Any]:
    """Connect a client to a Dask scheduler whose workers have what the sweep needs.

    Raises:
        MissingEngineError: The package distributed is not installed; the message names the extra.
        BadInputError: Nobody answers, there is no worker, or one has other versions or files.
    """
    distributed = require_extra("distributed", "--scheduler", "Dask", "cluster")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            client = distributed.Client(address, timeout=SCHEDULER_TIMEOUT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise BadInputError(
                f"no Dask scheduler answers at {address} ({type(error).__name__})"
            ) from None
    try:
        with suppress(TimeoutError):
            client.wait_for_workers(1, timeout=SCHEDULER_TIMEOUT)
        answers = client.run(environment_difference, ready, __version__, on_error="return")
        if not answers:
            raise BadInputError(f"the scheduler at {address} has no workers")
        for worker, wrong in answers.items():
            if isinstance(wrong, BaseException):
                raise BadInputError(f"the worker {worker} cannot run a sweep: {wrong}")
            if wrong:
                raise BadInputError(f"the worker {worker} has not the same {wrong} as this machine")
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=2)
