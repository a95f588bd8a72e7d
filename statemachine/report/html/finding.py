"""What was found, in words: each made from figures of this comparison, none a guess."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...compare import Agreement, Comparison
from ..figures_of import quantity, short_time
from .timeline import Event

if TYPE_CHECKING:
    from ...compare.why import Attribution

_MOTION = ("joint", "slide", "tip", "tip rotation", "body", "body rotation")
_SOME = 0.1  # share of the gap from which on a factor is named


def headline(
    comparison: Comparison, events: Sequence[Event], attribution: Attribution | None = None
) -> str:
    """The finding in one sentence."""
    if comparison.agrees:
        if all(found.max == 0 for found in comparison.agreements):
            return "The two runs are the same in every figure that was compared"
        return f"The two runs agree for {comparison.until:g} s: nothing leaves its tolerance"
    subject = leading(comparison)
    if subject is None:
        return "The two runs differ"
    parts = [_apart(subject)]
    names = comparison.one.backend, comparison.two.backend
    if names[0] != names[1]:
        parts[0] += f" on {names[0]} and {names[1]}"
    at = parting(comparison)
    if at is not None:
        clause = f"the runs part at {short_time(at)}" if at > 0 else "the runs part from the start"
        touch = touch_at(comparison, events)
        parts.append(clause + (f", when {_meets(touch[0].what)}" if touch else ""))
    cause = _cause(attribution)
    return capital("; ".join(parts)) + (f". {cause}" if cause else "")


def _apart(found: Agreement) -> str:
    if found.kind == "contact":
        return f"{found.name}: {found.note or quantity(found.max, found.kind) + ' apart'}"
    if found.verdict == "differs":
        return f"{_named(found)} ends {quantity(found.settled, found.kind)} apart"
    far = quantity(found.max, found.kind)
    return f"{_named(found)} gets {far} apart on the way, and comes together again"


def _named(found: Agreement) -> str:
    if found.kind in ("joint", "slide"):
        return f"joint {found.name}"
    name, _, part = found.name.partition(", ")
    return f"the {part} of {name}" if part else f"the {name}"


def _meets(what: str) -> str:
    one, _, two = what.partition(" on ")
    return f"{one} touches {two}"


def leading(comparison: Comparison) -> Agreement | None:
    """The quantity to speak of: of the motion if that differs, farthest beyond its tolerance."""
    for verdict in ("differs", "settles"):
        for kinds in (_MOTION, None):
            found = [
                each
                for each in comparison.agreements
                if each.verdict == verdict and (kinds is None or each.kind in kinds)
            ]
            if found:
                size = "settled" if verdict == "differs" else "max"
                return max(found, key=lambda each: getattr(each, size) / each.tolerance)
    return comparison.worst


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
) -> list[str]:
    """What a reader should know before the figures, a paragraph each."""
    one, two = comparison.one, comparison.two
    counts = {
        verdict: sum(found.verdict == verdict for found in comparison.agreements)
        for verdict in ("agrees", "settles", "differs")
    }
    total = len(comparison.agreements)
    found: list[str] = []
    if comparison.agrees:
        worst = comparison.worst
        text = f"All {total} quantities stay within tolerance at all {comparison.moments} moments."
        if worst is not None and worst.max:
            text += (
                f" Nearest to its tolerance comes {worst.name}: "
                f"{quantity(worst.max, worst.kind)} of {quantity(worst.tolerance, worst.kind)}."
            )
        found.append(text)
    else:
        text = (
            f"Of {total} quantities {counts['agrees']} agree, {counts['settles']} leave their "
            f"tolerance and come back, and {counts['differs']} still differ at the end."
        )
        subject = leading(comparison)
        if subject is not None and subject.kind != "contact":
            text += (
                f" {capital(_named(subject))} is {quantity(subject.max, subject.kind)} apart at "
                f"most, at {short_time(subject.at)}; its tolerance is "
                f"{quantity(subject.tolerance, subject.kind)}."
            )
        found.append(text)
        touch = touch_at(comparison, events)
        if touch:
            labels = one.label, two.label
            each = [f"at {short_time(e.time)} on {labels[e.side or 0]}" for e in touch]
            missing = [labels[k] for k in (0, 1) if k not in [e.side for e in touch]]
            each += [f"never on {label}" for label in missing]
            found.append(f"The first touch of {touch[0].what} is {' and '.join(each)}.")
    if attribution is not None and attribution.alone:
        found.append(_left(attribution))
    return found


def _left(attribution: Attribution) -> str:
    """What remains of the gap after the ladder."""
    from ..why import amount, conclusion

    counted = [trial for trial in attribution.ladder if trial.explains is not None]
    if len(counted) != 1:
        return conclusion(attribution)[0]
    trial = counted[0]
    how = f"with {title(trial.factor)} brought to the same ({trial.did})"
    if trial.way == "off":
        how = f"without {title(trial.factor)} ({trial.did})"
    return (
        f"Run again {how}, the largest difference {_of(attribution)} is "
        f"{amount(attribution, trial.worst)} instead of {amount(attribution, attribution.gap)}."
    )


def _of(attribution: Attribution) -> str:
    if attribution.quantity in ("joints", "slides"):
        return f"in the {attribution.quantity}"
    return f"of {attribution.quantity}"


def _cause(attribution: Attribution | None) -> str:
    """Which factors take the gap away, with their shares, one on top of the other."""
    if attribution is None or not attribution.alone:
        return ""
    from ..why import amount, percent

    counted = [trial for trial in attribution.ladder if trial.explains is not None]
    rungs = [trial for trial in counted if (trial.explains or 0.0) >= _SOME]
    rungs.sort(key=lambda trial: -(trial.explains or 0.0))
    if not rungs:
        return "None of the factors that were tried explains a tenth of the gap"
    named = [f"{title(trial.factor)} explains {percent(trial.explains)}" for trial in rungs[:1]]
    named += [f"{title(trial.factor)} {percent(trial.explains)}" for trial in rungs[1:3]]
    listed = " and ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)
    gap = amount(attribution, attribution.gap)
    return f"{capital(listed)} of the largest difference {_of(attribution)}, {gap}"


def title(factor: str) -> str:
    """A factor in words."""
    from ...compare.why import FACTORS

    return FACTORS[factor].title if factor in FACTORS else factor


def capital(text: str) -> str:
    """With a capital letter first."""
    return text[:1].upper() + text[1:]
