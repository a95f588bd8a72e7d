"""Two engines of a sweep as arrays, read once from its dataset: runs, and how far apart they are.

A run is an element of a structured array, whose fields are

    tip (m, 3) site at the moments that are kept [m]
    qpos (m, n) angles then [rad]
    touch when something first touched [s]; infinite if nothing did
    time simulated time at the end [s]
    timestep [s]

All are NaN where there is no run. A run that keeps fewer moments has NaN before them.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import BadInputError
from ..interface import Array, Ints
from ..page import Figures
from .design import Design
from .rows import DONE, require_parquet

_RESAMPLES = 400
Flags = NDArray[np.bool_]
Runs = NDArray[Any]  # structured, as above


# What the gap of two runs is a gap of: kind, as a tolerance calls it; in words, where {site} is the
# site's name; and whether it is that of the last moment, else the largest of those that are kept.
RUN_QUANTITIES = {
    "tip": Figures(kind="tip", says="site {site}", end=False),
    "tip-end": Figures(kind="tip", says="site {site} at the end", end=True),
    "qpos": Figures(kind="joint", says="joint angles", end=False),
    "qpos-end": Figures(kind="joint", says="joint angles at the end", end=True),
    "touch": Figures(kind="contact", says="first touch", end=False),
}


@dataclass(frozen=True, eq=False)
class SweepData:
    """Two engines of a sweep at every point and seed.

    Attributes:
        sides: Their names.
        design: Of the sweep; points: its points (p), each a setting.
        points: See design.
        runs: (2, p, s) runs of each side.
        gaps: (p, s) of each quantity that the dataset has, by name [SI]; NaN where either side
            has no run.
        failed: How many cells of either failed, by the class of the error; missing: have not run.
        missing: See failed.
    """

    sides: tuple[str, str]
    design: Design
    points: tuple[Figures, ...]
    runs: Runs
    gaps: Mapping[str, Array]
    failed: Mapping[str, int]
    missing: int

    def values(self, label: str) -> list[Any]:
        """(p) the value of a factor at each point."""
        place = [vary.label for vary in self.design.factors].index(label)
        return [point.values[place] for point in self.points]


def sweep_data(
    table: Any,
    design: Design,
    sides: tuple[str, str],
    seeds: int,
    moments: int,
    hinges: Sequence[int] | None = None,
) -> SweepData:
    """What the dataset of a sweep has of two engines.

    Args:
        table: As `read_cells` gives it.
        design: Of the sweep.
        sides: Two of its backends.
        seeds: How many the sweep has.
        moments: How many of a run it keeps.
        hinges: Which numbers of qpos are angles; None for all.

    Raises:
        BadInputError: No setting has a run on both.
    """
    points = tuple(design.points())
    place = {point.id: k for k, point in enumerate(points)}
    keys = [table[name].to_pylist() for name in ("backend", "point", "seed")]
    at = {
        row: (sides.index(backend), place[point], seed)
        for row, (backend, point, seed) in enumerate(zip(*keys, strict=True))
        if backend in sides and point in place and seed < seeds
    }
    table = table.take(np.array([*at], dtype=int))
    read = read_runs(table, moments, hinges)
    runs = np.full((2, len(points), seeds), np.nan, read.dtype)
    runs[tuple(np.array([*at.values()], dtype=int).reshape(-1, 3).T)] = read
    if not np.isfinite(runs["time"]).all(axis=0).any():
        raise BadInputError(
            f"no setting of this sweep has a run on both {sides[0]} and {sides[1]}; of cells that "
            "failed, the column error says why"
        )
    gaps = {name: gap_between(name, *runs) for name in RUN_QUANTITIES}
    figures = {**gaps, "touch": runs["touch"]}
    failed = Counter(kind for kind in table["error_class"].to_pylist() if kind)
    return SweepData(
        sides, design, points, runs,
        {name: gap for name, gap in gaps.items() if np.isfinite(figures[name]).any()},
        dict(failed.most_common()), 2 * len(points) * seeds - len(at),
    )  # fmt: skip


def read_runs(
    table: Any, moments: int, hinges: Sequence[int] | None = None, kind: Any = None
) -> Runs:
    """Runs (n,) from a table with the columns of a dataset; of a cell that failed there is none.

    Args:
        table: A pyarrow Table.
        moments: How many of a run are kept.
        hinges: Which numbers of qpos are angles; None for all.
        kind: The type of runs that these are compared with; None for their own.
    """
    tip, qpos = (_nested(table[name], moments) for name in ("sample_tip", "sample_qpos"))
    qpos = qpos if hinges is None else qpos[..., list(hinges)]
    if kind is None:
        fields: list[Any] = [("tip", float, (tip.shape[1], 3)), ("qpos", float, qpos.shape[1:])]
        kind = np.dtype(fields + [(name, float) for name in ("touch", "time", "timestep")])
    runs = np.full(table.num_rows, np.nan, kind)
    for name, values in (("tip", tip), ("qpos", qpos)):
        runs[name][..., : values.shape[-1]] = values[..., : runs[name].shape[-1]]
    time, steps, touch = (
        np.array(table[name].to_numpy(), dtype=float) for name in ("time", "steps", "first_touch")
    )
    runs["touch"] = np.where(np.isnan(touch), np.inf, touch)
    runs["time"], runs["timestep"] = time, time / np.maximum(steps, 1)
    runs[[status != DONE for status in table["status"].to_pylist()]] = np.nan
    return runs


def _nested(column: Any, moments: int) -> Array:
    """A column of lists of lists as an array (n, m, d), without a loop; NaN where one is short.

    The last moment of a run stays the last.
    """
    compute = require_parquet()[0].compute
    column = column.combine_chunks()
    inner = compute.list_flatten(column)
    run = compute.list_parent_indices(column).to_numpy()  # of each moment
    moment = compute.list_parent_indices(inner).to_numpy()  # of each number
    counts, widths = np.bincount(run, minlength=len(column)), np.bincount(moment)
    back = np.cumsum(counts)[run] - np.arange(len(run))  # from the end of its run, at least 1
    place = np.arange(len(moment)) - (np.cumsum(widths) - widths)[moment]
    shape = len(column), max(moments, counts.max(initial=0)), widths.max(initial=1)
    values: Array = np.full(shape, np.nan)
    values[run[moment], -back[moment], place] = compute.list_flatten(inner).to_numpy()
    return values


def vectors(name: str, runs: Runs) -> Array:
    """(…, m, d): what the gap of a quantity is the length of a difference of."""
    quantity = RUN_QUANTITIES[name]
    if quantity.kind == "contact":
        return np.where(np.isinf(runs["touch"]), np.nan, runs["touch"])[..., None, None]
    values: Array = runs["tip" if quantity.kind == "tip" else "qpos"]
    return values[..., -1:, :] if quantity.end else values


def length(name: str, difference: Array) -> Array:
    """The gap (…) that a difference (…, m, d) is: the largest of the moments."""
    if RUN_QUANTITIES[name].kind == "tip":
        return largest_known(np.linalg.norm(difference, axis=-1))
    return largest_known(largest_known(np.abs(difference)))


def gap_between(name: str, left: Runs, right: Runs) -> Array:
    """The gap (…) of a quantity between runs.

    Of a first touch that only one side has it is the length of the run, and 0 if neither has one.
    """
    if RUN_QUANTITIES[name].kind != "contact":
        return length(name, vectors(name, left) - vectors(name, right))
    until = np.minimum(left["time"], right["time"])
    never = np.isinf(left["touch"]).astype(int) + np.isinf(right["touch"])
    with np.errstate(invalid="ignore"):
        gap = np.abs(left["touch"] - right["touch"])
    return np.where(never == 2, 0.0 * until, np.where(never == 1, until, gap))


def largest_known(values: Array) -> Array:
    """Over the last axis, of what is a number; NaN where nothing is."""
    return np.fmax.reduce(values, axis=-1, initial=np.nan)


def median(values: Array, axis: int = -1) -> Array:
    """Of what is a number; NaN where nothing is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return np.asarray(np.nanmedian(values, axis=axis))


def drawn_again(count: int) -> Iterator[Ints]:
    """Places of samples that are drawn again from `count` of them, many times: a bootstrap."""
    draw = np.random.default_rng(0)
    return (draw.integers(0, count, count) for _ in range(_RESAMPLES))
