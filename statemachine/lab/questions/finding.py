"""What a comparison comes to: what differs most, since when, how far at the end, by chance or not.

Every figure and every choice that the sentences of a page rest on is a field here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...measures import QUANTITIES
from ..compare import Agreement, Comparison
from ..compare.agreement import ComparisonOutcome
from ..compare.chaos import Chance, ChaosFloor
from ..compare.outcomes import FELL, RunOutcome
from ..compare.series import at_the_end
from ..runs.floating import Bases
from .compared_names import traces_of

_STEADY = 0.1  # share by which a difference may change in the end and be called settled
_TOGETHER = 1.001  # of a step: events so far apart are at one time

# How well the time of a divergence is known: it is the start; it is known to a step; the runs
# differ at the first moment that both have, or at a later one of moments that lie farther apart.
DivergenceTime = Literal["start", "step", "first moment", "moment"]
# What rounding alone makes of a gap: see `Rounding`.
RoundingVerdict = Literal["not computed", "no bound", "less", "cannot be told", "as much"]
OpenLoop = Literal["none", "agrees", "differs"]
# Which sides of a robot that floats fell; "none" of one that is fixed.
Falls = Literal["none", "neither", "left alone", "right alone", "both"]


@dataclass(frozen=True)
class Divergence:
    """When the first quantity leaves its tolerance, and what happens then.

    Attributes:
        quantity: The name of the first quantity.
        time: When it leaves its tolerance [s].
        known_to: How well that time is known.
        body: A body whose first touch on either side is then; "" for none.
        ground: What it touches.
    """

    quantity: str
    time: float
    known_to: DivergenceTime
    body: str = ""
    ground: str = ""


@dataclass(frozen=True)
class Rounding:
    """What rounding alone makes of the gap that is farthest beyond its tolerance.

    Attributes:
        verdict: "less": less than a third of the gap; "as much": all of it; "cannot be told"
            between the two; "no bound": a perturbed run ended early; "not computed".
        most: The largest distance of a perturbed run from the run of its side [unit of the gap].
        ended: How many perturbed runs ended early.
    """

    verdict: RoundingVerdict
    most: float = 0.0
    ended: int = 0

    @property
    def may_be_all(self) -> bool:
        """Tell whether the gap may be chance, as far as is known."""
        return self.verdict in ("as much", "cannot be told", "no bound")


@dataclass(frozen=True)
class VerdictCounts:
    """How many quantities have which verdict.

    Attributes:
        differs: Those that are beyond their tolerance at the end.
        settles: Those that are beyond it on the way alone.
        agrees: Those that are within it always.
    """

    differs: int
    settles: int
    agrees: int

    @property
    def total(self) -> int:
        """Return the number of quantities."""
        return self.differs + self.settles + self.agrees

    @property
    def in_turn(self) -> list[str]:
        """Return each verdict that some quantity has, with the number of these."""
        counts = {"differs": self.differs, "settles": self.settles, "agrees": self.agrees}
        return [f"{verdict} {count}" for verdict, count in counts.items() if count]

    @classmethod
    def of(cls, agreements: Sequence[Agreement]) -> VerdictCounts:
        """Count verdicts."""
        verdicts = [agreement.verdict for agreement in agreements]
        return cls(verdicts.count("differs"), verdicts.count("settles"), verdicts.count("agrees"))


@dataclass(frozen=True)
class EarlyEnd:
    """A run that ended before its time.

    Attributes:
        side: 0 for the left, 1 for the right.
        time: When [s].
        reason: Why, as the engine says it.
    """

    side: int
    time: float
    reason: str


@dataclass(frozen=True)
class MissingPart:
    """What one side has nothing of, and the other has.

    Attributes:
        side: "left" or "right": who has none.
        part: "floor" or "actuators".
    """

    side: str
    part: str

    @property
    def other_side(self) -> str:
        """Return the side that has the part, "left" or "right"."""
        return "right" if self.side == "left" else "left"


@dataclass(frozen=True)
class Finding:
    """What a comparison of two runs comes to.

    Attributes:
        outcome: What came of it.
        is_same: Whether every figure is the same on both sides.
        counts: How many quantities have which verdict.
        lead: The quantity that is farthest beyond its tolerance, of those that differ at the end if
            any does; see `leading`. Where all agree, the one that comes nearest to its tolerance.
        is_changing: Whether its difference still changes at the end.
        noticed: Position of the fingertip, of the base, or of a free body: the one that is farthest
            apart. None where it is the lead, or where there is none.
        divergence: When the runs diverge; None where every quantity agrees.
        rounding: What rounding alone makes of the lead.
        open_loop: Whether the runs agree with the commands of the left on both sides; "none" where
            both got the same commands.
        ended: The runs that ended early.
        missing: What one side has nothing of, and the other has.
        bases: Whether the base of the robot floats, on each side.
        fall: When each side fell; None of a robot that is fixed.
    """

    outcome: ComparisonOutcome
    is_same: bool
    counts: VerdictCounts
    lead: Agreement
    is_changing: bool
    noticed: Agreement | None
    divergence: Divergence | None
    rounding: Rounding
    open_loop: OpenLoop
    ended: tuple[EarlyEnd, ...]
    missing: tuple[MissingPart, ...]
    bases: Bases
    fall: RunOutcome | None

    @property
    def falls(self) -> Falls:
        """Return which sides fell; "none" where no robot floats."""
        if self.fall is None:
            return "none"
        left_fell, right_fell = self.fall.left is not None, self.fall.right is not None
        if left_fell and right_fell:
            return "both"
        if left_fell:
            return "left alone"
        return "right alone" if right_fell else "neither"

    @property
    def holds(self) -> bool:
        """Tell whether the runs agree, in open loop too where there is one: the exit code is 0."""
        return self.outcome == "agrees" and self.open_loop != "differs"


def finding_of(
    comparison: Comparison,
    floor: ChaosFloor | None = None,
    played: Comparison | None = None,
    missing: tuple[tuple[str, str], ...] = (),
) -> Finding:
    """Return what a comparison comes to.

    Args:
        comparison: Of the two runs.
        floor: What rounding alone makes; None where that was not computed.
        played: The comparison of the open loop; None where it is that of the closed one.
        missing: What a side has nothing of, as of `SidesRun`.
    """
    lead = leading(comparison, floor)
    open_loop: OpenLoop = "none"
    if played is not None:
        open_loop = "agrees" if played.agrees else "differs"
    is_same = all(agreement.max == 0 for agreement in comparison.agreements)
    is_changing = _changes_at_the_end(comparison, lead)
    counts = VerdictCounts.of(comparison.agreements)
    noticed = _noticed(comparison.agreements, lead)
    divergence, rounding = _divergence(comparison), _rounding(lead, floor)
    ended = tuple(_early_ends(comparison))
    fall = comparison.outcome_named(FELL)
    missing_parts = tuple(MissingPart(side, part) for side, part in missing)
    return Finding(
        outcome=comparison.outcome,
        is_same=is_same,
        counts=counts,
        lead=lead,
        is_changing=is_changing,
        noticed=noticed,
        divergence=divergence,
        rounding=rounding,
        open_loop=open_loop,
        ended=ended,
        missing=missing_parts,
        bases=comparison.bases,
        fall=fall,
    )


def finding_about(
    finding: Finding, lead: Agreement, comparison: Comparison, floor: ChaosFloor | None
) -> Finding:
    """Return what a comparison comes to, said of another quantity than the one that leads.

    Args:
        finding: What it comes to.
        lead: The quantity, such as one whose gap was explained.
        comparison: Of the two runs.
        floor: What rounding alone makes; None where that was not computed.
    """
    return replace(
        finding,
        lead=lead,
        is_changing=_changes_at_the_end(comparison, lead),
        noticed=_noticed(comparison.agreements, lead),
        rounding=_rounding(lead, floor),
    )


def leading(comparison: Comparison, floor: ChaosFloor | None = None) -> Agreement:
    """Return the quantity that is farthest beyond its tolerance.

    It is one of the motion that differs at the end; where none does, one that settles; where all
    of the motion agrees, another quantity. Of these it is one of the base of a robot that floats;
    else a coordinate, of which --why speaks; else another one. What is not a number comes last.
    Where some gaps may be chance, it is one of those that are beyond the chaos floor.
    """
    beyond = [a for a in comparison.agreements if a.verdict != "agrees"]
    chances: tuple[Chance, ...] = ("beyond", "cannot be told") if floor else ()
    for chance in chances:
        clear = [a for a in beyond if floor is not None and floor.chance(a.name) == chance]
        if clear:
            beyond = clear
            break
    if not beyond:
        return max(comparison.agreements, key=_finite_tolerances)
    for verdict in ("differs", "settles"):
        motion = [a for a in beyond if a.verdict == verdict and QUANTITIES[a.kind].moves]
        of_base = [a for a in motion if QUANTITIES[a.kind].of_base]
        coordinates = [a for a in motion if QUANTITIES[a.kind].is_coordinate]
        for candidates in (of_base, coordinates, motion):
            if candidates:
                return max(candidates, key=_finite_tolerances)
    differing = [a for a in beyond if a.verdict == "differs"]
    return max(differing if differing else beyond, key=_finite_tolerances)


def _finite_tolerances(agreement: Agreement) -> float:
    """Return how many tolerances a gap is; what is not a number is less than anything."""
    return float(np.nan_to_num(agreement.tolerances(), posinf=-1.0))


def parting(comparison: Comparison) -> float | None:
    """Return when the first quantity leaves its tolerance [s]; None if none does."""
    return min((a.since for a in comparison.agreements if a.since is not None), default=None)


def _divergence(comparison: Comparison) -> Divergence | None:
    """Return when the runs diverge, and at what event."""
    time = parting(comparison)
    if time is None:
        return None
    first = next(agreement for agreement in comparison.agreements if agreement.since == time)
    step = max(trace.timestep for trace in traces_of(comparison))
    spacing = comparison.until / max(1, comparison.moments - 1)
    known_to: DivergenceTime = "step"
    if time == 0:
        known_to = "start"
    elif spacing > 1.5 * step:
        known_to = "first moment" if time <= _TOGETHER * spacing else "moment"
    body, ground = "", ""
    if known_to in ("step", "moment"):
        body, ground = _touching_at(comparison, time, step)
    return Divergence(first.name, time, known_to, body, ground)


def _touching_at(comparison: Comparison, time: float, step: float) -> tuple[str, str]:
    """Return the bodies that first touch at a time, give or take a step; ("", "") for none."""
    first_touches: list[tuple[float, str]] = []
    for touch in comparison.touches:
        for contacts in (touch.left, touch.right):
            # What touches from the start on is no event.
            if contacts.first and abs(contacts.first - time) <= _TOGETHER * step:
                first_touches.append((contacts.first, touch.pair))
    if not first_touches:
        return "", ""
    _, pair = min(first_touches, key=lambda first_touch: first_touch[0])
    body, _, ground = pair.partition(" on ")
    return body, ground


def _rounding(lead: Agreement, floor: ChaosFloor | None) -> Rounding:
    """Return what rounding alone makes of the gap of a quantity."""
    bands = () if floor is None else floor.bands
    for band in bands:
        if band.name == lead.name and floor is not None:
            verdict: RoundingVerdict = "less"
            if not np.isfinite(band.most) and band.chance != "beyond":
                verdict = "no bound"
            elif band.chance == "inside":
                verdict = "as much"
            elif band.chance == "cannot be told":
                verdict = "cannot be told"
            return Rounding(verdict, band.most, floor.ended)
    return Rounding("not computed")


def _noticed(agreements: Sequence[Agreement], lead: Agreement) -> Agreement | None:
    """Return where one would see the gap: the position that is farthest apart [m]."""
    positions = [a for a in agreements if a.kind in ("tip", "body", "base") and not np.isnan(a.max)]
    farthest = max(positions, key=lambda agreement: agreement.max, default=None)
    return None if farthest == lead else farthest


def _changes_at_the_end(comparison: Comparison, agreement: Agreement) -> bool:
    """Tell whether a difference moves within the end by more than it may to be settled."""
    for curve in comparison.curves:
        if curve.name == agreement.name:
            tail = curve.difference[at_the_end(curve.time)]
            return float(np.ptp(tail)) > min(agreement.tolerance, _STEADY * agreement.settled)
    return False


def _early_ends(comparison: Comparison) -> Iterator[EarlyEnd]:
    for side, trace in enumerate(traces_of(comparison)):
        if trace.header.ended:
            yield EarlyEnd(side, (len(trace) - 1) * trace.timestep, trace.header.ended)
