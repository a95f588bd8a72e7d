"""The chaos floor: how far rounding alone drives a run from itself, and what that makes of a gap.

After a grazing contact two runs that differ by rounding diverge exponentially. So each side is run
again with its start and commands perturbed, and the largest distance that this makes of a quantity,
between a perturbed run and the run of the same side, is its floor. A gap below the floor may be
chance; a gap above three times the floor is more than that; between the two nobody can tell.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...engines import raw_engine_of
from ...errors import BadInputError, EngineError, TraceError
from ...interface import Array, Ints, Model
from ...measures import QUANTITIES, common_moments, with_left_pair_names
from ...processes.parallel import forks_for, in_forks
from ..recordings import Rerun, Trace
from ..runs.drive import Progress, no_progress
from . import perturbed
from .agreement import Agreement, Comparison
from .outcomes import outcomes_of
from .perturbed import EXACT, Uncertainty, perturbed_run
from .series import NORMAL, at_the_end, series, touches

CLEAR = 3.0  # times the floor: a larger gap is more than chance
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
        rounding: What starts and commands were changed by, relative; on the side that is less
            exact.
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
    progress: Progress = no_progress,
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
        runs: How many perturbed runs of each side; None for `perturbed.RUNS`.
        seed: Of what is drawn.
        uncertain: What the start of a real robot is uncertain by.
        jobs: How many processes make the runs; None for one a processor where that pays, and for
            one where a function commands, which may keep something from run to run.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `runs` is less than 1, the seed is negative, or neither side was run here.
        EngineError: A process ended before its run was done, twice.
    """
    runs = perturbed.RUNS if runs is None else runs
    if runs < 1:
        raise BadInputError(f"the chaos floor wants at least one run; got {runs}")
    left, right = comparison.left.trace, comparison.right.trace
    common = common_moments(left.time, right.time, (left.timestep, right.timestep))
    sides = tuple(side for side, rerun in enumerate(reruns) if rerun is not None)
    if not sides:
        raise BadInputError("the chaos floor runs a side again, and both are recorded runs")
    work: list[Callable[[], _Departure]] = []
    traces, rows = (left, right), (common.left, common.right)
    for k in range(runs):
        # The sides in turn, so that what was done says how long the rest takes.
        for side, rerun in enumerate(reruns):
            if rerun is not None:
                draw = partial(perturbed_run, rerun, k, seed=seed, uncertain=uncertain)
                work.append(partial(_departure, draw, traces[side], comparison, rows[side]))
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
        rounding=max(model.capabilities.rounding for model in _models_of(reruns)),
        uncertain=uncertain,
        ended=ended,
        bands=tuple(bands),
    )


def _gaps_of(comparison: Comparison) -> dict[str, Array]:
    """Return how far apart the sides are (n,) in each quantity; (1,) of a touch or an outcome."""
    gaps = {curve.name: curve.difference for curve in comparison.curves}
    for agreement in comparison.agreements:
        if QUANTITIES[agreement.kind].is_outcome:
            gaps[agreement.name] = np.array([agreement.max])
    return gaps


def _largest_nearby(values: Array, half_width: int) -> Array:
    """Return for each of some values (n,) the largest within so many rows to either side."""
    padded = np.pad(values, half_width, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * half_width + 1).max(axis=1)


@dataclass(frozen=True)
class _Departure:
    """How far a perturbed run gets from the run of the same side.

    Attributes:
        distances: By quantity (n,) at the common moments, infinite where the run has ended; of a
            first touch or an outcome (1,).
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
    seconds, count = time.perf_counter() - began, 1
    progress(count / len(work))
    yield first

    def ran(_number: int, _departure: _Departure) -> None:
        nonlocal count
        count += 1
        progress(count / len(work))

    rest = work[1:]
    # A function of the user's may keep something from one run to the next.
    if jobs is None and any(rerun is not None and rerun.writes_state for rerun in reruns):
        jobs = 1
    engines = {model.backend for model in _models_of(reruns)}
    can_fork = all(raw_engine_of(engine).survives_fork for engine in engines)
    forks = forks_for(len(rest), seconds, jobs, can_fork)
    if forks > 1:
        for departure in in_forks(rest, forks, ran, seconds):
            if departure is None:
                raise EngineError("a run for the chaos floor ended its process twice")
            yield departure
        return
    for number, call in enumerate(rest):
        departure = call()
        yield departure
        ran(number, departure)


def _models_of(reruns: Sequence[Rerun | None]) -> list[Model]:
    """Return the Models of the sides that were run here."""
    return [rerun.model for rerun in reruns if rerun is not None]


def _departure(
    draw: Callable[[], Trace], trace: Trace, comparison: Comparison, rows: Ints
) -> _Departure:
    """Make a perturbed run, and measure how far it gets from the run of its side.

    Args:
        draw: Makes the run.
        trace: The run of the side as it comes, by the names of the comparison.
        comparison: Of both sides.
        rows: (n,) of `trace`, at the common moments.
    """
    run = draw()
    known = {name: run.columns[name] for name in trace.columns if name in run.columns}
    departed = Trace(replace(trace.header, ended=run.header.ended), known)
    distances: dict[str, Array] = {}
    try:
        curves, count = series(trace, departed, comparison.tip), len(departed)
        for touch in touches(trace, departed):
            left_first, right_first = touch.left.first, touch.right.first
            gap = comparison.until
            if left_first is not None and right_first is not None:
                gap = abs(left_first - right_first)
            distances[f"{touch.pair}{_FIRST_TOUCH}"] = np.array([gap])
        for outcome in outcomes_of(trace, departed, comparison.until):
            far = np.inf if run.header.ended else outcome.difference
            distances[outcome.name] = np.array([far])
    except TraceError:  # it ended at once
        curves, count = series(trace, trace, comparison.tip), 0
    for curve in curves:
        far = np.full(len(trace), np.inf)
        far[:count] = np.nan_to_num(curve.difference[:count], nan=np.inf)
        distances[curve.name] = far[rows]
    return _Departure(distances, bool(run.header.ended))


def _named_as(curves: Mapping[str, Array], distances: dict[str, Array]) -> dict[str, Array]:
    """Return distances by the names of the comparison: "a on b" may be "b on a" on one side."""
    named = dict(distances)
    for ending in (NORMAL, _FIRST_TOUCH):
        pairs = {name.removesuffix(ending): name for name in curves if name.endswith(ending)}
        measured = {name.removesuffix(ending): name for name in distances if name.endswith(ending)}
        for pair, name in with_left_pair_names(pairs, measured).items():
            named[f"{pair}{ending}"] = named.pop(name)
    return named


def _band(agreement: Agreement, gap: Array, width: Array, moments: Array) -> Band:
    """Return the chaos floor of one quantity.

    Args:
        agreement: Of the two sides.
        gap: (n,) how far apart they are; (1,) of a first touch or an outcome.
        width: Of the same length, how far a perturbed run gets from its side at the most.
        moments: (n,) since the start [s].
    """
    if QUANTITIES[agreement.kind].is_outcome:
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
    verdicts = {against_floor(*pair) for pair in pairs}
    if "beyond" in verdicts:
        return "beyond"
    return "cannot be told" if "cannot be told" in verdicts else "inside"
