"""What takes the gap away, each thing by itself, and what would make them agree."""

from __future__ import annotations

from collections.abc import Sequence

from ...compare.why import Attribution, FactorTrial
from ...comparison.text import capital, listed, percent
from ..why_words import amount, conclusion
from .finding import moves, title
from .markup import Html, joined, kept, tag
from .sections import table

_FULL = 1.0  # share of the gap that fills a bar


def causes_section(found: Attribution) -> Html:
    """Bars: how much of the gap each factor takes away, all on top of each other and alone."""
    gap = amount(found, found.gap)
    if not found.alone:
        return tag(
            "p",
            f"Differences below {amount(found, found.negligible)} are taken for rounding: there "
            "is nothing to explain.",
        )
    parts: list[object] = [
        tag(
            "p",
            kept(
                f"Both sides were run again, {found.runs} runs in all, with less and less between "
                f"them. The gap is the largest difference in {found.quantity} at any moment: "
                f"{gap} as they come. A bar is the part of it that goes when one thing is made "
                "the same on both sides or, where it is each engine's own doing, left out on both."
            ),
        ),
        _ladder(found),
        *_star(found, found.ladder),
        *_said(found),
    ]
    parts += [
        tag(
            "details",
            tag("summary", "Each by itself: what the gap becomes when one thing alone is changed"),
            tag(
                "p",
                "These figures are no shares of an explanation: what is the same on both sides is "
                "here left out on both too, which makes another motion with another gap. They "
                "need not add up.",
            ),
            _alone(found),
            *_star(found, found.alone),
            *(
                tag("p", kept(f"{capital(title(trial.factor))}: {trial.note}."))
                for trial in found.alone
                if trial.note
            ),
            tag("p", "The order of the table above. ", " ".join(found.order)),
        ),
    ]
    return joined([part for part in parts if part is not None])


def _said(found: Attribution) -> list[Html]:
    """The conclusion; beneath a line with a figure marked by "!" what that means."""
    one, two = found.names
    parts = []
    for line in conclusion(found):
        parts.append(tag("p", kept(line)))
        if "!" in line:
            text = (
                f"! More than twice what {one} moves at all ({amount(found, found.extent)}), and "
                f"than the gap: {two} does not do the experiment any more."
            )
            parts.append(tag("p", kept(text), class_="foot"))
    return parts


def agreement_steps(found: Attribution) -> Html | None:
    """What to set, in order, so that the runs agree, and what stays; None if nothing is known."""
    if not found.alone:
        return None
    one, two = found.names
    settings = [t for t in found.ladder if t.way == "parity" and t.did]
    rest = [t for t in found.ladder if t.way == "off" and t.explains is not None]
    same = amount(found, found.settings_same)
    items = [
        tag(
            "li",
            kept(f"{capital(title(t.factor))} of {_whose(found, t)}: {_change(found, t)}"),
            tag("span", kept(f" – the gap is then {_left(found, t)}"), class_="soft"),
        )
        for t in settings
    ]
    if items:
        first = tag("p", "Bring these to the same, in this order, each kept for the next:")
        what = f"What remains with all of it: {same}."
    else:
        first = tag(
            "p",
            f"Every setting that was tried is the same on {one} and {two}: there is nothing to "
            "set.",
        )
        what = f"What remains is all of the gap, {same}."
    if rest:
        last = rest[-1]
        names = listed([title(t.factor) for t in rest])
        what += (
            f" With {names} left out on both ({last.did.removesuffix(', both')}) it is "
            f"{amount(found, last.worst)}: that is each engine's own doing, and no setting that "
            "was tried brings it to the same."
        )
    return joined((first, tag("ol", *items) if items else "", tag("p", kept(what))))


def _whose(found: Attribution, trial: FactorTrial) -> str:
    one, two = found.names
    return two if trial.did == f"as {one}" else one


def _left(found: Attribution, trial: FactorTrial) -> str:
    if trial.worst is None:
        return trial.note or "not known by itself"
    return amount(found, trial.worst)


def _change(found: Attribution, trial: FactorTrial) -> str:
    had = trial.had if trial.did == f"as {found.names[0]}" else trial.had[::-1]
    return f"{had[1]} → {had[0]}"


def _did(found: Attribution, trial: FactorTrial) -> str:
    return _change(found, trial) if trial.way == "parity" else trial.did or "–"


def _star(found: Attribution, trials: Sequence[FactorTrial]) -> list[Html]:
    if not any(moves(trial) for trial in trials):
        return []
    text = (
        f"* {found.names[0]} itself then moves otherwise than it did, so the gap is that of "
        "another motion; a smaller one there is a hint, not a proof."
    )
    return [tag("p", text, class_="foot")]


def _ladder(found: Attribution) -> Html:
    signed = any((trial.explains or 0.0) < -0.005 for trial in found.ladder)
    rows = []
    for trial in found.ladder:
        text = percent(trial.explains) + ("*" if moves(trial) else "")
        rows.append(
            (
                capital(title(trial.factor)),
                _bar(trial.explains, text, signed),
                amount(found, trial.worst),
                kept(_did(found, trial)),
            )
        )
    gap, left = amount(found, found.gap), amount(found, found.left)
    return table(
        f"All of them, one on top of the other: from {gap} to {left}",
        ("what", "explains", "gap left", "brought to"),
        rows,
        words=(1, 3),
    )


def _alone(found: Attribution) -> Html:
    rows = []
    clipped = False
    for trial in found.alone:
        change = None if trial.explains is None else -trial.explains
        text = "–" if change is None else _signed(change) + ("*" if moves(trial) else "")
        clipped = clipped or (change is not None and abs(change) > _FULL)
        rows.append(
            (
                capital(title(trial.factor)),
                _bar(change, text, True),
                amount(found, trial.worst),
                kept(_did(found, trial)),
            )
        )
    made = table(
        f"One at a time: what becomes of the {amount(found, found.gap)}",
        ("what", "change of the gap", "gap", "brought to"),
        rows,
        words=(1, 3),
    )
    legend = "To the left of the line the gap shrinks, to the right it grows."
    if clipped:
        legend += " An arrow: the bar is cut off, the change is more than the gap itself."
    return joined((made, tag("p", legend, class_="foot")))


def _signed(change: float) -> str:
    text = percent(abs(change))
    if change == 0:
        return text
    sign = "+" if change > 0 else "−"
    if text[0] in "<>":
        return f"{text[0]} {sign}{text[2:]}" if change > 0 else f"{sign}{text[2:]}"
    return sign + text


def _bar(share: float | None, text: str, signed: bool) -> Html:
    """A share as a bar from a line of zero, to the left if it is below zero."""
    if share is None:
        return tag("span", text, class_="percent")
    length = 100 * min(_FULL, abs(share)) / (2 if signed else 1)
    left = 0.0 if not signed else 50.0 - (length if share < 0 else 0.0)
    look = "bar signed" if signed else "bar"
    if abs(share) > _FULL:
        look += " cut " + ("down" if share < 0 else "up")
    return tag(
        "span",
        tag("span", tag("i", style=f"left:{left:.1f}%;width:{length:.1f}%"), class_=look,
            aria_hidden="true"),
        tag("span", kept(text), class_="percent"),
        class_="measure",
    )  # fmt: skip
