"""Which parameter a figure is most sensitive to: first-order and total shares of its variance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from ..installed import require_extra
from ..interface import Array
from ..page import Figures
from .analysis_data import SweepData, drawn_again, median
from .design import Design, Vary

_TAIL = 50 * (1 - 0.95)  # percent, on each side of an interval
_LEAST_SEEDS = 3  # of which a bootstrap says something
_LEAST_SAMPLES = 4
_INTERVALS = ("first_interval", "total_interval")


def sensitivity(data: SweepData, figures: Array) -> Figures | None:
    """What a figure of a sweep's points is sensitive to; None where nothing can be said.

    Args:
        data: Of the sweep.
        figures: (p, s) at each point and seed; NaN where there is none. Of the seeds the median
            counts.

    Returns:
        method: "sobol": Saltelli's estimators on his design; "factorial": the variance of a full
            factorial taken apart; "rank": Spearman's correlation squared, which is neither.
        indices: One for each parameter, the largest total first: label; first: the share of the
            variance that it explains alone, whatever the others are; total: the share that
            vanishes where it is kept, what it does together with others included; first_interval
            and total_interval: of 95 %, None where there is nothing to compute them from.
        samples: From how many settings; of "sobol" how many in each block.
        error: What the intervals are of; "" without.
        notes: What a reader should know, sentences.
    """
    centre = median(figures)
    known = centre[np.isfinite(centre)]
    if len(known) < 2 or not np.ptp(known) > 1e-12 * np.abs(known).max():
        return None
    if data.design.indices:
        return _sobol(data.design, centre)
    return _rank(data, centre) if data.design.sampled else _factorial(data.design, figures)


def ranked(design: Design, shares: Figures | None) -> list[Vary]:
    """What is varied, the most sensitive first."""
    rank = {index.label: k for k, index in enumerate(shares.indices)} if shares else {}
    return sorted(design.factors, key=lambda vary: rank.get(vary.label, len(rank)))


def _sobol(design: Design, centre: Array) -> Figures | None:
    """Saltelli's design: blocks A, B and A with one range from B."""
    labels = [vary.label for vary in design.sampled]
    # The samples change slowest: blocks, then samples, then the combinations of lists.
    cube = centre.reshape(len(labels) + 2, design.samples, -1).mean(axis=2)
    complete = np.flatnonzero(np.isfinite(cube).all(axis=0))
    notes: list[str] = []
    if design.listed:
        names = ", ".join(vary.label for vary in design.listed)
        notes.append(f"They are of the mean over the values of {names}.")
    count = 2 ** int(np.log2(len(complete))) if len(complete) else 0
    if count < design.samples:
        notes.append(
            f"{design.samples - len(complete)} of {design.samples} samples have no gap at one of "
            f"their points and are left out; the indices are of the first {count} others, a "
            "power of two."
        )
    if count < _LEAST_SAMPLES:
        return None
    a, b, *mixed = cube[:, None, complete[:count]]
    indices = _stats().sobol_indices(func={"f_A": a, "f_B": b, "f_AB": np.array(mixed)}, n=count)
    # (2, d) each: of all samples, and of samples that are drawn again from those there are.
    shares = np.array([indices.first_order, indices.total_order]).reshape(2, -1)
    drawn = []
    for rows in drawn_again(count):
        blocks = indices._f_A[:, rows], indices._f_B[:, rows], indices._f_AB[..., rows]
        drawn.append(np.reshape(indices._indices_method(*blocks), shares.shape))
    return _result("sobol", labels, shares, count, drawn, "the samples drawn again", notes)


def _factorial(design: Design, figures: Array) -> Figures | None:
    """Every combination of lists and grids: the variance over the whole of it."""
    cube = figures.reshape(*(len(vary.values) for vary in design.factors), -1)
    levels = _without_holes(cube)
    left_out = [
        f"{vary.label} = {', '.join(str(v) for k, v in enumerate(vary.values) if k not in present)}"
        for vary, present in zip(design.factors, levels, strict=True)
        if len(present) < len(vary.values)
    ]
    note = "A full factorial has no holes: what has failed cells is left out ({})."
    notes = [note.format("; ".join(left_out))] if left_out else []
    cube = cube[np.ix_(*levels)]
    centre = median(cube)
    if centre.size < 2 or not np.ptp(centre) > 0:
        return None
    seeds, error, drawn = cube.shape[-1], "", []
    if seeds >= _LEAST_SEEDS:
        again = (median(cube[..., chosen]) for chosen in drawn_again(seeds))
        drawn = [variance_shares(medians) for medians in again if np.ptp(medians) > 0]
        error = f"the {seeds} seeds drawn again"
    labels = [vary.label for vary in design.factors]
    shares = variance_shares(centre)
    return _result("factorial", labels, shares, centre.size, drawn, error, notes)


def variance_shares(cube: Array) -> Array:
    """First-order and total shares (2, k) of the variance of a full factorial (n1, …, nk).

    Every level counts the same. First: Var(E[f | x_i]) / Var f; total: E[Var(f | all but x_i)] /
    Var f (T. Homma and A. Saltelli, Reliability Engineering & System Safety 52, 1996).
    """
    variance, axes = cube.var(), range(cube.ndim)
    if not variance:
        return np.zeros((2, cube.ndim))
    first = [cube.mean(axis=tuple(a for a in axes if a != k)).var() / variance for k in axes]
    total = [cube.var(axis=k).mean() / variance for k in axes]
    return np.array([first, total])


def _without_holes(cube: Array) -> list[list[int]]:
    """The levels of each factor that stay where those with holes go, the worst first."""
    levels = [list(range(n)) for n in cube.shape[:-1]]
    axes = range(len(levels))
    while (holes := np.isnan(median(cube[np.ix_(*levels)]))).any():
        shares = [holes.mean(axis=tuple(a for a in axes if a != k)) for k in axes]
        axis = max(axes, key=lambda k: shares[k].max())
        del levels[axis][int(shares[axis].argmax())]
    return levels


def _rank(data: SweepData, centre: Array) -> Figures | None:
    """Where the design allows no indices: which parameter the figure goes with."""
    known = np.isfinite(centre)
    labels = [vary.label for vary in data.design.factors if vary.numeric]
    shares = np.zeros((2, len(labels)))
    for k, label in enumerate(labels):
        values = np.array(data.values(label), dtype=float)[known]
        if len(values) > 2 and np.ptp(values):
            rho = float(_stats().spearmanr(values, centre[known]).statistic)
            shares[:, k] = np.nan_to_num(rho) ** 2
    note = (
        "Indices cannot be computed from this design: run it with --indices. These are "
        "squares of Spearman's rank correlation, and see only what goes up or down."
    )
    return _result("rank", labels, shares, int(known.sum()), [], "", [note]) if labels else None


def _stats() -> Any:
    return require_extra("scipy.stats", "a report of a sweep", "SciPy", "sweep")


def _result(
    method: Literal["sobol", "factorial", "rank"],
    labels: Sequence[str],
    shares: Array,
    samples: int,
    drawn: Sequence[Array],
    error: str,
    notes: Sequence[str],
) -> Figures:
    """The largest total first; `shares` (2, k) and `drawn`, many of them, are first and total."""
    intervals: Any = np.full((2, 2, len(labels)), None)
    if len(drawn):
        intervals = np.percentile(drawn, (_TAIL, 100 - _TAIL), axis=0)
    indices = [
        Figures(
            label=label,
            **dict(zip(("first", "total"), shares[:, k].tolist(), strict=True)),
            **{
                name: None if None in pair else tuple(pair)
                for name, pair in zip(_INTERVALS, intervals[..., k].T.tolist(), strict=True)
            },
        )
        for k, label in enumerate(labels)
    ]
    indices.sort(key=lambda index: -index.total)
    return Figures(
        method=method, indices=tuple(indices), samples=samples, error=error, notes=tuple(notes)
    )
