"""The chaos floor: the band of a gap in which nothing can be concluded.

After a grazing contact two runs that differ by rounding part exponentially. So one side is run
again with its start and commands perturbed, and what that makes of each quantity is its floor.
"""

from __future__ import annotations

import numpy as np

from ..errors import TraceError
from ..interface import Array, Ints
from ..measures import common_moments
from ..page import Figures
from ..runs import Trace
from ..runs.drive import Progress, silent
from ..runs.rerun import Rerun
from .agreement import Agreement, Comparison
from .perturbed import EXACT, ROUNDING, RUNS, Uncertainty, perturbed_runs
from .series import series, touches

_WINDOW = 0.025  # of the common time, to either side


def chaos_floor(
    comparison: Comparison,
    rerun: Rerun,
    *,
    runs: int = RUNS,
    seed: int = 0,
    uncertain: Uncertainty = EXACT,
    progress: Progress = silent,
) -> Figures:
    """The chaos floor of each quantity of a comparison.

    The band at a moment is the largest distance of a perturbed run from the left one, within 2.5 %
    of the common time before and after it. It is not a running maximum: a robot whose servos pull
    it back forgets where it started, and a gap that remains then is a difference although an
    impact in between was chaotic. And it is not of the moment alone: all perturbed runs part along
    the one direction that grows fastest, so that they cross the left one at the same time, and an
    impact that comes a step later is a spike in each of two places.

    Args:
        comparison: Of two traces, of which `rerun` makes the left one.
        rerun: How the left side is run.
        runs: How many perturbed runs.
        seed: Of what is drawn.
        uncertain: What the start of a real robot is uncertain by.
        progress: Told the fraction that is done.

    Returns:
        What was found, by name.

        - runs: How many perturbed runs of the left side it is made of; seed: of what was drawn.
        - rounding: What starts and commands were changed by, relative.
        - uncertain: What the start is uncertain by besides.
        - ended: How many of the runs ended early; from then on the band has no bound.
        - bands: One for each quantity that is compared; see `_band`.

    Raises:
        BadInputError: As `perturbed_runs`.
    """
    one, two = comparison.one.trace, comparison.two.trace
    common = common_moments(one.time, two.time, (one.timestep, two.timestep))
    gaps = {curve.name: curve.difference for curve in comparison.curves}
    gaps |= {a.name: np.array([a.max]) for a in comparison.agreements if a.kind == "contact"}
    widths = {name: np.zeros(len(gap)) for name, gap in gaps.items()}
    ended = 0
    for trace in perturbed_runs(
        rerun, runs=runs, seed=seed, uncertain=uncertain, progress=progress
    ):
        ended += bool(trace.header.ended)
        far_apart = _distances(one, trace, comparison.tip, comparison.until, common.one)
        for name, far in far_apart.items():
            if name in widths:
                widths[name] = np.maximum(widths[name], far)
    reach = round(_WINDOW * (len(common.time) - 1))
    bands = []
    for agreement in comparison.agreements:
        width, time = widths[agreement.name], common.time
        if agreement.kind == "contact":
            time = np.zeros(1)
        else:  # the largest within some rows to either side
            padded = np.pad(width, reach, mode="edge")
            width = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
        bands.append(_band(agreement, gaps[agreement.name], width, time))
    return Figures(
        runs=runs,
        seed=seed,
        rounding=ROUNDING,
        uncertain=uncertain,
        ended=ended,
        bands=tuple(bands),
    )


def _distances(
    one: Trace, perturbed: Trace, tip: str, until: float, rows: Ints
) -> dict[str, Array]:
    """How far a run is from `one` in some of its rows; infinite where it has ended.

    Of a first touch it is one number [s]: a touch that does not come has no time.
    """
    distances: dict[str, Array] = {}
    try:
        curves, count = series(one, perturbed, tip), len(perturbed)
        for touch in touches(one, perturbed):
            first, other = touch.one.first, touch.two.first
            gap = until if first is None or other is None else abs(first - other)
            distances[f"{touch.pair}, first touch"] = np.array([gap])
    except TraceError:  # it ended at once
        curves, count = series(one, one, tip), 0
    for curve in curves:
        far = np.full(len(one), np.inf)
        far[:count] = np.nan_to_num(curve.difference[:count], nan=np.inf)
        distances[curve.name] = far[rows]
    return distances


def _band(agreement: Agreement, gap: Array, width: Array, time: Array) -> Figures:
    """The chaos floor of one quantity.

    Returns:
        name, kind, unit: Of the Agreement of the two sides.
        most: The largest width of the band; end: the width at the last moment.
        inside_from: The time from which on the gap between the two sides lies inside [s];
            None if it does not at the end. Of a first touch 0 or None.
        beyond: Whether the gap is, at any moment, larger than both the band and the tolerance:
            only then it is more than chaos.
        _width: (n,) at each moment that the sides have in common; (1,) of a first touch.
    """
    outside = np.flatnonzero(~(gap <= width))
    last = int(outside[-1]) + 1 if len(outside) else 0
    return Figures(
        name=agreement.name,
        kind=agreement.kind,
        unit=agreement.unit,
        most=float(width.max()),
        end=float(width[-1]),
        inside_from=float(time[last]) if last < len(time) else None,
        beyond=bool((~(gap <= np.maximum(width, agreement.tolerance))).any()),
        _width=width,
    )
