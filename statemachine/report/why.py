"""What an explanation says: the cause first, then every difference with its part of the gap."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..compare.labels import lacking
from ..compare.perturbed import CLEAR
from ..engines.records import TURNED
from ..installed import DEFAULT
from ..measures.text import (
    NONE,
    capital,
    few,
    listed,
    percent,
    quantity,
    reading,
    sentence,
    short_time,
    significant,
)
from ..page import Block, Figures, Items, Page, Section, Table, TableCell, Text
from . import template
from .template import if_true

if TYPE_CHECKING:
    from ..compare.why import Explanation

_SHOWN = 12  # rows; the rest is folded away
_WIDE = 24  # characters of a value
_SMALL = 0.01  # of the gap: a chaos floor below that is not spoken of
_NO_PART = 1e-3  # of the gap: causes below that are one row
_INTERACTS = 0.5  # of the gap, between alone and last: it is said with the cause
_PROOF = 1e-3  # of the gap: nearer than this until the first touch, the touch parts the sides
_OFF = ("place", "anchor", "com", "axis")
_HEADS = ("what", "left", "right", "part", "alone", "last")
_SINGULAR = {"joints": "worst joint", "slides": "worst slide", "ball joints": "worst ball joint"}
_MEASURES = {
    "worst": "each run at its largest",
    "end": "in the end",
    "rms": "as a root mean square",
}

# Line one: what a side has nothing of, and what the gap comes from.
MISSING = {
    "actuators": "The {side} has no actuators, the {other} has: --actuators {other} gives it those",
    "floor": "The {side} has no floor, the {other} has: --floor {other} gives it that",
}
ADD = "add what the left has"
PLAYED = "the models were run again, with the recorded starts and commands"
ANSWERS = {
    "rounding": "The two sides move alike: {gap}",
    "alike": "The two sides move alike, although they differ: {gap}",
    "within": "The gap of {gap} is within its tolerance of {tolerance}, and may be chance: the "
    "chaos floor is {floor}, from {draws} perturbed runs of each side",
    "inside": "Nothing can be concluded: the gap is {gap}, and the chaos floor {floor}, from "
    "{draws} perturbed runs of each side",
    "cannot be told": "Whether the gap of {gap} is more than chance cannot be told: the chaos "
    "floor is {floor}, from {draws} perturbed runs of each side",
    "cause": "{cause}, {left} on the left and {right} on the right: {part} of the {gap}",
    "bare": "{cause}: {part} of the {gap}",
    "hidden": "The differences do not cause the {gap}: without them it is {brought}",
    "masked": "No single difference causes the {gap}: the differences act together",
    "together": "No single difference causes the {gap}: all of them together explain {part}",
    "located": (
        "{part} of the {gap} comes from {cause}, which no setting that both read makes the same"
    ),
    "one engine": (
        "The cause was not found: {part} of the {gap} goes without {cause} on both sides, but both "
        "compute that in the same way, so it is where the gap shows and not what causes it"
    ),
    "one engine, integrator": (
        "The cause was not found: {part} of the {gap} goes when both sides run with {without}, but "
        "both integrate in the same way, so it is where the gap shows and not what causes it"
    ),
    "refused": (
        "{part} of the {gap} goes without {cause} on both sides; it may come from {refused}, which "
        "cannot be made the same"
    ),
    "still": "{part} of the {gap} goes without {cause}, but so does the motion: a weak hint",
    "switched": "{part} of the {gap} comes from {cause} (left: {left}, right: {right})",
    "unexplained": "The cause was not found: {part} of the {gap} is unexplained",
}
TOUCH = "Until the first touch, {what} at {time}, the gap of the {quantity} is {before} at most."
TITLE = "What differs, and its part of the {gap} of the {quantity} ({measure})"
INTERACT = "{answer}, but {alone} alone and {last} last: it acts together with others"
HIDDEN = (
    "With the left's values on the right the gap is {brought}, not {gap}: the differences hide a "
    "part of it. Of the {brought}, {located} is localised and {unexplained} unexplained"
)
PARTS = "{explained} of the gap is explained, {located} is localised, {unexplained} is unexplained"


def page(result: Explanation, said: Sequence[str] = ()) -> Page:
    """What the gap comes from, what differs, what each difference explains, and what stays.

    Args:
        result: The explanation.
        said: Lines to say before anything else.
    """
    from ..compare.why import UNEXPLAINED

    only = lacking(result.unmatched, ("the left", "the right"))
    title, *further = [*missing(result.missing), answer(result)]
    lines = [*map(sentence, (*further, *said, *only, *result.notes)), *proofs(result), result.says]
    engines = {side.backend for side in result.provenance}
    verdict = result.verdict
    stays = verdict.divides and not verdict.holds
    hint = result.located > UNEXPLAINED >= result.unexplained
    located = {place.name for place in result.found_in}
    between = hint and verdict.divides and len(engines) > 1
    refused = [row.name for row in result.shares if row.note]
    files = {side.model_sha256 for side in result.provenance}
    return template.page(
        "why",
        title=title,
        experiment=result.experiment,
        left=result.labels[0],
        right=result.labels[1],
        seconds=result.seconds,
        runs=result.runs,
        took=short_time(result.took),
        moments=result.moments,
        first=[Text(line) for line in lines if line],
        causes=causes(result),
        changes=steps(result),
        refused=", ".join(refused[:4]) if stays and refused else None,
        engines=if_true(stays and not (refused or hint) and len(engines) > 1),
        between=if_true(between),
        soft=if_true(between and DEFAULT in engines and "contact" in located),
        files=if_true(stays and not refused and len(engines) == 1),
        both=if_true(min(len(engines), len(files)) > 1),
        parts=three_parts(result)[1:],
        holds=verdict.holds,
        answer=answer(result),
        three=f" {parts(result)}." if verdict.divides else "",
    )


def missing(parts: Sequence[tuple[str, str]]) -> list[str]:
    """What one side has nothing of, and how to give it the other's: lines without their end."""
    other = {"left": "right", "right": "left"}
    return [MISSING[part].format(side=side, other=other[side]) for side, part in parts]


def answer(result: Explanation) -> str:
    """What the gap comes from, in a sentence without its end."""
    verdict, kind = result.verdict, str(result.verdict.answer)
    gap = _amount(result, result.gap)
    if kind in ("rounding", "alike"):
        gap = f"{gap} is rounding" if result.gap else "the gap is 0"
    cause, left, right, without, part = "", NONE, NONE, "", percent(result.unexplained)
    refused = [row.name for row in result.shares if row.note]
    causes = [row for row in result.shares if row.share]
    places = sorted(result.found_in, key=lambda place: -place.share)
    if kind in ("located", "switched", "one engine", "refused", "still"):
        place = places[0]
        part, without = percent(place.share), place.without
        cause = f"the {place.name}" if place.values else place.name
        if kind == "one engine" and place.values:
            kind = "one engine, integrator"
        if kind == "switched":
            # The feature is on on one side alone, and the gap closes where both are without it.
            left, right = next(_values(row) for row in result.shares if row.name == place.name)
    elif kind == "together":
        part = percent(result.explained)
    elif kind == "cause":
        part = percent(abs(causes[0].share))
        cause, (left, right) = capital(causes[0].name), _values(causes[0])
        kind = "bare" if NONE in (left, right) else "cause"
    said = ANSWERS[kind].format(
        cause=cause,
        left=left,
        right=right,
        part=part,
        without=without,
        gap=gap,
        brought=_amount(result, result.brought or 0.0),
        refused=", ".join(refused[:2]),
        tolerance=_amount(result, result.tolerance),
        floor=_amount(result, result.floor),
        draws=result.draws,
    )
    if verdict.answer == "cause":
        alone, last = causes[0].alone, causes[0].last
        if None not in (alone, last) and abs(alone - last) > _INTERACTS:
            return INTERACT.format(answer=said, alone=percent(alone), last=percent(last))
    return said


def proofs(result: Explanation) -> tuple[str, ...]:
    """What the run itself shows of the cause: that the sides are together until they touch."""
    touch = result.touch
    if touch is None or not touch.time or touch.before >= _PROOF * result.gap:
        return ()
    before = _amount(result, touch.before)
    return (
        TOUCH.format(
            what=touch.what, time=short_time(touch.time), before=before, quantity=result.quantity
        ),
    )


def causes(result: Explanation) -> list[Block]:
    """How far apart the sides are, and how much of it each difference explains."""
    from ..compare.why import ADDS_UP

    able = [row for row in result.shares if not row.note]
    refused = [f"{capital(row.name)}: {row.note}." for row in result.shares if row.note]
    small, floor = result.gap <= result.negligible, _amount(result, result.floor)
    divides = result.verdict.divides
    noisy = divides and result.floor > _SMALL * result.gap
    hardly = _hardly(result, able)
    gap, method = result.first[result.quantity], result.method
    others = [
        f"{name.replace(',', '')} {quantity(other.worst, other.unit)}"
        for name, other in result.first.items()
        if name != result.quantity
    ]
    return template.blocks(
        "why_causes",
        what=_SINGULAR.get(result.quantity, result.quantity),
        at=short_time(gap.at),
        worst=quantity(gap.worst, gap.unit),
        rms=quantity(gap.rms, gap.unit),
        end=quantity(gap.end, gap.unit),
        explained=result.quantity,
        elsewhere="; ".join(others) or None,
        between=if_true(result.between),
        negligible=_amount(result, result.negligible) if small else None,
        chaos=floor if not (divides or small) else None,
        draws=result.draws,
        clear=f"{CLEAR:g}",
        same=if_true(not (result.shares or result.found_in or result.unread)),
        unread=few(list(result.unread), 6) or None,
        table=_table(result, able, hardly),
        more=few([row.name for row in hardly], 6) or None,
        located=[
            block
            for at, place in enumerate(result.found_in)  # left out on both sides, or an integrator
            for block in template.blocks(
                "why_located",
                cause=None if place.values or place.is_still else place.name,
                idle=place.name if place.is_still and not place.values else None,
                still=result.quantity,
                integrator=None if at else place.values and place.without,
                before=listed([row.name for row in result.found_in[:at]]) or None,
                then=place.values and place.without,
                alone=percent(place.alone),
            )
        ],
        hardly_move=", ".join(result.still) or None,
        add_up=f"{100 * ADDS_UP:g} %" if method == "one at a time" else None,
        all_sets=if_true(method == "all sets"),
        orders=result.orders if method == "drawn orders" else None,
        shares=if_true(method != "nothing"),
        several=if_true(method != "nothing" and len(able) > 1),
        no_figure=if_true(
            method != "nothing" and any(None in (row.alone, row.last) for row in able)
        ),
        beyond=if_true(any(abs(row.share or 0.0) > 1.0 + _NO_PART for row in able)),
        refused_too=if_true(refused),
        refused=Items(refused),
        impossible=len(result.impossible) or None,
        such_as=", ".join(next(iter(result.impossible), ())),
        noise=floor if noisy else None,
        quiet=floor if result.floor and divides and not noisy else None,
        noise_part=percent(result.floor / result.gap) if noisy else None,
    )


def steps(result: Explanation) -> list[Block]:
    """What to change, where, and what is left of the gap with everything changed."""
    if not result.verdict.divides:
        return []
    lines = []
    able = [row for row in result.shares if not (row.note or row.chosen)]
    for row in _at_least(_NO_PART, able):
        place = f"{row.place.file}, line {row.place.line}: " if row.place else ""
        singles = [
            (f", {value[0]}", Figures(**{**vars(row), "values": (value,), "units": (unit,)}))
            for value, unit in zip(row.values, row.units, strict=True)
        ]
        for figure, one in singles if _is_several(row) else [(_figure(row), row)]:
            left, right = _values(one)
            change = ADD if (left, right) == ("there", NONE) else "{right} → {left}"
            lines.append(f"{place}{row.name}{figure}: {change.format(left=left, right=right)}")
    side, integrator = next((row.chosen for row in result.shares if row.chosen), (None, None))
    own = lines and any(row.kind == "engine" for row in result.shares)
    sides = zip(result.labels, result.provenance, strict=True)
    engines = [
        made.backend
        for label, made in sides
        if (":engine" in label or "engine defaults" in label) and made.backend != DEFAULT
    ]
    return template.blocks(
        "why_changes",
        any=if_true(lines),
        engine=engines[0] if own and engines else None,
        changes=Items(lines),
        side=side,
        integrator=integrator,
        left=_amount(result, result.brought) if lines and result.brought is not None else None,
        quantity=result.quantity,
        redundant=", ".join(result.redundant) or None,
        others=if_true(0 < len(lines) < len(able) and len(result.first) > 1),
    )


def parts(result: Explanation) -> str:
    """The three parts of a gap, in a sentence without its end."""
    text, scale = PARTS, 1.0
    if result.verdict.answer == "hidden" and result.brought:
        text, scale = HIDDEN, result.gap / result.brought  # parts of the wider gap
    return text.format(
        gap=_amount(result, result.gap),
        brought=_amount(result, result.brought or 0.0),
        explained=percent(result.explained),
        located=percent(scale * result.located),
        unexplained=percent(scale * result.unexplained),
    )


def three_parts(result: Explanation) -> list[Block]:
    """The three parts of the gap, and what they mean; nothing where there is none to explain."""
    if not result.verdict.divides:
        return []
    clear = result.verdict.holds and not result.located
    return template.blocks("why_parts", parts=parts(result))[: 1 if clear else None]


def _table(result: Explanation, able: Sequence[Figures], small: Sequence[Figures]) -> list[Block]:
    """The differences, the largest share first; the small ones, without an effect, are one row."""
    rows = [_row(result, row) for row in able if row not in small]
    for place in result.found_in:  # what a feature takes away when it is left out on both sides
        mark = "†" if place.values else "*"
        explains = TableCell(f"{percent(place.share)}{mark}", share=place.share)
        rows.append((capital(place.name), *(place.values or (NONE, NONE)), explains, NONE, NONE))
    if small:
        share = sum(row.share or 0.0 for row in small)
        explains = TableCell(percent(share), share=share)
        rows.append((f"{len(small)} more, none above 0.1 %", NONE, NONE, explains, NONE, NONE))
    title = (
        "What differs"
        if not result.verdict.divides
        else TITLE.format(
            gap=_amount(result, result.gap),
            quantity=result.quantity,
            measure=_MEASURES[result.measure],
        )
    )
    if all(row[4:] == (NONE, NONE) for row in rows):  # nothing was brought over by itself
        rows = [row[:4] for row in rows]
    heads, words = _HEADS[: len(rows[0])] if rows else (), frozenset({0, 1, 2})
    most = _SHOWN if len(rows) > _SHOWN + 1 else len(rows)  # no table of one row
    heading = f"{len(rows) - most} more differences, with smaller parts"
    more = Table(heads, rows[most:], heading, words=words)
    folded = [Section("", heading, [more], folded=True)] if more.rows else []
    return [Table(heads, rows[:most], title, words=words), *folded] if rows else []


def _hardly(result: Explanation, able: Sequence[Figures]) -> list[Figures]:
    """The differences without an effect, if there are several."""
    large = _at_least(_NO_PART, able) if result.verdict.divides else able
    return [row for row in able if row not in large] if len(able) > len(large) + 1 else []


def _at_least(part: float, rows: Sequence[Figures]) -> list[Figures]:
    """The causes that take away so much of the gap: in the mean, alone, or last."""
    return [r for r in rows if max(abs(p or 0.0) for p in (r.share, r.alone, r.last)) >= part]


def _is_several(row: Figures) -> bool:
    """Whether its figures differ; a servo's kp stands in two, once with another sign."""
    return len({repr(value[1:]).replace("-", "") for value in row.values}) > 1


def _figure(row: Figures) -> str:
    """Which figure of a cause it is, where its name does not say so."""
    figure = row.values[0][0] if row.values else ""
    if _is_several(row):
        return f" ({len(row.values)} figures)"
    told = "[" in figure or figure == TURNED or row.kind == "option"
    shown = told and figure not in row.name
    return f" ({figure})" if shown else ""


def _row(result: Explanation, row: Figures) -> tuple[str, ...]:
    what = capital(row.name) + _figure(row)
    explains, alone, last = percent(row.share), percent(row.alone), percent(row.last)
    if row.error and math.isfinite(row.error):
        explains += f" ± {percent(row.error)}"
    noise = result.floor / result.gap if result.verdict.divides else 0.0
    if abs(row.share or 0.0) < noise and noise > _SMALL:  # no part is claimed inside the floor
        explains, alone, last = f"< {percent(noise)}", NONE, NONE
    return what, *_values(row), TableCell(explains, share=row.share), alone, last


def _values(row: Figures) -> tuple[str, str]:
    """The left's and the right's value of the figure that differs most.

    Of a place, or a direction, how far the right one is off.
    """
    if not row.values:
        return NONE, NONE
    figures = list(zip(row.values, row.units, strict=True))
    figure, unit = max(figures, key=lambda pair: _relative(pair[0]))
    name, left, right = figure
    a, b = (np.array(value if isinstance(value, tuple) else (), object) for value in (left, right))
    if name in _OFF and len(a) and len(b):
        a, b = a.astype(float), b.astype(float)
        if unit:
            return "here", f"{quantity(float(np.linalg.norm(a - b)), unit)} off"
        angle = float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
        return "this way", f"{quantity(angle, 'rad')} off"
    texts = [_value(value, unit) for value in (left, right)]
    if len(a) and len(a) == len(b) and max(map(len, texts)) > _WIDE:
        differ = a != b  # a cut would hide those
        texts = [_value(tuple(side[differ]), unit) for side in (a, b)]
        texts = texts if differ.all() else [f"{text} …" for text in texts]
    texts = [text if len(text) <= _WIDE else f"{text[: _WIDE - 1]}…" for text in texts]
    if texts[0] == texts[1] and _relative(figure):  # numbers, which read the same: all digits
        a, b = (np.array(value, dtype=float).ravel() for value in (left, right))
        texts = [f"{side[np.argmax(a != b)]:.12g}" for side in (a, b)]
    return texts[0], texts[1]


def _relative(figure: tuple[str, object, object]) -> float:
    """How far two values are apart, as a part of the larger; 0 where that is not a number."""
    try:
        left, right = (np.array(value, dtype=float) for value in figure[1:])
        size = max(float(np.linalg.norm(left)), float(np.linalg.norm(right)))
        return float(np.linalg.norm(left - right)) / size if size else 0.0
    except (TypeError, ValueError):
        return 0.0


def _value(value: object, unit: str) -> str:
    match value:
        case None:
            return NONE
        case tuple():
            factor, shown = reading(unit)
            return " ".join(_value(_scaled(entry, factor), "") for entry in value) + shown
        case bool():
            return "on" if value else "off"
        case int() | float():
            return quantity(float(value), unit) if unit else significant(float(value))
    return str(value)


def _scaled(value: object, factor: float) -> object:
    """Return a number times a factor, and anything else as it is."""
    if isinstance(value, bool) or not isinstance(value, int | float) or factor == 1:
        return value
    return value * factor


def _amount(result: Explanation, value: float) -> str:
    """A gap of the explanation's quantity, with its unit."""
    return quantity(value, result.unit) if math.isfinite(value) else "no bound"
