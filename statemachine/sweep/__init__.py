"""Sweeps: one experiment at many settings, from many starts, on every engine, as a dataset.

    from statemachine.sweep import Sweep, read_cells, run_sweep

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
from functools import partial
from pathlib import Path
from typing import Any

from .. import __version__
from ..backends import parse_backend
from ..errors import BadInputError, WorkerEndedError, refuse
from ..installed import require_extra
from ..page import Figures
from ..processes import checked_jobs
from ..processes.parallel import unwinding, worker_processes
from ..runs.drive import Progress, silent
from .design import Design, Vary
from .folder import check_folder, design_of, locked, read_manifest, settle_manifest
from .prepare import prepared
from .request import PreparedSweep, Sweep, SweepCell
from .rows import CELLS, COLUMNS, DONE, RowWriter, counted, read_cells, remove_failed
from .worker import Row, differing, row_of, run_batch

__all__ = [
    "COLUMNS",
    "Design",
    "PreparedSweep",
    "Sweep",
    "Vary",
    "design_of",
    "prepared",
    "read_cells",
    "read_manifest",
    "run_sweep",
]


# The driver of a sweep: hands out what is missing, and keeps what comes back.

Batch = Sequence[SweepCell]
Results = Generator[list[Row], None, None]
Submit = Callable[[PreparedSweep, Batch], Future[list[Row]]]  # to a worker

_BATCH, _MOST = 1.0, 500  # a task takes about so many seconds, and has at most so many cells
_TASKS = 4  # at least so many for each job, so that none is idle at the end
_PATIENCE = 10.0  # seconds for a scheduler to answer
_BATCH_APART = partial(run_batch, own=True)


def run_sweep(
    sweep: Sweep | PreparedSweep,
    out: str | Path,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    extend: bool = False,
    retry_failed: bool = False,
    progress: Progress = silent,
) -> Figures:
    """Run what is missing of a sweep.

    Args:
        sweep: What is asked for.
        out: The folder of its dataset; what it has of the same sweep is not run again.
        jobs: How many processes here; by default one for each processor.
        scheduler: Address of a Dask scheduler, whose workers run it instead.
        extend: Whether the design may be larger than that of the folder.
        retry_failed: Whether cells that failed are run again; their rows are replaced.
        progress: Told the fraction of what is missing that is done.

    Returns:
        folder: Where it is.
        cells: How many it has; points: of the design.
        done: How many have a result.
        failed: How many have none, by the class of the error.
        ran: How many were run this time.
        seconds: What this time took.
        said: What a reader should know.
        read: Python that opens the dataset.
        missing: How many have not run.

    Raises:
        BadInputError: The folder is of another sweep, or in use; see `prepared` for the rest.
        OSError: A file cannot be written; what was written is kept.
        MissingEngineError: An engine or a package is missing.
        KeyboardInterrupt: It was interrupted; what was done is in the folder.
    """
    began = time.monotonic()
    jobs, folder = checked_jobs(jobs), Path(out)
    ready = sweep if isinstance(sweep, PreparedSweep) else prepared(sweep)
    check_folder(folder)
    with locked(folder), ExitStack() as stack:
        client = stack.enter_context(_connected(scheduler, ready)) if scheduler else None
        known = dict(counted(folder))
        if extend and known:
            shared = sum(cell.id in known for name in ready.backends for cell in ready.cells(name))
            refuse(
                (
                    shared < len(known),
                    f"{folder} has {len(known) - shared} cells that are not of this design: a "
                    "sweep grows by values, seeds and backends that are added",
                )
            )
        settle_manifest(folder, ready.manifest(), extend)
        if retry_failed:
            remove_failed(folder)
            known = {cell: kind for cell, kind in known.items() if kind == DONE}
        missing, ran = len(ready) - len(known), 0
        kinds = Counter(known.values())
        writer = RowWriter(folder, ready.design.factors, ready.provenance())
        workers = max(1, sum(client.nthreads().values())) if client else jobs
        batches = _batches(ready, known, workers)
        with unwinding(at_once=False) as raise_if_ended:
            run = (
                _run_on_dask(ready, batches, workers, client, raise_if_ended)
                if client
                else _run_apart(ready, batches, workers, raise_if_ended)
            )
            try:
                with closing(run) as results:
                    for rows in results:
                        writer.add(rows)
                        kinds.update(row.get("error_class") or row["status"] for row in rows)
                        ran += len(rows)
                        progress(ran / max(1, missing))
            finally:
                writer.flush()
    place = (folder / CELLS).as_posix()
    done = kinds.pop(DONE, 0)
    return Figures(
        folder=os.fspath(folder),
        cells=len(ready),
        points=ready.design.size,
        done=done,
        failed=dict(kinds.most_common()),
        ran=ran,
        seconds=time.monotonic() - began,
        said=ready.said,
        read=f'pyarrow.dataset.dataset("{place}", partitioning="hive").to_table()',
        missing=len(ready) - done - sum(kinds.values()),
    )


def _batches(ready: PreparedSweep, known: Mapping[str, str], jobs: int) -> Iterator[Batch]:
    """What is missing, in tasks of about a second, from all backends in turn."""

    def of(backend: str) -> Iterator[Batch]:
        most = math.ceil((len(ready) - len(known)) / (_TASKS * jobs * len(ready.backends)))
        size = min(
            _MOST,
            max(1, int(_BATCH / max(1e-6, ready.cost.get(parse_backend(backend).name, _BATCH)))),
        )
        cells = (cell for cell in ready.cells(backend) if cell.id not in known)
        while batch := list(itertools.islice(cells, max(1, min(size, most)))):
            yield batch

    turns = itertools.zip_longest(*(of(name) for name in ready.backends))
    return (batch for turn in turns for batch in turn if batch is not None)


def _run_apart(
    ready: PreparedSweep,
    batches: Iterable[Batch],
    jobs: int,
    look: Callable[[], None],
) -> Results:
    """The rows of each batch, as they are ready, from processes of this machine.

    `look` is called between any two waits, and may raise.
    """
    with worker_processes(jobs) as workers:
        here = [partial(submit, _BATCH_APART) for submit in workers]
        yield from _results(ready, batches, here, here, look)


def _run_on_dask(
    ready: PreparedSweep,
    batches: Iterable[Batch],
    workers: int,
    client: Any,
    look: Callable[[], None],
) -> Results:
    """The same from the workers of Dask; what they do not survive is run here.

    Raises:
        BadInputError: The scheduler went away.
    """
    submit = partial(client.get_executor(pure=False).submit, partial(run_batch, own=False))
    with worker_processes(1) as (worker,):

        def submit_here(ready: PreparedSweep, batch: Batch) -> Future[list[Row]]:
            if client.status != "running":
                raise BadInputError("the scheduler went away; what was done is kept")
            return worker(_BATCH_APART, ready, batch)

        # Some batches always wait, so that no worker is idle.
        yield from _results(ready, batches, 2 * workers * [submit], [submit_here], look)


def _results(
    ready: PreparedSweep,
    batches: Iterable[Batch],
    workers: list[Submit],
    here: list[Submit],
    look: Callable[[], None],
) -> Results:
    """The rows of each batch, as they are ready.

    The cells of a batch that was lost with a process are run again one by one, each by a worker
    of `here`; one that ends that process, too, fails.

    Args:
        ready: The sweep.
        batches: What is to run.
        workers: Each submits one batch at a time; those that are idle.
        here: The same for cells that are run again; it may be the same list.
        look: Called between any two waits.
    """
    coming, again, ended = iter(batches), deque[SweepCell](), list[Any]()
    waiting: dict[Future[list[Row]], Any] = {}

    def begin(batch: Batch, is_again: bool, idle: list[Submit]) -> None:
        submit = idle.pop()
        waiting[submit(ready, batch)] = batch, is_again, idle, submit

    while True:
        while again and here:
            begin([again.popleft()], True, here)
        for batch in itertools.islice(coming, len(workers)):
            begin(batch, False, workers)
        yield from ended  # while every worker has something to do: rows may be written now
        if not waiting:
            return
        done = wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED).done
        look()
        ended.clear()
        for future in done:
            batch, is_again, idle, submit = waiting.pop(future)
            idle.append(submit)
            try:
                rows = future.result()
            except Exception:  # its process ended
                again += () if is_again else batch
                error = WorkerEndedError("its process ended before it was done, twice")
                rows = [row_of(ready, cell, error) for cell in batch if is_again]
            ended.append(rows)


@contextmanager
def _connected(address: str, ready: PreparedSweep) -> Iterator[Any]:
    """A client of a Dask scheduler whose workers have what the sweep needs.

    Raises:
        MissingEngineError: The package distributed is not installed; the message names the extra.
        BadInputError: Nobody answers, there is no worker, or one has other versions or files.
    """
    distributed = require_extra("distributed", "--scheduler", "Dask", "cluster")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            client = distributed.Client(address, timeout=_PATIENCE, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise BadInputError(
                f"no Dask scheduler answers at {address} ({type(error).__name__})"
            ) from None
    try:
        with suppress(TimeoutError):
            client.wait_for_workers(1, timeout=_PATIENCE)
        answers = client.run(differing, ready, __version__, on_error="return")
        refuse((not answers, f"the scheduler at {address} has no workers"))
        for worker, wrong in answers.items():
            refuse(
                (
                    isinstance(wrong, BaseException),
                    f"the worker {worker} cannot run a sweep: {wrong}",
                ),
                (wrong, f"the worker {worker} has not the same {wrong} as this machine"),
            )
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=2)
