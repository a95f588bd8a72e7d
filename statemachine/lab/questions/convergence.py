"""The page of finer timesteps: which gap vanishes with them, and which does not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from ...measures.text import (
    grouped,
    listed,
    milliseconds,
    quantity,
    short_time,
    significant,
)
from ...show import report_template as template
from ...show.blocks import Headline, Page, Table
from ...show.report_template import if_true, slots_of
from ..compare.convergence import FINER, Convergence, GapLimit, LimitVerdict
from ..compare.stillness import nothing_moved
from .compared_names import name_of
from .requests.converge import ConvergeResult

LEADS = {
    "rounding": "There is no gap beyond rounding, whatever the timestep",
    "vanishes": "The gap vanishes with the timestep: it is discretisation",
    "unclear": "It is unclear whether the gap vanishes with the timestep: that of {name} is "
    "{coarse}, and {fine} with the finest steps, in no steady order (so {unclear} of {total} "
    "quantities)",
    "stays": "The gap does not vanish with the timestep: that of {name} is {coarse}, and {fine} "
    "with the finest steps",
    "in part": "The gap vanishes with the timestep in part only: that of {name} is {coarse}, and "
    "{fine} with the finest steps",
}
NO_GAP = "Before the first touch, at {touch}, there is no gap."
DISCRETISATION = "Before the first touch, at {touch}, there is nothing but discretisation."
ByVerdict = Mapping[LimitVerdict, Sequence[GapLimit]]
_FINER = ("at h", *(f"h/{finer}" for finer in FINER[1:]))


def page(result: ConvergeResult, details: bool = False) -> Page:
    """Return the page of what vanishes with the timestep, and what does not.

    Args:
        result: What was found.
        details: Whether all of it is shown, and not the first screen alone.
    """
    by_verdict = grouped((limit.verdict, limit) for limit in result.whole)
    return template.page(
        "lab/questions/convergence",
        _of_the_limit(result, by_verdict),
        experiment=result.request.run.experiment,
        **slots_of(
            _runs_of(result),
            _limit_tables_of(result),
            _counts_of(result, by_verdict),
            _rounding_of(result),
            _advice_of(result),
        ),
    )


@dataclass(frozen=True)
class _Runs:
    """What the page says of the runs.

    Attributes:
        left: What the left side is called.
        right: What the right side is called.
        until: The last moment that is compared [s].
        steps: The engines' steps as given, each once.
        here: How long a command holds on the left; None where it holds as long on both sides.
        there: How long a command holds on the right.
        late: The longer of these [s].
    """

    left: str
    right: str
    until: float
    steps: str
    here: str | None
    there: str
    late: str


def _runs_of(result: Convergence) -> _Runs:
    left, right = result.labels
    here, there = (milliseconds(period, 3) for period in result.periods)
    steps = dict.fromkeys(milliseconds(step, 3) for step in result.steps)
    return _Runs(
        left=left,
        right=right,
        until=result.until,
        steps=" and ".join(steps),
        here=None if here == there else here,
        there=there,
        late=significant(max(result.periods)),
    )


@dataclass(frozen=True)
class _LimitTables:
    """The tables of the gaps.

    Attributes:
        before: Until the first touch; None where there is nothing to be seen in it.
        whole: Over the whole run.
    """

    before: Table | None
    whole: Table


def _limit_tables_of(result: Convergence) -> _LimitTables:
    before = None
    only_rounding = all(limit.verdict == "rounding" for limit in result.before)
    if result.touch is not None and not only_rounding:  # else one line says so
        title = f"The gap with finer steps, before the first touch at {short_time(result.touch)}"
        before = _limits(result.before, title)
    return _LimitTables(
        before, _limits(result.whole, "The gap with finer steps, over the whole run")
    )


def _limits(limits: Sequence[GapLimit], title: str) -> Table:
    """Return a row for each gap beyond rounding: with the first steps and the finest three."""
    levels = len(limits[0].gaps)
    columns: dict[str, Callable[[GapLimit], str]] = {
        "quantity": lambda limit: name_of(limit.name),
        "the gap is": lambda limit: limit.verdict,
    }
    for level in sorted({0, *range(levels - 3, levels)}):
        columns[_FINER[level]] = _gap_at(level)
    columns["at 0"] = lambda limit: quantity(limit.limit, limit.unit)
    return Table.of(
        [limit for limit in limits if limit.verdict != "rounding"],
        columns,
        title,
        words={"the gap is"},
        emphasis=lambda limit: limit.verdict in ("stays", "in part"),
    )


def _gap_at(level: int) -> Callable[[GapLimit], str]:
    """Return what fills a column: the gap in the runs with some of the steps."""
    return lambda limit: quantity(limit.gaps[level], limit.unit)


@dataclass(frozen=True)
class _Counts:
    """How many gaps do what, and how far the sides move with finer steps.

    Attributes:
        total: How many quantities there are.
        counts: How many gaps have each verdict.
        name: The quantity that is farthest apart with the steps as given, of the first's unit.
        left_moved: How far the left side is in it from its own run with the finest steps.
        right_moved: How far the right side is.
    """

    total: int
    counts: str
    name: str
    left_moved: str
    right_moved: str


def _counts_of(result: Convergence, by_verdict: ByVerdict) -> _Counts:
    alike = [limit for limit in result.whole if limit.unit == result.whole[0].unit]
    farthest = max(alike, key=lambda limit: limit.gaps[0])
    left_moved, right_moved = (quantity(moved, farthest.unit) for moved in farthest.moved)
    return _Counts(
        total=len(result.whole),
        counts=", ".join(f"{verdict} {len(limits)}" for verdict, limits in by_verdict.items()),
        name=name_of(farthest.name),
        left_moved=left_moved,
        right_moved=right_moved,
    )


@dataclass(frozen=True)
class _Rounding:
    """Of the gaps that are rounding.

    Attributes:
        rounding: How many there are; None for none.
        most: The largest of each unit.
    """

    rounding: int | None
    most: str


def _rounding_of(result: Convergence) -> _Rounding:
    gaps = [(max(limit.gaps), limit.unit) for limit in result.whole if limit.verdict == "rounding"]
    if not gaps:
        return _Rounding(None, "")
    largest = {unit: quantity(gap, unit) for gap, unit in sorted(gaps)}
    return _Rounding(len(gaps), listed(list(largest.values())))


@dataclass(frozen=True)
class _Advice:
    """What the page adds under a condition.

    Attributes:
        touch: "" where two engines touch something.
        quarter: A timestep that may tell what is unclear [s]; None where nothing is, or where
            something touches.
    """

    touch: str | None
    quarter: str | None


def _advice_of(result: Convergence) -> _Advice:
    touches = result.touch is not None
    quarter = None
    if result.unclear and not touches:
        quarter = significant(min(result.steps) / 4)
    return _Advice(if_true(touches and len(result.engines) > 1), quarter)


def _of_the_limit(result: Convergence, by_verdict: ByVerdict) -> Headline:
    """Return the headline: whether the gap vanishes with the timestep."""
    if result.is_still:
        return Headline(nothing_moved(result.motion), holds=False)
    if result.vanishes:
        return Headline(LEADS["vanishes" if by_verdict.keys() - {"rounding"} else "rounding"])
    gap = _leading(by_verdict)
    coarse, fine = quantity(gap.gaps[0], gap.unit), quantity(gap.gaps[-1], gap.unit)
    lead = LEADS[gap.verdict].format(
        name=name_of(gap.name),
        coarse=coarse,
        fine=fine,
        unclear=len(by_verdict.get("unclear", [])),
        total=len(result.whole),
    )
    return Headline(lead, end=_before_the_touch(result), holds=False)


def _leading(by_verdict: ByVerdict) -> GapLimit:
    """Return the gap that the headline is of.

    It is one that stays, or one that is unclear, whichever are more often; of those with the
    unit of the first the largest.
    """
    unclear = by_verdict.get("unclear", [])
    stay = [*by_verdict.get("stays", []), *by_verdict.get("in part", [])]
    if len(stay) > len(unclear):
        alike = [limit for limit in stay if limit.unit == stay[0].unit]
        return max(alike, key=lambda limit: limit.gaps[-1])
    candidates = unclear if unclear else list(chain(*by_verdict.values()))
    alike = [limit for limit in candidates if limit.unit == candidates[0].unit]
    return max(alike, key=lambda limit: limit.gaps[0])


def _before_the_touch(result: Convergence) -> str:
    """Say of a gap that stays that there is none until something touches; "" if there is one."""
    verdicts = {limit.verdict for limit in result.before}
    if result.touch is None or not verdicts or not verdicts <= {"rounding", "discretisation"}:
        return ""
    text = NO_GAP if verdicts == {"rounding"} else DISCRETISATION
    return text.format(touch=short_time(result.touch))
