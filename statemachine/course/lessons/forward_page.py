"""The page of the lesson on a write: four readings, and what each call changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from ...measures.text import vector
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, differences, emulated
from ...show.labels import TableLabels
from ...show.templates import PageContent
from ._stages import (
    ChangeCounts,
    WorstLag,
    change_tables,
    counts_of,
    lag_tables,
    own_tables,
    worst_lag_of,
)
from ._write import WriteEffects, refusals
from .forward import AfterStep, ForwardResult, Pairs
from .frame import LessonFrame

_SAY = TableLabels(__name__, "forward_labels.md.j2")
_INSIDE = 1e-3  # metres; less is how engines press things together
_CHOICES: dict[Pairs, int] = {((0, 1),): 0, ((1, 2),): 1, ((2, 3),): 2, ((1, 3),): 3}


@dataclass(frozen=True)
class FurtherPart:
    """What the page says of what goes further.

    Attributes:
        effects: What the next step makes of the write.
        changes: How many arrays each call changes.
        lag: How far what a step leaves is behind.
        of_a_moment: Whether it belongs to a moment, before the step or after it. RK4 leaves what it
            computed for a stage of its own.
    """

    effects: WriteEffects
    changes: ChangeCounts
    lag: WorstLag
    of_a_moment: bool


@dataclass(frozen=True)
class FurtherTables:
    """Tables of what goes further, of all engines.

    Attributes:
        refused: What is refused.
        changes: What each call changes.
        own_write: What the engines themselves make of a write.
        lag: Of which moment derived values are after a step.
        own_step: What the engines themselves do in a step.
    """

    refused: Table
    changes: Sequence[Table]
    own_write: Sequence[Table]
    lag: Sequence[Block]
    own_step: Sequence[Table]


@dataclass(frozen=True)
class ForwardPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        readings: The four readings.
        differences: How far the engines are from each other.
        tables: What goes further; empty where that was not asked for.
    """

    template = "forward.md.j2"
    lesson: LessonFrame
    result: ForwardResult
    readings: Table
    differences: Sequence[Table]
    tables: FurtherTables

    @property
    def right(self) -> int | None:
        """Return the number of the right choice; None if none of them is right."""
        return _CHOICES.get(self.result.equal)

    @property
    def zero_at_first(self) -> bool:
        """Tell whether the fingertip of a fresh Data is at the origin."""
        return not self.result.readings[0].fingertip.any()

    @property
    def unchanged(self) -> bool:
        """Tell whether the write changed nothing that is derived."""
        return (1, 2) in self.result.equal

    @property
    def overwrites(self) -> bool:
        """Tell whether another number stood where it was written: only then can a copy show it."""
        return self.result.written.copy != self.result.value

    @property
    def is_view(self) -> bool:
        """Tell whether another name for qpos shows what was written."""
        return self.result.written.view == self.result.value

    @property
    def engine_agrees(self) -> bool:
        """Tell whether the engine's own memory shows what was written."""
        return self.result.written.in_engine == self.result.value

    @property
    def no_time_passed(self) -> bool:
        """Tell whether the time is the same in all readings."""
        return len({reading.time for reading in self.result.readings}) == 1

    @property
    def stepped(self) -> AfterStep | None:
        """Return what one step leaves, if it is behind the state that the step ends in."""
        stepped = self.result.stepped
        return stepped if stepped is not None and stepped.behind > 0 else None

    @property
    def is_inside(self) -> bool:
        """Tell whether part of the robot is inside something after the write."""
        return self.result.deepest > _INSIDE

    @property
    def emulated(self) -> str:
        """Return what this interface does in place of the engine; "" for nothing."""
        promises = ("zeros when fresh", "stale after a write", "stale after a step")
        return emulated(self.result, *promises)

    @property
    def further(self) -> FurtherPart | None:
        """Return what goes further; None where that was not asked for."""
        further = self.result.further
        if further is None:
            return None
        return FurtherPart(
            effects=further.effects,
            changes=counts_of(further.changes),
            lag=worst_lag_of(further.lag),
            of_a_moment=not further.lag.neither,
        )


def contents(results: Results[ForwardResult], frame: LessonFrame) -> dict[str, ForwardPage]:
    """Return what the page shows of each engine."""
    first = next(iter(results.values()))
    rows: dict[str, Callable[[ForwardResult, ForwardResult], str]] = {}
    for k in range(len(first.readings)):
        rows[_SAY("reading", site=first.site, number=k + 1)] = partial(_apart, k)
    readings, apart = _readings(results, first), differences(results, rows)
    tables = _further_tables(results)
    return {
        name: ForwardPage(frame, result, readings, apart, tables)
        for name, result in results.items()
    }


def _further_tables(results: Results[ForwardResult]) -> FurtherTables:
    """Return the tables of what goes further; empty where that was not asked for."""
    further = {name: result.further for name, result in results.items() if result.further}
    if not further:
        return FurtherTables(Table((), ()), (), (), (), ())
    first = next(iter(further.values()))
    answers = {name: each.itself for name, each in further.items()}
    changes = {name: each.changes for name, each in further.items()}
    lag = {name: each.lag for name, each in further.items()}
    return FurtherTables(
        refused=refusals(first.effects),
        changes=change_tables(changes, _SAY),
        own_write=own_tables(answers, "write", _SAY),
        lag=lag_tables(lag, _SAY),
        own_step=own_tables(answers, "step", _SAY),
    )


def _readings(results: Results[ForwardResult], first: ForwardResult) -> Table:
    """Show the four readings; those that are equal to another are set off."""
    decimals = 3 if len(results) > 1 else 4  # so that two columns fit
    rows: list[tuple[str, ...]] = []
    for k, reading in enumerate(first.readings):
        cells = [vector(each.readings[k].fingertip, decimals) for each in results.values()]
        rows.append((str(k + 1), reading.after, *cells, f"{reading.time:g} s"))
    equal: set[int] = set()
    for result in results.values():
        equal.update(*result.equal)
    columns = [f"{name} [m]" for name in results]
    return Table(
        ("", "after", *columns, "data.time"),
        rows,
        words=frozenset({0, 1}),
        emphasis=frozenset(equal),
    )


def _apart(reading: int, left: ForwardResult, right: ForwardResult) -> str:
    """Return how far a reading on one engine is from that on another."""
    gap = math.dist(left.readings[reading].fingertip, right.readings[reading].fingertip)
    return f"{gap:.1e} m"
