"""The gap of a sweep's engines at each setting: whether it matters, and a map of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..interface import Array, Ints
from ..measures import QUANTITIES, Tolerance, tolerance_of
from ..page import Figures
from .analysis_data import RUN_QUANTITIES, SweepData, largest_known, median
from .analysis_indices import ranked
from .analysis_runs import ModelFacts
from .design import Value, Vary
from .rows import known

VERDICTS = ("agrees", "some seeds", "chaos", "differs", "no runs")
BINS = 6  # of a range that was sampled


def agreement_of(
    data: SweepData,
    name: str,
    width: Array | None,
    facts: ModelFacts,
    given: Mapping[str, float] | None,
) -> tuple[Figures, tuple[Figures, ...]]:
    """The gap of a quantity at every setting, and how many agree.

    Args:
        data: Of the sweep.
        name: Of the quantity.
        width: (p) the chaos floor; None where it is not known.
        facts: Of the model.
        given: Tolerances by kind, instead of ours [SI].

    Returns:
        Over all settings:

        name: Of the quantity; says: in words; unit: SI.
        tolerance: The gap that does not matter; reason: why that much.
        counts: How many settings have each verdict.
        median: Of all settings' medians [SI].
        worst: The largest of any seed at any setting.

        Of each setting:

        values: Of the parameters.
        median: The gap over the seeds [SI]; None without a run on both sides.
        worst: The largest of the seeds.
        floor: Its chaos floor; None where that is not known.
        verdict: "agrees": within tolerance at every seed; "some seeds": at some of them; "chaos":
            beyond, but inside the chaos floor; "differs"; "no runs".
        inside_floor: Whether there is a gap, and it is inside the chaos floor.
    """
    quantity, gap = RUN_QUANTITIES[name], data.gaps[name]
    tolerances = _tolerances(data, quantity.kind, facts, given)
    tolerance = np.array([tolerance.value for tolerance in tolerances])
    most_tolerant = tolerances[int(np.nanargmax(tolerance))]
    centre, most = median(gap), largest_known(gap)
    there, within = np.isfinite(gap), gap <= tolerance[:, None]
    floors = [None] * len(gap) if width is None else width.tolist()
    # The first of these that is true of a setting.
    true: dict[str, Any] = {
        "no runs": ~there.any(axis=1),
        "agrees": (within | ~there).all(axis=1),
        "chaos": centre <= (-np.inf if width is None else width),
        "some seeds": within.any(axis=1),
    }
    verdicts = np.select([*true.values()], [*true], "differs").tolist()
    settings = [
        Figures(
            values=point.values,
            median=known(middle),
            worst=known(worst),
            floor=floor,
            verdict=verdict,
            inside_floor=None not in (known(middle), floor) and middle <= floor,
        )
        for point, middle, worst, floor, verdict in zip(
            data.points, centre, most, floors, verdicts, strict=True
        )
    ]
    return (
        Figures(
            name=name,
            says=quantity.says.format(site=facts.site),
            unit=QUANTITIES[quantity.kind].unit,
            tolerance=most_tolerant.value,
            reason=most_tolerant.reason,
            counts={name: verdicts.count(name) for name in VERDICTS if name in verdicts},
            median=float(median(centre)),
            worst=float(largest_known(most)),
        ),
        tuple(settings),
    )


def _tolerances(
    data: SweepData, kind: str, facts: ModelFacts, given: Mapping[str, float] | None
) -> list[Tolerance]:
    """At each setting."""
    reach = 0.0
    if kind == "tip":
        reach = float(np.nanmax(np.linalg.norm(data.runs["tip"] - facts.foot, axis=-1)))
    steps = largest_known(np.concatenate(data.runs["timestep"], axis=1)).tolist()
    return [tolerance_of(kind, np.empty(0), np.empty(0), reach, step, given) for step in steps]


def only_rounding(settings: Sequence[Figures]) -> bool:
    """Whether every gap is inside the chaos floor."""
    there = [setting for setting in settings if setting.median is not None]
    return bool(there) and all(setting.inside_floor for setting in there)


def gap_map(
    data: SweepData, name: str, width: Array | None, shares: Figures | None
) -> Figures | None:
    """The gap over one or two parameters; over all others it is the median. None without any.

    Args:
        data: Of the sweep.
        name: Of the quantity.
        width: (p) the chaos floor; None where it is not known.
        shares: What the gap is most sensitive to.

    Returns:
        across: The parameter from left to right; up: from bottom to top, "" for none.
        columns: Its values; of a sampled range the middles of equal parts.
        rows: Of the other; one without a name if there is none.
        gap: By row and column [SI]; None where there is no run.
        inside: Whether the gap there is inside the chaos floor.
        others: The parameters over which it is the median.
        sampled: Which of the two are parts of a range.
    """
    if not data.design.factors:
        return None
    centre = median(data.gaps[name])
    across, *rest = ranked(data.design, shares)
    axes = [_axis(data, vary) for vary in (across, *rest[:1])]
    (columns, column), (rows, row) = (*axes, ((), np.zeros(len(centre), dtype=int)))[:2]
    fine = np.zeros(len(centre), dtype=bool) if width is None else centre <= width
    cells = [
        [np.isfinite(centre) & (row == r) & (column == c) for c in range(len(columns))]
        for r in range(max(1, len(rows)))
    ]
    return Figures(
        across=across.label,
        up="".join(vary.label for vary in rest[:1]),
        columns=tuple(columns),
        rows=tuple(rows),
        gap=tuple(tuple(known(median(centre[cell])) for cell in line) for line in cells),
        inside=tuple(
            tuple(bool(2 * fine[cell].sum() > cell.sum()) for cell in line) for line in cells
        ),
        others=tuple(vary.label for vary in rest[1:]),
        sampled=tuple(vary.label for vary in (across, *rest[:1]) if vary.bounds is not None),
    )


def _axis(data: SweepData, vary: Vary) -> tuple[Sequence[Value], Ints]:
    """The values of an axis, and at which of them each point is."""
    values = data.values(vary.label)
    if vary.bounds is not None:
        low, high = vary.bounds
        part = (np.array(values) - low) / (high - low) * BINS
        middles = low + (high - low) * (np.arange(BINS) + 0.5) / BINS
        return [float(f"{v:.3g}") for v in middles], np.clip(part.astype(int), 0, BINS - 1)
    levels = sorted(vary.values) if vary.numeric else list(vary.values)  # pyright: ignore
    place = {value: k for k, value in enumerate(levels)}
    return levels, np.array([place[value] for value in values])
