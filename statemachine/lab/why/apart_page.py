"""How far two sides are apart, as the second sentence of an explanation."""

from __future__ import annotations

from dataclasses import dataclass

from ...measures import Deviation
from ...show.templates import PageContent
from .answer_page import sentence_of
from .causes_page import nothing_differs, shown_gap, what_is_apart
from .explanation import Explanation


@dataclass(frozen=True)
class ApartSentence(PageContent):
    """How far the sides are apart, as a sentence.

    Attributes:
        result: The explanation.
    """

    template = "why_apart.md.j2"
    result: Explanation

    @property
    def what(self) -> str:
        """Return a phrase that names what is apart."""
        return what_is_apart(self.result)

    @property
    def gap(self) -> Deviation | None:
        """Return the gap that is explained, of one joint if it is of joints; None of rounding."""
        result = self.result
        return shown_gap(result) if result.gap > result.negligible else None

    @property
    def divides(self) -> bool:
        """Tell whether the gap was divided, so that what stays of it is a part of the answer."""
        return self.result.verdict.divides and self.result.is_complete

    @property
    def nothing_differs(self) -> bool:
        """Tell whether nothing differs that is compared."""
        return nothing_differs(self.result)


def apart_sentence(result: Explanation) -> str:
    """Say how far the sides are apart, in a sentence; "" where there is nothing to say."""
    content = ApartSentence(result)
    if content.gap is None and not content.nothing_differs:
        return ""
    return sentence_of(content)
