"""Page of what a recording of an arm tells of its model: gap, causes, parameters, motions.

The first screen has at most 24 lines of 80 columns. The rest stands under `--details`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import grouped
from ...show.blocks import Block, Page, Table
from ...show.first_screen import first_that_fits, with_answer
from ...show.templates import PageContent, render, render_blocks
from .identification_details import IdentificationDetails
from .page_of_recording import PageOfRecording
from .parameter_table import UNKNOWN, joint_table, ranked_shares
from .parameter_texts import figure_text, interval_text, size_text
from .results import (
    CauseShare,
    FittedParameter,
    Hypothesis,
    IdentificationResult,
)
from .typed_question import typed_question
from .units_page import units_blocks
from .unknown import TellingMotion, motions_of
from .written_page import written_blocks

_OVERLAP = 0.01  # of the gap: less does not count
_WRITTEN_FILE = "fitted.xml"
_MOST_ROWS = 6


@dataclass(frozen=True)
class IdentificationPage(PageOfRecording, PageContent):
    """What the page of an identification shows.

    Attributes:
        result: What was computed.
        most_rows: How many joints have a row.
        most_motions: How many motions are named.
        units: What the numbers were taken to mean.
        further: Everything else, under `--details`.
    """

    template = "identification.md.j2"
    result: IdentificationResult
    most_rows: int
    most_motions: int
    units: Sequence[Block]
    further: Sequence[Block]

    @property
    def engine(self) -> str:
        """Return the engine and its version."""
        source = self.result.provenance
        return f"{source.backend} {source.versions[source.backend]}"

    @property
    def is_last_third(self) -> bool:
        """Tell whether a third of the episode was not fitted, and not another episode."""
        return self.gap.part == "last third"

    @property
    def is_explained(self) -> bool:
        """Tell whether the fitted model is as near to the arm as can be measured."""
        return self.result.at_floor and self.result.holds

    @property
    def large(self) -> list[CauseShare]:
        """Return the causes with a part of the gap that counts, the largest first."""
        return [share for share in ranked_shares(self.result) if share.share >= _OVERLAP]

    @property
    def others(self) -> float:
        """Return what the other causes have of the gap, together."""
        return sum(share.share for share in self.result.shares if share.share < _OVERLAP)

    @property
    def standing_in(self) -> list[CauseShare]:
        """Return the causes that stand in for each other: each takes away more where it is alone.

        Empty where all of them alone take away no more than together.
        """
        ranked = ranked_shares(self.result)
        alone = sum(share.alone for share in ranked)
        together = sum(share.share for share in ranked)
        if alone <= together + _OVERLAP:
            return []
        return [share for share in ranked if share.alone > share.share + _OVERLAP]

    @property
    def likely(self) -> Hypothesis | None:
        """Return the other reading of the numbers that fits best, where what was fitted does not.

        None where no other one fits better.
        """
        if self.result.at_floor:
            return None
        readings = [each for each in self._better if each.size is None]
        return min(readings, key=lambda each: each.residual, default=None)

    @property
    def better(self) -> list[Hypothesis]:
        """Return the other readings of the numbers that fit better, without the likely one."""
        likely = self.likely
        return [each for each in self._better if each.size is None and each is not likely]

    @property
    def lacking(self) -> list[str]:
        """Return what the model lacks and fits better with, and how much of it."""
        sized = [each for each in self._better if each.size is not None]
        return [f"{each.name} ({size_text(each)})" for each in sized]

    @property
    def _better(self) -> list[Hypothesis]:
        return [each for each in self.result.hypotheses if each.verdict == "fits better"]

    @property
    def determined(self) -> list[FittedParameter]:
        """Return the parameters that the recording determines."""
        return [each for each in self.result.parameters if each.verdict == "determined"]

    @property
    def undetermined(self) -> list[FittedParameter]:
        """Return the parameters that the recording cannot tell."""
        return [each for each in self.result.parameters if each.verdict == "cannot tell"]

    @property
    def none_determined(self) -> bool:
        """Tell whether the recording determines nothing."""
        return not self.determined

    @property
    def by_joint(self) -> Table:
        """Return a table of what is determined: a row for each joint, a column for each kind.

        Empty under `--details`, which has a row for each parameter.
        """
        return joint_table(() if self.further else self.result.parameters, self.most_rows)

    @property
    def mark(self) -> str:
        """Return how that table marks what cannot be told; "" where it has no such cell."""
        return f" ({UNKNOWN})" if any(UNKNOWN in row for row in self.by_joint.rows) else ""

    @property
    def of_arm(self) -> list[str]:
        """Return what is determined of the arm as a whole, with intervals."""
        texts: list[str] = []
        for each in self.determined:
            if each.joint is None:
                value = figure_text(each.kind, each.fitted)
                texts.append(f"{each.kind} {value} ({interval_text(each)})")
        return texts

    @property
    def reasons(self) -> list[str]:
        """Return why parameters are not determined, and of how many that is so, if not of all."""
        by_reason = grouped((reason, 1) for each in self.undetermined for reason in each.reasons)
        if len(by_reason) == 1:
            return list(by_reason)
        ranked = sorted(by_reason.items(), key=lambda item: -len(item[1]))
        return [f"{reason} {len(those)}" for reason, those in ranked]

    @property
    def motions(self) -> list[TellingMotion]:
        """Return the motions that would tell the most of what this recording cannot."""
        return motions_of(self.result.parameters)[: self.most_motions]

    @property
    def rewritten(self) -> Sequence[Block]:
        """Return what was written of the model's file; empty where that was not asked."""
        return written_blocks(self.result, details=bool(self.further))

    @property
    def next_command(self) -> str:
        """Return what to type next; "" for nothing."""
        if self.result.ended_by:
            return typed_question(self.result.request, "--why")
        if not self.further:
            return typed_question(self.result.request, "--why", "--details")
        if self.none_determined or self.result.rewritten is not None:
            return ""
        return typed_question(self.result.request, "--why", "--write", _WRITTEN_FILE)


def page(result: IdentificationResult, details: bool = False) -> Page:
    """Return the result as a page.

    Args:
        result: What was computed.
        details: Whether everything is shown, and not the first screen alone.
    """
    if details:
        units = units_blocks(result.units, details=True)
        further = render_blocks(IdentificationDetails(result))
        return _page(IdentificationPage(result, _MOST_ROWS, 0, units, further))
    units = units_blocks(result.units, details=False)
    # What is left out first: how the numbers were read, then motions, then joints.
    contents = [
        IdentificationPage(result, _MOST_ROWS, 1, units, ()),
        IdentificationPage(result, _MOST_ROWS, 1, (), ()),
        *[IdentificationPage(result, rows, 0, (), ()) for rows in range(_MOST_ROWS, 0, -1)],
    ]
    return first_that_fits(_page(content) for content in contents)


def _page(content: IdentificationPage) -> Page:
    """Return the page of a content, below its answer."""
    return with_answer(render(content))
