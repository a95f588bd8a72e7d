"""What the gap of an odd side comes from, and the case of the battery that decides it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..why.cited_case import CitedCase
from ..why.explanation import Explanation
from ..why.verdict import Answer


@dataclass(frozen=True)
class GapOrigin:
    """What the gap between an odd side and the other that is nearest to it comes from.

    Attributes:
        left: What the odd side is called.
        right: What the other is called.
        answer: Whether it was explained, as `why` says.
        cause: What most of the gap comes from, or is located in; "" where nothing was found.
        share: The part of the gap that this takes away; None where nothing was found.
        is_located: Whether that is where the gap is found, by leaving it out on both sides, and no
            difference between them.
        is_complete: Whether the search came to its end; else `cause` is what has the largest
            effect by then, and has no share yet.
        cited_case: The case that decides the cause, and which of the two is nearer to the truth in
            it; None where no case does.
    """

    left: str
    right: str
    answer: Answer
    cause: str
    share: float | None
    is_located: bool
    is_complete: bool
    cited_case: CitedCase | None


def origin_of(left: str, right: str, explanation: Explanation) -> GapOrigin:
    """Return what a gap comes from, of all that explains it.

    Args:
        left: What the odd side is called.
        right: What the other is called.
        explanation: Of the gap between the two.
    """
    found = GapOrigin(
        left=left,
        right=right,
        answer=explanation.verdict.answer,
        cause="",
        share=None,
        is_located=False,
        is_complete=explanation.is_complete,
        cited_case=None,
    )
    if not explanation.is_complete:
        effects = explanation.ranking
        return replace(found, cause=effects[0].name) if effects else found
    largest = 0.0
    for row in explanation.shares:
        if row.share is not None and row.share > largest:
            largest = row.share
            found = replace(found, cause=row.name, share=largest)
    for place in explanation.found_in:
        if place.share > largest:
            largest = place.share
            found = replace(found, cause=place.name, share=largest, is_located=True)
    return replace(found, cited_case=explanation.cited_case)
