"""The page of an explanation: the verdict, the causes, what to change, and what to type next.

The first screen has at most 24 lines of 80 columns. The rest stands under `--details`, and on an
HTML page under its sections.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ...installed import DEFAULT
from ...show.blocks import Block, Headline, Page, Table, Text
from ...show.first_screen import LINES, MOST_ROWS, first_screen, lines_of
from ...show.templates import PageContent, render_blocks
from ..compare.base_frame_page import base_frame_blocks
from ..compare.call_periods_page import call_periods_blocks
from ..compare.chaos import CLEAR
from ..compare.known_changes_page import ShownChange, known_changes_blocks
from ..compare.labels import lines_on_unmatched
from .answer_page import amount, answer, missing, parts, proofs, refused
from .apart_page import apart_sentence
from .causes_page import causes
from .changes_page import engine_as_it_comes, steps
from .cited_case_page import cited_case_blocks
from .explanation import Explanation, Share
from .rewritten_page import rewritten_blocks
from .split_page import split_blocks
from .table_page import equalizable_shares, summary_table
from .verdict import UNEXPLAINED

Conclusion = Literal["wider", "divided", "stopped", "no gap", "refused", "chance", "nothing moved"]
Advice = Literal[
    "settings", "option", "write", "refused", "both", "engines", "between", "files", "chance",
    "details", "written", "go on", "same period", "",
]  # fmt: skip


@dataclass(frozen=True)
class WhyPage(PageContent):
    """What the page of an explanation shows.

    Attributes:
        result: The explanation.
        most_rows: How many causes have a row of their own, and how much of what was not written.
        further: Everything else, under `--details`.
        shows_case: Whether it says which side is nearer to the truth, where a case decides that.
    """

    template = "why.md.j2"
    result: Explanation
    most_rows: int
    further: Sequence[Block]
    shows_case: bool = True

    @property
    def base_frame(self) -> Sequence[Block]:
        """Return a note where the base has another frame on either side."""
        bases = self.result.bases
        return [] if bases is None else base_frame_blocks(bases.frame)

    @property
    def call_periods_note(self) -> Sequence[Block]:
        """Return a warning where a function is called at different intervals on the two sides."""
        return call_periods_blocks(self.result.call_periods)

    @property
    def known_changes(self) -> Sequence[Block]:
        """Return the known changes between two releases that concern the runs."""
        versions = [side.versions[side.backend] for side in self.result.provenance]
        changes = [ShownChange(versions[0], versions[1], change) for change in self.result.changes]
        return known_changes_blocks(changes)

    @property
    def causes(self) -> Table:
        """Return a table of the causes, the largest share first."""
        return summary_table(self.result, self.most_rows)

    @property
    def has_table(self) -> bool:
        """Tell whether the table of causes says more than the verdict, which names one."""
        count = len(equalizable_shares(self.result)) + len(self.result.found_in)
        return self.most_rows > 0 or count > 1

    @property
    def split(self) -> Sequence[Block]:
        """Return what of the gap is import, joint dynamics and contact.

        The first screen of a search that was ended has its room for the causes.
        """
        if not (self.further or self.result.is_complete):
            return []
        return split_blocks(self.result, details=bool(self.further))

    @property
    def cited_case(self) -> Sequence[Block]:
        """Return which side is nearer to the truth, in a case that decides the cause."""
        if not self.shows_case:
            return []
        return cited_case_blocks(self.result, details=bool(self.further))

    @property
    def conclusion(self) -> Conclusion:
        """Return the name of the sentence that ends the verdict."""
        return _conclusion(self.result)

    @property
    def parts(self) -> str:
        """Return the parts of the gap, as a sentence without its end."""
        return parts(self.result)

    @property
    def floor(self) -> str:
        """Return the chaos floor, with its unit; "not looked for" where no run was perturbed."""
        return amount(self.result, self.result.floor) if self.result.draws else "not looked for"

    @property
    def refused_names(self) -> tuple[str, ...]:
        """Return the names of the causes that cannot be equalized."""
        return tuple(row.name for row in refused(self.result))

    @property
    def clear(self) -> float:
        """Return how many times its chaos floor a gap must be to be more than chance."""
        return CLEAR

    @property
    def missing_parts(self) -> tuple[str, ...]:
        """Return what one side has nothing of, as sentences without their end."""
        return tuple(missing(self.result.missing))

    @property
    def engine(self) -> str:
        """Return the engine whose settings are those that it comes with; "" where there is none."""
        return engine_as_it_comes(self.result)

    @property
    def places(self) -> list[str]:
        """Return what the rest of the gap is found in."""
        return [place.name for place in self.result.found_in]

    @property
    def rewritten(self) -> Sequence[Block]:
        """Return what was written of the right's file; empty where that was not asked."""
        if self.result.rewritten is None:
            return []
        if self.further:
            return rewritten_blocks(self.result.rewritten)
        return rewritten_blocks(self.result.rewritten, self.most_rows)

    @property
    def advice(self) -> Advice:
        """Return the name of the sentence before the next command."""
        return _advice(self.result)

    @property
    def option(self) -> str:
        """Return the option of the right that makes the largest cause; "" where none does."""
        return _option_of_largest(self.result)

    @property
    def next_command(self) -> str:
        """Return the command to type next, in lines; "" where it is not known."""
        return _next_command(self.result, self.advice)


@dataclass(frozen=True)
class WhyDetails(PageContent):
    """What stands under the first screen of an explanation.

    Attributes:
        result: The explanation.
    """

    template = "why_details.md.j2"
    result: Explanation

    @property
    def left(self) -> str:
        """Return the label of the left side."""
        return self.result.labels[0]

    @property
    def right(self) -> str:
        """Return the label of the right side."""
        return self.result.labels[1]

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what a reader should know, in sentences."""
        only = lines_on_unmatched(self.result.unmatched, ("the left", "the right"))
        return (*only, *self.result.notes)

    @property
    def renamed(self) -> Table:
        """Return a table of the pairs whose names differ."""
        rows = [(pair.kind, pair.left, pair.right, pair.shared) for pair in self.result.renamed]
        heads = ("kind", "left", "right", "what both share")
        return Table(heads, rows, words=frozenset({0, 1, 2, 3}))

    @property
    def proofs(self) -> tuple[str, ...]:
        """Return what the run itself shows of the cause, in sentences."""
        return proofs(self.result)

    @property
    def causes(self) -> Sequence[Block]:
        """Return the gap between the sides, and how much of it each difference explains."""
        return causes(self.result)

    @property
    def changes(self) -> Sequence[Block]:
        """Return what to change on the right."""
        return steps(self.result)

    @property
    def parts(self) -> Sequence[Block]:
        """Return the three parts of the gap."""
        return three_parts(self.result)

    @property
    def is_soft(self) -> bool:
        """Tell whether the rest of the gap is in contacts, and MuJoCo is one of the engines."""
        result = self.result
        if not (result.verdict.divides and _is_found(result) and _engines_differ(result)):
            return False
        has_mujoco = any(side.backend == DEFAULT for side in result.provenance)
        return has_mujoco and any(place.name == "contact" for place in result.found_in)

    @property
    def both_differ(self) -> bool:
        """Tell whether both the file and the engine differ."""
        return _engines_differ(self.result) and _files_differ(self.result)


def page(result: Explanation, details: bool = False) -> Page:
    """Return the page of an explanation.

    Args:
        result: The explanation.
        details: Whether everything is shown, and not the first screen alone.
    """
    if details:
        return _page(WhyPage(result, MOST_ROWS, render_blocks(WhyDetails(result))))

    def page_with(rows: int) -> Page:
        return _page(WhyPage(result, rows, ()))

    shown = first_screen(page_with)
    if lines_of(shown) > LINES:
        shown = page_with(0)
    if lines_of(shown) > LINES:
        shown = _page(WhyPage(result, 0, (), shows_case=False))
    return shown


def _page(content: WhyPage) -> Page:
    """Return the page of a content, below its verdict."""
    result = content.result
    headline = Headline(answer(result), end=apart_sentence(result), holds=_holds(result))
    title = f"{result.experiment}: why {' and '.join(result.labels)} differ"
    return Page(title, "", render_blocks(content), headline)


def _holds(result: Explanation) -> bool:
    """Tell whether what was asked was answered, and written if that was asked."""
    return result.verdict.holds and not result.nothing_written


def _conclusion(result: Explanation) -> Conclusion:
    """Return which sentence ends the verdict."""
    match result.verdict.answer:
        case "hidden":
            return "wider"
        case "stopped":
            return "stopped"
        case "nothing moved":
            return "nothing moved"
        case "rounding" | "alike" | "within":
            return "refused" if refused(result) else "no gap"
        case "inside" | "cannot be told":
            return "chance"
        case _:
            return "divided"


def _advice(result: Explanation) -> Advice:
    """Return which sentence leads to the next command."""
    verdict, periods = result.verdict, result.call_periods
    if result.rewritten is not None:
        return "written"
    if verdict.answer == "nothing moved":
        return ""
    if result.ended_by and verdict.divides:
        return "go on"
    if verdict.divides and periods is not None and periods.differ:
        return "same period"
    if not verdict.divides:
        return "details" if verdict.answer in ("rounding", "alike", "within") else "chance"
    if verdict.holds:
        return _advice_where_explained(result)
    if refused(result):
        return "refused"
    if _engines_differ(result):
        return "both" if _files_differ(result) else "engines"
    return "files"


def _advice_where_explained(result: Explanation) -> Advice:
    """Return which sentence leads on from a gap of which little stays unexplained."""
    if _is_found(result) and _engines_differ(result):
        return "between"
    if engine_as_it_comes(result):
        return "settings"
    if _option_of_largest(result):
        return "option"
    largest = _largest_share(result)
    return "write" if largest is not None and largest.changes else "details"


def _largest_share(result: Explanation) -> Share | None:
    """Return the cause with the largest share; None if none takes away anything."""
    return next((row for row in result.shares if row.share), None)


def _option_of_largest(result: Explanation) -> str:
    """Return the option of the right that makes the largest cause; "" where none does."""
    largest = _largest_share(result)
    return "" if largest is None else largest.option


def _next_command(result: Explanation, advice: Advice) -> str:
    """Return what to type next, in lines; "" where that is not known."""
    if not result.command:
        return ""
    match advice:
        case "settings" | "both" | "engines" | "files":
            flags = ("--one-step",)
        case "between" | "chance":
            flags = ("--converge",)
        case "write":
            target = f"fixed{Path(result.right_file).suffix}"
            flags = (*result.command.question, "--write", target)
        case "refused" | "details":
            flags = (*result.command.question, "--details")
        case "option":
            without = result.command.without_option_of_right(_option_of_largest(result))
            return without.lines(*result.command.question)
        case "same period":
            return _with_same_period(result)
        case "go on":
            flags = result.command.question
        case "written" | "":
            return ""
    return result.command.lines(*flags)


def _with_same_period(result: Explanation) -> str:
    """Return the same question with a function that is called as often on both sides."""
    command, periods = result.command, result.call_periods
    if command is None or periods is None:
        return ""
    return command.calling_every(periods.common_word).lines(*command.question)


def _engines_differ(result: Explanation) -> bool:
    return len({side.backend for side in result.provenance}) > 1


def _files_differ(result: Explanation) -> bool:
    return len({side.model_sha256 for side in result.provenance}) > 1


def _is_found(result: Explanation) -> bool:
    """Tell whether all that is not explained was localised."""
    return result.located > UNEXPLAINED >= result.unexplained


def three_parts(result: Explanation) -> list[Block]:
    """Say the three parts of the gap; nothing where there is none."""
    if not result.verdict.divides:
        return []
    return [Text(f"{parts(result)}.")]
