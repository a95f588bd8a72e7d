"""What exactly is the state of an engine, and what leaves it alone? Found by trying.

A run is saved at several moments, goes on, is set back and goes on again: the same bytes at
every step? Each candidate for the state is tried on the engine itself, by its own functions,
and beside it the promise of our interface. And what should change nothing (several steps in one
call, forward, threads, another process) is tried in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

from ...engines import room
from ...engines.auditing import ITSELF, ONLY, Driver, ReferenceRun, SavePoint
from ...engines.measured import FutureGap, worst
from ...errors import BadInputError, DivergedError, refuse
from ...interface import Model
from ...interface.options import as_count
from ...measures.text import grouped
from ...page import Figures
from ...runs.drive import Progress, silent
from ...runs.header import provenance
from . import trials
from .interface_driver import InterfaceDriver, findings_elsewhere, points, run_elsewhere
from .trials import EACH_OTHER, FORGETS, NO_CONTACTS, NOT_RESTORED, RESTORE, WITHOUT

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
            points, as measured; the findings, of every trial, see `finding_of`; the conclusion.
        without: Save points that this model does not have, and why.
        holds: Whether every promise is kept.

    Raises:
        BadInputError: `steps` or `seed` is invalid, or nothing in the model moves.
    """
    nstep = as_count(steps, "steps")
    refuse(
        (seed < 0, f"seed must not be negative; got {seed}"),
        (not model.nv, f"nothing moves in {model.path.name}: it has no state to audit"),
    )
    save_points, without = points(model, seed)
    drivers = drivers_of(model, seed)
    interface = next(driver for driver in drivers if isinstance(driver, InterfaceDriver))
    runs, diverged = _runs(drivers, save_points, nstep)
    states = {run.point.name: interface.state(run.point) for run in runs[interface]}
    if not states:
        raise BadInputError(f"nothing can be saved in {model.path.name}: {'; '.join(diverged)}")
    kinds = tuple(map(type, drivers))
    findings: dict[Driver, list[Figures]] = {driver: [] for driver in drivers}
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
_OF_A_RUN: tuple[Callable[[Driver, ReferenceRun], Iterator[Figures]], ...] = (
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


# What follows from the findings: which state suffices, and what breaks a smaller one.

_NEARLY = 1e-6  # of a difference: what is left of it is rounding


def conclude(findings: Sequence[Figures]) -> Figures:
    """Draw the conclusion of one driver's findings.

    Returns:
        suffice: Candidates whose future was exact at every save point, whatever was restored.
        fail: The others, and the largest gap of each.
        agree: Candidates whose restores have one future, be it that of the run or not.
        missing: Components without which something differs: the engine's name of it; at which
            points, into whatever it is restored, and at which in the run itself, which nobody has
            written into; and the worst gap of it.
        idle: Components without which nothing differs.
        smallest: Whether those of `missing` alone suffice; None where that was not tried.
        forgotten: By way to save, what it does not bring back.
        touching: By save point, how far off all that can be written is in a fresh one, as
            it stands and with contacts switched off.
        in_contact: Where nearly all that is missing acts through contacts, and nothing else.
        not_read_back: Candidates that do not read back as they were saved, before any step,
            and where.
    """

    def by_case(experiment: str, among: bool = False) -> dict[str, list[Figures]]:
        return grouped(
            (finding.case, finding)
            for finding in findings
            if finding.experiment == experiment and (finding.into == EACH_OTHER) == among
        )

    tried, among, left_out = by_case(RESTORE), by_case(RESTORE, among=True), by_case(WITHOUT)
    alone = tried.pop(ONLY, None)
    missing = [
        Figures(
            field=name,
            points=_differing(of_name),
            itself=_differing(finding for finding in of_name if finding.into == ITSELF),
            gap=_worst(of_name),
        )
        for name, of_name in left_out.items()
    ]
    forgets = [f for f in findings if f.experiment == FORGETS and f.into != NOT_RESTORED]
    restores = {(f.case, f.into, f.point): f.gap for f in findings if f.experiment == RESTORE}
    without_contacts = [finding for finding in findings if finding.experiment == NO_CONTACTS]
    touching = {
        off.point: (restores[off.case, off.into, off.point], off.gap) for off in without_contacts
    }
    return Figures(
        suffice=tuple(case for case in tried if not _differing(tried[case])),
        fail={case: _worst(tried[case]) for case in tried if _differing(tried[case])},
        agree=tuple(case for case in among if case in tried and not _differing(among[case])),
        missing=tuple(component for component in missing if component.points),
        idle=tuple(component.field for component in missing if not component.points),
        smallest=None if alone is None else not _differing(alone),
        forgotten={
            way: tuple(f.case for f in forgets if f.into == way and not f.gap.exact)
            for way in dict.fromkeys(finding.into for finding in forgets)
        },
        touching=touching,
        in_contact=tuple(
            point
            for point, (standing, off) in touching.items()
            if not standing.exact and off.size <= _NEARLY * standing.size
        ),
        not_read_back={
            case: points
            for case, of_case in tried.items()
            if (points := _differing(finding for finding in of_case if finding.gap.first == 0))
        },
    )


def _differing(findings: Iterable[Figures]) -> tuple[str, ...]:
    """The save points at which a future differs."""
    return tuple(dict.fromkeys(finding.point for finding in findings if not finding.gap.exact))


def _worst(findings: Sequence[Figures]) -> FutureGap:
    return worst([finding.gap for finding in findings])
