"""The page of three sides or more: which one is odd, and what that hint is worth."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ...measures import QUANTITIES
from ...measures.text import listed, quantity, short_time
from ...show.blocks import Page, Table
from ...show.first_screen import MOST_ROWS, first_that_fits, with_answer
from ...show.templates import PageContent, render
from ..compare.odd_side import ODD
from ..compare.typed_command import typed_command
from ..why.cited_case_page import CitedCasePage
from .compared_names import name_of
from .finer_sides import FinerGap, FinerSides, OddGapState
from .requests.engines import SEARCH_SECONDS, EnginesResult, EnginesState, sides_of
from .several_sides import OddOne, SidesGap, Span
from .sides_outcomes import sides_outcomes_table

_NOBODY = "none"
_ODD_ROW = "odd is"
_SPANS: dict[Span, str] = {"run": "over the run", "end": "at the end"}
_STEPS = ("at h", "h/2", "h/4", "h/8", "h/16")


@dataclass(frozen=True)
class EnginesPage(PageContent):
    """What the page of several sides shows.

    Attributes:
        experiment: What was run.
        result: Which side is odd.
        gaps: Table of those between each two sides; without rows where `changing_gaps` stands in
            its place.
        changing_gaps: Table of these with finer steps, where the odd side changes with them; else
            without rows.
        more: How many pairs it does not show.
        next_command: What to type next; "" for nothing.
        details: Whether everything is shown.
    """

    template = "engines.md.j2"
    experiment: str
    result: EnginesResult
    gaps: Table
    changing_gaps: Table
    more: int
    next_command: str
    details: bool

    @property
    def labels(self) -> list[str]:
        """Return what the sides are called."""
        return list(self.result.labels)

    @property
    def until(self) -> float:
        """Return the last moment that is compared [s]."""
        return self.result.until

    @property
    def state(self) -> EnginesState:
        """Return in a word what came of it."""
        return self.result.state

    @property
    def is_odd(self) -> bool:
        """Tell whether a side is odd."""
        return self.result.odd is not None

    @property
    def at_the_end(self) -> bool:
        """Tell whether the verdict is about the end of the run alone."""
        return self.result.span == "end"

    @property
    def odd(self) -> str:
        """Return what the odd side is called."""
        return self._odd.side

    @property
    def nearest(self) -> str:
        """Return what the other side is called that is nearest to the odd one."""
        return self._odd.nearest

    @property
    def _odd(self) -> OddOne:
        """Return the odd side; one without a name where none is."""
        odd = self.result.odd
        return OddOne(_NOBODY, _NOBODY, 0.0, 0.0, 0.0) if odd is None else odd

    @property
    def others(self) -> list[str]:
        """Return what the sides are called that are not odd."""
        ended = [side.side for side in self.result.ended]
        return [label for label in self.labels if label not in (self.odd, *ended)]

    @property
    def odd_gap(self) -> str:
        """Return how far the nearest side is from the odd one, with its unit."""
        return quantity(self._odd.gap, self.result.unit)

    @property
    def spread(self) -> str:
        """Return how far apart the other sides are at most, with its unit."""
        return quantity(self._odd.spread, self.result.unit)

    @property
    def least_ratio(self) -> float:
        """Return how many times as far an odd side is at least."""
        return ODD

    @property
    def quantities(self) -> str:
        """Return what is measured, in the plural."""
        kind = self.result.kind
        return QUANTITIES[kind].plural if kind else "quantities"

    @property
    def farthest(self) -> SidesGap | None:
        """Return the gap of the two sides that are farthest apart; None where none is known."""
        return max(self.result.gaps, key=lambda gap: gap.largest, default=None)

    @property
    def largest_gap(self) -> str:
        """Return how far these are apart, with its unit."""
        return "" if self.farthest is None else quantity(self.farthest.largest, self.result.unit)

    @property
    def tolerance(self) -> str:
        """Return what does not matter, with its unit; "" where nothing was measured."""
        return "" if self.farthest is None else quantity(self.farthest.tolerance, self.result.unit)

    @property
    def ended(self) -> list[str]:
        """Return what is said of each run that ended early."""
        return [
            f"{side.side} ended at {short_time(side.time)}: {side.reason}"
            for side in self.result.ended
        ]

    @property
    def outcomes(self) -> Table:
        """Return what came of a policy on each side; no rows where anything else is run."""
        return sides_outcomes_table(self.result.outcomes, self.labels)

    @property
    def groups(self) -> list[str]:
        """Return which sides agree, over the run and at its end."""
        lines: list[str] = []
        for each in self.result.groups:
            groups = "; ".join(listed(group) for group in each.groups)
            lines.append(f"{_SPANS[each.span]}: {groups}")
        return lines

    @property
    def steps(self) -> OddGapState | Literal[""]:
        """Return what becomes of the odd side with finer steps; "" if not known."""
        return "" if self.result.finer is None else self.result.finer.state

    @property
    def finer_levels(self) -> list[str]:
        """Return how many times finer the steps were."""
        return [] if self.result.finer is None else [str(k) for k in self.result.finer.finer[1:]]

    @property
    def finer_odd(self) -> list[str]:
        """Return the side that is odd with each of these; "none" where no side is."""
        if self.result.finer is None:
            return []
        return [label or _NOBODY for label in self.result.finer.odd[1:]]

    @property
    def moved(self) -> list[str]:
        """Return how far each side moves by its own finer steps."""
        if self.result.finer is None:
            return []
        unit = self.result.unit
        return [f"{side.side} by {quantity(side.moved, unit)}" for side in self.result.finer.moved]

    @property
    def is_steady(self) -> bool:
        """Tell whether the same side is odd with finer steps, too."""
        return self.result.finer is not None and self.result.finer.is_steady

    @property
    def finer_gaps(self) -> Table:
        """Return a table of the gaps with finer steps; without rows where there are none."""
        gaps = () if self.result.finer is None else self.result.finer.gaps
        return _finer_table(gaps, self.result.unit)

    @property
    def case(self) -> CitedCasePage | None:
        """Return the case that decides the cause; None where none does."""
        origin = self.result.origin
        if origin is None or origin.cited_case is None:
            return None
        return CitedCasePage(origin.cited_case, self.details)

    @property
    def nearer(self) -> str:
        """Return what the side is called that is nearer to the truth in that case."""
        return self.odd if self._is_odd_nearer else self.nearest

    @property
    def farther(self) -> str:
        """Return what the side is called that is farther from it."""
        return self.nearest if self._is_odd_nearer else self.odd

    @property
    def _is_odd_nearer(self) -> bool:
        return self.case is not None and self.case.is_nearer_left

    @property
    def cause(self) -> str:
        """Return what most of the gap comes from; "" where that is not known."""
        return "" if self.result.origin is None else self.result.origin.cause

    @property
    def is_searched(self) -> bool:
        """Tell whether it was looked for what the gap comes from."""
        return self.result.origin is not None

    @property
    def largest_effect(self) -> str:
        """Return the cause with the largest effect, where the search was ended; else ""."""
        origin = self.result.origin
        return "" if origin is None or origin.is_complete else origin.cause

    @property
    def search_seconds(self) -> float:
        """Return after how long the search for causes ends [s]."""
        return SEARCH_SECONDS

    @property
    def located_in(self) -> str:
        """Return that where it is left out on both sides, to locate the gap; else ""."""
        origin = self.result.origin
        return origin.cause if origin is not None and origin.is_located else ""

    @property
    def share(self) -> float | None:
        """Return the part of the gap that this takes away; None where that is not known."""
        return None if self.result.origin is None else self.result.origin.share


def page(result: EnginesResult, details: bool = False) -> Page:
    """Return the page of several sides: which one is odd.

    Args:
        result: What came of it.
        details: Whether it says what odd means, which sides agree, and all gaps with finer steps.
    """
    gaps = sorted(result.gaps, key=lambda gap: -gap.largest)
    if details:
        return _page(result, gaps, details=True)
    return first_that_fits(_shorter_pages(result, gaps))


def _shorter_pages(result: EnginesResult, gaps: Sequence[SidesGap]) -> Iterator[Page]:
    """Yield the page, then without how far each side moves, and then with ever fewer gaps."""
    most = min(len(gaps), MOST_ROWS)
    yield _page(result, gaps[:most])
    for rows in range(most, min(most, 1) - 1, -1):
        yield _page(replace(result, finer=_without_moves(result)), gaps[:rows])


def _without_moves(result: EnginesResult) -> FinerSides | None:
    """Return the runs with finer steps without how far each side moves by them."""
    return None if result.finer is None else replace(result.finer, moved=())


def _page(result: EnginesResult, gaps: Sequence[SidesGap], details: bool = False) -> Page:
    """Return the page with some of the gaps."""
    command = ""
    if result.odd is not None:
        sides = dict(zip(result.labels, sides_of(result.request), strict=True))
        pair = result.request.pair(sides[result.odd.side], sides[result.odd.nearest])
        command = typed_command(pair).lines("--why")
    changing = gaps if result.state == "unclear" else ()
    compared = () if changing and not details else gaps
    content = EnginesPage(
        experiment=result.request.run.experiment,
        result=result,
        gaps=_gaps_table(compared, result.unit),
        changing_gaps=_changing_table(result, changing),
        more=len(result.gaps) - len(gaps),
        next_command=command,
        details=details,
    )
    return with_answer(render(content))


def _gaps_table(gaps: Sequence[SidesGap], unit: str) -> Table:
    """Return a row for each two sides."""
    return Table(
        ("left", "right", "quantity", "largest", "at the end", "verdict"),
        [_cells(gap, unit) for gap in gaps],
        words=frozenset({0, 1, 2, 5}),
        emphasis=frozenset(row for row, gap in enumerate(gaps) if gap.is_apart),
    )


def _cells(gap: SidesGap, unit: str) -> tuple[str, ...]:
    """Return the row of two sides."""
    largest, end = quantity(gap.largest, unit), quantity(gap.end, unit)
    return gap.left, gap.right, name_of(gap.quantity), largest, end, _verdict_of(gap)


def _verdict_of(gap: SidesGap) -> str:
    """Return the verdict on two sides in a word or two."""
    if gap.verdict != "agrees" and not gap.is_apart:
        return "may be chance"
    return "DIFFERS" if gap.verdict == "differs" else gap.verdict


def _finer_table(gaps: Sequence[FinerGap], unit: str) -> Table:
    """Return a row for each two sides: their gap with ever finer steps."""
    columns: dict[str, Callable[[FinerGap], str]] = {
        "left": lambda gap: gap.left,
        "right": lambda gap: gap.right,
        "the gap is": lambda gap: gap.verdict,
    }
    levels = max((len(gap.gaps) for gap in gaps), default=0)
    for level in range(levels):
        columns[_STEPS[level]] = _gap_at(level, unit)
    return Table.of(gaps, columns, "", words={"left", "right", "the gap is"})


def _changing_table(result: EnginesResult, gaps: Sequence[SidesGap]) -> Table:
    """Return a row for each of some pairs, their gap with ever finer steps, and who is odd then."""
    if result.finer is None or not gaps:
        return Table((), [])
    sizes = {(each.left, each.right): each.gaps for each in result.finer.gaps}
    rows: list[tuple[str, ...]] = []
    for gap in gaps:
        cells = [quantity(size, result.unit) for size in sizes[gap.left, gap.right]]
        rows.append((gap.left, gap.right, *cells))
    rows.append((_ODD_ROW, "", *(label or _NOBODY for label in result.finer.odd)))
    headers = ("left", "right", *_STEPS[: len(result.finer.finer)])
    return Table(headers, rows, words=frozenset({0, 1}), emphasis=frozenset({len(gaps)}))


def _gap_at(level: int, unit: str) -> Callable[[FinerGap], str]:
    """Return what fills a column: the gap in the runs with some of the steps."""
    return lambda gap: quantity(gap.gaps[level], unit)
