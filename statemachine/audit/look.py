"""What is done between two steps and should leave no trace: forward, a read, a save."""

from __future__ import annotations

from collections.abc import Iterator

from ..engines.auditing import Driver, ReferenceRun
from .findings import AuditFinding, finding_of

LOOK = "look"


def ask(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """Each call before each step, against the run without."""
    for look in driver.disturbances(run.point):
        with driver.at(run.point) as machine:
            future = driver.drive(machine, run.point, run.steps, look)
        off = driver.gap(run, future)
        yield finding_of(driver, LOOK, run, look.name, "the run without", off, look.promised)
