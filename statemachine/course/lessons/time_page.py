"""The page of the lesson on time: how fast a run is, with waiting and without."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...lab.runs.interleaved_timing import MIN_ROUNDS
from ...measures.text import duration, significant
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, by_engine
from ...show.labels import TableLabels
from ...show.templates import PageContent
from ._loop_cost import is_undecided, loop_tables, right_choice
from .frame import LessonFrame
from .time import NAP, TimeResult, is_still

_SAY = TableLabels(__name__, "time_labels.md.j2")
_BOUNDS = (1.0, 10.0)  # × real time, between the choices of the question


@dataclass(frozen=True)
class TimePage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        speed: How many times real time the run is.
        paces: The run with waiting and without.
        loops: What a loop of single steps costs; empty where that was not asked for.
    """

    template = "time.md.j2"
    lesson: LessonFrame
    result: TimeResult
    speed: Table
    paces: Table
    loops: Sequence[Block]

    @property
    def still(self) -> bool:
        """Tell whether neither time nor state moved while nothing was called."""
        return is_still(self.result)

    @property
    def right(self) -> int:
        """Return the number of the right choice."""
        return 0 if self.still else 1

    @property
    def later(self) -> float:
        """Return what the time would be if the sleep were part of it [s]."""
        return self.result.end + NAP

    @property
    def is_inexact(self) -> bool:
        """Tell whether rounding shows in the time at the end."""
        return self.result.end != round(self.result.end, 9)

    @property
    def simulated(self) -> float:
        """Return the simulated time of the run that does not wait [s]."""
        return self.result.nstep * self.result.provenance.timestep

    @property
    def is_speed_undecided(self) -> bool:
        """Tell whether the rounds are too few, or lie on both sides of a choice's bound."""
        rate = self.result.rate
        straddles = any(rate.low <= bound <= rate.high for bound in _BOUNDS)
        return rate.rounds < MIN_ROUNDS or straddles

    @property
    def speed_right(self) -> int:
        """Return the number of the right choice, how many times real time."""
        return sum(self.result.rate.median > bound for bound in _BOUNDS)

    @property
    def step_cost(self) -> float | None:
        """Return the wall time of a step in bulk [s]; None where that was not asked for."""
        further = self.result.further
        return None if further is None else further.bulk / further.nstep

    @property
    def is_loop_undecided(self) -> bool:
        """Tell whether it cannot be told how much longer a loop takes."""
        return self.result.further is not None and is_undecided(self.result.further)

    @property
    def loop_right(self) -> int | None:
        """Return the number of the right choice, how much longer a loop takes."""
        return None if self.result.further is None else right_choice(self.result.further)


def contents(results: Results[TimeResult], frame: LessonFrame) -> dict[str, TimePage]:
    """Return what the page shows of each engine."""
    first = next(iter(results.values()))
    loops = {name: result.further for name, result in results.items() if result.further}
    tables = loop_tables(loops, _SAY) if loops else []
    speed, paces = _speed(results, first), _paces(results)
    return {name: TimePage(frame, result, speed, paces, tables) for name, result in results.items()}


def _speed(results: Results[TimeResult], first: TimeResult) -> Table:
    """Return how many times real time the run is, by engine."""
    wall = _SAY("wall_unpaced") if first.realtime else _SAY("wall")
    rows: dict[str, Callable[[TimeResult], str]] = {
        wall: lambda result: duration(result.wall),
        _SAY("rate"): lambda result: result.rate.spread(" ×", 1),
    }
    return by_engine(results, rows)


def _paces(results: Results[TimeResult]) -> Table:
    """Return the run with waiting and without, by engine."""
    rows: dict[str, Callable[[TimeResult], str]] = {
        _SAY("unpaced"): _unpaced,
        _SAY("paced"): _paced_by_clock,
        _SAY("waiting"): _part_waited,
        _SAY("latest"): _latest,
    }
    return by_engine(results, rows)


def _unpaced(result: TimeResult) -> str:
    """Write the wall time of the run that does not wait."""
    return f"{duration(result.free)}, {significant(result.factor, 3)} × real time"


def _paced_by_clock(result: TimeResult) -> str:
    """Write the wall time of the run that waits."""
    return f"{result.paced:.3f} s, {result.paced_factor:.3g} × real time"


def _part_waited(result: TimeResult) -> str:
    """Write how much of the run that waits was waiting."""
    return f"{result.waited / result.paced:.0%}"


def _latest(result: TimeResult) -> str:
    """Write how late the latest step was."""
    return duration(result.latest)
