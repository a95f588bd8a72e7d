"""What is done between two steps and should leave no trace: forward, a read, a save."""

from __future__ import annotations

from collections.abc import Iterator

from .drivers import Driver, Run
from .findings import Finding

LOOK = "look"


def ask(driver: Driver, run: Run) -> Iterator[Finding]:
    """Each call before each step, against the run without."""
    for look in driver.looks(run.point):
        with driver.at(run.point) as machine:
            future = driver.drive(machine, run.point, run.steps, look)
        off = driver.gap(run, future)
        yield driver.found(LOOK, run, look.name, "the run without", off, look.promised)
