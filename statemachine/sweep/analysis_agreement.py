"""How many settings of a sweep agree, by one quantity: tolerance, chaos floor, seeds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..interface import Array
from ..measures import COUNT
from .analysis_gaps import QUANTITIES, SweepGaps, median, worst
from .analysis_runs import ModelFacts
from .factors import Value

SettingVerdict = Literal["agrees", "some seeds", "chaos", "differs", "no runs"]
VERDICTS: tuple[SettingVerdict, ...] = ("agrees", "some seeds", "chaos", "differs", "no runs")


@dataclass(frozen=True)
class SettingGap:
    """One setting of a sweep.

    Attributes:
        values: Of the parameters.
        median: The gap over the seeds [SI]; None without a run on both sides.
        worst: The largest of the seeds.
        floor: Its chaos floor; None where that is not known.
        verdict: "agrees": within tolerance at every seed; "some seeds": at some of them; "chaos":
            beyond, but inside the chaos floor; "differs"; "no runs".
    """

    values: tuple[Value, ...]
    median: float | None
    worst: float | None
    floor: float | None
    verdict: SettingVerdict

    @property
    def inside_floor(self) -> bool:
        """Whether there is a gap, and it is inside the chaos floor."""
        return self.median is not None and self.floor is not None and self.median <= self.floor


@dataclass(frozen=True)
class QuantityAgreement:
    """The gap of one quantity over all settings.

    Attributes:
        name: Of the quantity; says: in words; unit: SI.
        says: See name.
        unit: See name.
        tolerance: The gap that does not matter; reason: why that much.
        reason: See tolerance.
        counts: How many settings have each verdict.
        median: Of all settings' medians [SI].
        worst: The largest of any seed at any setting.
    """

    name: str
    says: str
    unit: str
    tolerance: float
    reason: str
    counts: Mapping[str, int]
    median: float
    worst: float


def agreement_of(
    gaps: SweepGaps,
    name: str,
    width: Array | None,
    facts: ModelFacts,
    given: Mapping[str, float] | None,
) -> tuple[QuantityAgreement, tuple[SettingGap, ...]]:
    """The gap of a quantity at every setting, and how many agree."""
    quantity = QUANTITIES[name]
    gap = gaps.gap(name)
    tolerance, reason = _tolerance(gaps, name, facts, given)
    within = np.where(np.isnan(gap), np.nan, gap <= tolerance[:, None])
    centre, most = median(gap), worst(gap)
    settings = []
    for k, point in enumerate(gaps.points):
        known = within[k][~np.isnan(within[k])]
        floor = None if width is None else float(width[k])
        verdict: SettingVerdict
        if not len(known):
            verdict = "no runs"
        elif known.all():
            verdict = "agrees"
        elif floor is not None and centre[k] <= floor:
            verdict = "chaos"
        else:
            verdict = "some seeds" if known.any() else "differs"
        pair = (float(centre[k]), float(most[k])) if len(known) else (None, None)
        settings.append(SettingGap(point.values, *pair, floor, verdict))
    counts = Counter(each.verdict for each in settings)
    return (
        QuantityAgreement(
            name, quantity.says, quantity.unit, float(np.nanmax(tolerance)), reason,
            {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]},
            float(median(centre)), float(worst(most)),
        ),
        tuple(settings),
    )  # fmt: skip


def _tolerance(
    gaps: SweepGaps, name: str, facts: ModelFacts, given: Mapping[str, float] | None
) -> tuple[Array, str]:
    """(p) at each setting, and why that much: those of `measures`."""
    kind, points = QUANTITIES[name].kind, len(gaps.points)
    if given and kind in given:
        return np.full(points, given[kind]), "as given"
    count = "one count of a 12-bit encoder, 1/4096 turn"
    if kind == "joint":
        return np.full(points, COUNT), count
    if kind == "tip":
        reach = np.linalg.norm(
            np.concatenate([gaps.left.tip, gaps.right.tip]) - facts.foot, axis=-1
        )
        far = float(np.nanmax(reach))
        return np.full(points, COUNT * far), f"what {count}, moves it, {far:.2f} m from the foot"
    steps = np.concatenate([gaps.left.timestep, gaps.right.timestep], axis=1)
    longest = worst(steps) * (1 + 1e-9)
    return longest, "one timestep: an engine looks at contacts once in a step"


def only_rounding(settings: Sequence[SettingGap]) -> bool:
    """Whether every gap is inside the chaos floor."""
    known = [each for each in settings if each.median is not None]
    return bool(known) and all(each.inside_floor for each in known)
