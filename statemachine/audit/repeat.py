"""The same start and the same commands: from a new machine, a reset one, in other pieces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..engines.auditing import Driver, ReferenceRun
from ..engines.futures import gap
from .findings import AuditFinding, finding_of

AGAIN, RESET, PIECES = "again", "reset", "step(n)"
_PIECES = (7, 1, 22)  # steps a call, over and over


def again(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """From another new machine."""
    with driver.at(run.point) as machine:
        future = driver.drive(machine, run.point, run.steps)
    yield finding_of(driver, AGAIN, run, "in a new one", "the first run", driver.gap(run, future))


def after_reset(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """From one that has another past, and was reset."""
    if not driver.resets:
        return
    with driver.used(run.point) as machine:
        driver.reset(machine)
        driver.arrive(machine, run.point)
        future = driver.drive(machine, run.point, run.steps)
    yield finding_of(driver, RESET, run, "a used one, reset", "a new one", driver.gap(run, future))


def pieces(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """Several steps by one call, against as many calls of one step."""
    if not driver.several or run.point.swings:  # its controller writes before each step
        return
    for name, sizes in (("step(n)", (run.steps,)), ("step(7), step(1), step(22)", _PIECES)):
        counts = np.cumsum(np.tile(sizes, run.steps // sum(sizes) + 1))
        counts = np.concatenate(([0], counts[counts <= run.steps]))
        with driver.at(run.point) as machine:
            trace = [driver.read(machine)]
            for nstep in np.diff(counts).tolist():
                driver.advance(machine, nstep)
                trace.append(driver.read(machine))
        off = gap(run.future[counts], np.array(trace), driver.coordinates, counts)
        yield finding_of(driver, PIECES, run, name, "n times step(1)", off)
