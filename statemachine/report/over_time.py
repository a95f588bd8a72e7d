"""What a page shows of two runs over time, where it has a slider: the scene, and charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..compare import Agreement, ChaosFloor, Comparison, Series
from ..compare.series import NORMAL, normal_forces, total_forces
from ..interface import Array
from ..measures import same_pairs
from ..measures.text import figure, quantity, reading, short_time
from ..page import Interactive, Traces
from ..runs import Trace
from .events import Event
from .finding import name_of

CHARTS_SHOWN = 20  # of a page or a figure
GAP = "how far apart"


@dataclass(frozen=True, eq=False)
class QuantityChart(Interactive):
    """One quantity over time: how far apart it is, and both sides.

    Attributes:
        curve: Both sides at common moments.
        found: The figures of the comparison.
        labels: What the sides are called.
        said: What it shows, for those who do not see it.
        foot: A note under it; "" for none.
        floor: (n,) the width of its chaos floor at the moments of the curve, if that is known.
    """

    curve: Series
    found: Agreement
    labels: tuple[str, str]
    said: str
    foot: str = ""
    floor: Array | None = None

    @property
    def unit(self) -> str:
        """What it is drawn in."""
        return reading(self.curve.unit)[1].strip()

    def values(self) -> Traces | None:
        """Both sides: a position as the way from where the first side began; None without."""
        curve, scale = self.curve, reading(self.curve.unit)[0]
        if not curve.one.size:
            return None
        sides = [curve.one, curve.two]
        if curve.one.ndim > 1:
            sides = [np.linalg.norm(side - curve.one[0], axis=1) for side in sides]
        curves = dict(zip(self.labels, ((curve.time, scale * side) for side in sides), strict=True))
        # What does not matter is not blown up to the height of the chart.
        least = 20 * scale * self.found.tolerance
        title = f"{self.title}, from its start" if curve.one.ndim > 1 else self.title
        return Traces(f"{title} [{self.unit}]", "", "", curves, sides=True, least=least)

    def gap(self) -> Traces:
        """How far apart they are, with the tolerance and the chaos floor."""
        time, scale = self.curve.time, reading(self.curve.unit)[0]
        name = "" if self.curve.one.size else f"{self.title}: "
        verdict = "DIFFERS" if self.found.verdict == "differs" else self.found.verdict
        return Traces(
            f"{name}{verdict}, {quantity(self.found.max, self.found.unit)}",
            "",
            "",
            {GAP: (time, scale * self.curve.difference)},
            log=True,
            sides=True,
            tolerance=scale * self.found.tolerance,
            floor=None if self.floor is None else (time, scale * self.floor),
        )


@dataclass(frozen=True, eq=False)
class BothRuns(Interactive):
    """Two runs in one picture, moment by moment.

    Attributes:
        one: The run that is drawn solid.
        two: The run that is drawn as a ghost over it.
        comparison: Of the two: what they are called, and until when they are shown.
        site: The site whose way is drawn; "" for none.
        start: The moment to begin at [s].
        events: First touches among them are marked.
        charts: What is followed.
        lead: Of these, the ones that are spoken, by number.
    """

    one: Trace
    two: Trace
    comparison: Comparison
    site: str
    start: float
    events: tuple[Event, ...]
    charts: tuple[QuantityChart, ...]
    lead: tuple[int, ...]


def charts_of(
    comparison: Comparison,
    one: Trace,
    two: Trace,
    curves: Sequence[Series],
    floor: ChaosFloor | None,
) -> tuple[QuantityChart, ...]:
    """A chart for each quantity that is a number throughout; of many, those most beyond."""
    labels = comparison.one.label, comparison.two.label
    found = {each.name: each for each in comparison.agreements}
    bands = {} if floor is None else {band.name: band.width for band in floor.bands}
    drawn = [curve for curve in curves if np.isfinite(curve.difference).all()]
    ranked = sorted(drawn, key=lambda curve: (curve.kind != "tip", -found[curve.name].tolerances()))
    kept = {curve.name for curve in ranked[:CHARTS_SHOWN]}
    return tuple(
        chart_of(
            curve,
            found[curve.name],
            labels,
            foot_of(curve, one, two, labels),
            bands.get(curve.name),
        )
        for curve in drawn
        if curve.name in kept
    )


def chart_of(
    curve: Series,
    found: Agreement,
    labels: tuple[str, str],
    foot: str = "",
    floor: Array | None = None,
) -> QuantityChart:
    """The chart of a quantity."""
    far, settled, tolerance = (
        quantity(size, curve.unit) for size in (found.max, found.settled, found.tolerance)
    )
    since = "never" if found.since is None else f"at {short_time(found.since)}"
    said = (
        f"{name_of(curve.name)}, difference over time: at most {far} at {short_time(found.at)}, "
        f"settled at {settled}; tolerance {tolerance}, left: {since}."
    )
    return QuantityChart(name_of(curve.name), curve, found, labels, said, foot, floor)


def foot_of(curve: Series, one: Trace, two: Trace, labels: tuple[str, str]) -> str:
    """Under a chart of the energy by what it was computed; of a force its other figure."""
    if curve.kind == "energy":
        by = dict.fromkeys(trace.header.energy_by or trace.header.backend for trace in (one, two))
        return (
            f"Computed by {' and '.join(by)}, from the masses, the armature and the gravity of "
            "the model."
        )
    if curve.kind != "force":
        return ""
    pair, sides = curve.name.removesuffix(NORMAL), []
    for of in (normal_forces, total_forces):
        left = of(one)
        sides.append([_most(forces, pair) for forces in (left, same_pairs(left, of(two)))])
    strongest = [
        f"{label}: at most {normal} N; the whole force, friction added as vectors: at most "
        f"{total} N."
        for label, normal, total in zip(labels, *sides, strict=True)
    ]
    return " ".join(["Drawn is the sum of the normal forces.", *strongest])


def _most(forces: Mapping[str, Array], pair: str) -> str:
    """The largest force of a pair of bodies [N]."""
    return figure(float(forces[pair].max()) if pair in forces else 0.0)


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
