"""The experiments: a future that nothing disturbed, against the same after something was done.

Each is a question to a driver about one run, or about all runs, and yields findings.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from itertools import combinations
from pathlib import Path

import numpy as np

from ...backends import load
from ...engines.auditing import (
    FRESH,
    Driver,
    Machine,
    ReferenceRun,
    Save,
    SaveMethod,
    SavePoint,
)
from ...engines.measured import FutureGap, gap, worst
from ...interface import Array, Model
from ...page import Figures

AGAIN, RESET, PIECES, LOOK = "again", "reset", "step(n)", "look"
BESIDE, THREADS, POOLS = "two at once", "threads", "pools"
RESTORE, WITHOUT, FORGETS, NO_CONTACTS = "restore", "leave one out", "forgets", "contacts off"
NOT_RESTORED = "not restored"
EACH_OTHER = "each other"  # the futures of several restores, instead of one and the reference
_PIECES = (7, 1, 22)  # steps a call, over and over
_THREADS = 4
_RUNS = 2  # of each point


def finding_of(
    driver: Driver,
    experiment: str,
    run: ReferenceRun,
    case: str,
    into: str,
    gap: FutureGap,
    promised: bool = True,
) -> Figures:
    """What came of an experiment on a driver.

    Returns:
        experiment: One of the words above, or of `findings_elsewhere`.
        layer: Who was asked: the engine itself, or our interface to it.
        point: The save point.
        case: What was tried: a candidate for the state, a call, a way to run.
        into: What the state was put into, or what else the future was compared with.
        promised: Whether somebody promises that the futures are the same, so that a
            difference is a fault and not a fact.
        gap: How far the future is from the one that it was compared with.
        verdict: Whether the bytes are the same: "exact" or "differs".
        holds: Whether nothing that is promised is broken by this.
    """
    return Figures(
        experiment=experiment,
        layer=driver.layer,
        point=run.point.name,
        case=case,
        into=into,
        promised=promised,
        gap=gap,
        verdict="exact" if gap.exact else "differs",
        holds=gap.exact or not promised,
    )


def against_run(
    driver: Driver,
    experiment: str,
    run: ReferenceRun,
    case: str,
    into: str,
    *futures: Array,
    promised: bool = True,
) -> Figures:
    """What came of an experiment whose futures should be that of the run."""
    return finding_of(driver, experiment, run, case, into, driver.gap(run, *futures), promised)


# The same start and the same commands: from a new machine, a reset one, in other pieces.


def again(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
    """From another new machine."""
    future = driver.run(run.point, run.steps).future
    yield against_run(driver, AGAIN, run, "in a new one", "the first run", future)


def after_reset(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
    """From one that has another past, and was reset."""
    if not driver.resets:
        return
    with driver.used(run.point) as machine:
        driver.reset(machine)
        driver.arrive(machine, run.point)
        future = driver.drive(machine, run.point, run.steps)
    yield against_run(driver, RESET, run, "a used one, reset", "a new one", future)


def pieces(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
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


# What is done between two steps, or beside them, and should leave no trace.


def look(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
    """Each call before each step (forward, a read, a save), against the run without."""
    for act in driver.disturbances(run.point):
        with driver.at(run.point) as machine:
            future = driver.drive(machine, run.point, run.steps, act)
        yield against_run(
            driver, LOOK, run, act.name, "the run without", future, promised=act.promised
        )


def beside(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
    """Stepped turn by turn with another one of the same Model, which has another past."""
    with driver.at(run.point) as machine, driver.used(run.point) as other:
        trace = [driver.read(machine)]
        for _ in range(run.steps):
            trace.append(driver.drive(machine, run.point, 1)[-1])
            driver.advance(other)
    yield against_run(driver, BESIDE, run, "turn by turn with another", "alone", np.array(trace))


def threads(driver: Driver, runs: Sequence[ReferenceRun]) -> Iterator[Figures]:
    """All points at once, twice each, on a pool of threads; one machine a run."""
    case = f"a pool of {_THREADS} threads"
    with ThreadPoolExecutor(_THREADS) as pool:
        jobs = [
            [pool.submit(driver.run, run.point, run.steps) for _ in range(_RUNS)] for run in runs
        ]
        for run, of_run in zip(runs, jobs, strict=True):
            futures = (job.result().future for job in of_run)
            yield against_run(driver, THREADS, run, case, "alone", *futures)


def pools(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
    """The engine's own ways to run several at once, where it has any."""
    if run.point.swings:  # they take no controller
        return
    for name, several in driver.pools().items():
        futures = several(run.point, run.steps)
        yield against_run(driver, POOLS, run, name, "alone, step by step", *futures)


# Save, go on, restore, go on: is it the same future? Which state vector suffices?


def restored(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
    """Each way to save, restored into the run itself, a fresh machine and a used one."""
    for way in driver.save_methods(run.point):
        yield from tried(driver, run, way)


def smallest(
    driver: Driver, runs: Sequence[ReferenceRun], findings: Sequence[Figures]
) -> Iterator[Figures]:
    """Only the components without which something differed, tried at each point."""
    needed = [f.case for f in findings if f.experiment == WITHOUT and not f.gap.exact]
    way = driver.only(tuple(dict.fromkeys(needed)))
    if way is not None:
        for run in runs:
            yield from tried(driver, run, way)


def tried(driver: Driver, run: ReferenceRun, way: SaveMethod) -> Iterator[Figures]:
    """One way to save, against the future of the run that was saved, and against itself."""
    experiment, case = (WITHOUT, way.left_out) if way.left_out else (RESTORE, way.name)
    futures = driver.futures(run.point, run.steps, way)
    for into, future in futures.items():
        yield against_run(driver, experiment, run, case, into, future, promised=way.promised)
    among = worst([gap(*pair, driver.coordinates) for pair in combinations(futures.values(), 2)])
    yield finding_of(driver, experiment, run, case, EACH_OTHER, among, way.agree)


def forgets(driver: Driver, runs: Sequence[ReferenceRun]) -> Iterator[Figures]:
    """What is changed after a save, and is still changed after the restore.

    Against the same without the change, so that nothing else can make the difference; and, to
    know whether the change shows at all, without a restore. At the point with most contacts:
    where nothing touches, nobody would miss a friction.
    """
    run = max(runs, key=lambda run: driver.measure(run.point).contacts, default=None)
    hidden = driver.hidden_state(run.point) if run else None
    if run is None or hidden is None:
        return

    def future(save: Save, change: Callable[[Machine], None] | None) -> Array:
        with driver.at(run.point) as machine, save(machine) as restore:
            if change:
                change(machine)
            restore(machine)
            return driver.drive(machine, run.point, run.steps)

    ways = {NOT_RESTORED: lambda _machine: nullcontext(lambda _other: None), **hidden.ways}
    for name, save in ways.items():
        unchanged = future(save, None)
        for what, change in hidden.changes.items():
            off = gap(unchanged, future(save, change), driver.coordinates)
            yield finding_of(driver, FORGETS, run, what, name, off, promised=False)


def contacts_off(driver: Driver, run: ReferenceRun) -> Iterator[Figures]:
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


# Looks where contacts come and go: boxes that fall onto each other, whatever the model is.

FALL = "fall"  # save points are called so, with a number
BOXES, DROPS, STEPS = 4, 4, 300
_HALF = 0.05  # of an edge [m]
_MODEL = """<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="2 2 .1"/>
{}</worldbody></mujoco>"""
_BOX = '<body pos="0 0 {}"><freejoint/><geom type="box" size=".05 .05 .05" mass=".2"/></body>\n'
_ASIDE, _TILTED = 0.03, 0.4  # at most, at the start [m], [rad]


def falls(driver: Driver) -> Iterator[Figures]:
    """Each look of an engine before each step of a few falls, against the run without.

    Args:
        driver: Of an engine itself; its kind and its seed count, not its model.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "boxes.xml"
        path.write_text(
            _MODEL.format("".join(map(_BOX.format, range(1, BOXES + 1)))), encoding="utf-8"
        )
        model = load(path, backend=driver.model.backend)
    other = type(driver)(model, driver.seed)
    for point in _drops(model, driver.seed):
        yield from look(other, other.run(point, STEPS))


def _drops(model: Model, seed: int) -> Iterator[SavePoint]:
    random = np.random.default_rng(seed)
    heights = 2 * _HALF + 2.6 * _HALF * np.arange(float(BOXES))
    how = f"{BOXES} boxes, one above the other, let go"
    for number in range(1, DROPS + 1):
        aside = random.uniform(-_ASIDE, _ASIDE, (BOXES, 2))
        half = random.uniform(-_TILTED, _TILTED, (BOXES, 3)) / 2
        quats = np.column_stack([np.ones(BOXES), half])
        quats /= np.linalg.norm(quats, axis=1, keepdims=True)
        qpos = np.hstack([aside, heights[:, None], quats]).ravel()
        still, none = np.zeros(model.nv), np.zeros(model.nu)
        yield SavePoint(f"{FALL} {number}", how, model, qpos, still, none, 0)
