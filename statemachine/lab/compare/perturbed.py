"""Both sides run again, changed by next to nothing; and the chaos floor that this makes.

After a grazing contact two runs that differ by rounding diverge exponentially. So each side is run
again with its start and commands perturbed, and the largest distance that this makes of a quantity,
between a perturbed run and the run of the same side, is its floor. A gap below the floor may be
chance; a gap above three times the floor is more than that; between the two nobody can tell.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...backends.starts import asleep_from_the_start
from ...errors import BadInputError, EngineError, EngineWarning, TraceError
from ...interface import Array, Data, Ints, JointType, Model
from ...measures import amount, common_moments, same_pairs
from ...processes.parallel import forks_for, in_forks
from ...rotations import times
from ..recordings import Rerun, Trace, beginning_with
from ..runs.drive import Progress, part_of, silent
from ..runs.scenarios import Controller
from .agreement import Agreement, Comparison
from .series import NORMAL, at_the_end, series, touches

RUNS = 8  # of each side
CLEAR = 3.0  # times the floor: a larger gap is more than chance
ROUNDING = 1e-12  # of a value, or of 1 where it is less; some thousand times that of a float64

Chance = Literal["inside", "cannot be told", "beyond"]


def against_floor(gap: float, floor: float) -> Chance:
    """Tell whether rounding alone can make a gap.

    Args:
        gap: How far apart the two sides are, above zero.
        floor: The chaos floor of both sides, in the unit of the gap; infinite where a perturbed run
            ended early.

    Returns:
        "inside" for a gap below the floor, of which nothing can be concluded; "beyond" for one
        above three times the floor, or one that is not a number; "cannot be told" between.
    """
    if gap < floor:
        return "inside"
    if gap <= CLEAR * floor:
        return "cannot be told"
    return "beyond"


@dataclass(frozen=True)
class Uncertainty:
    """What is not known of the start of a real robot.

    Attributes:
        length: Of the position of a slide or a free body [m].
        angle: Of a hinge, and of the rotation of a free body or a ball [rad].
    """

    length: float = 0.0
    angle: float = 0.0


EXACT = Uncertainty()


def parse_uncertainty(words: Iterable[str]) -> Uncertainty:
    """What words like "0.1mm" and "0.1deg" say.

    Raises:
        BadInputError: A word is invalid, or a length or an angle is given twice.
    """
    sizes: dict[str, float] = {}
    for word in words:
        value, unit = amount(word)
        kind = {"m": "length", "rad": "angle"}.get(unit, "")
        if not kind or np.isnan(value):
            raise BadInputError(f"an uncertainty reads like 0.1mm or 0.1deg; got {word!r}")
        if kind in sizes:
            raise BadInputError(f"the {kind} that is uncertain is given twice: {word!r}")
        sizes[kind] = value
    return Uncertainty(**sizes)


def perturbed_runs(
    rerun: Rerun,
    *,
    runs: int = RUNS,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    derive: bool = True,
    progress: Progress = silent,
) -> Iterator[Trace]:
    """The same run, again and again, from starts and with commands that differ by rounding.

    Positions, velocities and commands change by at most 1e-12 of themselves (of 1 where they
    are less), drawn anew for each run and each command. A quaternion is turned by such an
    angle, and stays one. Where the start is uncertain by more, each coordinate of it is
    displaced by all of that, to a side that is drawn, and in the next run to the other side:
    the corners of what is possible.

    Args:
        rerun: The run.
        runs: How many, at least 1.
        seed: Of what is drawn.
        uncertain: What is not known of the start.
        derive: Whether the traces tell what the engine derives, too.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `runs` is less than 1, or the seed is negative.
    """
    if runs < 1:
        raise BadInputError(f"the chaos floor wants at least one run; got {runs}")
    for k in range(runs):
        yield perturbed_run(
            rerun,
            k,
            seed=seed,
            uncertain=uncertain,
            derive=derive,
            progress=part_of(progress, k / runs, 1 / runs),
        )


def perturbed_run(
    rerun: Rerun,
    k: int,
    *,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    derive: bool = True,
    progress: Progress = silent,
) -> Trace:
    """The run with the number `k` of `perturbed_runs`, which depends on no other."""
    if seed < 0:
        raise BadInputError(f"seed must not be negative; got {seed}")
    draw = np.random.default_rng([seed, k])
    qpos, qvel = rerun.start()
    # At a corner of what is possible; of two runs one is opposite to the other.
    corner, side = np.random.default_rng([seed, k // 2]), -1.0 if k % 2 else 1.0

    def along() -> float:
        return side * float(corner.choice((-1.0, 1.0)))

    qpos = displaced(rerun.model, qpos, uncertain, corner, along, far=lambda: side)
    controller = nudged_controller(rerun.controller(rerun.model), draw)
    qpos, qvel = nudged_start(rerun.model, qpos, qvel, draw)
    # What an engine warns of, and what is wrong with the start, is told of the run itself.
    with warnings.catch_warnings(action="ignore", category=EngineWarning):
        return rerun.record(
            controller=controller,
            qpos=qpos,
            qvel=qvel,
            derive=derive,
            progress=progress,
        )


def displaced(
    model: Model,
    qpos: Array,
    size: Uncertainty,
    draw: np.random.Generator,
    along: Callable[[], float],
    far: Callable[[], float],
) -> Array:
    """A start (nq,) away from another one.

    Args:
        model: Whose joints they are.
        qpos: (nq,) the other one.
        size: How far away.
        draw: Of the directions of free bodies and rotations.
        along: Gives what share of it a hinge or a slide moves, with its sign.
        far: Gives what share of it a free body or a rotation does.
    """
    qpos = qpos.copy()
    for kind, place in zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True):
        if kind == JointType.HINGE:
            qpos[place] += size.angle * along()
            continue
        if kind == JointType.SLIDE:
            qpos[place] += size.length * along()
            continue
        if kind == JointType.FREE:
            qpos[place : place + 3] += size.length * far() * direction(draw)
        turn(qpos[place + JointType(kind).nq - 4 :][:4], size.angle * far() * direction(draw))
    return qpos


def nudged_start(
    model: Model, qpos: Array, qvel: Array, draw: np.random.Generator
) -> tuple[Array, Array]:
    """Return positions (nq,) and velocities (nv,) changed by rounding; a quaternion stays one.

    What belongs to a body that sleeps from the start stays as it is: any change wakes the body.
    """
    nudged = _nudged(qpos, draw)
    for _, place in model._quaternions:
        nudged[place : place + 4] = qpos[place : place + 4]
        turn(nudged[place : place + 4], ROUNDING * direction(draw))
    velocities = _nudged(qvel, draw)
    asleep = asleep_from_the_start(model)
    velocities[asleep] = qvel[asleep]
    for joint in np.flatnonzero(asleep[model.jnt_dofadr]):
        place = model.jnt_qposadr[joint]
        end = place + JointType(model.jnt_type[joint]).nq
        nudged[place:end] = qpos[place:end]
    return nudged, velocities


def turn(quat: Array, by: Array) -> None:
    """Turn a quaternion (4,), in place, by a vector (3,) along the axis, as long as the angle."""
    angle = float(np.linalg.norm(by))
    if angle:
        half = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * by / angle)])
        turned = times(half, quat)
        quat[:] = turned / np.linalg.norm(turned)


def direction(draw: np.random.Generator) -> Array:
    """A unit vector (3,), every direction as likely as any other."""
    vector = draw.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _nudged(values: Array, draw: np.random.Generator) -> Array:
    """Values (n,) changed by rounding; what is not finite stays."""
    finite = np.where(np.isfinite(values), values, 0.0)
    return values + ROUNDING * np.maximum(1.0, np.abs(finite)) * draw.uniform(-1, 1, len(values))


def nudged_controller(controller: Controller | None, draw: np.random.Generator) -> Controller:
    """A controller whose commands differ by rounding, and what is commanded without one."""

    def nudging(time: float, data: Data) -> Array | None:
        ctrl = None if controller is None else controller(time, data)
        return None if ctrl is None else _nudged(np.asarray(ctrl, dtype=np.float64), draw)

    # Once: a ctrl that stays as it is must not wander.
    return beginning_with(lambda data: _nudged(data.ctrl, draw), nudging)


_WINDOW = 0.025  # of the common time, to either side
_LATER = 0.05  # of the common time, by which an event may come later in another run
_FIRST_TOUCH = ", first touch"


@dataclass(frozen=True, eq=False)
class Band:
    """The chaos floor of one quantity of a comparison.

    Attributes:
        name: Of the quantity, as in the Agreement of the two sides.
        kind: Which sort of quantity it is.
        unit: Its SI unit.
        most: The largest width of the band, in the unit.
        end: The width at the last moment.
        inside_from: The time from which on the gap between the two sides lies inside [s]; None if
            it does not at the end. Of a first touch 0 or None.
        chance: Whether rounding alone can make a gap that leaves its tolerance, as
            `_chance_of` tells; None of a quantity that agrees.
        width: (n,) at each moment that the sides have in common; (1,) of a first touch.
    """

    name: str
    kind: str
    unit: str
    most: float
    end: float
    inside_from: float | None
    chance: Chance | None
    width: Array = field(metadata={"json": False})


@dataclass(frozen=True, eq=False)
class ChaosFloor:
    """The chaos floor of every quantity of a comparison.

    Attributes:
        runs: How many perturbed runs were made of each side.
        sides: The sides that were run again: 0 the left, 1 the right. A recorded run cannot be.
        seed: Of what was drawn.
        rounding: What starts and commands were changed by, relative.
        uncertain: What the start is uncertain by besides.
        ended: How many of the runs ended early; from then on the band has no bound.
        bands: One for each quantity that is compared.
    """

    runs: int
    sides: tuple[int, ...]
    seed: int
    rounding: float
    uncertain: Uncertainty
    ended: int
    bands: tuple[Band, ...]

    def chance(self, name: str) -> Chance | None:
        """Return whether rounding alone can make the gap of a quantity; None where it agrees."""
        for band in self.bands:
            if band.name == name:
                return band.chance
        return None


def chaos_floor(
    comparison: Comparison,
    reruns: Sequence[Rerun | None],
    *,
    runs: int | None = None,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    jobs: int | None = None,
    progress: Progress = silent,
) -> ChaosFloor:
    """Compute the chaos floor of each quantity of a comparison.

    The band at a moment is the largest distance of a perturbed run from the run of the same side,
    within 2.5 % of the common time before and after it. It is not a running maximum: a robot whose
    servos pull it back forgets where it started, and a gap that remains then is a difference
    although an impact in between was chaotic. And it is not of the moment alone: all perturbed runs
    diverge along the one direction that grows fastest, so that they cross the first run at the
    same time, and an impact that comes a step later is a spike in each of two places.

    Both sides are given the same draws, so that swapping the sides changes no figure.

    Args:
        comparison: Of two traces.
        reruns: How the left and the right were run; None for a side that was not run here.
        runs: How many perturbed runs of each side; None for `RUNS`.
        seed: Of what is drawn.
        uncertain: What the start of a real robot is uncertain by.
        jobs: How many processes make the runs; None for one a processor where that pays, and for
            one where a function commands, which may keep something from run to run.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `runs` is less than 1, the seed is negative, or neither side was run here.
        EngineError: A process ended before its run was done, twice.
    """
    runs = RUNS if runs is None else runs
    if runs < 1:
        raise BadInputError(f"the chaos floor wants at least one run; got {runs}")
    left, right = comparison.left.trace, comparison.right.trace
    common = common_moments(left.time, right.time, (left.timestep, right.timestep))
    sides = tuple(side for side, rerun in enumerate(reruns) if rerun is not None)
    if not sides:
        raise BadInputError("the chaos floor runs a side again, and both are recorded runs")
    work: list[Callable[[], _Departure]] = []
    for rerun, trace, rows in zip(reruns, (left, right), (common.left, common.right), strict=True):
        if rerun is not None:
            draws = [
                partial(perturbed_run, rerun, k, seed=seed, uncertain=uncertain)
                for k in range(runs)
            ]
            work += [partial(_departure, draw, trace, comparison, rows) for draw in draws]
    gaps = _gaps_of(comparison)
    widths = {name: np.zeros(len(gap)) for name, gap in gaps.items()}
    ended = 0
    for departure in _departures(work, reruns, jobs, progress):
        ended += departure.ended
        for name, distance in _named_as(gaps, departure.distances).items():
            if name in widths:
                widths[name] = np.maximum(widths[name], distance)
    bands = [
        _band(agreement, gaps[agreement.name], widths[agreement.name], common.time)
        for agreement in comparison.agreements
    ]
    return ChaosFloor(
        runs=runs,
        sides=sides,
        seed=seed,
        rounding=ROUNDING,
        uncertain=uncertain,
        ended=ended,
        bands=tuple(bands),
    )


def _gaps_of(comparison: Comparison) -> dict[str, Array]:
    """Return how far apart the sides are (n,) in each quantity; (1,) [s] of a first touch."""
    gaps = {curve.name: curve.difference for curve in comparison.curves}
    for agreement in comparison.agreements:
        if agreement.kind == "contact":
            gaps[agreement.name] = np.array([agreement.max])
    return gaps


def _largest_nearby(values: Array, reach: int) -> Array:
    """Return for each of some values (n,) the largest within so many rows to either side."""
    padded = np.pad(values, reach, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)


@dataclass(frozen=True)
class _Departure:
    """How far a perturbed run gets from the run of the same side.

    Attributes:
        distances: By quantity (n,) at the common moments, infinite where the run has ended; of a
            first touch (1,) [s].
        ended: Whether the run ended early.
    """

    distances: dict[str, Array]
    ended: bool


def _departures(
    work: Sequence[Callable[[], _Departure]],
    reruns: Sequence[Rerun | None],
    jobs: int | None,
    progress: Progress,
) -> Iterator[_Departure]:
    """Make the perturbed runs, in this process or in forks of it, in the order of `work`."""
    began = time.perf_counter()
    first = work[0]()
    took, done = time.perf_counter() - began, 1
    progress(done / len(work))
    yield first

    def ran() -> None:
        nonlocal done
        done += 1
        progress(done / len(work))

    rest = work[1:]
    # A function of the user's may keep something from one run to the next.
    if jobs is None and any(rerun is not None and rerun.writes_state for rerun in reruns):
        jobs = 1
    forks = forks_for(len(rest), took, jobs)
    if forks > 1:
        for departure in in_forks(rest, forks, ran, took):
            if departure is None:
                raise EngineError("a run for the chaos floor ended its process twice")
            yield departure
        return
    for call in rest:
        yield call()
        ran()


def _departure(
    draw: Callable[[], Trace], own: Trace, comparison: Comparison, rows: Ints
) -> _Departure:
    """Make a perturbed run, and measure how far it gets from the run of its side.

    Args:
        draw: Makes the run.
        own: The run of the side as it comes, by the names of the comparison.
        comparison: Of both sides.
        rows: (n,) of `own`, at the common moments.
    """
    run = draw()
    known = {name: run.columns[name] for name in own.columns if name in run.columns}
    perturbed = Trace(replace(own.header, ended=run.header.ended), known)
    distances: dict[str, Array] = {}
    try:
        curves, count = series(own, perturbed, comparison.tip), len(perturbed)
        for touch in touches(own, perturbed):
            first, other = touch.left.first, touch.right.first
            apart = comparison.until if first is None or other is None else abs(first - other)
            distances[f"{touch.pair}{_FIRST_TOUCH}"] = np.array([apart])
    except TraceError:  # it ended at once
        curves, count = series(own, own, comparison.tip), 0
    for curve in curves:
        far = np.full(len(own), np.inf)
        far[:count] = np.nan_to_num(curve.difference[:count], nan=np.inf)
        distances[curve.name] = far[rows]
    return _Departure(distances, bool(run.header.ended))


def _named_as(known: Mapping[str, Array], distances: dict[str, Array]) -> dict[str, Array]:
    """Return distances by the names of the comparison: "a on b" may be "b on a" on one side."""
    named = dict(distances)
    for ending in (NORMAL, _FIRST_TOUCH):
        pairs = {name.removesuffix(ending): name for name in known if name.endswith(ending)}
        own = {name.removesuffix(ending): name for name in distances if name.endswith(ending)}
        for pair, name in same_pairs(pairs, own).items():
            named[f"{pair}{ending}"] = named.pop(name)
    return named


def _band(agreement: Agreement, gap: Array, width: Array, moments: Array) -> Band:
    """Return the chaos floor of one quantity.

    Args:
        agreement: Of the two sides.
        gap: (n,) how far apart they are; (1,) of a first touch.
        width: Of the same length, how far a perturbed run gets from its side at the most.
        moments: (n,) since the start [s].
    """
    if agreement.kind == "contact":
        moments = np.zeros(1)
    else:
        width = _largest_nearby(width, round(_WINDOW * (len(moments) - 1)))
    outside = np.flatnonzero(~(gap <= width))
    last = int(outside[-1]) + 1 if len(outside) else 0
    inside_from = float(moments[last]) if last < len(moments) else None
    chance: Chance | None = None
    if agreement.verdict != "agrees":
        chance = _chance_of(gap, width, agreement.tolerance, at_the_end(moments))
    return Band(
        name=agreement.name,
        kind=agreement.kind,
        unit=agreement.unit,
        most=float(width.max()),
        end=float(width[-1]),
        inside_from=inside_from,
        chance=chance,
        width=width,
    )


def _chance_of(gap: Array, width: Array, tolerance: float, tail: NDArray[np.bool_]) -> Chance:
    """Tell whether rounding alone can make a gap that leaves its tolerance.

    Two things are held against three times the floor. The largest gap so far, at each moment,
    against the largest width until a twentieth of the common time later: so a gap that was there
    before the motion became chaotic counts, and an event that comes a little earlier in one run
    does not. And the mean gap of the last tenth against the largest width there: a robot whose
    servos pull it back forgets where it started, and what then remains is a difference.

    Args:
        gap: (n,) how far apart the sides are; not all within the tolerance.
        width: (n,) of the band.
        tolerance: In the same unit.
        tail: (n,) which moments are of the last tenth.
    """
    largest_gap = np.maximum.accumulate(np.nan_to_num(gap, nan=np.inf))
    largest_width = np.maximum.accumulate(width)
    later = min(round(_LATER * len(gap)), len(gap) - 1)
    ahead = np.append(largest_width[later:], np.full(later, largest_width[-1]))
    beyond = largest_gap > tolerance
    pairs = list(zip(largest_gap[beyond].tolist(), ahead[beyond].tolist(), strict=True))
    settled = float(gap[tail].mean())
    if not settled <= tolerance:
        pairs.append((settled, float(width[tail].max())))
    found = {against_floor(*pair) for pair in pairs}
    if "beyond" in found:
        return "beyond"
    return "cannot be told" if "cannot be told" in found else "inside"
