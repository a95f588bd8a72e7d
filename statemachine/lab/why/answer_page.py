"""What an explanation says first: what the gap comes from, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from ...engines.description.lines import SourceLine
from ...measures.text import NO_NUMBER, quantity
from ...show.blocks import Text
from ...show.markdown import plain_text
from ...show.templates import PageContent, render_blocks
from ..compare.stillness import nothing_moved
from .explanation import Explanation, Share
from .gap import FirstTouch
from .values_page import CauseWording, heading_of, sides_of, texts_of, wording_of

if TYPE_CHECKING:
    from .locate import Localisation

_INTERACTS = 0.25  # of the gap, between alone and last: it is said with the cause
_PROOF = 1e-3  # of the gap: nearer than this until the first touch, the touch parts the sides

PlaceWording = Literal["switched", "still", "refused", "one engine", "one integrator", "located"]


@dataclass(frozen=True)
class CauseSentence(PageContent):
    """What a sentence says of the cause that takes away most.

    Attributes:
        wording: Which sentence it is.
        heading: Name of the cause, and of its quantity where that needs one.
        element: Name of the element that the cause is of.
        left, right: The values of both sides, with their units.
        place: The line of the right's file that says it; None where that is not known.
        option: The option of the right that says it, as it is typed; "" where none does.
        part: What it takes away, as a part of the gap.
        gap: The gap, with its unit.
        alone, last: What it takes away as the only one, and after all others; None where that
            could not be run.
    """

    template = "why_cause.md.j2"
    wording: CauseWording
    heading: str
    element: str
    left: str
    right: str
    place: SourceLine | None
    option: str
    part: float
    gap: str
    alone: float | None
    last: float | None

    @property
    def interacts(self) -> bool:
        """Tell whether it takes away much more, or much less, alone than last."""
        if self.alone is None or self.last is None:
            return False
        return abs(self.alone - self.last) > _INTERACTS


@dataclass(frozen=True)
class PlaceSentence(PageContent):
    """What a sentence says of what was left out on both sides.

    Attributes:
        wording: Which sentence it is.
        cause: What was left out.
        without: What a run without it is.
        left, right: Its values, where one side has it and the other does not.
        part: What goes with it, as a part of the gap.
        gap: The gap, with its unit.
        refused: Names of the first differences that cannot be equalized.
    """

    template = "why_place.md.j2"
    wording: PlaceWording
    cause: str
    without: str
    left: str
    right: str
    part: float
    gap: str
    refused: tuple[str, ...]


@dataclass(frozen=True)
class EffectPhrase(PageContent):
    """What a cause takes away of the gap, by the figures that are known.

    Attributes:
        cause: The cause, whose range is known.
    """

    template = "why_effect.md.j2"
    cause: Share

    @property
    def is_alone(self) -> bool:
        """Tell whether it is known what the cause takes away as the only one."""
        return self.cause.alone is not None

    @property
    def is_last(self) -> bool:
        """Tell whether it is known what the cause takes away after all others."""
        return self.cause.last is not None

    @property
    def is_both(self) -> bool:
        """Tell whether both are known."""
        return self.is_alone and self.is_last

    @property
    def least(self) -> float:
        """Return the least part that it was seen to take away."""
        return 0.0 if self.cause.range is None else self.cause.range[0]


@dataclass(frozen=True)
class RankedPhrase(PageContent):
    """Which cause leads once each was tried, before shares are known.

    Attributes:
        unmeasured: The causes of whose part nothing is known yet: one may lead.
        leading_words: What takes away most of all that is known; "" where nothing is.
    """

    template = "why_ranked.md.j2"
    unmeasured: tuple[str, ...]
    leading_words: str


@dataclass(frozen=True)
class AnswerSentence(PageContent):
    """What the sentence of the verdict may say.

    Attributes:
        result: The explanation.
        nothing_moved: What is said where nothing moves; "" where something does.
        gap, floor, equalized_gap: Of the explanation, with their unit.
        cause_words: The sentence on the largest cause; "" where the verdict is another.
        place_words: That on what was left out; "" where the verdict is another.
        leading_words: What takes away most of all that is known, where the search was ended before
            shares were; "" where nothing is known of any cause.
        ranked_words: The same, once each cause was tried: it leads only if something is known of
            each.
    """

    template = "why_answer.md.j2"
    result: Explanation
    nothing_moved: str
    gap: str
    floor: str
    equalized_gap: str
    cause_words: str
    place_words: str
    leading_words: str
    ranked_words: str

    @property
    def first_failure(self) -> str:
        """Return why the first cause without a share could not be equalized; "" of none."""
        for row in self.result.shares:
            if row.failure is not None:
                return row.failure.failure.reason
        return ""

    @property
    def has_gap(self) -> bool:
        """Tell whether there is any gap."""
        return self.result.gap > 0


@dataclass(frozen=True)
class MissingSentence(PageContent):
    """What one side has nothing of.

    Attributes:
        part: "actuators" or "floor".
        side, other: "left" and "right": who has none, and who has.
    """

    template = "why_missing.md.j2"
    part: str
    side: str
    other: str


@dataclass(frozen=True)
class TouchSentence(PageContent):
    """What the run itself shows: that the sides are together until they touch.

    Attributes:
        touch: The first contact.
        quantity: What the gap is measured in.
        unit: Of the quantity.
    """

    template = "why_touch.md.j2"
    touch: FirstTouch
    quantity: str
    unit: str


@dataclass(frozen=True)
class PartsSentence(PageContent):
    """The parts of a gap.

    Attributes:
        is_wider: Whether the gap is wider with all causes equalized: of that one are the parts.
        gap: As the sides come, in `unit`.
        equalized_gap: With all causes equalized, in `unit`.
        unit: Of the quantity.
        explained, located, unexplained: Parts of the gap.
    """

    template = "why_parts.md.j2"
    is_wider: bool
    gap: float
    equalized_gap: float
    unit: str
    explained: float
    located: float
    unexplained: float


def sentence_of(content: PageContent) -> str:
    """Return the one paragraph of a content, as plain text."""
    (block,) = render_blocks(content)
    assert isinstance(block, Text)
    return plain_text(block.text)


def missing(parts: Sequence[tuple[str, str]]) -> list[str]:
    """Say what one side has nothing of, and how to give it the other's: lines without their end."""
    other = {"left": "right", "right": "left"}
    return [sentence_of(MissingSentence(part, side, other[side])) for side, part in parts]


def answer(result: Explanation) -> str:
    """Say what the gap comes from, in a sentence without its end."""
    cause, place, still = "", "", ""
    equalized_gap = amount(result, result.equalized_gap or 0.0)
    match result.verdict.answer:
        case "nothing moved":
            still = nothing_moved(result.motion, result.instead)
        case "cause":
            cause = sentence_of(_of_cause(result))
        case "located" | "switched" | "one engine" | "refused" | "still":
            place = sentence_of(_of_place(result))
        case _:
            pass
    return sentence_of(
        AnswerSentence(
            result=result,
            nothing_moved=still,
            gap=amount(result, result.gap),
            floor=amount(result, result.floor),
            equalized_gap=equalized_gap,
            cause_words=cause,
            place_words=place,
            leading_words=_leading(result),
            ranked_words=_ranked(result),
        )
    )


def _leading(result: Explanation) -> str:
    """Return what takes away most by the figures that are known; "" where there is none."""
    leading = result.leading()
    return "" if leading is None else sentence_of(EffectPhrase(leading))


def _ranked(result: Explanation) -> str:
    """Return which cause leads, if any does; "" where there is no cause."""
    names, leading = unmeasured(result), _leading(result)
    return sentence_of(RankedPhrase(names, leading)) if names or leading else ""


def unmeasured(result: Explanation) -> tuple[str, ...]:
    """Return the names of the causes of whose part nothing is known yet: one may lead."""
    return tuple(row.name for row in result.shares if row.range is None and not row.note)


def _of_cause(result: Explanation) -> CauseSentence:
    """Return what is said of the cause that takes away most."""
    cause = next(row for row in result.shares if row.share)
    wording = wording_of(cause)
    left, right = sides_of(cause)
    if wording in ("filter on the left", "filter on the right"):
        times = next(value for value in cause.values if value.quantity == "timeconst")
        left, right = texts_of(times)
    element = cause.name.rpartition(" of ")[2]
    part = abs(cause.share or 0.0)
    return CauseSentence(
        wording=wording,
        heading=heading_of(cause),
        element=element,
        left=left,
        right=right,
        place=cause.place,
        option=cause.option,
        part=part,
        gap=amount(result, result.gap),
        alone=cause.alone,
        last=cause.last,
    )


def _of_place(result: Explanation) -> PlaceSentence:
    """Return what is said of what takes away most when it is left out."""
    place = max(result.found_in, key=lambda place: place.share)
    left, right = _switch(result, place.name)
    names = tuple(row.name for row in refused(result))
    cause = f"the {place.name}" if place.values else place.name
    return PlaceSentence(
        wording=_wording_of_place(result, place),
        cause=cause,
        without=place.without,
        left=left,
        right=right,
        part=place.share,
        gap=amount(result, result.gap),
        refused=names[:2],
    )


def _wording_of_place(result: Explanation, place: Localisation) -> PlaceWording:
    """Return which sentence says where the gap goes."""
    match result.verdict.answer:
        case "one engine":
            return "one integrator" if place.values else "one engine"
        case "switched" | "still" | "refused" as wording:
            return wording
        case _:
            return "located"


def _switch(result: Explanation, name: str) -> tuple[str, str]:
    """Return a feature's values where it is on on one side alone.

    The gap closes where both sides are without it. Of other features nothing is said.
    """
    for row in result.shares:
        if row.name == name:
            return sides_of(row)
    return NO_NUMBER, NO_NUMBER


def refused(result: Explanation) -> list[Share]:
    """Return the causes without a part: they cannot be equalized, or could not be run."""
    return [row for row in result.shares if row.note]


def proofs(result: Explanation) -> tuple[str, ...]:
    """Say what the run itself shows of the cause: that the sides are together until they touch."""
    touch = result.touch
    if touch is None or not touch.time or touch.before >= _PROOF * result.gap:
        return ()
    return (sentence_of(TouchSentence(touch, result.quantity, result.unit)),)


def parts(result: Explanation) -> str:
    """Say the three parts of a gap, in a sentence without its end."""
    equalized_gap = 0.0 if result.equalized_gap is None else result.equalized_gap
    is_wider = result.verdict.answer == "hidden" and equalized_gap > 0
    wider = result.gap / equalized_gap if is_wider else 1.0  # parts of the wider gap
    return sentence_of(
        PartsSentence(
            is_wider=is_wider,
            gap=result.gap,
            equalized_gap=equalized_gap,
            unit=result.unit,
            explained=result.explained,
            located=wider * result.located,
            unexplained=wider * result.unexplained,
        )
    )


def amount(result: Explanation, value: float) -> str:
    """Return a gap of the explanation's quantity, with its unit."""
    return quantity(value, result.unit) if math.isfinite(value) else "no bound"
