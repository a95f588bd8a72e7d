"""Whether a gap vanishes with the timestep: both sides run with finer and finer steps.

What vanishes is discretisation: each side approaches the same motion, in its own way. What stays
is a difference of the machines. After a touch that cannot be told apart so simply: the contact
law of an engine depends on its timestep, and the runs have no common limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import EndedEarlyError
from ..interface import Array, Ints
from ..measures import common_moments
from ..runs import Trace
from ..runs.drive import Progress, silent
from .labels import labels_of
from .series import Series, default_tip, series

FINER = (1, 2, 4)  # engine steps to one of the first runs
_ROUNDING = 1e-9  # of the largest value of a quantity, or of 1
_FIRST_ORDER = 1.6  # the least ratio of two gaps, one with half of the other's steps
_PART, _MOST = 0.1, 0.75  # of the gap: less is left by chance, more is all of it

Limit = Literal["rounding", "discretisation", "stays", "in part", "unclear"]


@dataclass(frozen=True)
class QuantityLimit:
    """One quantity with finer and finer steps.

    Attributes:
        name: As in an Agreement; kind, unit: likewise.
        gaps: The largest gap between the sides, with the steps as given, halved and quartered.
        left: How far the left side's run with the steps as given, and with halved ones, is from
            its run with the finest; right: the same of the right side.
        limit: What the gap tends to for steps of no length, on the line through the last two.
        verdict: "rounding" where there is no gap; "discretisation" if each halving takes away
            half of it or about that, and nothing is left; "stays" if three quarters or more are
            there with the finest steps; "in part" if less is left, but some; "unclear" if it does
            not shrink from run to run.
    """

    name: str
    kind: str
    unit: str
    gaps: tuple[float, float, float]
    left: tuple[float, float]
    right: tuple[float, float]
    limit: float
    verdict: Limit


@dataclass(frozen=True)
class TimestepConvergence:
    """A comparison with finer and finer steps.

    Attributes:
        labels: The two sides.
        steps: The engine's steps of the left side and of the right one [s], as given; they are
            halved and quartered.
        until: The last moment that is compared [s].
        touch: When something touches first in any of the runs [s]; None if nothing does.
        before: Each quantity until then; of a run that begins with a touch there is none.
        whole: Each quantity over all of the run; the same as `before` if nothing touches.
    """

    labels: tuple[str, str]
    steps: tuple[float, float]
    until: float
    touch: float | None
    before: tuple[QuantityLimit, ...]
    whole: tuple[QuantityLimit, ...]

    @property
    def vanishes(self) -> bool:
        """Whether no gap is more than discretisation, over the whole run."""
        return all(each.verdict in ("rounding", "discretisation") for each in self.whole)


def convergence(
    run: Callable[[int], tuple[Trace, Trace]],
    *,
    tip: str | None = None,
    progress: Progress = silent,
) -> TimestepConvergence:
    """Run two sides with their steps as given, halved and quartered.

    Args:
        run: Gives the traces of both sides, with rows as far apart as ever and so many times as
            many engine steps between them (`Model.replace(substeps=…)`).
        tip: The site to compare; by default gripperframe, else the last one.
        progress: Told the fraction that is done.

    Raises:
        EndedEarlyError: A run ends before its time.
        TraceError: The sides have too few moments in common.
    """
    runs = []
    for k, finer in enumerate(FINER):
        runs.append(run(finer))
        progress((k + 1) / len(FINER))
        for trace in runs[-1]:
            if trace.header.ended:
                raise EndedEarlyError(
                    f"with steps {finer} times finer, {trace.header.label} ended early: "
                    f"{trace.header.ended}"
                )
    one, two = runs[0]
    tip = default_tip(one.header, two.header) if tip is None else tip
    time = common_moments(one, two).time
    touch = _first_touch(runs, float(time[-1]))
    before = time < (np.inf if touch is None else touch - 1e-9)
    curves = _Curves(runs, tip)
    whole = curves.limits(np.ones(len(time), dtype=bool))
    return TimestepConvergence(
        labels=labels_of(one.header, two.header).long,
        steps=(
            one.header.timestep / one.header.substeps,
            two.header.timestep / two.header.substeps,
        ),
        until=float(time[-1]),
        touch=touch,
        before=whole if touch is None else curves.limits(before) if before.any() else (),
        whole=whole,
    )


def _first_touch(runs: list[tuple[Trace, Trace]], until: float) -> float | None:
    found = []
    for trace in (trace for pair in runs for trace in pair):
        for touching in trace.touches().values():
            time = float(trace.time[int(np.argmax(touching))] - trace.time[0])
            if touching.any() and time <= until:
                found.append(time)
    return min(found, default=None)


class _Curves:
    """The gaps of all pairs of runs that count, at the moments of the first pair."""

    def __init__(self, runs: list[tuple[Trace, Trace]], tip: str) -> None:
        common = common_moments(*runs[0])
        self._first = series(*runs[0], tip)
        self._between = [_gaps(series(*pair, tip), None) for pair in runs]
        self._own = [
            [_gaps(series(pair[side], runs[-1][side], tip), rows) for pair in runs[:-1]]
            for side, rows in ((0, common.one), (1, common.two))
        ]

    def limits(self, chosen: NDArray[np.bool_]) -> tuple[QuantityLimit, ...]:
        """Each quantity that every pair has, at some of the moments (n,)."""
        found = []
        for curve in self._first:
            name = curve.name
            if curve.kind == "force" or any(name not in each for each in self._between):
                continue
            gaps = [float(each[name][chosen].max()) for each in self._between]
            own = [
                [float(each[name][chosen].max()) if name in each else np.nan for each in side]
                for side in self._own
            ]
            limit = max(0.0, 2 * gaps[2] - gaps[1])
            values = curve.one[chosen] if curve.one.size else np.ones(1)
            rounding = _ROUNDING * max(1.0, float(np.abs(values).max()))
            found.append(
                QuantityLimit(
                    name=name,
                    kind=curve.kind,
                    unit=curve.unit,
                    gaps=(gaps[0], gaps[1], gaps[2]),
                    left=(own[0][0], own[0][1]),
                    right=(own[1][0], own[1][1]),
                    limit=limit,
                    verdict=_verdict(gaps, limit, rounding),
                )
            )
        return tuple(found)


def _gaps(curves: list[Series], rows: Ints | None) -> dict[str, Array]:
    return {
        curve.name: curve.difference if rows is None else curve.difference[rows] for curve in curves
    }


def _verdict(gaps: list[float], limit: float, rounding: float) -> Limit:
    first, second, third = gaps
    if first <= rounding:
        return "rounding"
    if third >= _MOST * first:
        return "stays"
    if limit > max(_PART * first, rounding):
        return "in part" if third <= second <= first else "unclear"
    ratios = first / max(second, rounding), second / max(third, rounding)
    return "discretisation" if min(ratios) >= _FIRST_ORDER or third <= rounding else "unclear"
