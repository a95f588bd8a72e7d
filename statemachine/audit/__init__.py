"""What exactly is the state of an engine, and what leaves it alone? Found by trying.

A run is saved at several moments, goes on, is set back and goes on again: the same bytes at
every step? Each candidate for the state is tried on the engine itself, by its own functions,
and beside it the promise of our interface. And what should change nothing (several steps in one
call, forward, threads, another process) is tried in the same way. A file for each question.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from ..engines.auditing import Driver, Measured, ReferenceRun, SavePoint
from ..errors import BadInputError, DivergedError
from ..experiments._common import Progress, Provenance, provenance, silent
from ..interface import Model
from ..interface.checks import as_count
from . import apart, elsewhere, falls, look, repeat, restore
from .conclusions import Conclusion, conclude
from .drivers import drivers
from .findings import AuditFinding
from .interface_driver import InterfaceDriver
from .points import points

STEPS = 60  # of each future


@dataclass(frozen=True)
class Audited:
    """One of those that were audited.

    Attributes:
        layer: "engine" or "interface".
        name: What a page calls it.
        legend: What the names of its ways to save mean.
        points: The save points, as measured.
        findings: All that was tried, one finding a trial.
        conclusion: What follows from them.
    """

    layer: str
    name: str
    legend: str
    points: tuple[Measured, ...]
    findings: tuple[AuditFinding, ...]
    conclusion: Conclusion


@dataclass(frozen=True)
class Audit:
    """An engine and our interface to it.

    Attributes:
        steps: How many each future has.
        audited: The engine itself, where there is a driver for it; then the interface.
        without: Save points that this model does not have, and why.
    """

    steps: int
    audited: tuple[Audited, ...]
    without: tuple[str, ...]
    provenance: Provenance

    @property
    def holds(self) -> bool:
        """Whether nothing is broken that is promised."""
        return all(each.holds for one in self.audited for each in one.findings)


def run(model: Model, steps: int = STEPS, seed: int = 0, progress: Progress = silent) -> Audit:
    """Try everything on the engine behind a Model and on the interface.

    Args:
        model: Any model with something that moves.
        steps: Of each future that is compared.
        seed: Of the commands in motion and of other pasts.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `steps` or `seed` is no such number, or nothing in the model moves.
    """
    nstep = as_count(steps, "steps")
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    if not model.nv:
        raise BadInputError(f"nothing moves in {model.path.name}: it has no state to audit")
    places, without = points(model, seed)
    everyone = drivers(model, seed)
    interface = next(each for each in everyone if isinstance(each, InterfaceDriver))
    runs, diverged = _runs(everyone, places, nstep)
    states = {each.point.name: interface.state(each.point) for each in runs[interface]}
    if not states:
        raise BadInputError(f"nothing can be saved in {model.path.name}: {'; '.join(diverged)}")
    job = elsewhere.Job(model, seed, nstep, states, tuple(map(type, everyone)))
    found: dict[Driver, list[AuditFinding]] = {driver: [] for driver in everyone}
    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(elsewhere.run, job)
        work = [(driver, each) for driver in everyone for each in runs[driver]]
        for done, (driver, each) in enumerate(work):
            progress(done / (len(work) + len(everyone)))
            for question in _OF_A_RUN:
                found[driver] += question(driver, each)
        for done, driver in enumerate(everyone, start=len(work)):
            progress(done / (len(work) + len(everyone)))
            found[driver] += restore.smallest(driver, runs[driver], found[driver])
            found[driver] += restore.forgets(driver, runs[driver])
            found[driver] += apart.threads(driver, runs[driver])
            found[driver] += elsewhere.findings(answer.result(), driver, runs[driver])
            if driver.layer == "engine":
                found[driver] += falls.findings(driver)
        found[interface] += elsewhere.pickled(answer.result(), interface, runs[interface], states)
    audited = []
    for driver in everyone:
        seen = tuple(driver.measure(each.point) for each in runs[driver])
        findings = tuple(found[driver])
        audited.append(
            Audited(driver.layer, driver.name, driver.legend, seen, findings, conclude(findings))
        )
    return Audit(nstep, tuple(audited), without + diverged, provenance(model, seed))


# Each asks a driver about one save point, given the run from there that nothing disturbed.
_OF_A_RUN: tuple[Callable[[Driver, ReferenceRun], Iterator[AuditFinding]], ...] = (
    repeat.again,
    repeat.after_reset,
    repeat.pieces,
    look.ask,
    apart.beside,
    apart.pools,
    restore.ask,
    restore.contacts_off,
)


def _runs(
    everyone: Sequence[Driver], places: Sequence[SavePoint], steps: int
) -> tuple[dict[Driver, list[ReferenceRun]], tuple[str, ...]]:
    """The undisturbed runs, from points at which nobody diverges; and a line for each other."""
    runs: dict[Driver, list[ReferenceRun]] = {driver: [] for driver in everyone}
    without: list[str] = []
    for point in places:
        try:
            # The interface first: it raises, where an engine may go on and warn.
            knowing = [each for each in reversed(everyone) if not each.lacks(point)]
            found = [(driver, driver.run(point, steps)) for driver in knowing]
            reasons = [(each.name, each.lacks(point)) for each in everyone]
            without += [f"{point.name}: on {name}, {why}" for name, why in reasons if why]
        except DivergedError:
            without.append(f"{point.name}: the run diverges")
            continue
        for driver, run in found:
            runs[driver].append(run)
    return runs, tuple(without)
