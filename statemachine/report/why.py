"""What an explanation says: the cause first, then every difference with its part of the gap."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..compare.labels import lacking
from ..compare.why import ADDS_UP, CauseShare, Explanation, Located
from ..measures import Deviation
from ..measures.text import NONE, capital, percent, quantity, sentence, short_time, significant
from ..page import Block, Items, Page, Section, Table, TableCell, Text, Verdict

_SHOWN = 12  # rows; the rest is folded away
_WIDE = 15  # characters of a value
_SMALL = 0.01  # of the gap: a chaos floor below that is not spoken of
_NO_PART = 1e-3  # of the gap: causes below that are one row
_PROOF = 1e-3  # of the gap: nearer than this until the first touch, the touch parts the sides
_OFF = ("place", "anchor", "com", "axis")
_HEADS = ("what", "left", "right", "explains", "alone", "last")
_MEASURES = {"worst": "at its largest", "end": "in the end", "rms": "as a root mean square"}

# Line one: what a side has nothing of, and what the gap comes from.
MISSING = {
    "actuators": "The {side} has no actuators, the {other} has: --actuators {other} gives it those",
    "floor": "The {side} has no floor, the {other} has: --floor {other} gives it that",
}
ANSWERS = {
    "rounding": "The two sides move alike: {gap} is rounding",
    "alike": "The two sides move alike, although they differ: {gap} is rounding",
    "chaos": "Nothing can be concluded: chaos alone makes {floor}, and the gap is {gap}",
    "cause": "{cause}, {left} on the left and {right} on the right: {part} of the {gap}",
    "bare": "{cause}: {part} of the {gap}",
    "located": "{cause}: {part} of the {gap} goes only where {without} on both sides",
    "unexplained": "The cause was not found: {part} of the {gap} is unexplained",
}
ORIGIN = (
    "{experiment}; left: {left}; right: {right}; {seconds}, {runs} runs in {took}, compared at "
    "{moments} moments"
)
PLAYED = "the models were run again, with the recorded starts and commands"
GAP = (
    "As they come, the {what} is up to {worst} apart, at {at} (root mean square {rms}, in the end "
    "{end})."
)
TOUCH = (
    "Until the first touch, {what} at {time}, the two are {before} apart: what parts them acts "
    "where they touch."
)
THREE = (
    "Explained: it goes where settings are brought to the same. Located: it goes only where "
    "something is left out on both sides, which says where it comes from, and not why. "
    "Unexplained: it stays."
)
PARTS = "{explained} of the gap is explained, {located} is located, {unexplained} is unexplained"
LOCATED = "* Located: {cause} left out on both sides. That is another motion."
STILL = "* With {cause} left out nothing moves any more, so there can be no gap: a weak hint."
CHAOS = (
    "The left is as far from itself, {floor}, when its start and its commands are changed by no "
    "more than is known of them (the chaos floor). Of a gap that is not clearly larger nothing can "
    "be concluded."
)
NOISE = "The chaos floor is {floor}, {part} of the gap: smaller parts say nothing."
NEGLIGIBLE = "What is below {negligible} is taken for rounding."
BETWEEN = "The timesteps have too few moments in common: rows between were interpolated."
METHODS = {
    "nothing": "",
    "one at a time": "They add up, to within {adds_up} of the gap: each takes away as much alone "
    "as after all others, and explains the mean of the two.",
    "all sets": "They interact. Each share is the mean of what a cause takes away over all orders "
    "in which the causes can be brought to the same (Shapley value), over all sets of them.",
    "drawn orders": "They interact. Each share is the mean of what a cause takes away over "
    "{orders} drawn orders in which the causes are brought to the same (Shapley value), with its "
    "standard error.",
}
COLUMNS = "Alone, last: brought to the same first, or after all others."
WAY = "The right is brought to the left: the other way round the parts are those of another motion."
NO_FIGURE = "No figure: it can be brought to the same only together with others."
NEGATIVE = "Below zero: it hides others, so the gap is wider where it is brought to the same."
REDUNDANT = "Either one alone closes the gap: {causes}."
REFUSED = "These differ, too, and cannot be brought to the same:"
IMPOSSIBLE = "{number} of the sets of causes could not be run, such as: {causes}."
HARDLY_MOVE = (
    "In this experiment these joints hardly move, so a difference there cannot show: {joints}. "
    "Another may move them (waves)."
)
CHANGE = "What to change on the right:"
SET = "{place}{cause}: {right} → {left}"
SAME = (
    "All that is compared is the same: files, options, starts. What a user's function reads from "
    "elsewhere is not compared."
)
NEXT = {
    "refused": "What stays may come from what cannot be brought to the same: {causes}. Give both "
    "sides the same there, and compare again.",
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
    origin = ORIGIN.format(
        experiment=result.experiment,
        left=result.one,
        right=result.two,
        seconds=f"{result.seconds:g} s",
        runs=result.runs,
        took=short_time(result.took),
        moments=result.moments,
    )
    only = lacking(result.unmatched, ("the left", "the right"))
    lines = [*map(sentence, (*said, *only, *result.notes)), *proofs(result), result.says]
    title, *further = [*missing(result.missing), answer(result)]
    first: list[Block] = [Text(line) for line in (*map(sentence, further), *lines) if line]
    return Page(title, origin, [*first, *causes(result), *_verdict(result)])


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
    if kind == "located" and place:
        return ANSWERS[kind].format(
            cause=capital(place.name), part=percent(place.share), gap=gap, without=place.without
        )
    if kind == "cause" and first:
        left, right = _values(first)
        told = NONE not in (left, right)
        return ANSWERS["cause" if told else "bare"].format(
            cause=capital(first.name), left=left, right=right, part=percent(first.share), gap=gap
        )
    return ANSWERS["unexplained"].format(part=percent(result.unexplained), gap=gap)


def proofs(result: Explanation) -> tuple[str, ...]:
    """What the run itself shows of the cause: that the sides are together until they touch."""
    touch = result.touch
    if touch is None or not touch.time or touch.before >= _PROOF * result.gap:
        return ()
    time, before = short_time(touch.time), _amount(result, touch.before)
    return (TOUCH.format(what=touch.what, time=time, before=before),)


def causes(result: Explanation) -> list[Block]:
    """How far apart the sides are, and how much of it each difference explains."""
    blocks: list[Block] = [Text(_gap_sentence(result.first, result.quantity))]
    if result.between:
        blocks.append(Text(BETWEEN))
    if result.is_rounding and result.gap <= result.negligible:
        blocks.append(Text(NEGLIGIBLE.format(negligible=_amount(result, result.negligible))))
    elif result.is_rounding:
        blocks.append(Text(CHAOS.format(floor=_amount(result, result.floor))))
    blocks += _table(result)
    if not result.is_rounding and result.floor > _SMALL * result.gap:
        floor, part = _amount(result, result.floor), percent(result.floor / result.gap)
        blocks.append(Text(NOISE.format(floor=floor, part=part)))
    return blocks


def steps(result: Explanation) -> list[Block]:
    """What to change on the right, and where, so that the sides agree."""
    lines = []
    for row in result.shares:
        if (row.share or 0.0) >= _NO_PART and not row.note:
            left, right = _values(row)
            place = f"{row.place.file}, line {row.place.line}: " if row.place else ""
            lines.append(SET.format(place=place, cause=row.name, right=right, left=left))
    return [Text(CHANGE), Items(lines)] if lines and not result.is_rounding else []


def parts(result: Explanation) -> str:
    """The three parts of a gap, in a sentence without its end."""
    return PARTS.format(
        explained=percent(result.explained),
        located=percent(result.located),
        unexplained=percent(result.unexplained),
    )


def _verdict(result: Explanation) -> list[Block]:
    if result.is_rounding:
        refused = any(row.note for row in result.shares)
        return [Verdict(answer(result), not refused)]
    blocks = steps(result)
    if not result.is_explained:
        blocks.append(Text(_next(result)))
    return [*blocks, Text(THREE, small=True), Verdict(parts(result), result.is_explained)]


def _next(result: Explanation) -> str:
    """What to look at where something stays."""
    refused = [row.name for row in result.shares if row.note]
    engines = {side.backend for side in result.provenance}
    kind = "refused" if refused else "engines" if len(engines) > 1 else "files"
    return NEXT[kind].format(causes=", ".join(refused[:4]))


def _gap_sentence(gaps: Mapping[str, Deviation], of: str) -> str:
    """How far apart two runs are in one of some quantities; the others follow."""
    gap = gaps[of]
    worst, rms, end = (quantity(size, gap.unit) for size in (gap.worst, gap.rms, gap.end))
    singular = {"joints": "worst joint", "slides": "worst slide", "ball joints": "worst ball joint"}
    text = GAP.format(
        what=singular.get(of, of), worst=worst, at=short_time(gap.at), rms=rms, end=end
    )
    others = [f"{name} {quantity(g.worst, g.unit)}" for name, g in gaps.items() if name != of]
    return f"{text} Elsewhere (--quantity): {', '.join(others)}." if others else text


def _table(result: Explanation) -> list[Block]:
    """The differences, the largest share first; those without an effect folded away."""
    able = [row for row in result.shares if not row.note]
    refused = [row for row in result.shares if row.note]
    if not result.shares and not result.found_in:
        return [Text(SAME)]
    rows = [_row(result, row) for row in able if result.is_rounding or _counts(row)]
    rows += [_located_row(part) for part in result.found_in]
    small = [row for row in able if not result.is_rounding and not _counts(row)]
    if small:
        share = sum(row.share or 0.0 for row in small)
        name = capital(small[0].name) if len(small) == 1 else f"{len(small)} more, none above 0.1 %"
        values = _values(small[0]) if len(small) == 1 else (NONE, NONE)
        rows.append((name, *values, TableCell(percent(share), share=share), NONE, NONE))
    blocks: list[Block] = []
    if rows:
        title = f"What differs, and its part of the {_amount(result, result.gap)} of the "
        title += f"{result.quantity} ({_MEASURES[result.measure]})"
        title = "What differs" if result.is_rounding else title
        words = frozenset({0, 1, 2})
        most = _SHOWN if len(rows) > _SHOWN + 1 else len(rows)  # no table of one row
        blocks.append(Table(_HEADS, rows[:most], title, words=words))
        if rows[most:]:
            heading = f"{len(rows) - most} more differences, with smaller parts"
            more = Table(_HEADS, rows[most:], heading, words=words)
            blocks.append(Section("", heading, [more], folded=True))
    blocks += [
        Text((STILL if part.is_still else LOCATED).format(cause=part.name), small=True)
        for part in result.found_in
    ]
    if result.still:
        blocks.append(Text(HARDLY_MOVE.format(joints=", ".join(result.still))))
    return [*blocks, *_legend(result, able), *_not_brought(result, refused)]


def _counts(row: CauseShare) -> bool:
    """Whether a cause has a row of its own."""
    return max(abs(part or 0.0) for part in (row.share, row.alone, row.last)) >= _NO_PART


def _legend(result: Explanation, able: Sequence[CauseShare]) -> list[Block]:
    """How the shares were computed, and what the columns are."""
    if result.method == "nothing":
        return []
    method = METHODS[result.method].format(orders=result.orders, adds_up=f"{100 * ADDS_UP:g} %")
    lines = [method, COLUMNS, WAY] if len(able) > 1 else [COLUMNS]
    if any((row.share or 0.0) < -_NO_PART for row in able):
        lines.append(NEGATIVE)
    if any(None in (row.alone, row.last) for row in able):
        lines.append(NO_FIGURE)
    if result.redundant:
        lines.append(REDUNDANT.format(causes=", ".join(result.redundant)))
    return [Text(" ".join(lines))]


def _not_brought(result: Explanation, refused: Sequence[CauseShare]) -> list[Block]:
    """What could not be brought to the same, and what could not be run."""
    blocks: list[Block] = []
    if refused:
        lines = [f"{capital(row.name)}: {row.note}." for row in refused]
        blocks += [Text(REFUSED), Items(lines)]
    if result.impossible:
        number, first = len(result.impossible), ", ".join(result.impossible[0])
        blocks.append(Text(IMPOSSIBLE.format(number=number, causes=first)))
    return blocks


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


def _located_row(part: Located) -> tuple[str | TableCell, ...]:
    """What a feature that was left out takes away; of an integrator, which it is on one side."""
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
    if left == right and isinstance(one, float) and isinstance(two, float):
        return f"{one:.12g}", f"{two:.12g}"
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


__all__ = ["answer", "causes", "page", "parts", "proofs", "steps"]
