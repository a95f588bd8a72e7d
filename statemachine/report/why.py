"""What an attribution says: what each difference explains, what stays, and what to set."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..compare.why import UNEXPLAINED, Attribution, FactorTrial
from ..measures.text import NONE, capital, listed, percent, quantity, short_time
from ..page import Block, Items, Page, Section, Table, TableCell, Text, Verdict
from .why_words import (
    SMALL,
    THREE,
    amount,
    astray,
    conclusion,
    gap_sentence,
    inside,
    moves,
    noisy,
    shown,
    three,
    title,
    titles,
)


def page(result: Attribution, said: Sequence[str] = ()) -> Page:
    """What the gap is, each factor alone, all of them together, and what follows.

    Args:
        result: The attribution.
        said: Lines to say before anything else.
    """
    one, two = result.names
    name = f"{result.experiment}: why {two} is not {one}"
    origin = (
        f"{result.one} and {result.two}, {result.seconds:g} s, "
        f"{result.runs} runs compared at {result.moments} moments"
    )
    blocks: list[Block] = [Text(line) for line in (*said, result.says) if line]
    blocks += causes(result)
    if result.alone:
        blocks.append(Section("agree", "To make them agree", steps(result), detail=True))
        blocks.append(Text(THREE, small=True))
        blocks.append(
            Verdict(
                three(result.explained, result.located, result.unexplained),
                abs(result.unexplained) <= UNEXPLAINED,
            )
        )
    return Page(name, origin, blocks)


def causes(result: Attribution) -> list[Block]:
    """How much of the gap each factor takes away, all on top of each other and alone."""
    text = gap_sentence(result.first, result.quantity, "Without any change")
    if result.between:
        text += " The timesteps have too few moments in common: rows between were interpolated."
    blocks: list[Block] = [Text(text)]
    if not result.alone and result.gap > result.negligible:
        known = math.isfinite(result.floor)
        return [*blocks, Text(inside(amount(result, result.floor) if known else "without a bound"))]
    if not result.alone:
        told = f"What is below {amount(result, result.negligible)} is taken for rounding: "
        return [*blocks, Text(f"{told}there is nothing to explain.")]
    if result.floor > SMALL * result.gap:
        blocks.append(Text(noisy(amount(result, result.floor), result.floor / result.gap)))
    blocks.append(_ladder(result))
    starred = any(moves(trial) for trial in result.ladder)
    if starred:
        blocks.append(_star(result))
    marked = False
    for line in conclusion(result):
        blocks.append(Text(line))
        if "!" in line:
            blocks.append(_astray(result))
            marked = True
    return [*blocks, *_detection(result), _alone(result, starred, marked)]


def _detection(result: Attribution) -> list[Block]:
    """Whether the engines find the same contacts at the same states."""
    found = result.detection
    if found is None:
        return []
    one, _ = result.names
    text = f"Contacts found at equal states, {found.moments} of the run on {one}: "
    if not found.differing:
        return [Text(f"{text}the same pairs, as deep. What differs of contact is its law.")]
    return [
        Text(
            f"{text}at {found.differing} of them other pairs, or not as deep, first at "
            f"{short_time(found.first or 0.0)}; by up to {quantity(found.depth, 'm')}, "
            f"{found.where} (--one-step)."
        )
    ]


def steps(result: Attribution) -> list[Block]:
    """What to set, in order, so that the runs agree, and what stays."""
    one, two = result.names
    same = amount(result, result.settings_same)
    settings = [trial for trial in result.ladder if trial.way == "parity" and trial.did]
    if settings:
        blocks: list[Block] = [
            Text("Bring these to the same, in this order, each kept for the next:"),
            Items([_step(result, trial) for trial in settings], ordered=True),
        ]
        text = f"What remains with all of it: {same}."
    else:
        blocks = []
        text = (
            f"Every setting that was tried is the same on {one} and {two}: there is nothing to "
            f"set. What remains is all of the gap, {same}."
        )
    rest = [t for t in result.ladder if t.way == "off" and t.explains is not None]
    if rest:
        names = listed([title(trial.factor) for trial in rest])
        text += (
            f" With {names} left out on both ({rest[-1].did.removesuffix(', both')}) it is "
            f"{amount(result, rest[-1].worst)}: that is each engine's own doing, and no setting "
            "that was tried brings it to the same."
        )
    return [*blocks, Text(text)]


def _step(result: Attribution, trial: FactorTrial) -> str:
    one, two = result.names
    whose = two if trial.did == f"as {one}" else one
    left = trial.note or "not known by itself"
    if trial.worst is not None:
        left = amount(result, trial.worst)
    return (
        f"{capital(title(trial.factor))} of {whose}: {_brought(result, trial)} – the gap is then "
        f"{left}"
    )


def _brought(result: Attribution, trial: FactorTrial) -> str:
    if trial.way == "parity":
        had = trial.had if trial.did == f"as {result.names[0]}" else trial.had[::-1]
        return f"{had[1]} → {had[0]}"
    return trial.did or NONE


def _star(result: Attribution) -> Text:
    text = (
        f"* With this change {result.names[0]} itself moves differently. The gap is that of "
        "another motion, so a smaller gap is a hint and no proof."
    )
    return Text(text, small=True)


def _astray(result: Attribution) -> Text:
    one, two = result.names
    text = (
        f"! More than twice what {one} moves at all ({amount(result, result.extent)}), and than "
        f"the gap itself: {two} does not do the experiment any more."
    )
    return Text(text, small=True)


def _ladder(result: Attribution) -> Table:
    """All factors, each added to those before."""
    rows = [
        (
            capital(title(trial.factor)),
            _share(trial.explains, percent(trial.explains), trial),
            amount(result, trial.worst),
            _brought(result, trial),
        )
        for trial in result.ladder
    ]
    gap, left = amount(result, result.gap), amount(result, result.left)
    return Table(
        ("what", "explains", "gap left", "brought to"),
        rows,
        f"All of them, each added to those before: from {gap} to {left}",
        words=frozenset({0, 3}),
    )


def _alone(result: Attribution, starred: bool, marked: bool) -> Section:
    """What the gap becomes when one thing alone is changed.

    Args:
        result: The attribution.
        starred: Whether it was said already what a star means.
        marked: The same of an exclamation mark.
    """
    set_back = any(trial.put_back is not None for trial in result.alone)
    rows = []
    for trial in result.alone:
        change = None if trial.explains is None else -trial.explains
        text = NONE if change is None else _signed(change)
        rows.append(
            (
                capital(title(trial.factor)),
                _share(change, text, trial),
                shown(result, trial.worst, trial),
                shown(result, trial.put_back) if set_back else amount(result, trial.moved),
                _brought(result, trial),
            )
        )
    table = Table(
        (
            "what",
            "change of\nthe gap",
            "gap",
            "put back" if set_back else f"moves {result.names[0]} by",
            "brought to",
        ),
        rows,
        f"One at a time: what becomes of the {amount(result, result.gap)}",
        words=frozenset({0, 4}),
    )
    notes: list[Block] = []
    if any(moves(trial) for trial in result.alone) and not starred:
        notes.append(_star(result))
    given = [t.put_back for t in result.alone] + [t.worst for t in result.alone if not t.moved]
    if any(astray(result, gap) for gap in given) and not marked:
        notes.append(_astray(result))
    order = f"How the order was chosen. {' '.join(result.order)}"
    notes += [Text(_meaning(result, set_back)), Text(order)]
    heading = "Each by itself: what the gap becomes when one thing alone is changed"
    return Section("", heading, [table, *notes], folded=True)


def _meaning(result: Attribution, set_back: bool) -> str:
    """What the figures of one thing alone mean."""
    one, two = result.names
    lines = [
        "These figures are not shares of the gap and need not add up: one setting can hide "
        "another, and leaving something out on both sides makes another motion."
    ]
    if set_back:
        lines.append("Put back: the gap when all settings are the same and this one is as it came.")
    lines += [
        f"{capital(title(trial.factor))}, put back, takes {titles(trial.along)} back with it: "
        "they can be set only where it is."
        for trial in result.alone
        if trial.along
    ]
    lines += [f"{capital(title(t.factor))}: {t.note}." for t in result.alone if t.note]
    if any(trial.way == "one side" for trial in result.alone):
        lines.append(f"Integrator: {two} has none to choose from, so only {one} was changed.")
    return " ".join(lines)


def _share(share: float | None, text: str, trial: FactorTrial) -> TableCell:
    return TableCell(f"{text}*" if moves(trial) else text, share=share)


def _signed(change: float) -> str:
    text = percent(abs(change))
    if change == 0:
        return text
    sign = "+" if change > 0 else "-"
    if text[0] in "<>":
        return f"{text[0]} {sign}{text[2:]}" if change > 0 else f"{sign}{text[2:]}"
    return sign + text
