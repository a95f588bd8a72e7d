"""What was found, in words: each made from figures of this comparison, none a guess."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..compare import Agreement, ChaosFloor, Comparison, Series
from ..compare.series import SETTLED, at_the_end
from ..compare.why import Explanation
from ..measures import QUANTITIES
from ..measures.text import capital, listed, quantity, rounded, short_time
from ..page import Block, Headline, TableCell
from . import template
from .events import Event
from .template import if_true
from .why import answer, proofs

_STEADY = 0.1  # share by which a difference may change in the end and be called settled

LEADS = {
    "same": "The two runs are the same in every figure that was compared",
    "agree": "The two runs agree for {until:g} s: nothing leaves its tolerance",
    "ended": "{sides} ended early; until {until:g} s {agrees} of {total} quantities are within "
    "tolerance",
    "differ": "The two runs differ",
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
    "within": "On average over {window}, all of the motion is within its tolerance.",
    "settled": "On average over {window} {what} is still {far} apart.",
    "changing": "On average over {window} {what} is still {far} apart, and still changing: {last} "
    "at the last moment.",
}


@dataclass(frozen=True)
class MainDifference:
    """The difference to speak of: its name, the largest value as text, and when [s]."""

    named: str
    far: str
    at: float
    found: Agreement | None


def headline(
    comparison: Comparison,
    events: Sequence[Event],
    explanation: Explanation | None = None,
    curves: Sequence[Series] = (),
) -> Headline:
    """The largest difference, what explains it, and what is left of it in the end."""
    agreements, until = comparison.agreements, comparison.until
    holds, main = comparison.agrees, subject(comparison, explanation)
    of = main.found if main else None
    if holds:
        kind = "same" if all(agreement.max == 0 for agreement in agreements) else "agree"
    elif comparison.ended:
        kind = "ended"
    else:
        kind = "differ" if main is None else "contact" if of and of.kind == "contact" else "apart"
    sides = [side.label for side in (comparison.one, comparison.two) if side.ended]
    left, right = short_labels(comparison)
    slots = {"what": main.named, "far": main.far, "at": short_time(main.at)} if main else {}
    if of and kind == "contact":
        slots |= {"what": name_of(of.name), "far": of.note or slots["far"]}
    lead = LEADS[kind].format(
        until=until,
        sides=" and ".join(sides),
        agrees=sum(agreement.verdict == "agrees" for agreement in agreements),
        total=len(agreements),
        left=left,
        right=right,
        parting=_parting(comparison, events),
        **slots,
    )
    if kind not in ("apart", "contact"):
        return Headline(lead, holds=holds)
    causes = () if explanation is None else (*proofs(explanation), f"{answer(explanation)}.")
    return Headline(capital(lead), causes, _in_the_end(comparison, curves), holds=False)


def _parting(comparison: Comparison, events: Sequence[Event]) -> str:
    """When the runs part; of moments farther apart than timesteps, which is the first."""
    at = parting(comparison)
    if at is None:
        return ""
    spacing = comparison.until / max(1, comparison.moments - 1)
    steps = comparison.one.timestep, comparison.two.timestep
    kind = "at the start" if at == 0 else "exact"
    if at and spacing > 1.5 * max(steps):
        kind = "first" if at <= 1.001 * spacing else "coarse"
    # A touch later than a step after the parting has nothing to do with it.
    slack = 1.001 * max(steps) if at and kind != "first" else -1.0
    touches = (e.what for e in events if e.kind == "touch" and e.time and abs(e.time - at) <= slack)
    body, _, ground = next(touches, "").partition(" on ")
    when = f", when {body} touches {ground}" if body else ""
    return PARTING[kind].format(time=short_time(at)) + when


def short_labels(comparison: Comparison) -> tuple[str, str]:
    """What the sides are called for short: their engines, or what tells two of one apart."""
    return comparison.one.short, comparison.two.short


def long_labels(comparison: Comparison) -> tuple[str, str]:
    """What the sides are called: engine and version, or what tells two of one apart."""
    return comparison.one.label, comparison.two.label


def window(comparison: Comparison) -> str:
    """What the figures of the end are a mean over."""
    return f"the last {SETTLED * comparison.until:.3g} s"


def _in_the_end(comparison: Comparison, curves: Sequence[Series]) -> str:
    """What of the motion is still apart, as a mean over the end, and whether it still changes."""
    motion = [a for a in comparison.agreements if QUANTITIES[a.kind].moves]
    differ = [a for a in motion if a.verdict == "differs"]
    known = [a for a in differ if a.settled >= 0]  # what is no number is on neither side
    over = window(comparison)
    if not known:
        return ENDS["within"].format(window=over) if motion and not differ else ""
    most = max(known, key=lambda a: a.settled / (a.tolerance or 1e-300))
    far = quantity(most.settled, most.unit)
    last = next((_last(curve, most) for curve in curves if curve.name == most.name), None)
    kind = "settled" if last is None else "changing"
    last_one = quantity(last, most.unit)
    return ENDS[kind].format(window=over, what=named(most), far=far, last=last_one)


def _last(curve: Series, agreement: Agreement) -> float | None:
    """The last difference, if it moves within the end by more than it may to be settled."""
    tail = curve.difference[at_the_end(curve.time)]
    moves = float(np.ptp(tail)) > min(agreement.tolerance, _STEADY * agreement.settled)
    return float(tail[-1]) if moves else None


def name_of(name: str) -> str:
    """A quantity's name where names stand in a list: without a comma of its own."""
    return name.replace(", ", " ")


def moment(time: float | None) -> TableCell:
    """A time of the run [s] in a cell, to which a slider can go."""
    return TableCell("never" if time is None else f"{time:.3f}", at=time)


def named(agreement: Agreement) -> str:
    """A quantity within a sentence."""
    if agreement.kind in ("joint", "slide"):
        return f"joint {agreement.name}"
    name, _, part = agreement.name.partition(", ")
    return f"the {part} of {name}" if part else f"the {name}"


def subject(
    comparison: Comparison, explanation: Explanation | None = None
) -> MainDifference | None:
    """The largest difference: that whose causes were looked for, else the leading one."""
    if explanation is None or explanation.is_rounding:
        lead = leading(comparison)
        if lead is None:
            return None
        return MainDifference(named(lead), quantity(lead.max, lead.unit), lead.at, lead)
    gap = explanation.first[explanation.quantity]
    kind = {"joints": "joint", "slides": "slide"}.get(explanation.quantity)
    same = [
        agreement
        for agreement in comparison.agreements
        if (kind or f"{explanation.quantity}, position")
        == (agreement.kind if kind else agreement.name)
        and abs(agreement.max - gap.worst) <= 1e-6 * gap.worst
    ]
    far = quantity(gap.worst, explanation.unit)
    who = f"one of the {explanation.quantity}" if kind else f"the {explanation.quantity}"
    first = same[0] if same else None
    return MainDifference(named(first) if first else who, far, gap.at, first)


def leading(comparison: Comparison) -> Agreement | None:
    """The quantity farthest beyond its tolerance: a coordinate, of which --why speaks, if any is.

    Else one of the motion, as the fingertip; else any.
    """
    beyond = [a for a in comparison.agreements if a.verdict != "agrees"]
    own = [a for a in beyond if QUANTITIES[a.kind].own]
    motion = [a for a in beyond if QUANTITIES[a.kind].moves]
    return max(own or motion or beyond, key=_finite_first, default=comparison.worst)


def _finite_first(agreement: Agreement) -> float:
    """How many tolerances it is beyond; what is no number comes last."""
    share = agreement.tolerances()
    return share if np.isfinite(share) else -1.0


def parting(comparison: Comparison) -> float | None:
    """When the first quantity leaves its tolerance [s]; None if none does."""
    return min((a.since for a in comparison.agreements if a.since is not None), default=None)


def in_words(comparison: Comparison) -> list[Block]:
    """What a reader should know before the figures."""
    agreements, holds, ended = comparison.agreements, comparison.agrees, comparison.ended
    worst, first = leading(comparison), parting(comparison)
    counts = Counter(agreement.verdict for agreement in agreements)
    unlike = not holds and not ended
    slots: dict[str, Any] = {"nearest": None, "farthest": None, "first": None}
    if worst is not None:
        slots["far"], slots["tolerance"] = (
            quantity(size, worst.unit) for size in (worst.max, worst.tolerance)
        )
        slots["at"] = short_time(worst.at)
        slots["nearest"] = name_of(worst.name) if holds and worst.max else None
        slots["farthest"] = named(worst) if unlike and worst.kind != "contact" else None
    if ended and not holds and first is not None:
        slots["first"] = named(next(a for a in agreements if a.since == first))
        slots["at"] = short_time(first)
    return template.blocks(
        "finding",
        total=len(agreements),
        moments=comparison.moments,
        within=if_true(holds),
        cut=if_true(ended and not holds),
        unlike=if_true(unlike),
        **{kind: counts[kind] for kind in ("agrees", "settles", "differs")},
        **slots,
    )


def floor_words(comparison: Comparison, floor: ChaosFloor) -> list[Block]:
    """How the floor was made, how high it is, and what lies inside it."""
    largest = [
        max((band for band in floor.bands if band.unit == unit), key=lambda b: b.most, default=None)
        for unit in ("rad", "m")
    ]
    sizes = [f"{quantity(b.most, b.unit)} ({name_of(b.name)})" for b in largest if b]
    motion = [band for band in floor.bands if band.kind != "contact"]
    within = [band for band in motion if band.inside_from is not None]
    moving = [
        f"{name_of(b.name)} from {short_time(b.inside_from or 0.0)} on"
        for b in within
        if b.most > 0
    ]
    everywhere = len(within) == len(motion) and all(band.inside_from == 0 for band in within)
    verdicts = {agreement.name: agreement.verdict for agreement in comparison.agreements}
    chance = [b.name for b in floor.bands if not b.beyond and verdicts[b.name] != "agrees"]
    inside = moving and not everywhere
    return template.blocks(
        "floor",
        side=short_labels(comparison)[0],
        runs=floor.runs,
        changed=changed_by(floor),
        ended=floor.ended or None,
        most=listed(sizes) if sizes and not floor.ended else None,
        no_gap=if_true(not moving),
        every_gap=if_true(moving and everywhere),
        inside=", ".join(moving) if inside else None,
        chance=listed([name_of(name) for name in chance]) if chance and inside else None,
    )


def changed_by(floor: ChaosFloor) -> str:
    """What was changed in the runs that it is made of."""
    size = floor.uncertain
    sizes = [rounded(v, unit) for v, unit in ((size.length, "m"), (size.angle, "rad")) if v > 0]
    start = f", and its start by {listed(sizes)}" if sizes else ""
    return f"start and commands changed by rounding ({floor.rounding:g}){start}"
