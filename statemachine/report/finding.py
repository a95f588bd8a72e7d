"""What was found, in words: each made from figures of this comparison, none a guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..compare import Agreement, Comparison, Series
from ..compare.series import SETTLED, at_the_end
from ..compare.why import Attribution
from ..measures import QUANTITIES
from ..measures.text import capital, on, quantity, short_time
from ..page import Block, Headline, Section, Text
from .events import Event
from .why_words import amount, causes

_MOVES = 0.1  # share by which a difference may change in the end and be called settled


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
    attribution: Attribution | None = None,
    curves: Sequence[Series] = (),
) -> Headline:
    """The largest difference, what explains it, and what is left of it in the end."""
    if comparison.agrees:
        if all(found.max == 0 for found in comparison.agreements):
            return Headline("The two runs are the same in every figure that was compared")
        return Headline(
            f"The two runs agree for {comparison.until:g} s: nothing leaves its tolerance"
        )
    if comparison.ended:
        return Headline(
            f"{_agreeing(comparison)} until {comparison.until:g} s, and "
            f"{_ended(comparison)} before {_its(comparison)} time",
            holds=False,
        )
    of = subject(comparison, attribution)
    if of is None:
        return Headline("The two runs differ", holds=False)
    if of.found is not None and of.found.kind == "contact":
        found = of.found
        lead = f"{name_of(found.name)}: {found.note or of.far + ' apart'}"
    else:
        lead = f"{of.named} is up to {of.far} apart"
        names = short_labels(comparison)
        if names != (comparison.one.backend, comparison.two.backend):
            lead += f" between {names[0]} and {names[1]}"
        else:
            lead += f" on {names[0]} and {names[1]}"
        lead += f", at {short_time(of.at)}"
    return Headline(
        capital("; ".join([lead, *_parting(comparison, events)])),
        () if attribution is None else causes(attribution),
        _in_the_end(comparison, curves),
        holds=False,
    )


def _ended(comparison: Comparison) -> str:
    """Which sides did not reach the end of the run."""
    labels = zip(long_labels(comparison), (comparison.one, comparison.two), strict=True)
    return f"{' and '.join(label for label, side in labels if side.ended)} ended"


def _its(comparison: Comparison) -> str:
    return "their" if comparison.one.ended and comparison.two.ended else "its"


def _agreeing(comparison: Comparison) -> str:
    """How many quantities are within tolerance at every moment, as "2 of 5 quantities agree"."""
    total = len(comparison.agreements)
    count = sum(found.verdict == "agrees" for found in comparison.agreements)
    if count == total:
        return f"All {total} quantities agree"
    return f"{count or 'None'} of {total} quantities {_s(count, 'agree')}"


def _parting(comparison: Comparison, events: Sequence[Event]) -> list[str]:
    """When the runs part; of moments farther apart than timesteps, that it is only the first."""
    at = parting(comparison)
    if at is None:
        return []
    if at == 0:
        return ["the runs part from the start"]
    touch = touch_at(comparison, events)
    when = f", when {_meets(touch[0].what)}" if touch else ""
    apart = _spacing(comparison)
    if apart is None:
        return [f"the runs part at {short_time(at)}{when}"]
    if at <= 1.001 * apart:
        return [f"they are apart at the first common moment already, {short_time(at)}"]
    return [f"they are apart from the common moment {short_time(at)} on{when}"]


def _spacing(comparison: Comparison) -> float | None:
    """How far apart common moments are [s], if that is more than a timestep of both."""
    apart = comparison.until / max(1, comparison.moments - 1)
    steps = comparison.one.timestep, comparison.two.timestep
    return apart if apart > 1.5 * max(steps) else None


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
    motion = [found for found in comparison.agreements if QUANTITIES[found.kind].moves]
    still = [found for found in motion if found.verdict == "differs" and found.settled >= 0]
    over = f"On average over {window(comparison)}"
    if not still and any(found.verdict == "differs" for found in motion):
        return ""  # what is no number is neither within its tolerance nor beyond it
    if not still:
        return f"{over}, all of the motion is within its tolerance." if motion else ""
    most = max(still, key=lambda found: found.settled / (found.tolerance or 1e-300))
    text = f"{over} {named(most)} is still {quantity(most.settled, most.unit)} apart"
    curve = next((each for each in curves if each.name == most.name), None)
    last = None if curve is None else changing(curve, most)
    if last is None:
        return f"{text}."
    return f"{text}, and still changing: {quantity(last, most.unit)} at the last moment."


def changing(curve: Series, found: Agreement) -> float | None:
    """The last difference, if it moves within the end by more than it may to be settled."""
    tail = curve.difference[at_the_end(curve.time)]
    moves = float(np.ptp(tail))
    if moves > min(found.tolerance, _MOVES * found.settled):
        return float(tail[-1])
    return None


def name_of(name: str) -> str:
    """A quantity's name where names stand in a list: without a comma of its own."""
    return name.replace(", ", " ")


def named(found: Agreement) -> str:
    """A quantity within a sentence."""
    if found.kind in ("joint", "slide"):
        return f"joint {found.name}"
    name, _, part = found.name.partition(", ")
    return f"the {part} of {name}" if part else f"the {name}"


def _meets(what: str) -> str:
    one, _, two = what.partition(" on ")
    return f"{one} touches {two}"


def subject(
    comparison: Comparison, attribution: Attribution | None = None
) -> MainDifference | None:
    """The largest difference: that whose causes were looked for, else the leading one."""
    found = leading(comparison)
    if attribution is None or not attribution.alone:
        if found is None:
            return None
        return MainDifference(named(found), quantity(found.max, found.unit), found.at, found)
    gap = attribution.first[attribution.quantity]
    kinds = {"joints": "joint", "slides": "slide"}
    kind = kinds.get(attribution.quantity)
    same = [
        each
        for each in comparison.agreements
        if (each.kind == kind if kind else each.name == f"{attribution.quantity}, position")
        and abs(each.max - gap.worst) <= 1e-6 * gap.worst
    ]
    far = amount(attribution, gap.worst)
    if same:
        return MainDifference(named(same[0]), far, gap.at, same[0])
    who = f"one of the {attribution.quantity}" if kind else f"the {attribution.quantity}"
    return MainDifference(who, far, gap.at, None)


def leading(comparison: Comparison) -> Agreement | None:
    """The quantity farthest beyond its tolerance; of the motion if any of that is beyond."""
    beyond = [each for each in comparison.agreements if each.verdict != "agrees"]
    motion = [each for each in beyond if QUANTITIES[each.kind].moves]
    return max(motion or beyond, key=_finite_first, default=comparison.worst)


def _finite_first(found: Agreement) -> float:
    """How many tolerances it is beyond; what is no number comes last."""
    share = found.tolerances()
    return share if np.isfinite(share) else -1.0


def parting(comparison: Comparison) -> float | None:
    """When the first quantity leaves its tolerance [s]; None if none does."""
    return min((a.since for a in comparison.agreements if a.since is not None), default=None)


def touch_at(comparison: Comparison, events: Sequence[Event]) -> list[Event]:
    """The first touches of what touches when the runs part; empty if nothing does then."""
    at = parting(comparison)
    if not at:
        return []
    slack = 1.001 * max(comparison.one.timestep, comparison.two.timestep)
    touches = [event for event in events if event.kind == "touch" and event.time > 0]
    near = [event for event in touches if abs(event.time - at) <= slack]
    return [event for event in touches if near and event.what == near[0].what]


def in_words(
    comparison: Comparison, events: Sequence[Event], attribution: Attribution | None = None
) -> list[Block]:
    """What a reader should know before the figures."""
    one, two = comparison.one, comparison.two
    counts = {
        verdict: sum(found.verdict == verdict for found in comparison.agreements)
        for verdict in ("agrees", "settles", "differs")
    }
    total = len(comparison.agreements)
    found: list[Block] = []
    if comparison.agrees:
        worst = comparison.worst
        text = f"All {total} quantities stay within tolerance at all {comparison.moments} moments."
        if worst is not None and worst.max:
            text += (
                f" Nearest to its tolerance comes {name_of(worst.name)}: "
                f"{quantity(worst.max, worst.unit)} of {quantity(worst.tolerance, worst.unit)}."
            )
        found.append(Text(text))
    elif comparison.ended:
        at = parting(comparison)
        text = (
            f"{_ended(comparison)} before {_its(comparison)} time: the rest of the run cannot be "
            f"compared, and no cause is named. {_agreeing(comparison)} until then"
        )
        if at is not None:
            first = next(each for each in comparison.agreements if each.since == at)
            text += f"; the first to leave its tolerance is {named(first)}, at {short_time(at)}"
        found.append(Text(f"{text}."))
    else:
        still = counts["differs"]
        text = (
            f"Of {total} quantities {counts['agrees']} {_s(counts['agrees'], 'agree')}, "
            f"{counts['settles']} {_s(counts['settles'], 'leave')} tolerance and "
            f"{_s(counts['settles'], 'come')} back, and {still} still {_s(still, 'differ')} "
            f"over {window(comparison)}."
        )
        of = subject(comparison, attribution)
        if of is not None and of.found is not None and of.found.kind != "contact":
            text += (
                f" The tolerance of {named(of.found)} is "
                f"{quantity(of.found.tolerance, of.found.unit)}."
            )
        far = leading(comparison)
        if of is not None and of.found is None and far is not None:
            text += (
                f" Farthest beyond its tolerance is {named(far)}: "
                f"{quantity(far.max, far.unit)} of {quantity(far.tolerance, far.unit)}, at "
                f"{short_time(far.at)}."
            )
        found.append(Text(text))
        touch = touch_at(comparison, events)
        if touch:
            labels = one.label, two.label
            each = [f"at {short_time(e.time)} {on(labels[e.side or 0])}" for e in touch]
            missing = [labels[k] for k in (0, 1) if k not in [e.side for e in touch]]
            each += [f"never {on(label)}" for label in missing]
            text = f"The first touch of {touch[0].what} is {' and '.join(each)}."
            found.append(Section("", "", [Text(text)], detail=True))
    return found


def _s(count: int, verb: str) -> str:
    return verb + ("s" if count == 1 else "")
