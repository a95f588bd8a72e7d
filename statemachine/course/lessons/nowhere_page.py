"""The page of the first lesson: where the fingertip is, and who else says so."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...measures.text import vector
from ...show.blocks import Table
from ...show.engine_tables import Results, differences, emulated
from ...show.labels import TableLabels
from ...show.templates import PageContent
from .frame import LessonFrame
from .nowhere import NowhereResult

_SAY = TableLabels(__name__, "nowhere_labels.md.j2")


@dataclass(frozen=True)
class NowherePage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        witness_table: The fingertip by each engine, and by the other library; without rows where
            that was not asked.
        differences: How far the engines are from each other.
    """

    template = "nowhere.md.j2"
    lesson: LessonFrame
    result: NowhereResult
    witness_table: Table
    differences: Sequence[Table]

    @property
    def is_zero(self) -> bool:
        """Tell whether the fingertip of the fresh Data is at the origin."""
        return not self.result.first.any()

    @property
    def right(self) -> int:
        """Return the number of the right choice."""
        return 0 if self.is_zero else 1

    @property
    def centimetres_in_front(self) -> float:
        """Return how far in front of the foot the fingertip is [cm]."""
        return 100 * math.hypot(*self.result.second[:2])

    @property
    def centimetres_above(self) -> float:
        """Return how high above the floor the fingertip is [cm]."""
        return 100 * float(self.result.second[2])

    @property
    def emulated(self) -> str:
        """Return what this interface does in place of the engine; "" for nothing."""
        return emulated(self.result, "zeros when fresh")


def contents(results: Results[NowhereResult], frame: LessonFrame) -> dict[str, NowherePage]:
    """Return what the page shows of each engine."""
    first = next(iter(results.values()))
    witness_table = _witness_table(results, first)
    apart = differences(results, {_SAY("after"): _apart})
    return {
        name: NowherePage(frame, result, witness_table, apart) for name, result in results.items()
    }


def _witness_table(results: Results[NowhereResult], first: NowhereResult) -> Table:
    """Show the fingertip by each engine, and by the witness; nothing without a witness."""
    rows: list[tuple[str, str]] = []
    if first.witness:
        rows = [(name, vector(result.second, 10)) for name, result in results.items()]
        rows.append((first.witness.library, vector(first.witness.fingertip, 10)))
    return Table(("", "x, y, z [m]"), rows)


def _apart(left: NowhereResult, right: NowhereResult) -> str:
    """Return how far the fingertip is on one engine from that on another."""
    return f"{math.dist(left.second, right.second):.1e} m"
