"""Save, go on, restore, go on: is it the same future? Which state vector suffices?"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations

from ..engines.auditing import Driver, Machine, ReferenceRun, Restore, Save, SaveMethod
from ..engines.futures import gap, worst
from ..interface import Array
from .findings import EACH_OTHER, AuditFinding, finding_of

RESTORE, WITHOUT, FORGETS, NO_CONTACTS = "restore", "leave one out", "forgets", "contacts off"
# What is restored.
ITSELF, FRESH, USED = "the run itself", "a fresh one", "a used one"
NOT_RESTORED = "not restored"
AGAIN = "the run itself, again"  # where nothing else can be


def ask(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """Each way to save, restored into the run itself, a fresh machine and a used one."""
    for way in driver.save_methods(run.point):
        yield from _tried(driver, run, way)


def smallest(
    driver: Driver, runs: Sequence[ReferenceRun], findings: Sequence[AuditFinding]
) -> Iterator[AuditFinding]:
    """Only the components without which something differed, tried at each point."""
    broke = [
        finding.case
        for finding in findings
        if finding.experiment == WITHOUT and not finding.gap.exact
    ]
    way = driver.only(tuple(dict.fromkeys(broke)))
    if way is not None:
        for run in runs:
            yield from _tried(driver, run, way)


def _tried(driver: Driver, run: ReferenceRun, way: SaveMethod) -> Iterator[AuditFinding]:
    """One way to save, against the future of the run that was saved, and against itself."""
    experiment, case = (WITHOUT, way.left_out) if way.left_out else (RESTORE, way.name)
    futures = _futures(driver, run, way)
    for into, future in futures.items():
        off = driver.gap(run, future)
        yield finding_of(driver, experiment, run, case, into, off, way.promised)
    among = worst([gap(*pair, driver.coordinates) for pair in combinations(futures.values(), 2)])
    yield finding_of(driver, experiment, run, case, EACH_OTHER, among, way.agree)


def _futures(driver: Driver, run: ReferenceRun, way: SaveMethod) -> dict[str, Array]:
    """What follows from a restore, by what was restored."""
    point, futures = run.point, {}
    with driver.at(point) as machine, way.save(machine) as restore:
        driver.drive(machine, point, run.steps)
        for into in (ITSELF,) if way.travels else (ITSELF, AGAIN):
            restore(machine)
            futures[into] = driver.drive(machine, point, run.steps)
        for into, other in ((FRESH, driver.new), (USED, driver.used)) if way.travels else ():
            with other(point) as target:
                restore(target)
                futures[into] = driver.drive(target, point, run.steps)
    return futures


def forgets(driver: Driver, runs: Sequence[ReferenceRun]) -> Iterator[AuditFinding]:
    """What is changed after a save, and is still changed after the restore.

    Against the same without the change, so that nothing else can make the difference; and, to
    know whether the change shows at all, without a restore. At the point with most contacts:
    where nothing touches, nobody would miss a friction.
    """
    run = max(runs, key=lambda run: driver.measure(run.point).contacts, default=None)
    hidden = driver.hidden_state(run.point) if run else None
    if run is None or hidden is None:
        return

    def future(save: Save | None, change: Callable[[Machine], None] | None) -> Array:
        with driver.at(run.point) as machine, (save or _nothing)(machine) as restore:
            if change:
                change(machine)
            restore(machine)
            return driver.drive(machine, run.point, run.steps)

    ways = {NOT_RESTORED: None, **hidden.ways}
    for name, save in ways.items():
        unchanged = future(save, None)
        for what, change in hidden.changes.items():
            off = gap(unchanged, future(save, change), driver.coordinates)
            yield finding_of(driver, FORGETS, run, what, name, off, promised=False)


@contextmanager
def _nothing(_machine: Machine) -> Iterator[Restore]:
    """The way that neither saves nor restores."""
    yield lambda _other: None


def contacts_off(driver: Driver, run: ReferenceRun) -> Iterator[AuditFinding]:
    """How far off the best that can be written is where nothing touches any more."""
    hidden = driver.hidden_state(run.point)
    if hidden is None:
        return
    with driver.at(run.point) as machine, hidden.best.save(machine) as restore:
        hidden.let_pass(machine)
        alone = driver.drive(machine, run.point, run.steps)
        with driver.new(run.point) as other:
            restore(other)
            hidden.let_pass(other)
            future = driver.drive(other, run.point, run.steps)
    off = gap(alone, future, driver.coordinates)
    yield finding_of(driver, NO_CONTACTS, run, hidden.best.name, FRESH, off, promised=False)
