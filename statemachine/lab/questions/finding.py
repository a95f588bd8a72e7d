"""What a comparison found, in words: each from its figures, none a guess."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...measures import QUANTITIES
from ...measures.text import capital, quantity, short_time
from ...show import report_template as template
from ...show.blocks import Block, Headline
from ...show.report_template import if_true, slots_of
from ..compare import Agreement, Comparison, Series
from ..compare.chaos import Chance, ChaosFloor
from ..compare.instead import Instead
from ..compare.series import at_the_end
from ..compare.stillness import extent_of, nothing_moved
from ..why.answer_page import answer, proofs

if TYPE_CHECKING:
    from ..why import Explanation
from .compared_names import name_of, named, short_labels, traces_of, window
from .events import Event
from .floor_words import floor_sides

_STEADY = 0.1  # share by which a difference may change in the end and be called settled
LEADS = {
    "same": "The two runs are the same in every figure that was compared",
    "agree": "The two runs agree for {until:g} s: nothing leaves its tolerance",
    "ended": "{sides} ended early; until {until:g} s {agrees} of {total} quantities are within "
    "tolerance",
    "apart": "{what} is up to {far} apart between {left} and {right}, at {at}{parting}",
    "contact": "{what}: {far}{parting}",
}
PARTING = {
    "at the start": "; the runs part from the start",
    "exact": "; the runs part at {time}",
    "first": "; they are apart at the first common moment already, {time}",
    "coarse": "; they are apart from the common moment {time} on",
}
ENDS = {
    "inside": "Nothing can be concluded: rounding alone makes up to {floor} of it (the chaos "
    "floor, from {runs} perturbed runs of {sides}).",
    "cannot be told": "Whether that is more than chance cannot be told: rounding alone makes up to "
    "{floor} of it (the chaos floor, from {runs} perturbed runs of {sides}).",
    "alike": "All of the motion is within its tolerance at all moments.",
    "within": "On average over {window}, all of the motion is within its tolerance.",
    "settled": "On average over {window} {what} is still {far} apart.",
    "changing": "On average over {window} {what} is still {far} apart, and still changing: {last} "
    "at the last moment.",
}


def headline(
    comparison: Comparison,
    events: Sequence[Event],
    explanation: Explanation | None = None,
    floor: ChaosFloor | None = None,
    instead: Instead | None = None,
) -> Headline:
    """Return the largest difference, what explains it, and what is left of it in the end.

    Args:
        comparison: The figures.
        events: What happens when.
        explanation: What explains the largest difference; None if that was not asked.
        floor: The chaos floor; None if it was not looked for.
        instead: What to run where nothing moved; None where that was not looked for.
    """
    if comparison.outcome == "nothing moved":
        return Headline(nothing_moved(comparison.motion, instead), holds=False)
    if comparison.agrees:
        same = all(agreement.max == 0 for agreement in comparison.agreements)
        return Headline(LEADS["same" if same else "agree"].format(until=comparison.until))
    if comparison.ended:
        return _of_an_early_end(comparison)
    what, far, at, agreement = subject(comparison, explanation, floor)
    parting_words = _parting(comparison, events)
    if agreement is not None and agreement.kind == "contact":
        what = name_of(agreement.name)
        far = agreement.note if agreement.note else far
        lead = LEADS["contact"].format(what=what, far=far, parting=parting_words)
    else:
        left, right = short_labels(comparison)
        lead = LEADS["apart"].format(
            what=what,
            far=far,
            at=short_time(at),
            left=left,
            right=right,
            parting=parting_words,
        )
    causes = () if explanation is None else (*proofs(explanation), f"{answer(explanation)}.")
    end = _by_chance(comparison, floor, agreement)
    if not end:
        end = _in_the_end(comparison, agreement)
    return Headline(capital(lead), causes, end, holds=False)


def _of_an_early_end(comparison: Comparison) -> Headline:
    """Return the headline of a comparison of which a run ended before its time."""
    sides = [side.label for side in (comparison.left, comparison.right) if side.trace.header.ended]
    verdicts = Counter(agreement.verdict for agreement in comparison.agreements)
    lead = LEADS["ended"].format(
        sides=" and ".join(sides),
        until=comparison.until,
        agrees=verdicts["agrees"],
        total=len(comparison.agreements),
    )
    return Headline(lead, holds=False)


def _by_chance(
    comparison: Comparison, floor: ChaosFloor | None, agreement: Agreement | None
) -> str:
    """Say that rounding alone may make the gap of a quantity; "" where the gap is beyond that."""
    if floor is None or agreement is None:
        return ""
    for band in floor.bands:
        if band.name == agreement.name and band.chance in ("inside", "cannot be told"):
            return ENDS[band.chance].format(
                floor=quantity(band.most, band.unit),
                runs=floor.runs,
                sides=floor_sides(comparison, floor),
            )
    return ""


def _parting(comparison: Comparison, events: Sequence[Event]) -> str:
    """When the runs part; of moments farther apart than timesteps, which is the first."""
    at = parting(comparison)
    if at is None:
        return ""
    step = max(trace.timestep for trace in traces_of(comparison))
    spacing = comparison.until / max(1, comparison.moments - 1)
    kind = "at the start" if at == 0 else "exact"
    if at and spacing > 1.5 * step:
        kind = "first" if at <= 1.001 * spacing else "coarse"
    # A touch later than a step after the parting has nothing to do with it.
    slack = 1.001 * step if at and kind != "first" else -1.0
    touches = (e.what for e in events if e.kind == "touch" and e.time and abs(e.time - at) <= slack)
    body, _, ground = next(touches, "").partition(" on ")
    when = f", when {body} touches {ground}" if body else ""
    return PARTING[kind].format(time=short_time(at)) + when


def _in_the_end(comparison: Comparison, lead: Agreement | None) -> str:
    """What of the motion is still apart, as a mean over the end, and whether it still changes.

    Of several that are as far apart it is `lead`, which the headline names already.
    """
    motion = [a for a in comparison.agreements if QUANTITIES[a.kind].moves]
    differ = [a for a in motion if a.verdict == "differs"]
    known = [a for a in differ if a.settled >= 0]  # what is not a number is on neither side
    over = window(comparison)
    if not known:
        kind = "alike" if all(a.verdict == "agrees" for a in motion) else "within"
        return "" if differ or not motion else ENDS[kind].format(window=over)
    most = max(
        known, key=lambda a: (float(f"{a.settled / (a.tolerance or 1e-300):.2g}"), a == lead)
    )
    last = next(_last(curve, most) for curve in comparison.curves if curve.name == most.name)
    return ENDS["settled" if last is None else "changing"].format(
        window=over,
        what=named(most),
        far=quantity(most.settled, most.unit),
        last=quantity(last, most.unit),
    )


def _last(curve: Series, agreement: Agreement) -> float | None:
    """The last difference, if it moves within the end by more than it may to be settled."""
    tail = curve.difference[at_the_end(curve.time)]
    moves = float(np.ptp(tail)) > min(agreement.tolerance, _STEADY * agreement.settled)
    return float(tail[-1]) if moves else None


def subject(
    comparison: Comparison,
    explanation: Explanation | None = None,
    floor: ChaosFloor | None = None,
) -> tuple[str, str, float, Agreement | None]:
    """The largest difference: that whose causes were looked for, else the leading one.

    Returns:
        Its name, the largest value as text, when that is [s], and the figures of the comparison;
        None where they have no such quantity.
    """
    if explanation is None or not explanation.verdict.divides:
        lead = leading(comparison, floor)
        return named(lead), quantity(lead.max, lead.unit), lead.at, lead
    gap, quantities = explanation.first[explanation.quantity], explanation.quantity
    kind = {"joints": "joint", "slides": "slide"}.get(quantities)
    same = [
        agreement
        for agreement in comparison.agreements
        if (agreement.kind == kind if kind else agreement.name == f"{quantities}, position")
        and abs(agreement.max - gap.worst) <= 1e-6 * gap.worst
    ]
    who = f"one of the {quantities}" if kind else f"the {quantities}"
    first = max(same, key=lambda a: a.max, default=None)  # as `leading`
    far = quantity(gap.worst, explanation.unit)
    return named(first) if first else who, far, gap.at, first


def leading(comparison: Comparison, floor: ChaosFloor | None = None) -> Agreement:
    """The quantity farthest beyond its tolerance: a coordinate, of which --why speaks, if any is.

    Else one of the motion, as the fingertip; else any. What is not a number comes last. Where some
    gaps may be chance, it is one of those that are beyond the chaos floor.
    """
    beyond = [a for a in comparison.agreements if a.verdict != "agrees"]
    chances: tuple[Chance, ...] = ("beyond", "cannot be told") if floor else ()
    for chance in chances:
        clear = [a for a in beyond if floor is not None and floor.chance(a.name) == chance]
        if clear:
            beyond = clear
            break
    own = [a for a in beyond if QUANTITIES[a.kind].own]
    motion = [a for a in beyond if QUANTITIES[a.kind].moves]
    return max(
        own or motion or beyond or comparison.agreements,
        key=lambda a: np.nan_to_num(a.tolerances(), posinf=-1.0),
    )


def parting(comparison: Comparison) -> float | None:
    """When the first quantity leaves its tolerance [s]; None if none does."""
    return min((a.since for a in comparison.agreements if a.since is not None), default=None)


def in_words(comparison: Comparison) -> list[Block]:
    """Return what a reader should know before the figures."""
    slots = slots_of(_verdicts_of(comparison), _worst_of(comparison), _first_parting_of(comparison))
    return template.blocks("lab/questions/finding", **slots)


@dataclass(frozen=True)
class _Verdicts:
    """How many quantities agree, and which sentences that makes.

    Attributes:
        total: How many quantities there are.
        moments: How many moments were compared.
        agrees: How many quantities agree.
        settles: How many settle.
        differs: How many differ.
        within: "" where all agree.
        cut: "" where a run ended before its time.
        unlike: "" where neither is so.
        unmoved: How far the sides move where they agree in forces and energy alone; else None.
    """

    total: int
    moments: int
    agrees: int
    settles: int
    differs: int
    within: str | None
    cut: str | None
    unlike: str | None
    unmoved: str | None


def _verdicts_of(comparison: Comparison) -> _Verdicts:
    counts = Counter(agreement.verdict for agreement in comparison.agreements)
    outcome = comparison.outcome
    all_agree = outcome in ("agrees", "nothing moved")
    unmoved = None
    if outcome == "agrees" and not comparison.motion.moved:
        unmoved = extent_of(comparison.motion)
    total = len(comparison.agreements)
    return _Verdicts(
        total=total,
        moments=comparison.moments,
        agrees=counts["agrees"],
        settles=counts["settles"],
        differs=counts["differs"],
        within=if_true(all_agree),
        cut=if_true(outcome == "ended"),
        unlike=if_true(outcome == "differs"),
        unmoved=unmoved,
    )


@dataclass(frozen=True)
class _Worst:
    """The quantity that is farthest beyond its tolerance.

    Attributes:
        far: Its largest difference.
        tolerance: Its tolerance.
        at: When the difference is largest.
        nearest: What it is called where all agree and something differs at all; else None.
        farthest: What it is called where not all agree; else None.
    """

    far: str
    tolerance: str
    at: str
    nearest: str | None
    farthest: str | None


def _worst_of(comparison: Comparison) -> _Worst:
    worst = leading(comparison)
    nearest = farthest = None
    if comparison.outcome in ("agrees", "nothing moved") and worst.max:
        nearest = name_of(worst.name)
    if comparison.outcome == "differs" and worst.kind != "contact":
        farthest = named(worst)
    far, tolerance = (quantity(value, worst.unit) for value in (worst.max, worst.tolerance))
    return _Worst(far, tolerance, short_time(worst.at), nearest, farthest)


@dataclass(frozen=True)
class _FirstParting:
    """What leaves its tolerance first before a run ends early.

    Attributes:
        first: What it is called; None for nothing.
        parted: When.
    """

    first: str | None = None
    parted: str | None = None


def _first_parting_of(comparison: Comparison) -> _FirstParting:
    at = parting(comparison)
    if at is None or not comparison.ended:
        return _FirstParting()
    first = next(a for a in comparison.agreements if a.since == at)
    return _FirstParting(named(first), short_time(at))
