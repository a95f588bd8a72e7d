"""What an explanation says: the cause first, then every difference with its part of the gap."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..compare.labels import lacking
from ..compare.why import ADDS_UP, CauseShare, Explanation, Located
from ..measures import Deviation
from ..measures.text import NONE, capital, percent, quantity, sentence, short_time, significant
from ..page import Block, Items, Page, Section, Table, TableCell, Text
from . import template
from .template import if_true

_SHOWN = 12  # rows; the rest is folded away
_WIDE = 15  # characters of a value
_SMALL = 0.01  # of the gap: a chaos floor below that is not spoken of
_NO_PART = 1e-3  # of the gap: causes below that are one row
_MASKED = 2.0  # of the gap: a cause with more has others against it
_PROOF = 1e-3  # of the gap: nearer than this until the first touch, the touch parts the sides
_OFF = ("place", "anchor", "com", "axis")
_HEADS = ("what", "left", "right", "explains", "alone", "last")
_SINGULAR = {"joints": "worst joint", "slides": "worst slide", "ball joints": "worst ball joint"}
_MEASURES = {"worst": "at its largest", "end": "in the end", "rms": "as a root mean square"}

# Line one: what a side has nothing of, and what the gap comes from.
MISSING = {
    "actuators": "The {side} has no actuators, the {other} has: --actuators {other} gives it those",
    "floor": "The {side} has no floor, the {other} has: --floor {other} gives it that",
}
ADD = "add what the left has"
PLAYED = "the models were run again, with the recorded starts and commands"
ANSWERS = {
    "rounding": "The two sides move alike: {gap} is rounding",
    "alike": "The two sides move alike, although they differ: {gap} is rounding",
    "chaos": "Nothing can be concluded: the gap is {gap}, and the chaos floor {floor}",
    "cause": "{cause}, {left} on the left and {right} on the right: {part} of the {gap}",
    "bare": "{cause}: {part} of the {gap}",
    "masked": "No single difference causes the {gap}: the differences hide one another",
    "located": "{cause}: {part} of the {gap} is localised there, not explained",
    "unexplained": "The cause was not found: {part} of the {gap} is unexplained",
}
TOUCH = (
    "Until the first touch, {what} at {time}, the two are {before} apart: what parts them acts "
    "where they touch."
)
PARTS = "{explained} of the gap is explained, {located} is localised, {unexplained} is unexplained"
THREE = (
    "Explained: this part goes when settings of the right are given the left's values. Localised "
    "by leaving it out, not explained: this part goes only when something is left out on both "
    "sides, which says where it comes from, and not why. Unexplained: this part stays."
)
LEFT_OUT = {
    False: "* Localised by leaving it out, not explained: both sides ran again without {cause}, "
    "which is another motion.",
    True: "* Without {cause} nothing moves any more, so there can be no gap: a weak hint.",
}
INTEGRATOR = (
    "* Localised by choosing it, not explained: both sides ran again with other integrators "
    "({left} on the left, {right} on the right), which is another motion."
)
METHODS = {
    "nothing": None,
    "one at a time": "The parts add up, to within {adds_up} of the gap: each cause takes away as "
    "much alone as last, and “explains” is the mean of the two.",
    "all sets": "The causes interact. “explains” is the mean of what a cause takes away over all "
    "orders in which the right can be given the left's values (Shapley value, over all sets).",
    "drawn orders": "The causes interact. “explains” is the mean of what a cause takes away over "
    "{orders} drawn orders in which the right is given the left's values (Shapley value), with its "
    "standard error.",
}
NEXT = {
    "refused": "What stays may come from what cannot be made the same: {causes}. Give both sides "
    "the same there, and compare again.",
    "engines": "What stays is between the engines. Look at one step at a time (--one-step), which "
    "names the stage, and at the timestep (--converge).",
    "files": "What stays is in nothing that is compared. Look at the function that commands, and "
    "at the order of ctrl; if the open loop agrees, the difference is in what is commanded. Look "
    "at one step at a time (--one-step).",
}


def page(result: Explanation, said: Sequence[str] = ()) -> Page:
    """What the gap comes from, what differs, what each difference explains, and what stays.

    Args:
        result: The explanation.
        said: Lines to say before anything else.
    """
    only = lacking(result.unmatched, ("the left", "the right"))
    title, *further = [*missing(result.missing), answer(result)]
    lines = [*map(sentence, (*further, *said, *only, *result.notes)), *proofs(result), result.says]
    rounding, stays = result.is_rounding, not (result.is_rounding or result.is_explained)
    refused = any(row.note for row in result.shares)
    return template.page(
        "why",
        title=title,
        experiment=result.experiment,
        left=result.one,
        right=result.two,
        seconds=result.seconds,
        runs=result.runs,
        took=short_time(result.took),
        moments=result.moments,
        first=[Text(line) for line in lines if line],
        causes=causes(result),
        changes=steps(result),
        next=_next(result) if stays else None,
        parts=three_parts(result)[1:],
        holds=not refused if rounding else result.is_explained,
        verdict=answer(result) if rounding else parts(result),
    )


def missing(parts: Sequence[tuple[str, str]]) -> list[str]:
    """What one side has nothing of, and how to give it the other's: lines without their end."""
    other = {"left": "right", "right": "left"}
    return [MISSING[part].format(side=side, other=other[side]) for side, part in parts]


def answer(result: Explanation) -> str:
    """What the gap comes from, in a sentence without its end."""
    gap, floor = _amount(result, result.gap), _amount(result, result.floor)
    if result.is_rounding:
        differ = "alike" if result.shares else "rounding"
        kind = differ if result.gap <= result.negligible else "chaos"
        return ANSWERS[kind].format(gap=gap, floor=floor)
    first = next((row for row in result.shares if row.share), None)
    place = max(result.found_in, key=lambda part: part.share, default=None)
    parts = {
        "cause": abs(first.share or 0.0) if first else 0.0,
        "located": place.share if place else 0.0,
        "unexplained": result.unexplained,
    }
    kind = max(parts, key=parts.__getitem__)
    slots: dict[str, object] = {}
    if kind == "located" and place:
        slots = {"cause": capital(place.name)}
    elif kind == "cause" and first:
        left, right = _values(first)
        slots = {"cause": capital(first.name), "left": left, "right": right}
        kind = "bare" if NONE in (left, right) else kind
        # A share below zero hides others; one far above the whole gap does only what they hide.
        kind = kind if 0 < (first.share or 0.0) < _MASKED else "masked"
    return ANSWERS[kind].format(part=percent(max(parts.values())), gap=gap, **slots)


def proofs(result: Explanation) -> tuple[str, ...]:
    """What the run itself shows of the cause: that the sides are together until they touch."""
    touch = result.touch
    if touch is None or not touch.time or touch.before >= _PROOF * result.gap:
        return ()
    time, before = short_time(touch.time), _amount(result, touch.before)
    return (TOUCH.format(what=touch.what, time=time, before=before),)


def causes(result: Explanation) -> list[Block]:
    """How far apart the sides are, and how much of it each difference explains."""
    able = [row for row in result.shares if not row.note]
    refused = [f"{capital(row.name)}: {row.note}." for row in result.shares if row.note]
    small, floor = result.gap <= result.negligible, _amount(result, result.floor)
    noisy = not result.is_rounding and result.floor > _SMALL * result.gap
    legend = METHODS[result.method]
    return template.blocks(
        "why_causes",
        **_gap_slots(result.first, result.quantity),
        between=if_true(result.between),
        negligible=_amount(result, result.negligible) if result.is_rounding and small else None,
        chaos=floor if result.is_rounding and not small else None,
        same=if_true(not result.shares and not result.found_in),
        table=_table(result, able),
        left_out=[Text(_left_out(part), small=True) for part in result.found_in],
        hardly_move=", ".join(result.still) or None,
        method=legend and legend.format(orders=result.orders, adds_up=f"{100 * ADDS_UP:g} %"),
        legend=if_true(legend),
        several=if_true(legend and len(able) > 1),
        negative=if_true(legend and any((row.share or 0.0) < -_NO_PART for row in able)),
        no_figure=if_true(legend and any(None in (row.alone, row.last) for row in able)),
        redundant=", ".join(result.redundant) or None,
        refused_too=if_true(refused),
        refused=[Items(refused)] if refused else [],
        impossible=len(result.impossible) or None,
        such_as=", ".join(next(iter(result.impossible), ())),
        noise=floor if noisy else None,
        noise_part=percent(result.floor / result.gap) if noisy else None,
    )


def steps(result: Explanation) -> list[Block]:
    """What to change on the right, and where, so that the sides agree."""
    lines = []
    for row in result.shares:
        if (row.share or 0.0) >= _NO_PART and not row.note:
            left, right = _values(row)
            place = f"{row.place.file}, line {row.place.line}: " if row.place else ""
            change = ADD if (left, right) == ("there", NONE) else "{right} → {left}"
            lines.append(f"{place}{row.name}: {change.format(left=left, right=right)}")
    hidden = result.is_rounding or not lines
    return [] if hidden else [Text("What to change on the right:"), Items(lines)]


def parts(result: Explanation) -> str:
    """The three parts of a gap, in a sentence without its end."""
    names = ("explained", "located", "unexplained")
    return PARTS.format(**{name: percent(getattr(result, name)) for name in names})


def three_parts(result: Explanation) -> list[Block]:
    """The three parts of the gap, and what they mean; nothing where there is none to explain."""
    if result.is_rounding:
        return []
    return [Text(f"{parts(result)}."), Text(THREE, small=True)]


def _next(result: Explanation) -> str:
    """What to look at where something stays."""
    refused = [row.name for row in result.shares if row.note]
    engines = {side.backend for side in result.provenance}
    kind = "refused" if refused else "engines" if len(engines) > 1 else "files"
    return NEXT[kind].format(causes=", ".join(refused[:4]))


def _gap_slots(gaps: Mapping[str, Deviation], of: str) -> dict[str, str | None]:
    """How far two runs are apart in one of some quantities, and in the others."""
    gap = gaps[of]
    others = [f"{name} {quantity(g.worst, g.unit)}" for name, g in gaps.items() if name != of]
    return {
        "what": _SINGULAR.get(of, of),
        "at": short_time(gap.at),
        **{size: quantity(getattr(gap, size), gap.unit) for size in ("worst", "rms", "end")},
        "elsewhere": ", ".join(others) or None,
    }


def _table(result: Explanation, able: Sequence[CauseShare]) -> list[Block]:
    """The differences, the largest share first; those without an effect folded away."""
    rows = [_row(result, row) for row in able if result.is_rounding or _counts(row)]
    rows += [_located_row(part) for part in result.found_in]
    small = [row for row in able if not result.is_rounding and not _counts(row)]
    if small:
        share = sum(row.share or 0.0 for row in small)
        name = capital(small[0].name) if len(small) == 1 else f"{len(small)} more, none above 0.1 %"
        values = _values(small[0]) if len(small) == 1 else (NONE, NONE)
        rows.append((name, *values, TableCell(percent(share), share=share), NONE, NONE))
    title = "What differs"
    if not result.is_rounding:
        title += f", and its part of the {_amount(result, result.gap)} of the {result.quantity} "
        title += f"({_MEASURES[result.measure]})"
    words = frozenset({0, 1, 2})
    most = _SHOWN if len(rows) > _SHOWN + 1 else len(rows)  # no table of one row
    heading = f"{len(rows) - most} more differences, with smaller parts"
    more = Table(_HEADS, rows[most:], heading, words=words)
    first: list[Block] = [Table(_HEADS, rows[:most], title, words=words)] if rows else []
    return [*first, *([Section("", heading, [more], folded=True)] if more.rows else [])]


def _counts(row: CauseShare) -> bool:
    """Whether a cause has a row of its own."""
    return max(abs(part or 0.0) for part in (row.share, row.alone, row.last)) >= _NO_PART


def _row(result: Explanation, row: CauseShare) -> tuple[str | TableCell, ...]:
    what = capital(row.name)
    if len(row.values) > 1 and len({repr(value[1:]) for value in row.values}) > 1:
        what += f" ({len(row.values)} figures)"
    elif row.values and "[" in row.values[0][0] and not row.name.startswith(row.values[0][0]):
        what += f" ({row.values[0][0]})"
    left, right = _values(row)
    if result.is_rounding:
        return what, left, right, NONE, NONE, NONE
    noise = result.floor / result.gap
    if abs(row.share or 0.0) < noise and noise > _SMALL:  # no part is claimed inside the floor
        explains = f"< {percent(noise)}"
        return what, left, right, TableCell(explains, share=row.share), NONE, NONE
    explains = percent(row.share)
    if row.error and math.isfinite(row.error):
        explains += f" ± {percent(row.error)}"
    alone, last = (NONE if part is None else percent(part) for part in (row.alone, row.last))
    return what, left, right, TableCell(explains, share=row.share), alone, last


def _left_out(part: Located) -> str:
    if part.values:
        return INTEGRATOR.format(left=part.values[0], right=part.values[1])
    return LEFT_OUT[part.is_still].format(cause=part.name)


def _located_row(part: Located) -> tuple[str | TableCell, ...]:
    """What a feature that was left out takes away; of an integrator, what the sides have."""
    left, right = part.values or (NONE, NONE)
    explains = TableCell(f"{percent(part.share)}*", share=part.share)
    return capital(part.name), left, right, explains, NONE, NONE


def _values(row: CauseShare) -> tuple[str, str]:
    """The left's and the right's value of the figure that differs most."""
    if not row.values:
        return NONE, NONE
    return _sides(max(row.values, key=_relative), row.unit)


def _relative(figure: tuple[str, object, object]) -> float:
    """How far two values are apart, as a part of the larger; 0 where that is no number."""
    try:
        one, two = (np.array(value, dtype=float) for value in figure[1:])
        size = max(float(np.linalg.norm(one)), float(np.linalg.norm(two)))
        return float(np.linalg.norm(one - two)) / size if size else 0.0
    except (TypeError, ValueError):
        return 0.0


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
        texts = [" ".join(_number(number, "") for number in value) for value in (one, two)]
        if max(map(len, texts)) > _WIDE:  # those that differ, which a cut would hide
            apart = [pair for pair in zip(one, two, strict=True) if pair[0] != pair[1]]
            cut = () if len(apart) == len(one) else ("…",)
            one, two = ((*(pair[k] for pair in apart), *cut) for k in (0, 1))
    left, right = _value(one, unit), _value(two, unit)
    if left == right and _relative(figure):  # numbers, which read the same: with all their digits
        a, b = (np.array(value, dtype=float).ravel() for value in figure[1:])
        left, right = (f"{each[np.argmax(a != b)]:.12g}" for each in (a, b))
    return left, right


def _value(value: object, unit: str) -> str:
    if value is None:
        return NONE
    if isinstance(value, tuple):
        text = " ".join(_number(number, "") for number in value)
        return text if len(text) <= _WIDE else f"{text[: _WIDE - 1].rstrip()}…"
    return _number(value, unit)


def _number(value: object, unit: str) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, int | float):
        return quantity(float(value), unit) if unit else significant(float(value))
    text = str(value)
    return text if len(text) <= _WIDE else f"{text[: _WIDE - 1]}…"


def _amount(result: Explanation, value: float) -> str:
    """A gap of the explanation's quantity, with its unit."""
    return quantity(value, result.unit) if math.isfinite(value) else "no bound"
