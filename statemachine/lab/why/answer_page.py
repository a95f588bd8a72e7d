"""What an explanation says first: what the gap comes from, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...measures.text import NONE, capital, percent, quantity, short_time
from ..compare.stillness import nothing_moved
from .values_page import heading_of, phrase_of, sides_of

if TYPE_CHECKING:
    from . import Explanation, Share

_INTERACTS = 0.5  # of the gap, between alone and last: it is said with the cause
_PROOF = 1e-3  # of the gap: nearer than this until the first touch, the touch parts the sides

# Line one: what a side has nothing of, and what the gap comes from.
MISSING = {
    "actuators": "The {side} has no actuators, the {other} has: --actuators {other} gives it those",
    "floor": "The {side} has no floor, the {other} has: --floor {other} gives it that",
}
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
INTERACT = "{answer}, but {alone} alone and {last} last: it acts together with others"
HIDDEN = (
    "With the left's values on the right the gap is {brought}, not {gap}: the differences hide a "
    "part of it. Of the {brought}, {located} is localised and {unexplained} unexplained"
)
PARTS = "{explained} of the gap is explained, {located} is localised, {unexplained} is unexplained"


def missing(parts: Sequence[tuple[str, str]]) -> list[str]:
    """Say what one side has nothing of, and how to give it the other's: lines without their end."""
    other = {"left": "right", "right": "left"}
    return [MISSING[part].format(side=side, other=other[side]) for side, part in parts]


def answer(result: Explanation) -> str:
    """Say what the gap comes from, in a sentence without its end."""
    gap = amount(result, result.gap)
    match result.verdict.answer:
        case "nothing moved":
            return nothing_moved(result.motion, result.instead)
        case "rounding" | "alike" as kind:
            size = f"{gap} is rounding" if result.gap else "the gap is 0"
            return ANSWERS[kind].format(gap=size)
        case "within" | "inside" | "cannot be told" as kind:
            return ANSWERS[kind].format(
                gap=gap,
                tolerance=amount(result, result.tolerance),
                floor=amount(result, result.floor),
                draws=result.draws,
            )
        case "hidden":
            brought = amount(result, result.brought or 0.0)
            return ANSWERS["hidden"].format(gap=gap, brought=brought)
        case "masked":
            return ANSWERS["masked"].format(gap=gap)
        case "together":
            return ANSWERS["together"].format(gap=gap, part=percent(result.explained))
        case "unexplained":
            return ANSWERS["unexplained"].format(gap=gap, part=percent(result.unexplained))
        case "cause":
            return _by_cause(result)
    return _by_place(result)


def _by_cause(result: Explanation) -> str:
    """Say which cause takes away most, and what it does together with others."""
    cause = next(row for row in result.shares if row.share)
    left, right = sides_of(cause)
    phrase = phrase_of(cause)
    kind = "bare" if phrase or NONE in (left, right) else "cause"
    said = ANSWERS[kind].format(
        cause=capital(phrase if phrase else heading_of(cause)),
        left=left,
        right=right,
        part=percent(abs(cause.share or 0.0)),
        gap=amount(result, result.gap),
    )
    alone, last = cause.alone, cause.last
    if alone is not None and last is not None and abs(alone - last) > _INTERACTS:
        return INTERACT.format(answer=said, alone=percent(alone), last=percent(last))
    return said


def _by_place(result: Explanation) -> str:
    """Say without what most of the gap goes."""
    kind = str(result.verdict.answer)
    place = max(result.found_in, key=lambda place: place.share)
    if kind == "one engine" and place.values:
        kind = "one engine, integrator"
    names = [row.name for row in refused(result)]
    left, right = _switch(result, place.name)
    cause = f"the {place.name}" if place.values else place.name
    return ANSWERS[kind].format(
        cause=cause,
        left=left,
        right=right,
        part=percent(place.share),
        without=place.without,
        gap=amount(result, result.gap),
        refused=", ".join(names[:2]),
    )


def _switch(result: Explanation, name: str) -> tuple[str, str]:
    """Return a feature's values where it is on on one side alone.

    The gap closes where both sides are without it. Of other features nothing is said.
    """
    for row in result.shares:
        if row.name == name:
            return sides_of(row)
    return NONE, NONE


def refused(result: Explanation) -> list[Share]:
    """Return the causes without a part: they cannot be equalized, or could not be run."""
    return [row for row in result.shares if row.note]


def proofs(result: Explanation) -> tuple[str, ...]:
    """Say what the run itself shows of the cause: that the sides are together until they touch."""
    touch = result.touch
    if touch is None or not touch.time or touch.before >= _PROOF * result.gap:
        return ()
    said = TOUCH.format(
        what=touch.what,
        time=short_time(touch.time),
        before=amount(result, touch.before),
        quantity=result.quantity,
    )
    return (said,)


def parts(result: Explanation) -> str:
    """Say the three parts of a gap, in a sentence without its end."""
    if result.verdict.answer == "hidden" and result.brought:
        wider = result.gap / result.brought  # parts of the wider gap
        return HIDDEN.format(
            gap=amount(result, result.gap),
            brought=amount(result, result.brought),
            located=percent(wider * result.located),
            unexplained=percent(wider * result.unexplained),
        )
    return PARTS.format(
        explained=percent(result.explained),
        located=percent(result.located),
        unexplained=percent(result.unexplained),
    )


def amount(result: Explanation, value: float) -> str:
    """Return a gap of the explanation's quantity, with its unit."""
    return quantity(value, result.unit) if math.isfinite(value) else "no bound"
