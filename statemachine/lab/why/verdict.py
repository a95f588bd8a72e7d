"""The verdict on a gap: what it comes from, and whether that answers the question.

One function decides it, from a few facts about the runs; the words are the page's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..compare.chaos import against_floor
from .shapley import Method

UNEXPLAINED = 0.05  # of the gap: where more stays, the answer is no
_MASKED = 2.0  # of the gap: a cause that takes away more has others against it

GapState = Literal["rounding", "within", "inside", "cannot be told", "beyond"]
Answer = Literal[
    "stopped", "ranked",
    "nothing moved", "rounding", "alike", "within", "inside", "cannot be told",
    "cause", "together", "masked", "hidden",
    "located", "switched", "one engine", "refused", "still", "unexplained",
]  # fmt: skip


def gap_state(gap: float, negligible: float, tolerance: float, floor: float) -> GapState:
    """Tell whether there is a gap to explain.

    Args:
        gap: Between the two sides; the others are in its unit.
        negligible: What the arithmetic of an engine makes of a run.
        tolerance: What does not matter.
        floor: The chaos floor of both sides; 0 if it was not looked for.

    Returns:
        "rounding" for a gap that is negligible; "beyond" for one that is clearly more than the
        chaos floor, which alone can be divided among causes; "within" for another one that is
        within its tolerance; "inside" or "cannot be told" for a larger one, as `against_floor`.
    """
    if gap <= negligible:
        return "rounding"
    chance = against_floor(gap, floor)
    if chance != "beyond" and gap <= tolerance:
        return "within"
    return chance


@dataclass(frozen=True)
class CausePart:
    """What the cause with the largest share takes away, as parts of the gap.

    Attributes:
        share: Its Shapley value.
        alone: What it takes away as the only one; last: after all others; None where that could
            not be run.
    """

    share: float
    alone: float | None
    last: float | None


@dataclass(frozen=True)
class LocatedPart:
    """What goes when a feature is left out on both sides.

    Attributes:
        share: The part of the gap.
        is_still: Whether the motion goes with it, so that there can be no gap.
        is_switch: Whether one side has the feature and the other does not.
    """

    share: float
    is_still: bool = False
    is_switch: bool = False


@dataclass(frozen=True)
class Facts:
    """What the verdict is made of.

    Attributes:
        state: Whether there is a gap to explain.
        differs: Whether files, options, commands or starts differ in anything.
        refused: Whether something differs that cannot be made the same.
        one_engine: Whether both sides run on one engine and release, both with its own settings
            or both with the model's: then nothing that is computed differs but by its input.
        explained, located, unexplained: Parts of the gap; they add up to 1.
        cause: The cause with the largest share; None without one.
        places: What was left out on both sides, each on top of those before.
        moved: Whether a side moves at all.
        is_complete: Whether nothing ended the search before its end.
        method: How the shares were computed, as far as they are.
        unavailable: Causes with which no set could be run, or none with all others.
    """

    state: GapState
    differs: bool
    refused: bool
    one_engine: bool
    explained: float = 0.0
    located: float = 0.0
    unexplained: float = 1.0
    cause: CausePart | None = None
    places: tuple[LocatedPart, ...] = ()
    moved: bool = True
    is_complete: bool = True
    method: Method = "all sets"
    unavailable: tuple[str, ...] = ()

    @property
    def place(self) -> LocatedPart | None:
        """Return the part that takes away most where it is left out; None if none was left out."""
        return max(self.places, key=lambda place: place.share, default=None)


@dataclass(frozen=True)
class GapVerdict:
    """What a gap comes from.

    Attributes:
        unavailable: Causes whose share cannot be had, since no set of causes with one of them could
            be run, or none with all others: to be said before the answer, which is about the other
            causes. Empty where all could be run.
        answer: Which answer is given first.

            - "stopped": the search was ended before each cause was equalized alone, and last: there
              is no answer; "ranked": it was ended after that, before shares were known.
            - "nothing moved": there is no gap, for nothing moves on either side: nothing was
              compared.
            - "rounding": there is no gap, and nothing differs; "alike": there is none, although
              something differs; "within": it is within its tolerance, and may be chance.
            - "inside": rounding alone makes as large a gap, so that nothing can be concluded;
              "cannot be told": whether it does cannot be told.
            - "cause": a cause that was equalized; "together": many causes, of which none takes
              away more than what stays; "masked": causes that act against one another;
              "hidden": with all causes equalized the gap is wider.
            - "located": what was left out on both sides, which their engines compute differently;
              "switched": the same, where one side has it and the other does not; "one engine":
              the same, where both compute it alike, so that it is no cause; "refused": it may come
              from a difference that cannot be made the same; "still": the motion went with it.
            - "unexplained": none of these.

        holds: Whether the question is answered: no more than a twentieth of the gap stays
            unexplained, or there is none. False where the search was ended before it was complete.
        divides: Whether the gap was divided among causes.
    """

    unavailable: tuple[str, ...]
    answer: Answer
    holds: bool
    divides: bool = True


def verdict_of(facts: Facts) -> GapVerdict:
    """Make the verdict on a gap."""
    answer, holds, divides = _answer_of(facts)
    return GapVerdict(facts.unavailable, answer, holds and facts.is_complete, divides)


def _answer_of(facts: Facts) -> tuple[Answer, bool, bool]:
    """Return the answer, whether it holds for a search that is complete, and whether it divides."""
    if facts.state == "rounding" and not facts.moved:
        return "nothing moved", False, False
    if facts.state == "rounding":
        answer: Answer = "alike" if facts.differs else "rounding"
        return answer, not facts.refused, False
    if facts.state == "within":
        return "within", not facts.refused, False
    if facts.state in ("inside", "cannot be told"):
        return facts.state, False, False
    if facts.explained < -UNEXPLAINED:
        return "hidden", False, True
    if facts.method == "not ranked":
        return "stopped", False, True
    if facts.method == "alone and last":
        return "ranked", False, True
    holds = abs(_stays(facts)) <= UNEXPLAINED
    if _is_masked(facts):
        return "masked", holds, True
    return _largest(facts), holds, True


def _stays(facts: Facts) -> float:
    """Return the part of the gap that is not accounted for.

    What goes only when a feature is left out on both sides does not count as found where it may
    come from something else: both sides compute that feature alike, the motion goes with it, or
    something differs that could not be made the same.
    """
    for place in facts.places:
        if place.is_still or (facts.one_engine and not place.is_switch):
            return 1.0 - facts.explained
    if facts.refused:
        return 1.0 - facts.explained
    return facts.unexplained


def _is_masked(facts: Facts) -> bool:
    """Tell whether the differences act against one another, so that none of them is the cause."""
    parts = [facts.explained]
    cause = facts.cause
    if cause is not None and abs(cause.share) > facts.located:
        parts += [part for part in (cause.share, cause.alone, cause.last) if part is not None]
    return min(parts) < -UNEXPLAINED or max(parts) > _MASKED


def _largest(facts: Facts) -> Answer:
    """Return what most of the gap comes from."""
    by_cause = abs(facts.cause.share) if facts.cause is not None else 0.0
    place = facts.place
    by_place = place.share if place is not None else 0.0
    if by_cause >= max(by_place, facts.unexplained) and by_cause > 0.0:
        return "cause"
    # No single cause is as large as what stays: together they may be.
    if facts.explained > max(by_place, facts.unexplained):
        return "together"
    if place is not None and by_place >= facts.unexplained:
        return _located(facts, place)
    return "unexplained"


def _located(facts: Facts, place: LocatedPart) -> Answer:
    """Return what is said of a feature that was left out on both sides."""
    if place.is_switch:
        return "switched"
    if place.is_still:
        return "still"
    if facts.refused:
        return "refused"
    if facts.one_engine:
        return "one engine"
    return "located"
