"""What was found, in words: each made from figures of this comparison, none a guess."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..compare import Agreement, Comparison, Series
from ..compare.series import SETTLED, at_the_end
from ..compare.why import Explanation
from ..measures import QUANTITIES
from ..measures.text import capital, quantity, short_time
from ..page import Block, Headline, Text
from .events import Event
from .why import answer, proofs

_MOVES = 0.1  # share by which a difference may change in the end and be called settled

# The headline, and what follows it.
SAME = "The two runs are the same in every figure that was compared"
AGREE = "The two runs agree for {until:g} s: nothing leaves its tolerance"
ENDED = "{sides} ended early; until {until:g} s {agrees} of {total} quantities are within tolerance"
DIFFER = "The two runs differ"
APART = "{what} is up to {far} apart between {left} and {right}, at {at}{parting}"
CONTACT = "{what}: {far}{parting}"
PARTING = {
    "at the start": "; the runs part from the start",
    "exact": "; the runs part at {time}",
    "first": "; they are apart at the first common moment already, {time}",
    "coarse": "; they are apart from the common moment {time} on",
}
MEETS = ", when {body} touches {ground}"
WITHIN = "On average over {window}, all of the motion is within its tolerance."
STILL = "On average over {window} {what} is still {far} apart"
CHANGING = "{still}, and still changing: {last} at the last moment"

# Below the headline.
ALL_WITHIN = "All {total} quantities stay within tolerance at all {moments} moments."
NEAREST = "{text} Nearest to its tolerance comes {what}: {far} of {tolerance}."
CUT = "What comes after cannot be compared, and no cause is named."
FIRST = "First to leave its tolerance: {what}, at {at}."
VERDICTS = "Of {total} quantities: agrees {agrees}, settles {settles}, differs {differs}."
FARTHEST = "{text} Farthest beyond its tolerance is {what}: {far} of {tolerance}, at {at}."


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
    if comparison.agrees:
        same = all(agreement.max == 0 for agreement in agreements)
        return Headline(SAME if same else AGREE.format(until=until))
    if comparison.ended:
        sides = [side.label for side in (comparison.one, comparison.two) if side.ended]
        agrees = sum(agreement.verdict == "agrees" for agreement in agreements)
        lead = ENDED.format(
            sides=" and ".join(sides), until=until, agrees=agrees, total=len(agreements)
        )
        return Headline(lead, holds=False)
    main = subject(comparison, explanation)
    if main is None:
        return Headline(DIFFER, holds=False)
    contact = main.found if main.found and main.found.kind == "contact" else None
    left, right = short_labels(comparison)
    lead = (CONTACT if contact else APART).format(
        what=name_of(contact.name) if contact else main.named,
        far=contact.note or main.far if contact else main.far,
        left=left,
        right=right,
        at=short_time(main.at),
        parting=_parting(comparison, events),
    )
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
    touch = next(
        (
            e
            for e in events
            if at and e.time and kind != "first" and _is_touch(e, at, 1.001 * max(steps))
        ),
        None,
    )
    body, _, ground = touch.what.partition(" on ") if touch else ("", "", "")
    when = MEETS.format(body=body, ground=ground) if touch else ""
    return PARTING[kind].format(time=short_time(at)) + when


def _is_touch(event: Event, at: float, slack: float) -> bool:
    return event.kind == "touch" and abs(event.time - at) <= slack


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
    if not known:
        return WITHIN.format(window=window(comparison)) if motion and not differ else ""
    most = max(known, key=lambda a: a.settled / (a.tolerance or 1e-300))
    far = quantity(most.settled, most.unit)
    text = STILL.format(window=window(comparison), what=named(most), far=far)
    last = next((_last(curve, most) for curve in curves if curve.name == most.name), None)
    if last is not None:
        text = CHANGING.format(still=text, last=quantity(last, most.unit))
    return f"{text}."


def _last(curve: Series, agreement: Agreement) -> float | None:
    """The last difference, if it moves within the end by more than it may to be settled."""
    tail = curve.difference[at_the_end(curve.time)]
    moves = float(np.ptp(tail)) > min(agreement.tolerance, _MOVES * agreement.settled)
    return float(tail[-1]) if moves else None


def name_of(name: str) -> str:
    """A quantity's name where names stand in a list: without a comma of its own."""
    return name.replace(", ", " ")


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
    """The quantity farthest beyond its tolerance; of the motion if any of that is beyond."""
    beyond = [a for a in comparison.agreements if a.verdict != "agrees"]
    motion = [a for a in beyond if QUANTITIES[a.kind].moves]
    return max(motion or beyond, key=_finite_first, default=comparison.worst)


def _finite_first(agreement: Agreement) -> float:
    """How many tolerances it is beyond; what is no number comes last."""
    share = agreement.tolerances()
    return share if np.isfinite(share) else -1.0


def parting(comparison: Comparison) -> float | None:
    """When the first quantity leaves its tolerance [s]; None if none does."""
    return min((a.since for a in comparison.agreements if a.since is not None), default=None)


def in_words(
    comparison: Comparison, events: Sequence[Event], explanation: Explanation | None = None
) -> list[Block]:
    """What a reader should know before the figures."""
    agreements, total = comparison.agreements, len(comparison.agreements)
    worst = leading(comparison)
    figures = {}
    if worst is not None:
        far, tolerance = (quantity(size, worst.unit) for size in (worst.max, worst.tolerance))
        figures = {"far": far, "tolerance": tolerance, "at": short_time(worst.at)}
    if comparison.agrees:
        text = ALL_WITHIN.format(total=total, moments=comparison.moments)
        if worst is not None and worst.max:
            text = NEAREST.format(text=text, what=name_of(worst.name), **figures)
        return [Text(text)]
    if comparison.ended:
        first = min((a for a in agreements if a.since is not None), key=_since, default=None)
        parted = first and FIRST.format(what=named(first), at=short_time(_since(first)))
        return [Text(f"{CUT} {parted}" if parted else CUT)]
    counts = Counter(a.verdict for a in agreements)
    text = VERDICTS.format(
        total=total, **{kind: counts[kind] for kind in ("agrees", "settles", "differs")}
    )
    if worst is not None and worst.kind != "contact":
        text = FARTHEST.format(text=text, what=named(worst), **figures)
    return [Text(text)]


def _since(agreement: Agreement) -> float:
    return agreement.since or 0.0
