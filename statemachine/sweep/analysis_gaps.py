"""The gap between two engines at every point and seed of a sweep, from the rows of its dataset."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import BadInputError
from ..interface import Array
from .cell import DONE
from .design import Design, DesignPoint

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class GapQuantity:
    """What the gap of two runs is a gap of.

    Attributes:
        name: As an option calls it; kind: as a tolerance calls it.
        kind: See name.
        says: In words.
        unit: SI.
        end: Whether it is that of the last moment; else the largest of the moments that are kept.
    """

    name: str
    kind: str
    says: str
    unit: str
    end: bool = False


QUANTITIES = {
    each.name: each
    for each in (
        GapQuantity("tip", "tip", "fingertip", "m"),
        GapQuantity("tip-end", "tip", "fingertip at the end", "m", True),
        GapQuantity("qpos", "joint", "joint angles", "rad"),
        GapQuantity("qpos-end", "joint", "joint angles at the end", "rad", True),
        GapQuantity("touch", "contact", "first touch", "s"),
    )
}


@dataclass(frozen=True, eq=False)
class SweepRuns:
    """Runs of one engine, at points and seeds or in any other order; NaN where there is none.

    Attributes:
        tip: (…, m, 3) fingertip at the moments that are kept [m]; qpos: (…, m, n) angles [rad].
        qpos: See tip.
        touch: (…) when something first touched [s]; infinite if nothing did.
        time: (…) simulated time at the end [s]; timestep: (…) [s].
        timestep: See time.
    """

    tip: Array
    qpos: Array
    touch: Array
    time: Array
    timestep: Array

    @property
    def done(self) -> Flags:
        """(…) whether there is a run."""
        return ~np.isnan(self.time)

    def __getitem__(self, place: Any) -> SweepRuns:
        return SweepRuns(*(getattr(self, name)[place] for name in self.__dataclass_fields__))

    def vectors(self, name: str) -> Array:
        """(…, m, d): what the gap of a quantity is the length of a difference of."""
        if name == "touch":
            return np.where(np.isinf(self.touch), np.nan, self.touch)[..., None, None]
        values = self.tip if QUANTITIES[name].kind == "tip" else self.qpos
        return values[..., -1:, :] if QUANTITIES[name].end else values


def length(name: str, difference: Array) -> Array:
    """The gap (…) that a difference (…, m, d) is: the largest of the moments."""
    if QUANTITIES[name].kind == "tip":
        return _largest(np.linalg.norm(difference, axis=-1))
    return _largest(_largest(np.abs(difference)))


def _largest(values: Array) -> Array:
    """Over the last axis, of what is a number; NaN where nothing is."""
    if not values.shape[-1]:
        return np.full(values.shape[:-1], np.nan)
    found: Array = np.where(np.isnan(values), -np.inf, values).max(axis=-1)
    return np.where(found == -np.inf, np.nan, found)


def gap_between(name: str, one: SweepRuns, two: SweepRuns) -> Array:
    """The gap (…) of a quantity between runs.

    Of a first touch that only one side has it is the length of the run, and 0 if neither has one.
    """
    if name != "touch":
        return length(name, one.vectors(name) - two.vectors(name))
    until = np.minimum(one.time, two.time)
    never = np.isinf(one.touch).astype(int) + np.isinf(two.touch)
    with np.errstate(invalid="ignore"):
        gap = np.abs(one.touch - two.touch)
    return np.where(never == 2, 0.0 * until, np.where(never == 1, until, gap))


def runs_of(rows: Sequence[Mapping[str, Any]], hinges: Sequence[int] | None = None) -> SweepRuns:
    """Runs (n,) from rows as the dataset has them; a row that failed is none.

    Args:
        rows: Of cells.
        hinges: Which numbers of qpos are angles; None for all.
    """
    done = np.array([row["status"] == DONE for row in rows], dtype=bool)

    def scalar(name: str, none: float) -> Array:
        found = [row.get(name) for row in rows]
        return np.where(done, [none if v is None else float(v) for v in found], np.nan)

    def nested(name: str) -> Array:
        kept = [np.array(r.get(name) or [], dtype=float) if d else None
                for r, d in zip(rows, done, strict=True)]  # fmt: skip
        shapes = [each.shape for each in kept if each is not None and each.ndim == 2]
        m, d = (max((shape[k] for shape in shapes), default=0) for k in (0, 1))
        made = np.full((len(rows), m, d), np.nan)
        for k, each in enumerate(kept):
            if each is not None and each.ndim == 2:  # the last moment stays the last
                made[k, m - len(each) :, : each.shape[1]] = each
        return made

    qpos, time, steps = nested("sample_qpos"), scalar("time", np.nan), scalar("steps", np.nan)
    return SweepRuns(
        nested("sample_tip"),
        qpos if hinges is None else qpos[..., list(hinges)],
        scalar("first_touch", np.inf),
        time,
        time / np.maximum(steps, 1),
    )


def _nested(column: Any) -> Array | None:
    """A column of lists of lists (n, m, d) without a loop; None if they are of several lengths."""
    column = column.combine_chunks()
    inner = column.flatten()
    if column.null_count or inner.null_count or not len(column) or not len(inner):
        return None
    outer, lengths = (np.diff(each.offsets.to_numpy()) for each in (column, inner))
    if np.ptp(outer) or np.ptp(lengths):
        return None
    flat = inner.flatten().to_numpy(zero_copy_only=False)
    return np.array(flat, dtype=float).reshape(len(column), outer[0], lengths[0])


@dataclass(frozen=True, eq=False)
class SweepGaps:
    """Both engines of a sweep at every point and seed.

    Attributes:
        sides: Their names.
        design: Of the sweep; points: its points (p), each a setting.
        points: See design.
        seeds: Which ones.
        left: Runs (p, s) of the one; right: of the other.
        right: See left.
        failed: How many cells of either failed, by the class of the error; missing: have not run.
        missing: See failed.
    """

    sides: tuple[str, str]
    design: Design
    points: tuple[DesignPoint, ...]
    seeds: tuple[int, ...]
    left: SweepRuns
    right: SweepRuns
    failed: Mapping[str, int]
    missing: int

    @cached_property
    def _gaps(self) -> dict[str, Array]:
        return {name: gap_between(name, self.left, self.right) for name in QUANTITIES}

    def gap(self, name: str) -> Array:
        """(p, s) of a quantity; NaN where either side has no run."""
        return self._gaps[name]

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """The names of what the dataset has on both sides."""
        found = [
            name for name in QUANTITIES if name != "touch" and np.isfinite(self.gap(name)).any()
        ]
        if any((np.isfinite(each.touch)).any() for each in (self.left, self.right)):
            found.append("touch")
        return tuple(found)

    def values(self, label: str) -> list[Any]:
        """(p) the value of a factor at each point."""
        place = [vary.label for vary in self.design.factors].index(label)
        return [point.values[place] for point in self.points]


def gaps_of(
    table: Any,
    design: Design,
    sides: tuple[str, str],
    seeds: int,
    hinges: Sequence[int] | None = None,
) -> SweepGaps:
    """What the dataset of a sweep says of two engines.

    Args:
        table: As `read_cells` gives it.
        design: Of the sweep.
        sides: Two of its backends.
        seeds: How many the sweep has.
        hinges: Which numbers of qpos are angles; None for all.

    Raises:
        BadInputError: No setting has a run on both.
    """
    lacking = BadInputError(
        f"no setting of this sweep has a run on both {sides[0]} and {sides[1]}; of cells that "
        "failed, the column error says why"
    )
    points = tuple(design.points())
    place = {point.id: k for k, point in enumerate(points)}
    keys = [table[name].to_pylist() for name in ("backend", "point", "seed", "status")]
    failed: Counter[str] = Counter()
    found: list[SweepRuns] = []
    count = 0
    for side in sides:
        rows, where = [], []
        for k, (backend, point, seed, status) in enumerate(zip(*keys, strict=True)):
            if backend == side and point in place and seed < seeds:
                count += 1
                if status == DONE:
                    rows.append(k)
                    where.append(place[point] * seeds + seed)
                else:
                    failed[table["error_class"][k].as_py()] += 1
        if not rows:
            raise lacking
        found.append(_spread(_read(table.take(rows), hinges), where, len(points), seeds))
    left, right = found
    if not (left.done & right.done).any():
        raise lacking
    missing = 2 * len(points) * seeds - count
    left, right = alike(left, right)
    return SweepGaps(
        sides, design, points, tuple(range(seeds)), left, right,
        dict(failed.most_common()), missing,
    )  # fmt: skip


def _read(table: Any, hinges: Sequence[int] | None) -> SweepRuns:
    """Runs (n,) of the rows of a table, all of them done."""
    tip, qpos = _nested(table["sample_tip"]), _nested(table["sample_qpos"])
    if tip is None or qpos is None:
        names = ("status", "time", "steps", "first_touch", "sample_tip", "sample_qpos")
        return runs_of(table.select(names).to_pylist(), hinges)
    time, steps, touch = (
        np.array(table[name].to_numpy(), dtype=float) for name in ("time", "steps", "first_touch")
    )
    touch = np.where(np.isnan(touch), np.inf, touch)
    qpos = qpos if hinges is None else qpos[..., list(hinges)]
    return SweepRuns(tip, qpos, touch, time, time / np.maximum(steps, 1))


def _spread(runs: SweepRuns, where: Sequence[int], points: int, seeds: int) -> SweepRuns:
    """Runs (n,) put at their points and seeds (p, s)."""

    def put(values: Array) -> Array:
        made = np.full((points * seeds, *values.shape[1:]), np.nan)
        made[list(where)] = values
        return made.reshape(points, seeds, *values.shape[1:])

    return SweepRuns(*(put(getattr(runs, name)) for name in runs.__dataclass_fields__))


def joined(runs: Sequence[SweepRuns]) -> SweepRuns:
    """Runs (n,) one after the other, with arrays of the same shapes."""
    found = runs[0]
    for other in runs[1:]:
        pair = alike(found, other)
        names = found.__dataclass_fields__
        found = SweepRuns(
            *(np.concatenate([getattr(each, name) for each in pair]) for name in names)
        )
    return found


def alike(one: SweepRuns, two: SweepRuns) -> tuple[SweepRuns, SweepRuns]:
    """Both with arrays of the same shapes, the shorter one filled up with NaN."""

    def filled(values: Array, like: Array) -> Array:
        m, d = (max(values.shape[k], like.shape[k]) for k in (-2, -1))
        made = np.full((*values.shape[:-2], m, d), np.nan)
        made[..., m - values.shape[-2] :, : values.shape[-1]] = values
        return made

    def of(a: SweepRuns, b: SweepRuns) -> SweepRuns:
        return SweepRuns(filled(a.tip, b.tip), filled(a.qpos, b.qpos), a.touch, a.time, a.timestep)

    return of(one, two), of(two, one)


def median(values: Array, axis: int = -1) -> Array:
    """Of what is a number; NaN where nothing is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found: Array = np.nanmedian(values, axis=axis)
    return found


def worst(values: Array) -> Array:
    """The largest over the last axis of what is a number; NaN where nothing is."""
    return _largest(values)
