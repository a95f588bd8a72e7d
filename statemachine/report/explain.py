"""What an explanation says: what differs between two sides, and what each of it explains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compare.labels import lacking
from ..compare.why import ADDS_UP, CauseShare, Explanation
from ..measures.text import NONE, capital, percent, quantity, sentence, short_time, significant
from ..page import Block, Items, Page, Section, Table, TableCell, Text, Verdict
from . import why
from .why_words import SMALL, THREE, gap_sentence, inside, noisy, three

_SHOWN = 12  # rows; the rest is folded away
_WIDE = 15  # characters of a value
_MEASURES = {"worst": "at its largest", "end": "in the end", "rms": "as a root mean square"}
_OFF = ("place", "anchor", "com", "axis")
_METHODS = {
    "nothing": "",
    "one at a time": f"They add up, to within {100 * ADDS_UP:g} % of the gap: each takes away as "
    "much alone as after all others, and explains the mean of the two.",
    "all sets": "They interact. Each share is the mean of what a cause takes away over all orders "
    "in which the causes can be brought to the same (Shapley value), over all sets of them.",
    "drawn orders": "They interact. Each share is the mean of what a cause takes away over {} "
    "drawn orders in which the causes are brought to the same (Shapley value), with its standard "
    "error.",
}


def page(result: Explanation, said: Sequence[str] = ()) -> Page:
    """What the gap is, what differs, what each difference explains, and what stays.

    Args:
        result: The explanation.
        said: Lines to say before anything else.
    """
    origin = (
        f"left: {result.one}; right: {result.two}; {result.seconds:g} s, {result.runs} runs "
        f"in {short_time(result.took)}, compared at {result.moments} moments"
    )
    only = lacking(result.unmatched, ("the left", "the right"))  # it comes first
    lines = [*said, *map(sentence, (*only, *result.notes)), result.says]
    first = [Text(line) for line in lines if line]
    name = f"{result.experiment}: why the right is not the left"
    return Page(name, origin, [*first, *causes(result), *_verdict(result)])


def causes(result: Explanation) -> list[Block]:
    """How far apart the sides are, and how much of it each difference explains."""
    text = gap_sentence(result.first, result.quantity, "As they come", " (--quantity)")
    blocks: list[Block] = [Text(text)]
    if result.is_rounding:
        blocks.append(Text(_nothing(result)))
    elif result.floor > SMALL * result.gap:
        floor = quantity(result.floor, result.unit)
        blocks.append(Text(noisy(floor, result.floor / result.gap)))
    blocks += _table(result)
    if result.engines is not None:
        left = quantity(result.engines.gap, result.unit)
        text = f"The left file on both engines: {left} is between the engines themselves"
        blocks.append(Section("engines", text, why.causes(result.engines)))
    return blocks


def three_of(result: Explanation) -> list[Block]:
    """The three parts of the gap, and what they mean; nothing where there is none to explain."""
    if result.is_rounding:
        return []
    text = three(result.explained, result.located, result.unexplained)
    return [Text(f"{text}."), Text(THREE, small=True)]


def _nothing(result: Explanation) -> str:
    """Why there is no gap to explain."""
    if result.gap <= result.negligible:
        return f"What is below {quantity(result.negligible, result.unit)} is taken for rounding."
    known = np.isfinite(result.floor)
    return inside(quantity(result.floor, result.unit) if known else "without a bound")


def _table(result: Explanation) -> list[Block]:
    """The differences, the largest share first; those without an effect folded away."""
    able = [each for each in result.shares if not each.note]
    refused = [each for each in result.shares if each.note]
    blocks: list[Block] = []
    if not result.shares:
        return [Text("The files, options and starts of the two sides are the same.")]
    rows = [_row(result, each) for each in able]
    if rows:
        gap = quantity(result.gap, result.unit)
        title = (
            f"What differs, and its part of the {gap} of the {result.quantity} "
            f"({_MEASURES[result.measure]})"
        )
        title = "What differs" if result.is_rounding else title
        heads = ("what", "left", "right", "explains", "alone", "last")
        words = frozenset({0, 1, 2})
        most = _SHOWN if len(rows) > _SHOWN + 1 else len(rows)  # no table of one row
        blocks.append(Table(heads, rows[:most], title, words=words))
        if rows[most:]:
            heading = f"{len(rows) - most} more differences, with smaller parts"
            more = Table(heads, rows[most:], heading, words=words)
            blocks.append(Section("", heading, [more], folded=True))
    if result.method != "nothing":
        method = _METHODS[result.method].format(result.orders)
        columns = "Alone, last: brought to the same first, or after all others."
        way = "The right is brought to the left: the other way round the parts are those of another"
        text = f"{method} {columns} {way} motion." if len(able) > 1 else columns
        blocks.append(Text(text))
    if refused:
        lines = [f"{capital(each.name)}: {each.note}." for each in refused]
        blocks += [Text("These differ, too, and cannot be brought to the same:"), Items(lines)]
    if result.impossible:
        number = len(result.impossible)
        first = ", ".join(result.impossible[0])
        sets = "set" if number == 1 else "sets"
        blocks.append(Text(f"{number} {sets} of causes could not be run, such as: {first}."))
    return blocks


def _row(result: Explanation, each: CauseShare) -> tuple[str | TableCell, ...]:
    values = each.values
    left, right = _sides(values[0], each.unit) if values else (NONE, NONE)
    what = capital(each.name)
    if len(values) == 1 and not each.name.startswith(values[0][0]):
        what += f" ({values[0][0]})" if "[" in values[0][0] else ""
    elif len(values) > 1:
        what += f" ({len(values)} figures)"
    explains = percent(each.share)
    if each.error:
        explains += f" ± {percent(each.error)}"
    if result.is_rounding:
        return what, left, right, NONE, NONE, NONE
    return (
        what,
        left,
        right,
        TableCell(explains, share=each.share),
        percent(each.alone) if each.alone is not None else NONE,
        percent(each.last) if each.last is not None else NONE,
    )


def _sides(figure: tuple[str, object, object], unit: str) -> tuple[str, str]:
    """Both values; of a place, or a direction, how far the right one is off."""
    name, one, two = figure
    if name in _OFF and isinstance(one, tuple) and isinstance(two, tuple):
        a, b = np.array(one, dtype=float), np.array(two, dtype=float)
        if unit:
            return "here", f"{quantity(float(np.linalg.norm(a - b)), unit)} off"
        angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
        return "this way", f"{quantity(angle, 'rad')} off"
    if isinstance(one, tuple) and isinstance(two, tuple) and len(one) == len(two):
        texts = [" ".join(_number(each, "") for each in value) for value in (one, two)]
        if max(map(len, texts)) > _WIDE:  # those that differ, which a cut would hide
            apart = [pair for pair in zip(one, two, strict=True) if pair[0] != pair[1]]
            cut = () if len(apart) == len(one) else ("…",)
            one, two = ((*(pair[k] for pair in apart), *cut) for k in (0, 1))
    left, right = _value(one, unit), _value(two, unit)
    if left == right and isinstance(one, float) and isinstance(two, float):
        return f"{one:.12g}", f"{two:.12g}"
    return left, right


def _value(value: object, unit: str) -> str:
    if value is None:
        return NONE
    if isinstance(value, tuple):
        text = " ".join(_number(each, "") for each in value)
        return text if len(text) <= _WIDE else f"{text[: _WIDE - 1].rstrip()}…"
    return _number(value, unit)


def _number(value: object, unit: str) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, int | float):
        return quantity(float(value), unit) if unit else significant(float(value))
    text = str(value)
    return text if len(text) <= _WIDE else f"{text[: _WIDE - 1]}…"


def _verdict(result: Explanation) -> list[Block]:
    if result.is_rounding:
        refused = any(each.note for each in result.shares)
        text = "the two sides move alike" + (", although they differ" if result.shares else "")
        if result.gap > result.negligible:
            text = "the gap is inside the chaos floor: there is nothing to explain"
        return [Verdict(text, not refused)]
    blocks: list[Block] = []
    if not result.is_explained:
        blocks.append(Text(_next(result)))
    text = three(result.explained, result.located, result.unexplained)
    return [*blocks, Text(THREE, small=True), Verdict(text, result.is_explained)]


def _next(result: Explanation) -> str:
    """What to look at where something stays."""
    refused = [each.name for each in result.shares if each.note]
    if refused:
        return (
            f"What stays may come from what cannot be brought to the same: {', '.join(refused[:4])}"
            ". Give both sides the same there, and compare again."
        )
    if result.engines is not None:
        return (
            "What stays is between the engines. Look at one step at a time (--one-step), which "
            "names the stage, and at the timestep (--converge)."
        )
    return "What stays is in nothing that is compared. Look at one step at a time (--one-step)."
