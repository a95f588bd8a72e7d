"""A quantity of two runs over time: how far apart it is, and both sides, as a chart each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....interface import Array
from ....measures import distances, with_left_pair_names
from ....measures.text import display_unit, figure, quantity
from ....show.blocks import Interactive
from ....show.pictures import Traces
from ....show.templates import PageContent, render_texts
from ...compare import Agreement, Comparison, Series
from ...compare.chaos import ChaosFloor
from ...compare.series import NORMAL, normal_forces, total_forces
from ..compared_names import long_labels, name_of, traces_of

CHARTS_SHOWN = 20  # of a page or a figure
GAP = "how far apart"


@dataclass(frozen=True)
class ChartInWords(PageContent):
    """What a chart shows, for those who do not see it.

    Attributes:
        title: Of the chart.
        agreement: The figures of the comparison.
    """

    template = "quantity_chart.md.j2"
    title: str
    agreement: Agreement


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
        """Return the unit that it is drawn in."""
        return display_unit(self.curve.unit)[1].strip()

    @property
    def said(self) -> str:
        """Return what it shows, for those who do not see it."""
        return " ".join(render_texts(ChartInWords(self.title, self.agreement)))

    def values(self) -> Traces | None:
        """Return both sides: a position as the way from where the first began; None without."""
        curve, scale = self.curve, display_unit(self.curve.unit)[0]
        if not curve.left.size:
            return None
        title, left, right = self.title, curve.left, curve.right
        if left.ndim > 1:
            title = f"{title}, from its start"
            left, right = distances(left, curve.left[0]), distances(right, curve.left[0])
        left_label, right_label = self.labels
        curves = {
            left_label: (curve.time, scale * left),
            right_label: (curve.time, scale * right),
        }
        # What does not matter is not blown up to the height of the chart.
        least = 20 * scale * self.agreement.tolerance
        return Traces(f"{title} [{self.unit}]", "", "", curves, sides=True, least=least)

    def gap(self) -> Traces:
        """Return how far apart they are, with the tolerance and the chaos floor."""
        time, scale = self.curve.time, display_unit(self.curve.unit)[0]
        verdict = "DIFFERS" if self.agreement.verdict == "differs" else self.agreement.verdict
        title = f"{verdict}, {quantity(self.agreement.max, self.agreement.unit)}"
        if not self.curve.left.size:  # this is the only chart of the quantity
            title = f"{self.title}: {title}"
        curves = {GAP: (time, scale * self.curve.difference)}
        return Traces(
            title,
            across="",
            up="",
            curves=curves,
            log=True,
            sides=True,
            tolerance=scale * self.agreement.tolerance,
            floor=None if self.floor is None else (time, scale * self.floor),
        )


def charts_of(comparison: Comparison, floor: ChaosFloor | None = None) -> tuple[QuantityChart, ...]:
    """Return a chart for each quantity that is always a number; of many, those most beyond."""
    agreements = {agreement.name: agreement for agreement in comparison.agreements}
    bands: dict[str, Array] = {}
    if floor is not None:
        bands = {band.name: band.width for band in floor.bands}
    finite = [curve for curve in comparison.curves if np.isfinite(curve.difference).all()]
    ranked = sorted(
        finite, key=lambda curve: (curve.kind != "tip", -agreements[curve.name].tolerances())
    )
    shown = ranked[:CHARTS_SHOWN]
    charts = []
    for curve in finite:
        if curve in shown:
            chart = QuantityChart(
                title=name_of(curve.name),
                curve=curve,
                agreement=agreements[curve.name],
                labels=long_labels(comparison),
                foot=foot_of(curve, comparison),
                floor=bands.get(curve.name),
            )
            charts.append(chart)
    return tuple(charts)


@dataclass(frozen=True)
class ForcesInWords:
    """The largest forces between two bodies [N].

    Attributes:
        left: What the left side is called.
        right: What the right side is called.
        left_normal: The largest normal force on the left.
        right_normal: On the right.
        left_whole: The largest of the whole force on the left.
        right_whole: On the right.
    """

    left: str
    right: str
    left_normal: str
    right_normal: str
    left_whole: str
    right_whole: str


@dataclass(frozen=True)
class ChartFoot(PageContent):
    """What stands under a chart.

    Attributes:
        computed_by: What computed the energies; empty under another chart.
        forces: The largest forces; None under another chart.
    """

    template = "quantity_foot.md.j2"
    computed_by: Sequence[str] = ()
    forces: ForcesInWords | None = None


def foot_of(curve: Series, comparison: Comparison) -> str:
    """Say under a chart of the energy what computed it; under one of a force its other figure."""
    if curve.kind == "energy":
        headers = [trace.header for trace in traces_of(comparison)]
        by = dict.fromkeys(header.energy_by or header.backend for header in headers)
        foot = ChartFoot(computed_by=list(by))
    elif curve.kind == "force":
        pair = curve.name.removesuffix(NORMAL)
        left, right = traces_of(comparison)
        left_label, right_label = long_labels(comparison)
        left_normal, right_normal = _strongest(pair, normal_forces(left), normal_forces(right))
        left_whole, right_whole = _strongest(pair, total_forces(left), total_forces(right))
        foot = ChartFoot(
            forces=ForcesInWords(
                left=left_label,
                right=right_label,
                left_normal=left_normal,
                right_normal=right_normal,
                left_whole=left_whole,
                right_whole=right_whole,
            )
        )
    else:
        return ""
    return " ".join(render_texts(foot))


def _strongest(pair: str, left: Mapping[str, Array], right: Mapping[str, Array]) -> tuple[str, str]:
    """Return the largest force between two bodies on the left and on the right, as text."""
    texts = []
    for forces in (left, with_left_pair_names(left, right)):
        strongest = float(forces[pair].max()) if pair in forces else 0.0
        texts.append(figure(strongest))
    return texts[0], texts[1]


def spans(mask: NDArray[np.bool_], time: Array, step: float, until: float) -> list[list[float]]:
    """Return from when to when rows are marked [s]; a row counts until the next one.

    Args:
        mask: (n,) which rows.
        time: (n,) of each [s].
        step: How long the last of some rows lasts [s].
        until: What is later is cut off [s].
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    pairs = ((float(time[a]), float(time[b - 1]) + step) for a, b in edges.reshape(-1, 2).tolist())
    return [[start, min(end, until)] for start, end in pairs if start <= until]
