"""What a page shows of two runs over time, where it has a slider: the scene, and charts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compare import Agreement, Comparison, Series
from ..compare.perturbed import ChaosFloor
from ..compare.series import NORMAL, normal_forces, total_forces
from ..interface import Array
from ..measures import same_pairs
from ..measures.text import figure, quantity, reading, short_time
from ..page import Figures, Interactive, Traces
from . import template
from .finding import long_labels, name_of, traces_of

CHARTS_SHOWN = 20  # of a page or a figure
GAP = "how far apart"
SAID = (
    "{title}, difference over time: at most {far} at {at}, settled at {settled}; tolerance "
    "{tolerance}, left: {since}."
)


@dataclass(frozen=True, eq=False)
class QuantityChart(Interactive):
    """One quantity over time: how far apart it is, and both sides.

    Attributes:
        curve: Both sides at common moments.
        agreement: The figures of the comparison.
        labels: What the sides are called.
        foot: A note under it; "" for none.
        floor: (n,) the width of its chaos floor at the moments of the curve, if that is known.
    """

    curve: Series
    agreement: Agreement
    labels: tuple[str, str]
    foot: str = ""
    floor: Array | None = None

    @property
    def unit(self) -> str:
        """What it is drawn in."""
        return reading(self.curve.unit)[1].strip()

    @property
    def said(self) -> str:
        """What it shows, for those who do not see it."""
        gap = self.agreement
        return SAID.format(
            title=self.title,
            far=quantity(gap.max, gap.unit),
            at=short_time(gap.at),
            settled=quantity(gap.settled, gap.unit),
            tolerance=quantity(gap.tolerance, gap.unit),
            since="never" if gap.since is None else f"at {short_time(gap.since)}",
        )

    def values(self) -> Traces | None:
        """Both sides: a position as the way from where the first side began; None without."""
        curve, scale = self.curve, reading(self.curve.unit)[0]
        if not curve.left.size:
            return None
        sides = [
            np.linalg.norm(side - curve.left[0], axis=1) if side.ndim > 1 else side
            for side in (curve.left, curve.right)
        ]
        curves = dict(zip(self.labels, ((curve.time, scale * side) for side in sides), strict=True))
        # What does not matter is not blown up to the height of the chart.
        least = 20 * scale * self.agreement.tolerance
        title = f"{self.title}, from its start" if curve.left.ndim > 1 else self.title
        return Traces(f"{title} [{self.unit}]", "", "", curves, sides=True, least=least)

    def gap(self) -> Traces:
        """How far apart they are, with the tolerance and the chaos floor."""
        time, scale = self.curve.time, reading(self.curve.unit)[0]
        name = "" if self.curve.left.size else f"{self.title}: "
        verdict = "DIFFERS" if self.agreement.verdict == "differs" else self.agreement.verdict
        return Traces(
            f"{name}{verdict}, {quantity(self.agreement.max, self.agreement.unit)}",
            "",
            "",
            {GAP: (time, scale * self.curve.difference)},
            log=True,
            sides=True,
            tolerance=scale * self.agreement.tolerance,
            floor=None if self.floor is None else (time, scale * self.floor),
        )


@dataclass(frozen=True, eq=False)
class BothRuns(Interactive):
    """Two runs in one picture, moment by moment.

    Attributes:
        comparison: Of the two: the left one is drawn solid, the right one as a ghost over it.
        start: The moment to begin at [s].
        events: First touches among them are marked.
        charts: What is followed.
        lead: Of these, the ones that are spoken, by number.
    """

    comparison: Comparison
    start: float
    events: tuple[Figures, ...]
    charts: tuple[QuantityChart, ...]
    lead: tuple[int, ...]


def charts_of(comparison: Comparison, floor: ChaosFloor | None = None) -> tuple[QuantityChart, ...]:
    """A chart for each quantity that is a number throughout; of many, those most beyond."""
    agreements = {agreement.name: agreement for agreement in comparison.agreements}
    bands = {} if floor is None else {band.name: band.width for band in floor.bands}
    drawn = [curve for curve in comparison.curves if np.isfinite(curve.difference).all()]
    ranked = sorted(
        drawn, key=lambda curve: (curve.kind != "tip", -agreements[curve.name].tolerances())
    )
    return tuple(
        QuantityChart(
            name_of(curve.name),
            curve,
            agreements[curve.name],
            long_labels(comparison),
            foot_of(curve, comparison),
            bands.get(curve.name),
        )
        for curve in drawn
        if curve in ranked[:CHARTS_SHOWN]
    )


def foot_of(curve: Series, comparison: Comparison) -> str:
    """Under a chart of the energy by what it was computed; of a force its other figure."""
    (left_label, right_label), traces = long_labels(comparison), traces_of(comparison)
    by = dict.fromkeys(trace.header.energy_by or trace.header.backend for trace in traces)
    slots: dict[str, Any] = {"by": " and ".join(by) if curve.kind == "energy" else None}
    slots |= {"left": left_label if curve.kind == "force" else None, "right": right_label}
    if curve.kind == "force":
        pair = curve.name.removesuffix(NORMAL)
        for name, forces_of in (("normal", normal_forces), ("whole", total_forces)):
            left, right = map(forces_of, traces)
            for side, forces in (("left", left), ("right", same_pairs(left, right))):
                strongest = float(forces[pair].max()) if pair in forces else 0.0
                slots[f"{side}_{name}"] = figure(strongest)
    return " ".join(template.texts("over_time", **slots))


def spans(mask: NDArray[np.bool_], time: Array, step: float, until: float) -> list[list[float]]:
    """From when to when rows are marked [s]; a row counts until the next one.

    Args:
        mask: (n,) which rows.
        time: (n,) of each [s].
        step: How long the last of some rows lasts [s].
        until: What is later is cut off [s].
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    pairs = ((float(time[a]), float(time[b - 1]) + step) for a, b in edges.reshape(-1, 2).tolist())
    return [[start, min(end, until)] for start, end in pairs if start <= until]
