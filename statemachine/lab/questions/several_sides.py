"""Gaps between each two of several sides, all in one kind of quantity, and which side is odd."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from ..compare import Agreement, Comparison
from ..compare.chaos import Chance, ChaosFloor
from ..compare.odd_side import OddSide, SideDistance, groups_of, odd_side
from ..compare.quantity_agreement import Verdict
from .finding import leading

Two = tuple[int, int]  # numbers of two sides, the smaller first
# What of a gap counts: the largest at any moment, or the mean over the last tenth of the run.
Span = Literal["run", "end"]
SPANS: tuple[Span, ...] = ("run", "end")
_WORST_FIRST: tuple[Verdict, ...] = ("differs", "settles", "agrees")
_CLEAREST_FIRST: tuple[Chance | None, ...] = ("beyond", "cannot be told", "inside", None)


@dataclass(frozen=True)
class MeasuredQuantities:
    """What the sides are measured in.

    Attributes:
        kind: Which sort of quantity it is, such as "joint".
        unit: Its SI unit.
        names: Of those that all sides have.
    """

    kind: str
    unit: str
    names: frozenset[str]

    def of(self, comparison: Comparison) -> list[Agreement]:
        """Return these quantities of a comparison."""
        return [a for a in comparison.agreements if a.kind == self.kind and a.name in self.names]


@dataclass(frozen=True)
class SidesGap:
    """How far apart two of several sides are.

    Attributes:
        left: What a side is called.
        right: What the other is called.
        quantity: The one that is farthest apart at any moment.
        largest: How far that is [unit].
        at: When [s from the start].
        end: The largest mean over the last tenth of the run, of all quantities of the kind [unit].
        tolerance: What does not matter, of `quantity` [unit].
        floor: How far rounding alone drives these quantities of a side at most [unit]; infinite
            where a perturbed run ended early, None where that was not looked for.
        verdict: The worst of all quantities of the kind.
        chance: Whether rounding alone can make what differs, of the quantity where it least can;
            None where all agree, or where that was not looked for.
        is_apart: Whether some quantity leaves its tolerance, by more than rounding makes.
        is_apart_at_end: Whether some quantity is beyond it at the end, too.
    """

    left: str
    right: str
    quantity: str
    largest: float
    at: float
    end: float
    tolerance: float
    floor: float | None
    verdict: Verdict
    chance: Chance | None
    is_apart: bool
    is_apart_at_end: bool


@dataclass(frozen=True)
class OddOne:
    """The side that is odd.

    Attributes:
        side: What it is called.
        nearest: What the other side is called that is nearest to it.
        gap: How far away that is [unit].
        spread: The largest gap between any two of the others [unit].
        ratio: How many times the spread the gap is; infinite where the others are the same.
    """

    side: str
    nearest: str
    gap: float
    spread: float
    ratio: float


@dataclass(frozen=True)
class SideGroups:
    """Which sides agree, and which one is odd.

    Attributes:
        span: What of a gap counts.
        groups: Names of sides, within each group of which no two are told apart.
        odd: The side that is odd; None where none is.
    """

    span: Span
    groups: tuple[tuple[str, ...], ...]
    odd: OddOne | None


def measured_quantities(
    comparisons: Mapping[Two, Comparison], floors: Mapping[Two, ChaosFloor | None]
) -> MeasuredQuantities:
    """Return what all pairs are measured in: the kind of what differs most in any of them.

    Args:
        comparisons: Of each two sides, at least one pair.
        floors: The chaos floor of each; None where that was not looked for.
    """
    leads = {pair: leading(each, floors[pair]) for pair, each in comparisons.items()}
    shared = _kinds_of_all(list(comparisons.values()))
    candidates = [lead for lead in leads.values() if lead.kind in shared]
    if not candidates:  # all have a joint in common, or they could not be compared
        first = next(iter(comparisons.values()))
        candidates = [a for a in first.agreements if a.kind in shared]
    worst = max(candidates, key=lambda lead: (lead.verdict != "agrees", lead.tolerances()))
    return MeasuredQuantities(worst.kind, worst.unit, shared[worst.kind])


def _kinds_of_all(comparisons: Sequence[Comparison]) -> dict[str, frozenset[str]]:
    """Return the names of each kind of quantity that all comparisons have."""
    names: dict[str, set[str]] = {}
    for agreement in comparisons[0].agreements:
        names.setdefault(agreement.kind, set()).add(agreement.name)
    for comparison in comparisons[1:]:
        known = {agreement.name for agreement in comparison.agreements}
        for of_kind in names.values():
            of_kind.intersection_update(known)
    return {kind: frozenset(of_kind) for kind, of_kind in names.items() if of_kind}


def sides_gap(
    labels: tuple[str, str],
    quantities: MeasuredQuantities,
    comparison: Comparison,
    floor: ChaosFloor | None,
) -> SidesGap:
    """Return how far apart two sides are.

    Args:
        labels: What they are called.
        quantities: What is measured.
        comparison: Of the two.
        floor: What rounding alone makes of them; None where that was not looked for.
    """
    agreements = quantities.of(comparison)
    verdicts = {agreement.verdict for agreement in agreements}
    farthest = max(agreements, key=lambda agreement: _number(agreement.max))
    chances: dict[str, Chance | None] = dict.fromkeys(agreement.name for agreement in agreements)
    width = None
    if floor is not None:
        chances = {name: floor.chance(name) for name in chances}
        width = _largest_width(floor, chances)
    apart = [a for a in agreements if _is_apart(a, chances[a.name])]
    end = max(_number(agreement.settled) for agreement in agreements)
    verdict: Verdict = next(verdict for verdict in _WORST_FIRST if verdict in verdicts)
    chance: Chance | None = next(chance for chance in _CLEAREST_FIRST if chance in chances.values())
    is_apart_at_end = any(agreement.verdict == "differs" for agreement in apart)
    return SidesGap(
        left=labels[0],
        right=labels[1],
        quantity=farthest.name,
        largest=_number(farthest.max),
        at=farthest.at,
        end=end,
        tolerance=farthest.tolerance,
        floor=width,
        verdict=verdict,
        chance=chance,
        is_apart=bool(apart),
        is_apart_at_end=is_apart_at_end,
    )


def _is_apart(agreement: Agreement, chance: Chance | None) -> bool:
    """Tell whether a quantity tells two sides apart: not where its gap may be chance."""
    return agreement.verdict != "agrees" and chance in (None, "beyond")


def _largest_width(floor: ChaosFloor, names: Collection[str]) -> float:
    """Return the largest width of the chaos floor of some quantities."""
    return max((band.most for band in floor.bands if band.name in names), default=0.0)


def _number(gap: float) -> float:
    """Return a gap; what is no number is as far as can be."""
    return math.inf if math.isnan(gap) else gap


def side_groups(span: Span, gaps: Mapping[Two, SidesGap], labels: Mapping[int, str]) -> SideGroups:
    """Return which sides agree, and which one is odd.

    Args:
        span: What of a gap counts.
        gaps: Of each two sides.
        labels: What each side is called, by its number.
    """
    distances: list[SideDistance] = []
    for (left, right), each in gaps.items():
        if span == "run":
            distances.append(SideDistance(left, right, each.largest, each.is_apart))
        else:
            distances.append(SideDistance(left, right, each.end, each.is_apart_at_end))
    odd = odd_side(distances)
    named: list[tuple[str, ...]] = []
    for group in groups_of(distances):
        named.append(tuple(labels[side] for side in group))
    return SideGroups(span, tuple(named), None if odd is None else _named(odd, labels))


def _named(odd: OddSide, labels: Mapping[int, str]) -> OddOne:
    """Return a side that is odd by its name."""
    return OddOne(labels[odd.side], labels[odd.nearest], odd.gap, odd.spread, odd.ratio)
