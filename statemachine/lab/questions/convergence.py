"""The page of finer timesteps: which gap vanishes with them, and which does not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ...measures import QUANTITIES
from ...measures.text import grouped, milliseconds, quantity, short_time
from ...show.blocks import Block, Page, Table
from ...show.first_screen import first_screen, with_answer
from ...show.templates import PageContent, render
from ..compare.call_periods_page import call_periods_blocks
from ..compare.convergence import FINER, Convergence, GapLimit, GapState, TouchState
from ..compare.sides import Request, Side
from ..compare.stillness import nothing_moved
from ..compare.typed_command import typed_command
from ..runs.call_period import CallPeriods
from .compared_names import name_of
from .requests.converge import ConvergeResult

_FINER = ("at h", *(f"h/{finer}" for finer in FINER[1:]))
_WORST_FIRST = ("stays", "in part", "unclear", "discretisation")
_FINER_BY = 4  # than the steps as given, where those are too coarse
_OTHER_EXPERIMENT = "waves"  # moves whatever has an actuator

NextStep = Literal[
    "one step", "same period", "smaller steps", "finer", "another experiment", "nothing"
]


@dataclass(frozen=True)
class ConvergencePage(PageContent):
    """What the page of finer timesteps shows.

    Attributes:
        experiment: What was run.
        limits: What becomes of the gap of each quantity.
        worst: Table of the gaps that vanish least.
        more: How many gaps beyond rounding it does not show.
        next_step: What the next command is for.
        next_command: What to type next; "" for nothing.
        call_periods: How often a function is called on each side; None where none is run.
        details: Whether everything is shown.
        is_policy: Whether a policy is run, which says itself how often it commands.
    """

    template = "convergence.md.j2"
    experiment: str
    limits: Convergence
    worst: Table
    more: int
    next_step: NextStep
    next_command: str
    call_periods: CallPeriods | None
    details: bool
    is_policy: bool

    @property
    def left(self) -> str:
        """Return the label of the left side."""
        return self.limits.labels[0]

    @property
    def right(self) -> str:
        """Return the label of the right side."""
        return self.limits.labels[1]

    @property
    def holds(self) -> bool:
        """Tell whether something was compared, and every gap vanishes."""
        return self.limits.vanishes and not self.limits.is_still

    @property
    def state(self) -> GapState:
        """Return in a word what becomes of the gap with finer steps."""
        return self.limits.state

    @property
    def still(self) -> str:
        """Return the phrase for runs in which nothing moved."""
        return nothing_moved(self.limits.motion)

    @property
    def until_touch(self) -> TouchState:
        """Return what is left of the gap before the first touch."""
        return self.limits.until_touch

    @property
    def lead(self) -> GapLimit:
        """Return the quantity that is named first."""
        return self.limits.lead

    @property
    def name(self) -> str:
        """Return the name of the quantity that is named first, as a page has it."""
        return name_of(self.limits.lead.name)

    @property
    def counts(self) -> list[str]:
        """Return each verdict, with the number of gaps that have it."""
        by_verdict = grouped((limit.verdict, limit) for limit in self.limits.whole_run)
        return [f"{verdict} {len(limits)}" for verdict, limits in by_verdict.items()]

    @property
    def steps(self) -> list[str]:
        """Return the timesteps of both engines as they are without halving, each once."""
        return list(dict.fromkeys(milliseconds(step, 3) for step in self.limits.steps))

    @property
    def call_periods_note(self) -> list[Block]:
        """Return a warning where a function is called at different intervals on the two sides."""
        return call_periods_blocks(self.call_periods)

    @property
    def asks_function(self) -> bool:
        """Tell whether a function of the user's is the controller."""
        return self.call_periods is not None

    @property
    def periods_differ(self) -> bool:
        """Tell whether a command holds for another time on each side."""
        return not self.is_policy and self.period_left != self.period_right

    @property
    def period_left(self) -> str:
        """Return the time for which a command holds on the left, in milliseconds."""
        return milliseconds(self.limits.periods[0], 3)

    @property
    def period_right(self) -> str:
        """Return the time for which a command holds on the right, in milliseconds."""
        return milliseconds(self.limits.periods[1], 3)

    @property
    def longest_period(self) -> float:
        """Return the longer time for which a command holds [s]."""
        return max(self.limits.periods)

    @property
    def before_touch(self) -> Table:
        """Return a table of the gaps until the first touch; without rows where nothing touches."""
        touch = self.limits.touch
        if touch is None:
            return _limits_table((), "")
        title = f"The gap with finer steps, before the first touch at {short_time(touch)}"
        return _limits_table(self.limits.before_touch, title)

    @property
    def whole_run(self) -> Table:
        """Return a table of the gaps over the whole run."""
        return _limits_table(self.limits.whole_run, "The gap with finer steps, over the whole run")

    @property
    def farthest(self) -> GapLimit:
        """Return the quantity that is farthest apart with the timesteps that the sides have.

        Looked at are quantities with the unit of the first one.
        """
        limits = self.limits.whole_run
        alike = [limit for limit in limits if limit.unit == limits[0].unit]
        return max(alike, key=lambda limit: limit.as_given)

    @property
    def farthest_name(self) -> str:
        """Return the name of that quantity, as a page has it."""
        return name_of(self.farthest.name)

    @property
    def most_rounding(self) -> list[str]:
        """Return the largest gap that is rounding, in each unit."""
        largest: dict[str, float] = {}
        for limit in self.limits.whole_run:
            if limit.verdict == "rounding":
                largest[limit.unit] = max(*limit.gaps, largest.get(limit.unit, 0.0))
        return [quantity(gap, unit) for unit, gap in largest.items()]


def page(result: ConvergeResult, details: bool = False) -> Page:
    """Return the page of what vanishes with the timestep, and what does not.

    Args:
        result: What becomes of each gap.
        details: Whether every gap is shown, and those before the first touch.
    """
    gaps = _worst_first(result.whole_run)
    if details:
        return _page(result, (), details=True)
    return first_screen(lambda rows: _page(result, gaps[:rows]), len(gaps))


def _page(result: ConvergeResult, worst: Sequence[GapLimit], details: bool = False) -> Page:
    """Return the page with some of the gaps; with details two tables have all of them."""
    run = result.request.run
    periods = run.call_periods(result.periods)
    next_step = _next_step(result, run, periods)
    more = 0 if details else len(_worst_first(result.whole_run)) - len(worst)
    content = ConvergencePage(
        experiment=run.experiment,
        limits=result,
        worst=_limits_table(worst, "", finest=1),
        more=more,
        call_periods=periods,
        next_step=next_step,
        next_command=_next_command(next_step, result, run, periods),
        details=details,
        is_policy=run.is_policy,
    )
    return with_answer(render(content))


def _worst_first(limits: Sequence[GapLimit]) -> list[GapLimit]:
    """Return the gaps beyond rounding: those that vanish least first, coordinates before others.

    Of one unit the largest gap is the first.
    """
    units = list(dict.fromkeys(limit.unit for limit in limits))

    def place(limit: GapLimit) -> tuple[int, bool, int, float]:
        is_other = not QUANTITIES[limit.kind].is_coordinate
        return (
            _WORST_FIRST.index(limit.verdict),
            is_other,
            units.index(limit.unit),
            -limit.finest,
        )

    return sorted((limit for limit in limits if limit.verdict != "rounding"), key=place)


def _limits_table(limits: Sequence[GapLimit], title: str, finest: int = 3) -> Table:
    """Return a row for each gap beyond rounding.

    Args:
        limits: What becomes of each gap.
        title: Of the table.
        finest: How many of the finest steps have a column, beside the steps as given.
    """
    columns: dict[str, Callable[[GapLimit], str]] = {
        "quantity": lambda limit: name_of(limit.name),
        "the gap is": lambda limit: limit.verdict,
    }
    levels = max((len(limit.gaps) for limit in limits), default=0)
    for level in sorted({0, *range(max(levels - finest, 0), levels)}):
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


def _next_step(limits: Convergence, run: Request, periods: CallPeriods | None) -> NextStep:
    """Return what to ask next."""
    if periods is not None and periods.differ and limits.state not in ("still", "rounding"):
        return "same period"
    match limits.state:
        case "still":
            return "nothing" if run.what[0] == _OTHER_EXPERIMENT else "another experiment"
        case "rounding":
            return "nothing"
        case "vanishes":
            return "finer"
        case "unclear" if limits.touch is None:
            return "smaller steps"
    return "one step"


def _next_command(
    next_step: NextStep, limits: Convergence, run: Request, periods: CallPeriods | None
) -> str:
    """Return what to type next; "" for nothing."""
    if periods is not None:  # whose function is called as often with finer steps
        run = replace(run, every=periods.common_word)
    match next_step:
        case "same period":
            return typed_command(run).lines("--converge")
        case "one step":  # not --why, which leads here
            return typed_command(run).lines("--one-step")
        case "smaller steps":
            return typed_command(_with_finer_steps(run, limits.steps)).lines("--converge")
        case "finer":
            return typed_command(_with_finer_steps(run, limits.steps)).lines()
        case "another experiment":
            other = replace(run, what=(_OTHER_EXPERIMENT,), every=1, seconds=None)
            return typed_command(other).lines()
    return ""


def _with_finer_steps(run: Request, steps: tuple[float, float]) -> Request:
    """Return what is run, with a part of the timestep on both sides.

    Args:
        run: What is run.
        steps: The engine's step of each side, as given [s].
    """
    if steps[0] == steps[1] and not any("timestep" in side.options for side in run.sides):
        return replace(run, options={**run.options, "timestep": steps[0] / _FINER_BY})
    if not run.sides:  # one model on two engines, with steps of their own
        return replace(run, options={**run.options, "timestep": min(steps) / _FINER_BY})
    sides: list[Side] = []
    for side, step in zip(run.sides, steps, strict=True):
        sides.append(replace(side, options={**side.options, "timestep": step / _FINER_BY}))
    return replace(run, sides=tuple(sides))
