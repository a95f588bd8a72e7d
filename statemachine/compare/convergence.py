"""Whether a gap vanishes with the timestep: both sides run with finer and finer steps.

What vanishes is discretisation: each side approaches the same motion, in its own way. What stays
is a difference of the machines. After a touch that cannot be told apart so simply: the contact
law of an engine depends on its timestep, and the runs have no common limit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import EndedEarlyError
from ..interface import Array, Ints
from ..measures import common_moments
from ..page import Figures
from ..runs import Trace
from ..runs.drive import Progress, silent
from .labels import labels_of
from .series import Series, default_tip, series

FINER = (1, 2, 4)  # engine steps to one of the first runs
_ROUNDING = 1e-9  # of the largest value of a quantity, or of 1
_FIRST_ORDER = 1.6  # the least ratio of two gaps, one with half of the other's steps
_PART, _MOST = 0.1, 0.75  # of the gap: less is left by chance, more is all of it

Limit = Literal["rounding", "discretisation", "stays", "in part", "unclear"]


def convergence(
    run: Callable[[int], tuple[Trace, Trace]],
    *,
    progress: Progress = silent,
) -> Figures:
    """Run two sides with their steps as given, halved and quartered.

    Args:
        run: Gives the traces of both sides, with rows as far apart as ever and so many times as
            many engine steps between them (`Model.replace(substeps=…)`).
        progress: Told the fraction that is done.

    Returns:
        What was found, by name.

        - labels: The two sides.
        - steps: The engine's steps of the left side and of the right one [s], as given; they are
          halved and quartered.
        - until: The last moment that is compared [s].
        - touch: When something touches first in any of the runs [s]; None if nothing does.
        - before: Each quantity until then, see `_limit`; of a run that begins with a touch there is
          none.
        - whole: Each quantity over all of the run; the same as `before` if nothing touches.
        - vanishes: Whether no gap is more than discretisation, over the whole run.

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
    left, right = runs[0]
    tip = default_tip(left.header, right.header)
    common = common_moments(left.time, right.time, (left.timestep, right.timestep))
    time = common.time
    # Of the pairs of sides; then of each side's first runs and its finest.
    between = [_gaps(a, b, tip) for a, b in runs]
    own = [
        [_gaps(pair[side], runs[-1][side], tip, rows) for pair in runs[:-1]]
        for side, rows in ((0, common.left), (1, common.right))
    ]
    curves = [
        curve
        for curve in series(left, right, tip)
        if curve.kind != "force" and all(curve.name in gaps for gaps in between)
    ]
    firsts = [
        float(trace.time[trace["contact_row"][0]] - trace.time[0])
        for pair in runs
        for trace in pair
        if "contact_row" in trace and len(trace["contact_row"])
    ]
    touch = min((first for first in firsts if first <= time[-1]), default=None)
    early = time < (np.inf if touch is None else touch - 1e-9)
    whole, before = (
        tuple(_limit(curve, between, own, chosen) for curve in curves if chosen.any())
        for chosen in (np.ones(len(time), dtype=bool), early)
    )
    return Figures(
        labels=labels_of(left.header, right.header).long,
        steps=(
            left.header.timestep / left.header.substeps,
            right.header.timestep / right.header.substeps,
        ),
        until=float(time[-1]),
        touch=touch,
        before=before,
        whole=whole,
        vanishes=all(limit.verdict in ("rounding", "discretisation") for limit in whole),
    )


def _gaps(
    left: Trace, right: Trace, tip: str, rows: Ints | slice = slice(None)
) -> dict[str, Array]:
    return {curve.name: curve.difference[rows] for curve in series(left, right, tip)}


def _limit(
    curve: Series,
    between: list[dict[str, Array]],
    own: list[list[dict[str, Array]]],
    chosen: NDArray[np.bool_],
) -> Figures:
    """One quantity at some of the moments (n,), with finer and finer steps.

    Returns:
        name, kind, unit: As of an Agreement.
        gaps: The largest gap between the sides, with the steps as given, halved and quartered.
        left: How far the left side's run with the steps as given, and with halved ones, is from
            its run with the finest; right: the same of the right side.
        limit: What the gap tends to for steps of no length, on the line through the last two.
        verdict: "rounding" where there is no gap; "discretisation" if each halving takes away
            half of it or about that, and nothing is left; "stays" if three quarters or more are
            there with the finest steps; "in part" if less is left, but some; "unclear" if it does
            not shrink from run to run.
    """
    name = curve.name
    gaps = [float(run[name][chosen].max()) for run in between]
    left, right = (
        [float(run[name][chosen].max()) if name in run else np.nan for run in side] for side in own
    )
    values = curve.left[chosen] if curve.left.size else np.ones(1)
    rounding = _ROUNDING * max(1.0, float(np.abs(values).max()))
    limit = max(0.0, 2 * gaps[2] - gaps[1])
    return Figures(
        name=name,
        kind=curve.kind,
        unit=curve.unit,
        gaps=gaps,
        left=left,
        right=right,
        limit=limit,
        verdict=_verdict(gaps, limit, rounding),
    )


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
