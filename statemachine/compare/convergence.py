"""Whether a gap vanishes with the timestep: both sides run with finer and finer steps.

What vanishes is discretisation: each side approaches the same motion, in its own way. What stays
is a difference of the machines. After a touch that cannot be told apart so simply: the contact
law of an engine depends on its timestep, and the runs have no common limit.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import EndedEarlyError
from ..interface import Array
from ..measures import common_moments
from ..page import Figures
from ..runs import Trace
from ..runs.drive import Progress, silent
from .labels import labels_of
from .series import Series, default_tip, series

FINER = (1, 2, 4, 8, 16)  # engine steps to one of the first runs; from 8 on, where it is unclear
_ROUNDING = 1e-9  # of the largest value of a quantity, or of 1
# What a halving divides a gap by, at orders from 0.7 (Euler's is 1) to 4.5 (RK4's is 4).
_SLOWEST, _FASTEST = 2**0.7, 2**4.5
_MARGIN = 0.25  # of an extrapolation, that it may be off: a safety factor of 1.25 (Roache)
_LEVEL = 0.85  # of the largest of three gaps: then three quarters are left, at any such order
_MOST = 0.75  # of the first gap: with so much left, it stays

Limit = Literal["rounding", "discretisation", "stays", "in part", "unclear"]


def convergence(
    run: Callable[[int], tuple[Trace, Trace]],
    *,
    progress: Progress = silent,
) -> Figures:
    """Run two sides with their steps as given, halved and quartered; then finer, while unclear.

    Args:
        run: Gives the traces of both sides, with rows as far apart as ever and so many times as
            many engine steps between them (`Model.replace(substeps=…)`).
        progress: Told the fraction that is done.

    Returns:
        What was found, by name.

        - labels: The two sides.
        - steps: The engine's steps of the left side and of the right one [s], as given.
        - until: The last moment that is compared [s].
        - touch: When something touches first in any of the runs [s]; None if nothing does.
        - before: Each quantity until then, see `_limit`; of a run that begins with a touch there is
          none.
        - whole: Each quantity over all of the run; the same as `before` if nothing touches.
        - vanishes: Whether no gap is more than discretisation, over the whole run.
        - unclear: Whether some gap has no steady order.

    Raises:
        EndedEarlyError: A run ends before its time.
        TraceError: The sides have too few moments in common.
    """
    runs, result = [], Figures()
    for finer in FINER:
        runs.append(run(finer))
        progress(finer / FINER[-1])
        for trace in runs[-1]:
            if trace.header.ended:
                raise EndedEarlyError(
                    f"with steps {finer} times finer, {trace.header.label} ended early: "
                    f"{trace.header.ended}"
                )
        if len(runs) >= 3 and not (result := _result(runs)).unclear:
            break
    return result


def _result(runs: list[tuple[Trace, Trace]]) -> Figures:
    left, right = runs[0]
    tip = default_tip(left.header, right.header)
    time = common_moments(left.time, right.time, (left.timestep, right.timestep)).time
    between = [{c.name: c.difference for c in series(*pair, tip)} for pair in runs]
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
    own = [
        {c.name: float(c.difference.max()) for c in series(coarse, fine, tip)}
        for coarse, fine in zip(runs[0], runs[-1], strict=True)
    ]
    touch = min((first for first in firsts if first <= time[-1]), default=None)
    early = time < (np.inf if touch is None else touch - 1e-9)
    whole, before = (
        tuple(_limit(curve, between, chosen, own) for curve in curves if chosen.any())
        for chosen in (np.ones(len(time), dtype=bool), early)
    )
    return Figures(
        labels=labels_of(left.header, right.header).long,
        steps=(
            left.header.timestep / left.header.substeps,
            right.header.timestep / right.header.substeps,
        ),
        _periods=(left.timestep, right.timestep),
        _engines={left.header.backend, right.header.backend},
        until=float(time[-1]),
        touch=touch,
        before=before,
        whole=whole,
        vanishes=all(limit.verdict in ("rounding", "discretisation") for limit in whole),
        unclear=any(limit.verdict == "unclear" for limit in (*whole, *before)),
    )


def _limit(
    curve: Series,
    between: list[dict[str, Array]],
    chosen: NDArray[np.bool_],
    own: list[dict[str, float]],
) -> Figures:
    """One quantity at some of the moments (n,), with finer and finer steps.

    Returns:
        name, kind, unit: As of an Agreement.
        gaps: The largest gap between the sides, with the steps as given, halved, quartered, ….
        moved: How far each side is, at most, from its own run with the finest steps; NaN where it
            has no quantity of that name.
        limit: What the gap tends to for steps of no length; None where that is not known.
        verdict: "rounding" where there is no gap; "discretisation" if it tends to nothing;
            "stays" if it tends to three quarters of the first gap or more; "in part" if it tends
            to less; "unclear" if it has no steady order.
    """
    gaps = [float(run[curve.name][chosen].max()) for run in between]
    values = curve.left[chosen] if curve.left.size else np.ones(1)
    rounding = _ROUNDING * max(1.0, float(np.abs(values).max()))
    verdict, limit = verdict_of(gaps, rounding)
    return Figures(
        name=curve.name,
        kind=curve.kind,
        unit=curve.unit,
        gaps=gaps,
        moved=[side.get(curve.name, np.nan) for side in own],
        limit=limit,
        verdict=verdict,
    )


def verdict_of(gaps: list[float], rounding: float) -> tuple[Limit, float | None]:
    """What becomes of a gap, and what it tends to.

    Three gaps give the observed order of convergence and the limit (Richardson's extrapolation;
    P. J. Roache, "Quantification of uncertainty in computational fluid dynamics", Annual Review
    of Fluid Mechanics 29, 1997). That holds only where the order is steady. A gap is an absolute
    distance, and the greatest of a run: where the limits of the two sides differ, it may cross
    zero on its way, and another moment or touch may become the greatest. So two triples in a row,
    of four gaps, must say that something is left. Nothing is left where each of three halvings
    divides the gap by what an order does, and the last three extrapolate to nothing. Three gaps
    that are level need no order.

    Args:
        gaps: Three or more, each with half of the steps of the one before.
        rounding: No gap is less.
    """
    if gaps[-1] <= rounding:
        return ("rounding", None) if max(gaps) <= rounding else ("discretisation", 0.0)
    last = gaps[-3:]
    if min(last) >= _LEVEL * max(last):
        return ("stays" if last[-1] >= _MOST * gaps[0] else "in part"), None
    before, now = (_extrapolated(gaps[0], *gaps[k:][:3]) for k in (-4, -3))
    if len(gaps) > 3 and before[0] == now[0] != "unclear":
        return now
    halved = len(gaps) > 3 and all(a >= _SLOWEST * b for a, b in pairwise(gaps[-4:]))
    if halved and gaps[0] == max(gaps) and now[1] is None:
        return "discretisation", 0.0
    return "unclear", None


def _extrapolated(
    first: float, coarse: float, middle: float, fine: float
) -> tuple[Limit, float | None]:
    ratio = (coarse - middle) / (middle - fine or np.inf)  # 2 to the power of the order
    rest = (middle - fine) / (ratio - 1 or np.inf)
    limit = fine - rest
    if limit <= _MARGIN * abs(rest) or not _SLOWEST <= ratio <= _FASTEST:
        return "unclear", None
    return ("stays" if limit >= _MOST * first else "in part"), limit
