"""Which parameter a figure is most sensitive to: first-order and total shares of its variance."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..installed import require_extra
from ..interface import Array
from .analysis_gaps import median
from .design import Design, DesignPoint

_RESAMPLES, _LEVEL = 400, 0.95
_LEAST_SEEDS = 3  # of which a bootstrap says something
_LEAST_SAMPLES = 4


@dataclass(frozen=True)
class ParameterIndex:
    """How much of the variance of a figure a parameter explains.

    Attributes:
        label: Of the parameter.
        first: The share that it explains alone, whatever the others are.
        total: The share that vanishes where it is kept; what it does together with others
            included.
        first_interval: 95 % interval; None where there is nothing to compute it from.
        total_interval: See first_interval.
    """

    label: str
    first: float
    total: float
    first_interval: tuple[float, float] | None = None
    total_interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class Sensitivity:
    """What a figure is sensitive to.

    Attributes:
        method: "sobol": Saltelli's estimators on his design; "factorial": the variance of a full
            factorial taken apart; "rank": Spearman's correlation squared, which is neither.
        indices: One for each parameter, the largest total first.
        samples: From how many settings; of "sobol" how many in each block.
        error: What the intervals are of; "" without.
        notes: What a reader should know, sentences.
    """

    method: Literal["sobol", "factorial", "rank"]
    indices: tuple[ParameterIndex, ...]
    samples: int
    error: str = ""
    notes: tuple[str, ...] = ()


def require_stats() -> Any:
    """SciPy's statistics.

    Raises:
        MissingEngineError: SciPy is not installed; the message names the extra.
    """
    return require_extra("scipy.stats", "a report of a sweep", "SciPy", "sweep")


def sensitivity(
    design: Design, points: Sequence[DesignPoint], figures: Array
) -> Sensitivity | None:
    """What a figure of a design's points is sensitive to; None where nothing can be said.

    Args:
        design: Of the sweep.
        points: Its points (p).
        figures: (p, s) at each point and seed; NaN where there is none. Of the seeds the median
            counts.
    """
    if not design.factors or len(points) < 2:
        return None
    centre = median(figures)
    known = centre[np.isfinite(centre)]
    if len(known) < 2 or not np.ptp(known) > 1e-12 * np.abs(known).max():
        return None
    if design.indices:
        return _sobol(design, points, centre)
    return _rank(design, points, centre) if design.sampled else _factorial(design, figures)


def _sobol(design: Design, points: Sequence[DesignPoint], centre: Array) -> Sensitivity | None:
    """Saltelli's design: blocks A, B and A with one range from B."""
    labels = [vary.label for vary in design.sampled]
    combinations = len(points) // ((len(labels) + 2) * design.samples)
    # The samples change slowest: blocks, then samples, then the combinations of lists.
    cube = centre.reshape(len(labels) + 2, design.samples, combinations).mean(axis=2)
    whole = np.flatnonzero(np.isfinite(cube).all(axis=0))
    notes: list[str] = []
    if design.listed:
        names = ", ".join(vary.label for vary in design.listed)
        notes.append(f"They are of the mean over the values of {names}.")
    count = 2 ** int(np.log2(len(whole))) if len(whole) else 0
    if count < design.samples:
        notes.append(
            f"{design.samples - len(whole)} of {design.samples} samples have no gap at one of "
            f"their points and are left out; the indices are of the first {count} others, a "
            "power of two."
        )
    if count < _LEAST_SAMPLES:
        return None
    cube = cube[:, whole[:count]]
    stats = require_stats()
    found = stats.sobol_indices(
        func={"f_A": cube[:1], "f_B": cube[1:2], "f_AB": cube[2:, None, :]}, n=count
    )
    first, total = np.atleast_1d(found.first_order), np.atleast_1d(found.total_order)
    drawn = _resampled(found, count)
    return Sensitivity(
        "sobol",
        _ordered(labels, first, total, drawn[:, 0], drawn[:, 1]),
        count,
        "the samples drawn again",
        tuple(notes),
    )


def _resampled(found: Any, count: int) -> Array:
    """(n, 2, d) the indices of samples that are drawn again from those there are."""
    draw = np.random.default_rng(0)
    made = []
    for _ in range(_RESAMPLES):
        rows = draw.integers(0, count, count)
        a, b, ab = found._f_A[:, rows], found._f_B[:, rows], found._f_AB[..., rows]
        pair = np.array(found._indices_method(a, b, ab))
        made.append(pair.reshape(2, -1))
    return np.array(made)


def _factorial(design: Design, figures: Array) -> Sensitivity | None:
    """Every combination of lists and grids: the variance over the whole of it."""
    labels = [vary.label for vary in design.factors]
    cube = figures.reshape(*(len(vary.values) for vary in design.factors), -1)
    cube, left_out = _whole(cube)
    if cube.size == 0 or cube[..., 0].size < 2:
        return None
    notes = []
    if any(left_out):
        told = [
            f"{vary.label} = {', '.join(f'{vary.values[k]}' for k in gone)}"
            for vary, gone in zip(design.factors, left_out, strict=True)
            if gone
        ]
        notes.append(
            f"A full factorial has no holes: what has failed cells is left out ({'; '.join(told)})."
        )
    centre = median(cube)
    if not np.ptp(centre) > 0:
        return None
    first, total = variance_shares(centre)
    seeds, error = cube.shape[-1], ""
    drawn = None
    if seeds >= _LEAST_SEEDS:
        draw = np.random.default_rng(0)
        again = (median(cube[..., draw.integers(0, seeds, seeds)]) for _ in range(_RESAMPLES))
        drawn = np.array([variance_shares(each) for each in again if np.ptp(each) > 0])
        error = f"the {seeds} seeds drawn again"
    pair = (None, None) if drawn is None else (drawn[:, 0], drawn[:, 1])
    indices = _ordered(labels, first, total, *pair)
    return Sensitivity("factorial", indices, centre.size, error, tuple(notes))


def variance_shares(cube: Array) -> tuple[Array, Array]:
    """First-order and total shares (k,) of the variance of a full factorial (n1, …, nk).

    Every level counts the same. First: Var(E[f | x_i]) / Var f; total: E[Var(f | all but x_i)] /
    Var f (T. Homma and A. Saltelli, Reliability Engineering & System Safety 52, 1996).
    """
    variance, axes = cube.var(), range(cube.ndim)
    if not variance:
        return np.zeros(cube.ndim), np.zeros(cube.ndim)
    first = [cube.mean(axis=tuple(a for a in axes if a != k)).var() / variance for k in axes]
    total = [cube.var(axis=k).mean() / variance for k in axes]
    return np.array(first), np.array(total)


def _whole(cube: Array) -> tuple[Array, list[list[int]]]:
    """The factorial without the levels that have holes, the worst first; which went."""
    kept = [list(range(n)) for n in cube.shape[:-1]]
    gone: list[list[int]] = [[] for _ in kept]
    while cube.size and (holes := ~np.isfinite(median(cube))).any():
        shares = [
            (holes.mean(axis=tuple(a for a in range(holes.ndim) if a != k))).tolist()
            for k in range(holes.ndim)
        ]
        axis, level = max(
            itertools.chain.from_iterable(
                ((k, n) for n in range(len(share))) for k, share in enumerate(shares)
            ),
            key=lambda place: shares[place[0]][place[1]],
        )
        gone[axis].append(kept[axis].pop(level))
        cube = np.delete(cube, level, axis=axis)
    return cube, gone


def _rank(design: Design, points: Sequence[DesignPoint], centre: Array) -> Sensitivity | None:
    """Where the design allows no indices: which parameter the figure goes with."""
    stats = require_stats()
    known = np.isfinite(centre)
    found = []
    for place, vary in enumerate(design.factors):
        if not vary.numeric:
            continue
        values = np.array([float(point.values[place]) for point in points])[known]
        rho = 0.0
        if len(values) > 2 and np.ptp(values):
            rho = float(stats.spearmanr(values, centre[known]).statistic)
        share = 0.0 if np.isnan(rho) else rho**2
        found.append(ParameterIndex(vary.label, share, share))
    found.sort(key=lambda each: -each.total)
    note = (
        "The design is none that indices can be computed from: run it with --indices. These are "
        "squares of Spearman's rank correlation, and see only what goes up or down."
    )
    return Sensitivity("rank", tuple(found), int(known.sum()), "", (note,)) if found else None


def _ordered(
    labels: Sequence[str],
    first: Array,
    total: Array,
    first_drawn: Array | None,
    total_drawn: Array | None,
) -> tuple[ParameterIndex, ...]:
    """One for each parameter, the largest total first."""

    def interval(drawn: Array | None, place: int) -> tuple[float, float] | None:
        if drawn is None or not len(drawn):
            return None
        tail = 50 * (1 - _LEVEL)
        low, high = np.percentile(drawn[:, place], (tail, 100 - tail))
        return float(low), float(high)

    found = [
        ParameterIndex(
            label, float(first[k]), float(total[k]), interval(first_drawn, k),
            interval(total_drawn, k),
        )
        for k, label in enumerate(labels)
    ]  # fmt: skip
    return tuple(sorted(found, key=lambda each: -each.total))
