"""The page of the lesson on replay: two runs compared, and ways back to a state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...measures import largest
from ...measures.text import degrees, millimetres
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, by_engine, differences
from ...show.labels import TableLabels
from ...show.templates import PageContent
from ._two_runs import (
    BrokenRun,
    Touching,
    broken_table,
    course_of,
    growth,
    of_its_own,
    through_us,
    touching_table,
)
from .frame import LessonFrame
from .replay import FinerRuns, ReplayResult

_SAY = TableLabels(__name__, "replay_labels.md.j2")
_COURSES = ("grows", "shrinks", "stays")  # of a difference, in the order of the choices


@dataclass(frozen=True)
class ReplayPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        outcome: Whether the two runs are equal.
        growth: The difference after some of the steps, of a second run that was made to differ.
        broken_runs: What became of second runs that were made to differ, if this one was not.
        differences: How far the engines are from each other.
        touched: What touched in the first run.
        ways: The ways back of this interface; without rows where they were not tried.
        own_ways: The ways back of the engines themselves, where they were tried.
    """

    template = "replay.md.j2"
    lesson: LessonFrame
    result: ReplayResult
    outcome: Table
    growth: Sequence[Block]
    broken_runs: Sequence[Block]
    differences: Sequence[Table]
    touched: Table
    ways: Table
    own_ways: Sequence[Table]

    @property
    def right(self) -> int | None:
        """Return the number of the right choice; None if none of them is right.

        The choices of a second run that was made to differ are `_COURSES`.
        """
        if self.result.broken_by is None:
            return 0 if self.result.identical else None
        return _COURSES.index(course_of(self.result.difference))

    @property
    def peak(self) -> float:
        """Return the largest difference on the way [rad, m or part of a quaternion]."""
        return largest(self.result.difference)[0]

    @property
    def peak_step(self) -> int:
        """Return after which step the difference is largest."""
        return largest(self.result.difference)[1]

    @property
    def end(self) -> float:
        """Return the difference at the end [rad, m or part of a quaternion]."""
        return float(self.result.difference[-1])

    @property
    def shrinks(self) -> bool:
        """Tell whether the difference of a second run that was made to differ becomes small."""
        is_apart = self.result.broken_by is not None and not self.result.identical
        return is_apart and course_of(self.result.difference) == "shrinks"

    @property
    def touch(self) -> bool:
        """Tell whether something touches in every step."""
        return bool(self.result.contacts.all())

    @property
    def fewest(self) -> int:
        """Return the smallest number of contacts in a step."""
        return int(self.result.contacts.min())

    @property
    def broken(self) -> BrokenRun | None:
        """Return the first second run that was made to differ; None without one."""
        return self.result.breaks[0] if self.result.breaks else None

    @property
    def broken_right(self) -> int | None:
        """Return the number of the right choice of that run; None without one."""
        return None if self.broken is None else _COURSES.index(self.broken.course)

    @property
    def notices(self) -> bool:
        """Tell whether the ends of all broken runs differ from that of the first run."""
        return bool(self.result.breaks) and all(run.end > 0 for run in self.result.breaks)

    @property
    def equal_ends(self) -> int:
        """Return how many broken runs differ on the way, and end in the same bits all the same."""
        return sum(run.peak > 0 and run.end == 0 for run in self.result.breaks)

    @property
    def shrinks_all(self) -> bool:
        """Tell whether the difference of each broken run becomes small again."""
        return bool(self.result.breaks) and all(
            run.course == "shrinks" for run in self.result.breaks
        )

    @property
    def fools(self) -> int:
        """Return how many broken runs end elsewhere, and `np.allclose` calls the end equal."""
        return sum(run.close and run.end > 0 for run in self.result.breaks)

    @property
    def finer(self) -> FinerRuns | None:
        """Return the runs with half the timestep if they repeat and end elsewhere, else None."""
        finer = self.result.finer
        ends_elsewhere = finer is not None and finer.identical and finer.difference > 0
        return finer if ends_elsewhere else None


def contents(results: Results[ReplayResult], frame: LessonFrame) -> dict[str, ReplayPage]:
    """Return what the page shows of each engine."""
    first = next(iter(results.values()))
    touching = {name: Touching(result.contacts, result.pairs) for name, result in results.items()}
    rows: dict[str, Callable[[ReplayResult, ReplayResult], str]] = {
        _SAY("hinges_apart"): _hinges_apart,
        _SAY("bodies_apart", body=first.body): _bodies_apart,
        _SAY("contacts_apart"): _contacts_apart,
    }
    outcome, grown, apart = _outcome(results), _growth(results, first), differences(results, rows)
    breaks = broken_table({name: result.breaks for name, result in results.items()}, _SAY)
    touched = touching_table(touching, _SAY)
    ways = through_us({name: result.ways for name, result in results.items()}, _SAY)
    own_ways = of_its_own({name: result.own_ways for name, result in results.items()}, _SAY)
    return {
        name: ReplayPage(frame, result, outcome, grown, breaks, apart, touched, ways, own_ways)
        for name, result in results.items()
    }


def _growth(results: Results[ReplayResult], first: ReplayResult) -> list[Block]:
    """Return the difference after some of the steps, if the second run was made to differ."""
    if not first.broken_by:
        return []
    gaps = {name: result.difference for name, result in results.items()}
    bodies = {name: result.apart for name, result in results.items()}
    return growth(gaps, bodies, first.body, _SAY)


def _outcome(results: Results[ReplayResult]) -> Table:
    """Show whether the two runs are equal, and how far they are apart."""
    rows: dict[str, Callable[[ReplayResult], str]] = {}
    rows["np.array_equal"] = lambda result: str(result.identical)
    rows["np.allclose"] = lambda result: str(result.close)
    rows[_SAY("at_end")] = lambda result: f"{result.difference[-1]:.1e}"
    rows[_SAY("on_the_way")] = lambda result: f"{result.difference.max():.1e}"
    rows[_SAY("turn")] = lambda result: degrees(result.travel, 1)
    return by_engine(results, rows)


def _hinges_apart(left: ReplayResult, right: ReplayResult) -> str:
    """Return the largest distance of a hinge between two ends."""
    gaps = np.abs(left.qpos - right.qpos)[list(left.hinges)]
    return degrees(float(gaps.max()), 3) if len(gaps) else "there are none"


def _bodies_apart(left: ReplayResult, right: ReplayResult) -> str:
    """Return the distance of the free body between two ends."""
    if left.free is None:
        return "there is none"
    return millimetres(float(np.linalg.norm((left.qpos - right.qpos)[list(left.free)])))


def _contacts_apart(left: ReplayResult, right: ReplayResult) -> str:
    """Compare the average number of contacts in a step."""
    return f"{right.contacts.mean():.1f} instead of {left.contacts.mean():.1f}"
