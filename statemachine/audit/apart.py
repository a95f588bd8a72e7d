"""What runs beside it changes nothing: another Data, threads, the engine's own pools."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..engines.auditing import Driver, ReferenceRun, SavePoint
from ..interface import Array
from .findings import AuditFinding, finding_of

BESIDE, THREADS, POOLS = "two at once", "threads", "pools"
_THREADS = 4
_EACH = 2  # runs of each point


def beside(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """Stepped turn by turn with another one of the same Model, which has another past."""
    with driver.at(run.point) as machine, driver.used(run.point) as other:
        trace = [driver.read(machine)]
        for _ in range(run.steps):
            trace.append(driver.drive(machine, run.point, 1)[-1])
            driver.advance(other)
    off = driver.gap(run, np.array(trace))
    yield finding_of(driver, BESIDE, run, "turn by turn with another", "alone", off)


def threads(driver: Driver, runs: Sequence[ReferenceRun]) -> Iterator[AuditFinding]:
    """All points at once, twice each, on a pool of threads; one machine a run."""

    def once(point: SavePoint, steps: int) -> Array:
        with driver.at(point) as machine:
            return driver.drive(machine, point, steps)

    with ThreadPoolExecutor(_THREADS) as pool:
        jobs = [[pool.submit(once, run.point, run.steps) for _ in range(_EACH)] for run in runs]
        for run, of in zip(runs, jobs, strict=True):
            off = driver.gap(run, *(job.result() for job in of))
            yield finding_of(driver, THREADS, run, f"a pool of {_THREADS} threads", "alone", off)


def pools(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """The engine's own ways to run several at once, where it has any."""
    if run.point.swings:  # they take no controller
        return
    for name, several in driver.pools().items():
        off = driver.gap(run, *several(run.point, run.steps))
        yield finding_of(driver, POOLS, run, name, "alone, step by step", off)
