"""What exactly is the state of an engine, and what leaves it alone? Found by trying.

A run is saved at several moments, goes on, is set back and goes on again: the same bytes at
every step? Each candidate for the state is tried on the engine itself, by its own functions,
and beside it the promise of our interface. And what should change nothing (several steps in one
call, forward, threads, another process) is tried in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

from ...engines import room
from ...engines.auditing import Driver, ReferenceRun, SavePoint
from ...errors import BadInputError, DivergedError
from ...interface import Model
from ...interface.options import as_count
from ...page import Figures
from ...runs.drive import Progress, silent
from ...runs.provenance import provenance
from . import trials
from .conclusions import conclude
from .interface_driver import InterfaceDriver, findings_elsewhere, run_elsewhere
from .points import points
from .trials import AuditFinding

STEPS = 60  # of each future


def run(model: Model, steps: int = STEPS, seed: int = 0, progress: Progress = silent) -> Figures:
    """Try everything on the engine behind a Model and on the interface.

    Args:
        model: Any model with something that moves.
        steps: Of each future that is compared.
        seed: Of the commands in motion and of other pasts.
        progress: Told the fraction that is done.

    Returns:
        steps: How many each future has.
        audited: The engine itself, where there is a driver for it; then the interface. Of each:
            the layer, "engine" or "interface"; its name; a legend of its ways to save; the save
            points, as measured; the findings, an AuditFinding of every trial; the conclusion.
        without: Save points that this model does not have, and why.
        holds: Whether every promise is kept.

    Raises:
        BadInputError: `steps` or `seed` is no such number, or nothing in the model moves.
    """
    nstep = as_count(steps, "steps")
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    if not model.nv:
        raise BadInputError(f"nothing moves in {model.path.name}: it has no state to audit")
    save_points, without = points(model, seed)
    drivers = drivers_of(model, seed)
    interface = next(driver for driver in drivers if isinstance(driver, InterfaceDriver))
    runs, diverged = _runs(drivers, save_points, nstep)
    states = {run.point.name: interface.state(run.point) for run in runs[interface]}
    if not states:
        raise BadInputError(f"nothing can be saved in {model.path.name}: {'; '.join(diverged)}")
    kinds = tuple(map(type, drivers))
    findings: dict[Driver, list[AuditFinding]] = {driver: [] for driver in drivers}
    with ThreadPoolExecutor(1) as pool:
        child = pool.submit(run_elsewhere, model, seed, nstep, states, kinds)
        work = [(driver, run) for driver in drivers for run in runs[driver]]
        for done, (driver, run) in enumerate(work):
            progress(done / (len(work) + len(drivers)))
            for question in _OF_A_RUN:
                findings[driver] += question(driver, run)
        for done, driver in enumerate(drivers, start=len(work)):
            progress(done / (len(work) + len(drivers)))
            findings[driver] += [
                *trials.smallest(driver, runs[driver], findings[driver]),
                *trials.forgets(driver, runs[driver]),
                *trials.threads(driver, runs[driver]),
                *findings_elsewhere(child.result(), driver, runs[driver], states),
                *(trials.falls(driver) if driver.layer == "engine" else ()),
            ]
    audited = tuple(
        Figures(
            layer=driver.layer,
            name=driver.name,
            legend=driver.legend,
            points=tuple(driver.measure(run.point) for run in runs[driver]),
            findings=tuple(findings[driver]),
            conclusion=conclude(findings[driver]),
        )
        for driver in drivers
    )
    return Figures(
        steps=nstep,
        audited=audited,
        without=without + diverged,
        holds=all(finding.holds for driver in audited for finding in driver.findings),
        provenance=provenance(model, seed),
    )


# A question to a driver about one save point, given the run from there that nothing disturbed.
_OF_A_RUN: tuple[Callable[[Driver, ReferenceRun], Iterator[AuditFinding]], ...] = (
    trials.again,
    trials.after_reset,
    trials.pieces,
    trials.look,
    trials.beside,
    trials.pools,
    trials.restored,
    trials.contacts_off,
)


def drivers_of(model: Model, seed: int) -> tuple[Driver, ...]:
    """The engine behind a Model, where its room has a driver, and the interface to it."""
    engine = room(model.backend).driver(model, seed)
    return (*((engine,) if engine else ()), InterfaceDriver(model, seed))


def _runs(
    drivers: Sequence[Driver], save_points: Sequence[SavePoint], steps: int
) -> tuple[dict[Driver, list[ReferenceRun]], tuple[str, ...]]:
    """The undisturbed runs, from points at which no driver diverges; a line for each other."""
    runs: dict[Driver, list[ReferenceRun]] = {driver: [] for driver in drivers}
    without: list[str] = []
    for point in save_points:
        try:
            # The interface first: it raises, where an engine may go on and warn.
            able = [driver for driver in reversed(drivers) if not driver.lacks(point)]
            undisturbed = [(driver, driver.run(point, steps)) for driver in able]
        except DivergedError:
            without.append(f"{point.name}: the run diverges")
            continue
        lacking = [driver for driver in drivers if driver not in able]
        without += [f"{point.name}: on {driver.name}, {driver.lacks(point)}" for driver in lacking]
        for driver, run in undisturbed:
            runs[driver].append(run)
    return runs, tuple(without)
