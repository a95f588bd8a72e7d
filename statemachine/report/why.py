"""The page of an attribution: what each difference explains, and what stays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..compare.why import FACTORS, Attribution, FactorTrial
from ..comparison.text import NONE, capital, percent, quantity, short_time
from ..page import Page, Table, Text, Verdict
from .why_words import ENOUGH, amount, astray, conclusion, shown, titles

_BAR = 16  # characters of the longest bar


def page(result: Attribution, said: Sequence[str] = ()) -> Page:
    """What the gap is, each factor alone, all of them together, and what follows.

    Args:
        result: The attribution.
        said: Lines to say before anything else.
    """
    blocks: list[Any] = [Text(line) for line in (*said, result.says) if line]
    blocks.append(Text(_gap_sentence(result)))
    if not result.alone:
        blocks.append(
            Text(
                f"What is below {amount(result, result.negligible)} is taken for rounding: "
                "there is nothing to explain."
            )
        )
        return Page(_title(result), _origin(result), blocks)
    blocks += [_alone(result), *(Text(line) for line in _notes(result))]
    blocks += [_ladder(result), Text(f"The order. {' '.join(result.order)}")]
    blocks += [Text(line) for line in conclusion(result)]
    blocks.append(
        Verdict(
            f"{percent(1 - result.unexplained)} of the gap is explained, "
            f"{percent(result.unexplained)} is not",
            abs(result.unexplained) <= ENOUGH,
        )
    )
    return Page(_title(result), _origin(result), blocks)


def _title(result: Attribution) -> str:
    one, two = result.names
    return f"{result.experiment}: why {two} is not {one}"


def _origin(result: Attribution) -> str:
    return (
        f"{result.one} and {result.two}, {result.seconds:g} s, "
        f"{result.runs} runs compared at {result.moments} moments"
    )


def _what(result: Attribution) -> str:
    if result.quantity == "joints":
        return "the worst joint"
    if result.quantity == "slides":
        return "the worst slide"
    return f"the {result.quantity}"


def _gap_sentence(result: Attribution) -> str:
    gap = result.first[result.quantity]
    text = (
        f"As they come, {_what(result)} is up to {amount(result, gap.worst)} apart, at "
        f"{short_time(gap.at)} (root mean square {amount(result, gap.rms)}, in the end "
        f"{amount(result, gap.end)})."
    )
    others = [
        f"{name} {quantity(other.worst, other.unit)}"
        for name, other in result.first.items()
        if name != result.quantity
    ]
    if others:
        text += f" Elsewhere: {', '.join(others)}."
    if result.between:
        text += " The timesteps have too few moments in common: rows between were interpolated."
    return text


def _alone(result: Attribution) -> Table:
    set_back = any(trial.put_back is not None for trial in result.alone)
    rows = []
    for trial in result.alone:
        last = shown(result, trial.put_back) if set_back else amount(result, trial.moved)
        rows.append(
            (
                FACTORS[trial.factor].title,
                _brought(result, trial),
                shown(result, trial.worst, trial),
                percent(trial.explains) + ("*" if _another(trial) else ""),
                last,
            )
        )
    headers = (
        "",
        "brought to",
        "gap",
        "explains",
        "put back" if set_back else f"moves {result.names[0]} by",
    )
    return Table(headers, rows, "One at a time: what happens to the gap", frozenset({0, 1}))


def _brought(result: Attribution, trial: FactorTrial) -> str:
    if trial.way == "parity":
        had = trial.had if trial.did == f"as {result.names[0]}" else trial.had[::-1]
        return f"{had[1]} → {had[0]}"
    return trial.did or NONE


def _another(trial: FactorTrial) -> bool:
    """Whether one itself moves otherwise with it: then the gap is that of another motion."""
    return bool(trial.moved) and trial.worst is not None


def _notes(result: Attribution) -> list[str]:
    one, two = result.names[0], result.names[1]
    found = []
    if any(trial.put_back is not None for trial in result.alone):
        found.append(
            "Explains: the part of the gap that goes when this alone is brought to the same; "
            "below zero, the gap grows. Put back: the gap when all settings are the same and "
            "this one is as it came. The parts need not add up: one setting can hide another."
        )
    found += [
        f"{capital(FACTORS[trial.factor].title)}, put back, takes {titles(trial.along)} back "
        "with it: they can be set only where it is."
        for trial in result.alone
        if trial.along
    ]
    if any(_another(trial) for trial in result.alone):
        found.append(
            f"* This moves {one} itself, so the gap is that of another motion. A smaller gap "
            "there is a hint, not a proof."
        )
    marked = [t.put_back for t in result.alone] + [t.worst for t in result.alone if not t.moved]
    if any(astray(result, gap) for gap in marked):
        found.append(
            f"! More than twice what {one} moves at all ({amount(result, result.extent)}), and "
            f"than the gap itself: so {two} does not do the experiment any more."
        )
    for trial in result.alone:
        if trial.note:
            found.append(f"{capital(FACTORS[trial.factor].title)}: {trial.note}.")
    if any(trial.way == "one side" for trial in result.alone):
        found.append(f"Integrator: {two} has none to choose from, so only {one} was changed.")
    return found


def _ladder(result: Attribution) -> Table:
    gaps = [result.gap, *(t.worst for t in result.ladder if t.worst is not None)]
    longest = max(gaps)
    rows = [("as they come", "", amount(result, result.gap), "", _bar(result.gap, longest))]
    for trial in result.ladder:
        rows.append(
            (
                f"+ {FACTORS[trial.factor].title}",
                trial.did.removesuffix(", both"),
                amount(result, trial.worst),
                _rung(trial),
                "" if trial.worst is None else _bar(trial.worst, longest),
            )
        )
    rows.append(("unexplained", "", amount(result, result.left), percent(result.unexplained), ""))
    return Table(
        ("", "brought to", "gap left", "explains", ""),
        rows,
        "All of them, one on top of the other",
        frozenset({0, 1, 4}),
        frozenset({len(rows) - 1}),
    )


def _rung(trial: FactorTrial) -> str:
    if trial.explains is None and trial.worst:
        return trial.note
    return percent(trial.explains) + ("*" if _another(trial) else "")


def _bar(value: float, longest: float) -> str:
    return "█" * round(_BAR * value / longest)
