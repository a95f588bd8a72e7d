"""The page of the lesson on Model and Data: what each costs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...measures.text import duration
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, by_engine, differences
from ...show.labels import TableLabels
from ...show.templates import PageContent
from ._many_worlds import Crowd, world_tables
from .frame import LessonFrame
from .objects import ObjectsResult

_SAY = TableLabels(__name__, "objects_labels.md.j2")
_CHEAP = 5  # times; a Data that is not cheaper than that is no bargain


@dataclass(frozen=True)
class ObjectsPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        costs: What each part costs.
        differences: How far the engines are from each other.
        worlds_tables: What many worlds cost; empty where that was not asked for.
    """

    template = "objects.md.j2"
    lesson: LessonFrame
    result: ObjectsResult
    costs: Table
    differences: Sequence[Table]
    worlds_tables: Sequence[Block]

    @property
    def right(self) -> int:
        """Return the number of the right choice."""
        return 0 if self.result.alone else 1

    @property
    def stepped(self) -> float:
        """Return the simulated time of the steps that the code takes [s]."""
        return 100 * self.result.provenance.timestep

    @property
    def cheap(self) -> bool:
        """Tell whether another Data costs much less than another load."""
        return self.result.making < self.result.loading / _CHEAP

    @property
    def crowd(self) -> Crowd | None:
        """Return what is said of many worlds; None where that was not asked for."""
        return None if self.result.further is None else Crowd(self.result.further)

    @property
    def apart(self) -> Crowd | None:
        """Return the same where each world is one of the engine's own, else None."""
        is_apart = self.result.further is not None and not self.result.further.shared
        return self.crowd if is_apart else None


def contents(results: Results[ObjectsResult], frame: LessonFrame) -> dict[str, ObjectsPage]:
    """Return what the page shows of each engine."""
    worlds = {name: result.further for name, result in results.items() if result.further}
    tables = world_tables(worlds, _SAY) if worlds else []
    costs, apart = _costs(results), _differences(results)
    return {
        name: ObjectsPage(frame, result, costs, apart, tables) for name, result in results.items()
    }


def _costs(results: Results[ObjectsResult]) -> Table:
    """Return the wall time of each part by engine."""
    rows: dict[str, Callable[[ObjectsResult], str]] = {}
    rows[_SAY("load_cost")] = lambda result: duration(result.loading)
    rows[_SAY("data_cost")] = lambda result: duration(result.making)
    rows[_SAY("step_cost")] = lambda result: duration(result.stepping)
    rows[_SAY("load_in_steps")] = lambda result: f"{result.ratio:,.0f} steps"
    return by_engine(results, rows)


def _differences(results: Results[ObjectsResult]) -> Sequence[Table]:
    """Return how much longer each part takes on another engine than on the first."""
    rows: dict[str, Callable[[ObjectsResult, ObjectsResult], str]] = {}
    rows[_SAY("load_takes")] = lambda a, b: _times(a.loading, b.loading)
    rows[_SAY("data_takes")] = lambda a, b: _times(a.making, b.making)
    rows[_SAY("step_takes")] = lambda a, b: _times(a.stepping, b.stepping)
    return differences(results, rows)


def _times(first: float, other: float) -> str:
    """Write how many times as long as the first another takes."""
    return f"{other / first:.1f} ×"
