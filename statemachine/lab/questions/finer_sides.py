"""Whether the gap of an odd side vanishes with the timestep: all sides run with finer steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from ..compare import Comparison, compare
from ..compare.convergence import FINER, LEAST_GAP, LimitVerdict, verdict_of
from .several_sides import (
    MeasuredQuantities,
    SidesGap,
    Span,
    Two,
    side_groups,
    sides_gap,
)

_AT_LEAST = 3  # of `FINER`, where that is enough for every gap

OddGapState = Literal["vanishes", "stays", "changes", "unclear"]


@dataclass(frozen=True)
class FinerGap:
    """What becomes of the gap between two sides with finer and finer steps of both.

    Attributes:
        left: What a side is called.
        right: What the other is called.
        gaps: Between them [unit]: with the steps as given, and with ever finer ones.
        verdict: As of a `GapLimit`, from all of these gaps.
    """

    left: str
    right: str
    gaps: tuple[float, ...]
    verdict: LimitVerdict


@dataclass(frozen=True)
class MovedSide:
    """How far a side gets from its own run with the timestep.

    Attributes:
        side: What it is called.
        moved: The largest gap between its run as it comes and one with finer steps [unit].
    """

    side: str
    moved: float


@dataclass(frozen=True)
class FinerSides:
    """Several sides, run with finer and finer steps.

    Attributes:
        finer: How many times as many engine steps each of the runs has, 1 first.
        gaps: Of each two sides.
        odd: What the side is called that is odd, in each of the runs; "" where none is.
        moved: Of each side.
    """

    finer: tuple[int, ...]
    gaps: tuple[FinerGap, ...]
    odd: tuple[str, ...]
    moved: tuple[MovedSide, ...]

    @property
    def state(self) -> OddGapState:
        """Return in a word what becomes of the side that is odd as the sides come.

        "vanishes" where its gaps to all others do; else "changes" where another side is odd, or
        none, with some finer steps; "stays" where its gaps to all others do, in part or whole;
        else "unclear".
        """
        own = {gap.verdict for gap in self.gaps if self.odd[0] in (gap.left, gap.right)}
        if own <= {"discretisation", "rounding"}:
            return "vanishes"
        if not self.is_steady:
            return "changes"
        return "stays" if own <= {"stays", "in part"} else "unclear"

    @property
    def is_steady(self) -> bool:
        """Tell whether the same side is odd whatever the steps are."""
        return len(set(self.odd)) == 1


def finer_sides(
    compared: Mapping[Two, Comparison],
    run: Callable[[Two, int], Comparison],
    quantities: MeasuredQuantities,
    span: Span,
    labels: Mapping[int, str],
) -> FinerSides:
    """Run all sides with steps 2 and 4 times finer; then 8 and 16, while something is unclear.

    That is so as well while not the same side is odd with all of these steps.

    Args:
        compared: Each two sides as they come; as many pairs as there are.
        run: Runs two sides with so many times as many engine steps, and compares.
        quantities: What is measured.
        span: What of a gap counts.
        labels: What each side is called, by its number.

    Raises:
        StateMachineError: A side does not run with finer steps.
    """
    runs: list[Mapping[Two, Comparison]] = [compared]
    for finer in FINER[1:]:
        made: dict[Two, Comparison] = {}
        for pair in compared:
            made[pair] = run(pair, finer)
        runs.append(made)
        if len(runs) < _AT_LEAST:
            continue
        result = _result(runs, quantities, span, labels)
        if result.is_steady and "unclear" not in {gap.verdict for gap in result.gaps}:
            return result
    return _result(runs, quantities, span, labels)


def _result(
    runs: list[Mapping[Two, Comparison]],
    quantities: MeasuredQuantities,
    span: Span,
    labels: Mapping[int, str],
) -> FinerSides:
    """Return what becomes of each gap over some runs, each with finer steps than the one before."""
    levels: list[dict[Two, SidesGap]] = []
    for run in runs:
        gaps = {
            (left, right): sides_gap((labels[left], labels[right]), quantities, each, None)
            for (left, right), each in run.items()
        }
        levels.append(gaps)
    odds: list[str] = []
    for gaps in levels:
        odd = side_groups(span, gaps, labels).odd
        odds.append("" if odd is None else odd.side)
    finer: list[FinerGap] = []
    for pair, first in levels[0].items():
        sizes = [_size(gaps[pair], span) for gaps in levels]
        verdict, _ = verdict_of(sizes, LEAST_GAP)
        finer.append(FinerGap(first.left, first.right, tuple(sizes), verdict))
    moved = [MovedSide(labels[side], _moved(side, runs, quantities, span)) for side in labels]
    return FinerSides(FINER[: len(runs)], tuple(finer), tuple(odds), tuple(moved))


def _size(gap: SidesGap, span: Span) -> float:
    """Return the figure of a gap that counts."""
    return gap.largest if span == "run" else gap.end


def _moved(
    side: int,
    runs: list[Mapping[Two, Comparison]],
    quantities: MeasuredQuantities,
    span: Span,
) -> float:
    """Return how far a side is at most from its own run as it comes [unit]."""
    pair = next(each for each in runs[0] if side in each)
    traces = []
    for run in runs:
        sides = run[pair]
        traces.append((sides.left if side == pair[0] else sides.right).trace)
    labels = ("as it comes", "with finer steps")
    gaps = [sides_gap(labels, quantities, compare(traces[0], each), None) for each in traces[1:]]
    return max(_size(gap, span) for gap in gaps)
