"""The page of the lesson on a command: the way there, and what is in the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...interface import Array
from ...measures import contacts_in_words, largest
from ...measures.text import position
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, differences, largest_gap, where
from ...show.labels import TableLabels
from ...show.pictures import Traces
from ...show.templates import PageContent
from ._torques import Strain, strain_of, torque_table
from .frame import LessonFrame
from .hold import HoldResult

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)
_AT_TARGET = np.radians(0.1)  # rad, or m
_OLDER_LIMITS = np.radians(1e-3), np.radians(1)  # of the choices on an older release
_SAY = TableLabels(__name__, "hold_labels.md.j2")


@dataclass(frozen=True)
class TargetGap:
    """How far a joint is from its target.

    Attributes:
        joint: Its name.
        size: The distance [rad; of a slide, m].
        slide: Whether it is a slide.
    """

    joint: str
    size: float
    slide: bool


@dataclass(frozen=True)
class HoldPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        way: The worst joint at some moments.
        pose: Where each joint is to be, and where it is at the end.
        torque: What each servo exerts; without rows where no engine tells it.
        curves: The way of each joint.
        strain: What the servos exert of what they can; None where that is not one number.
        differences: How far the engines are from each other.
    """

    template = "hold.md.j2"
    lesson: LessonFrame
    result: HoldResult
    way: Table
    pose: Table
    torque: Table
    curves: Sequence[Block]
    strain: Strain | None
    differences: Sequence[Table]

    @property
    def at_target(self) -> float:
        """Return the distance within which a joint is at its target [rad or m]."""
        return float(_AT_TARGET)

    @property
    def seconds(self) -> float:
        """Return the simulated time of the run [s]."""
        return float(self.result.time[-1])

    @property
    def steps(self) -> int:
        """Return the number of its steps."""
        return len(self.result.time) - 1

    @property
    def away(self) -> int:
        """Return how many joints are not at their targets at the end."""
        return int((self.result.distances()[-1] > _AT_TARGET).sum())

    @property
    def right(self) -> int:
        """Return the number of the right choice: all, some or none are at their targets."""
        if self.away == 0:
            return 0
        return 2 if self.away == len(self.result.joints) else 1

    @property
    def worst(self) -> TargetGap:
        """Return the joint that is farthest from its target at the end."""
        return _farthest(self.result, self.result.qpos[-1])

    @property
    def free_worst(self) -> TargetGap | None:
        """Return that of the run in which nothing can touch; None without such a run."""
        if self.result.without_contacts is None:
            return None
        return _farthest(self.result, self.result.without_contacts)

    @property
    def touched(self) -> str:
        """Return what touches what when the robot first touches something."""
        return contacts_in_words(self.result.touched)

    @property
    def touching(self) -> str:
        """Return what touches what at the end."""
        return contacts_in_words(self.result.touching) if self.result.touching else "nothing"

    @property
    def pressed(self) -> bool:
        """Tell whether the robot is pressed against something, and cannot reach its target."""
        free_gap = _farthest(self.result, self.result.ends_without_contacts()).size
        return bool(self.result.touching) and self.worst.size > max(_AT_TARGET, free_gap)

    @property
    def installed(self) -> str:
        """Return the version of the engine."""
        return self.result.provenance.versions[self.result.provenance.backend]

    @property
    def older_right(self) -> int | None:
        """Return the number of the right choice on an older release; None without one."""
        if self.result.older is None:
            return None
        return sum(self.result.older.gap > limit for limit in _OLDER_LIMITS)


def _farthest(result: HoldResult, pose: Array) -> TargetGap:
    """Return the joint that is farthest from its target in a pose (k,) [rad; of a slide, m]."""
    gap, joint = largest(np.abs(pose - result.target))
    return TargetGap(result.joints[joint], gap, result.slides[joint])


def contents(results: Results[HoldResult], frame: LessonFrame) -> dict[str, HoldPage]:
    """Return what the page shows of each engine."""
    first = next(iter(results.values()))
    rows: dict[str, Callable[[HoldResult, HoldResult], str]] = {
        _SAY("apart_before"): _apart_before_touch,
        _SAY("apart_after"): _apart_after_touch,
        _SAY("apart_end"): _apart_at_end,
        _SAY("apart_freely"): _apart_freely,
    }
    torque = torque_table({name: result.torques for name, result in results.items()}, _SAY)
    curves = [*_curves(results, False), *_curves(results, True)]
    way, pose = _way(results, end=float(first.time[-1])), _pose(results, first)
    apart = differences(results, rows)
    return {
        name: HoldPage(frame, result, way, pose, torque, curves, strain_of(result.torques), apart)
        for name, result in results.items()
    }


def _way(results: Results[HoldResult], end: float) -> Table:
    """Show how far the worst joint is from its target at some times."""
    times = [time for time in _TIMES if time < end - 1e-6] + [end]
    rows: list[tuple[str, ...]] = []
    for time in times:
        cells = [_worst_at(result, time) for result in results.values()]
        rows.append((f"{time:.3f} s", *cells))
    return Table(("time", *results), rows)


def _worst_at(result: HoldResult, time: float) -> str:
    """Say which joint is farthest from its target at a time, and by how much."""
    moment = int(np.argmin(np.abs(result.time - time)))
    gap, joint = largest(result.distances()[moment])
    return f"{result.joints[joint]}  {position(gap, result.slides[joint], 3)}"


def _pose(results: Results[HoldResult], first: HoldResult) -> Table:
    """Show where the joints are to be, and where they are at the end."""
    poses = {"target": first.target}
    if not np.array_equal(first.command, first.target):
        poses = {"command": first.command, **poses}
    for name, result in results.items():
        poses[name] = result.qpos[-1]
    rows: list[tuple[str, ...]] = []
    for k, joint in enumerate(first.joints):
        cells = [position(float(pose[k]), first.slides[k]) for pose in poses.values()]
        rows.append((joint, *cells))
    return Table(("joint", *poses), rows)


def _curves(results: Results[HoldResult], slide: bool) -> list[Block]:
    """Draw how far each slide, or each other joint, is from its target."""
    scale, unit = (1e3, "mm") if slide else (np.degrees(1.0), "°")
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for name, result in results.items():
        prefix = where(results, name)
        distances = scale * (result.qpos - result.target)
        for k, joint in enumerate(result.joints):
            if result.slides[k] is slide:
                curves[f"{prefix}{joint}"] = (result.time.tolist(), distances[:, k].tolist())
    if not curves:
        return []
    return [Traces(_SAY("curves"), "time [s]", _SAY("distance", unit=unit), curves)]


def _after_touch(left: HoldResult, right: HoldResult) -> int:
    """Return the row after that in which one of two runs first touches something."""
    times = [run.first_contact for run in (left, right) if run.first_contact is not None]
    if not times:
        return len(left.time)
    return round(min(times) / left.provenance.timestep) + 1


def _apart_before_touch(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint up to the first touch."""
    return _apart(left, right, slice(_after_touch(left, right)))


def _apart_after_touch(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint after the first touch."""
    return _apart(left, right, slice(_after_touch(left, right), None))


def _apart_at_end(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint at the end."""
    return _apart(left, right, slice(-1, None))


def _apart(left: HoldResult, right: HoldResult, rows: slice) -> str:
    """Return the largest gap of a joint in some rows of two runs."""
    return largest_gap(left.qpos[rows], right.qpos[rows], left.slides, left.joints, left.time[rows])


def _apart_freely(left: HoldResult, right: HoldResult) -> str:
    """Return the largest gap of a joint at the ends without contacts."""
    poses = left.ends_without_contacts()[None], right.ends_without_contacts()[None]
    return largest_gap(*poses, slides=left.slides, names=left.joints, time=np.array([]))
