"""What one step on each side was read from many states, and which stage of it differs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..interface import Array
from .stages import (
    ACCELERATION,
    AFTER,
    FORCE,
    FOUND,
    KINEMATICS,
    MASS,
    STAGES,
    Reading,
    StageGroup,
    StageReader,
    Touching,
)

_STANDS_OUT = 10.0  # times the median
_MOST_SPIKES = 5
_LEAST = 1e-3  # of the largest: a size that is less is not usual
_FORCES = ("bias", "actuator", "passive", FORCE, "other constraints")


@dataclass(frozen=True)
class StageGap:
    """One stage of a step, over all moments.

    Attributes:
        stage: Its name.
        told: Whether both engines tell it; reason: why not, or "".
        unit: Of the figures.
        scale: Its usual size on the two sides: the median of its largest entry over the moments
            at which that is at least a thousandth of what it ever is.
        tolerance: What does not count.
        null: How far the left side, put back to its own states, gets from its own run.
        worst: The largest difference; at: when [s from the start].
        where: The joint, body or pair to look at then.
        beyond: At how many moments it is beyond the tolerance and beyond the null.
        leads: At how many of them no earlier stage is, so that it has a cause of its own.
        first: The first of them [s]; None if there is none.
    """

    stage: str
    told: bool
    reason: str = ""
    unit: str = ""
    scale: float = 0.0
    tolerance: float = 0.0
    null: float = 0.0
    worst: float = 0.0
    at: float | None = None
    where: str = ""
    beyond: int = 0
    leads: int = 0
    first: float | None = None


@dataclass(frozen=True)
class StepSpike:
    """A moment at which the accelerations of one step differ far more than they usually do.

    Attributes:
        at: When [s from the start].
        size: The difference of accelerations [unit]; joint: whose.
        stage: The first stage beyond its tolerance there; where: its joint, body or pair.
    """

    at: float
    size: float
    unit: str
    joint: str
    stage: str
    where: str


@dataclass(eq=False)
class StageMeasure:
    """What was read of one group, at n moments.

    Attributes:
        group: Its k elements.
        apart: (n, k) how far the two sides are apart.
        null: (n, k) how far the left side is from itself.
        scale: Its usual size, on either side.
        tolerance: What does not count.
    """

    group: StageGroup
    apart: Array
    null: Array
    scale: float
    tolerance: float = 0.0

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """(n, k) what is beyond the tolerance, and beyond the null."""
        return self.apart > np.maximum(self.tolerance, self.null)


class StepSamples:
    """What was read at all moments."""

    def __init__(self, reader: StageReader) -> None:
        self._reader, self.failed = reader, False
        self.times: list[float] = []
        # At each moment the numbers of the groups and the contacts, as of each `add`.
        self._read: list[list[tuple[list[Array], Touching]]] = []

    def add(self, time: float, *readings: tuple[Reading, Array]) -> None:
        """One moment: the left side as it runs, put back to its State, and the right side."""
        self.times.append(time)
        self._read.append(
            [
                (self._reader.whole(side, *each), each[0][1])
                for side, each in zip((0, 0, 1), readings, strict=True)
            ]
        )

    def measures(self, relative: float) -> list[StageMeasure]:
        """What both sides tell, each group with its scale and tolerance."""
        found: list[StageMeasure] = []
        for g, group in enumerate(self._reader.groups if self._read else ()):
            running, left, right = (np.array([m[k][0][g] for m in self._read]) for k in range(3))
            if group.names:
                sizes = group.largest(left, right)
                found += _measure(
                    group, group.apart(left, right), group.apart(running, left), sizes
                )
        pairs = tuple(dict.fromkeys(p for m in self._read for k in (1, 2, 0) for p in m[k][1]))
        if pairs:
            # Depth and force of each pair at each moment; what is not found is zero.
            running, left, right = (
                np.array([[m[k][1].get(pair, np.zeros(4)) for pair in pairs] for m in self._read])
                for k in range(3)
            )
            for stage, unit, of in ((FOUND, "m", _depths), (FORCE, "N", _pushes)):
                sizes = np.maximum(of(left), of(right)).max(axis=1)
                group = StageGroup(stage, unit, pairs)
                found += _measure(group, of(left - right), of(running - left), sizes)
        # What is nothing but rounding, as the contact force of a run in which nothing touches,
        # is held against the other forces, and accelerations against what forces give.
        pushed = {unit: _largest(found, _FORCES, unit) for unit in ("N·m", "N")}
        masses = {unit: _largest(found, (MASS,), unit) for unit in ("kg·m²", "kg")}
        least = {**pushed, "rad/s²": 0.0, "m/s²": 0.0}
        for unit, force, mass in (("rad/s²", "N·m", "kg·m²"), ("m/s²", "N", "kg")):
            if masses[mass]:
                least[unit] = pushed[force] / masses[mass]
        for each in found:
            if each.group.stage in (*_FORCES, ACCELERATION, AFTER):
                each.scale = max(each.scale, _LEAST * least[each.group.unit])
            each.tolerance = relative * each.scale
        return found

    def gaps(self, measures: Sequence[StageMeasure]) -> tuple[StageGap, ...]:
        """Each stage, by that of its units that is farthest beyond its tolerance."""
        found, leading = [], Counter(stage for stage, _ in self._firsts(measures))
        for stage in STAGES:
            own = [self._gap(each) for each in measures if each.group.stage == stage]
            if not own:
                reason = "nothing touches" if stage == FOUND else "an engine does not tell it"
                own = [StageGap(stage, stage == FOUND, reason)]
            # Of the measures of one stage that of pairs comes last, and says more than joints do.
            gap = max(reversed(own), key=_how_far if stage != FORCE else _differs)
            found.append(replace(gap, leads=leading[stage]))
        return tuple(found)

    def _gap(self, each: StageMeasure) -> StageGap:
        row, place = np.unravel_index(int(np.argmax(each.apart)), each.apart.shape)
        worst, hits = float(each.apart[row, place]), each.beyond.any(axis=1)
        return StageGap(
            stage=each.group.stage,
            told=True,
            unit=each.group.unit,
            scale=each.scale,
            tolerance=each.tolerance,
            null=float(each.null.max()),
            worst=worst,
            at=self.times[int(row)] if worst else None,
            where=_culprit(each, int(row)) if worst else "",
            beyond=int(hits.sum()),
            first=self.times[int(np.argmax(hits))] if hits.any() else None,
        )

    def spikes(self, measures: Sequence[StageMeasure]) -> tuple[StepSpike, ...]:
        """The moments at which the accelerations stand out."""
        firsts = self._firsts(measures)
        found: list[StepSpike] = []
        for each in measures:
            if each.group.stage != AFTER:
                continue
            most = each.apart.max(axis=1)
            stands = each.beyond.any(axis=1) & (most > _STANDS_OUT * np.median(most))
            padded = np.concatenate([[-np.inf], most, [-np.inf]])
            stands &= (most >= padded[:-2]) & (most > padded[2:])  # no flank of another
            for row in np.flatnonzero(stands).tolist():
                joint = each.group.names[int(np.argmax(each.apart[row]))]
                found.append(
                    StepSpike(
                        self.times[row], float(most[row]), each.group.unit, joint, *firsts[row]
                    )
                )
        return tuple(sorted(found, key=lambda spike: -spike.size)[:_MOST_SPIKES])

    def _firsts(self, measures: Sequence[StageMeasure]) -> list[tuple[str, str]]:
        """For each moment the first stage beyond its tolerance, and its worst element."""
        found = [("", "")] * len(self.times)
        for each in sorted(measures, key=lambda m: -STAGES.index(m.group.stage)):
            for row in np.flatnonzero(each.beyond.any(axis=1)).tolist():
                found[row] = each.group.stage, _culprit(each, row)
        return found


def _measure(group: StageGroup, apart: Array, null: Array, sizes: Array) -> Iterator[StageMeasure]:
    """That of the elements which both sides tell, if there are any."""
    told = np.isfinite(apart).all(axis=0)
    if told.any():
        own = replace(group, names=tuple(np.array(group.names, dtype=object)[told]))
        yield StageMeasure(own, apart[:, told], np.nan_to_num(null[:, told]), _usual(sizes))


def _culprit(each: StageMeasure, row: int) -> str:
    """What to look at in a moment: the element that differs most, or where that comes from.

    A body that is elsewhere takes along all that hangs on it, so that the first one counts; a
    mass shows in the entries of every joint that carries it, so that the last of these counts.
    """
    names, hits = each.group.names, np.flatnonzero(each.beyond[row])
    if each.group.stage == MASS:
        hits = np.array([k for k in hits.tolist() if " and " not in names[k]], dtype=np.int64)
    if len(hits) and each.group.stage in (KINEMATICS, MASS):
        return names[int(hits[0] if each.group.stage == KINEMATICS else hits[-1])]
    return names[int(np.argmax(each.apart[row]))]


def _usual(sizes: Array) -> float:
    """The median of sizes (n,), of those that are no thousandth of the largest."""
    acting = sizes[sizes > _LEAST * sizes.max(initial=0.0)]
    return float(np.median(acting)) if len(acting) else 0.0


def _largest(measures: Sequence[StageMeasure], stages: Sequence[str], unit: str) -> float:
    """The largest scale of some stages in a unit."""
    scales = (m.scale for m in measures if m.group.stage in stages and m.group.unit == unit)
    return max(scales, default=0.0)


def _differs(gap: StageGap) -> tuple[bool, bool]:
    """Whether it differs, and whether at all."""
    return gap.beyond > 0, gap.worst > 0


def _how_far(gap: StageGap) -> tuple[bool, float]:
    """By what the units of one stage are ranked."""
    if not gap.worst:
        return gap.beyond > 0, 0.0
    return gap.beyond > 0, gap.worst / gap.tolerance if gap.tolerance else np.inf


def _depths(touches: Array) -> Array:
    """How deep (n, p) [m], of depths and forces (n, p, 4)."""
    return np.abs(touches[:, :, 0])


def _pushes(touches: Array) -> Array:
    """How long the forces are (n, p) [N], of depths and forces (n, p, 4)."""
    return np.array([[float(np.linalg.norm(t[1:])) for t in moment] for moment in touches])
