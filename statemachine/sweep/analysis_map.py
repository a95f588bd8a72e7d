"""The gap over the two parameters that it is most sensitive to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..interface import Array
from .analysis_gaps import SweepGaps, median
from .analysis_indices import Sensitivity
from .factors import Value, Vary

BINS = 6  # of a range that was sampled


@dataclass(frozen=True)
class GapMap:
    """The gap over one or two parameters; over all others it is the median.

    Attributes:
        across: The parameter from left to right; up: from bottom to top, "" for none.
        up: See across.
        columns: Its values; of a sampled range the middles of equal parts.
        rows: Of the other; one without a name if there is none.
        gap: By row and column [SI]; None where there is no run.
        inside: Whether the gap there is inside the chaos floor.
        others: The parameters over which it is the median.
        sampled: Which of the two are parts of a range.
    """

    across: str
    up: str
    columns: tuple[Value, ...]
    rows: tuple[Value, ...]
    gap: tuple[tuple[float | None, ...], ...]
    inside: tuple[tuple[bool, ...], ...]
    others: tuple[str, ...] = ()
    sampled: tuple[str, ...] = ()


def gap_map(
    gaps: SweepGaps, centre: Array, width: Array | None, shares: Sensitivity | None
) -> GapMap | None:
    """The map of a gap; None where nothing is varied.

    Args:
        gaps: Of the sweep.
        centre: (p) the gap at each point.
        width: (p) the chaos floor there; None where it is not known.
        shares: What the gap is most sensitive to.
    """
    factors = gaps.design.factors
    if not factors:
        return None
    order = [each.label for each in shares.indices] if shares else []
    ranked = sorted(factors, key=lambda v: order.index(v.label) if v.label in order else len(order))
    across, up = ranked[0], ranked[1] if len(ranked) > 1 else None
    columns, column = _axis(gaps, across)
    rows, row = ((), np.zeros(len(centre), dtype=int)) if up is None else _axis(gaps, up)
    shape = (max(1, len(rows)), len(columns))
    table, inside = np.full(shape, np.nan), np.zeros(shape, dtype=bool)
    for r in range(shape[0]):
        for c in range(shape[1]):
            here = (row == r) & (column == c) & np.isfinite(centre)
            if here.any():
                table[r, c] = median(centre[here])
                if width is not None:
                    inside[r, c] = (centre[here] <= width[here]).mean() > 0.5
    return GapMap(
        across.label,
        up.label if up else "",
        tuple(columns),
        tuple(rows),
        tuple(tuple(None if np.isnan(v) else float(v) for v in line) for line in table),
        tuple(tuple(line) for line in inside.tolist()),
        tuple(vary.label for vary in ranked[2:]),
        tuple(vary.label for vary in (across, up) if vary is not None and vary.bounds is not None),
    )


def _axis(gaps: SweepGaps, vary: Vary) -> tuple[Sequence[Value], Array]:
    """The values of an axis, and at which of them each point is."""
    values = gaps.values(vary.label)
    if vary.bounds is not None:
        low, high = vary.bounds
        part = (np.array(values) - low) / (high - low) * BINS
        middles = low + (high - low) * (np.arange(BINS) + 0.5) / BINS
        return [float(f"{v:.3g}") for v in middles], np.clip(part.astype(int), 0, BINS - 1)
    levels = sorted(vary.values) if vary.numeric else list(vary.values)  # pyright: ignore
    place = {value: k for k, value in enumerate(levels)}
    return levels, np.array([place[value] for value in values])
