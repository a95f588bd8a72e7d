"""Which value of a parameter brings two sides together: the least gap between its design points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..interface import Array
from ..page import Figures
from .analysis_data import Flags, drawn_again, length

_SCAN = 401  # values that are looked at between the bounds, before the minimum is refined
_LEAST = 3  # values that a fit is of, and curves of which a bootstrap says something
_EDGE = 0.005  # of the range
MOST_CURVES = 200


def values_within(fit: Figures, good: float) -> tuple[float, float] | None:
    """The least and the largest value whose predicted gap is at most so much; None if none."""
    fine = [value for value, gap in zip(*fit._scan, strict=True) if gap <= good]
    return (fine[0], fine[-1]) if fine else None


def fit_curves(
    name: str, levels: Array, left: Array, right: Array, seeds: Sequence[int]
) -> Figures | None:
    """The least gap over a parameter, from runs at some of its values.

    Each number of a run is interpolated over the parameter (PCHIP, which does not overshoot), and
    the gap is computed from what that gives: a gap itself has a kink where it is least, and the
    runs do not. What of a curve is not there at every value is left out.

    Args:
        name: Of the quantity.
        levels: (k,) values of the parameter, increasing.
        left: (c, k, m, d) curves of the one side; (c, 1, m, d) where it keeps its own value.
        right: (c, k, m, d) of the other. NaN where there is no run.
        seeds: (c,) that of each curve: the curves of a seed are not independent figures.

    Returns:
        None if there are fewer than three values or no whole curve; else

        value: Of the parameter.
        error: Its standard error; of: what that is from.
        gap: What is predicted there, the mean of the curves [SI].
        bounds: The range of the design.
        edge: Whether it is at the end of the range.
        curves: From how many curves; of a sampled design, from how many settings.
        _scan: (n,) values between the bounds, and (n,) the predicted gap there.
        _by_curve: (c,) what is predicted at the value for each curve that was given, or NaN.
    """
    from scipy.interpolate import PchipInterpolator

    used = _comparable(left, right)
    complete = np.flatnonzero(used.any(axis=(1, 2)))
    if len(levels) < _LEAST or not len(complete):
        return None
    chosen = complete[
        np.linspace(0, len(complete) - 1, min(len(complete), MOST_CURVES)).astype(int)
    ]
    used = used[chosen]
    left, right = (np.where(used[:, None], side[chosen], 0.0) for side in (left, right))
    difference = PchipInterpolator(levels, right - left, axis=1)

    def gaps(values: Array) -> Array:
        """(n, c)"""
        return length(name, np.moveaxis(difference(values), 1, 0))

    low, high = float(levels[0]), float(levels[-1])
    scan = np.linspace(low, high, _SCAN)
    table = gaps(scan)
    centre = table.mean(axis=1)
    value = _refined(lambda x: float(gaps(np.array([x])).mean()), scan, centre)
    by_curve = np.full(len(seeds), np.nan)
    by_curve[chosen] = gaps(np.array([value]))[0]
    own_seeds = np.array(seeds)[chosen]
    by_seed = [table[:, own_seeds == seed].mean(axis=1) for seed in np.unique(own_seeds)]
    for what, columns in (("seeds", np.array(by_seed).T), ("curves", table)):
        if (drawn := columns.shape[1]) >= _LEAST:
            error, of = float(np.std(_best_again(scan, columns))), f"{drawn} {what} drawn again"
            break
    else:
        error, of = (
            _curvature(difference(value)[used], difference.derivative()(value)[used]),
            "the curvature",
        )
    return Figures(
        value=value,
        error=error,
        of=of,
        gap=float(np.nanmean(by_curve)),
        bounds=(low, high),
        edge=not low + _EDGE * (high - low) < value < high - _EDGE * (high - low),
        curves=len(chosen),
        _scan=(tuple(scan.tolist()), tuple(centre.tolist())),
        _by_curve=by_curve,
    )


def fit_scatter(values: Array, gaps: Array) -> Figures | None:
    """The same from settings that differ in everything: a parabola through the squared gaps.

    Where a run is linear in its parameters the squared length of a difference is a parabola.

    Args:
        values: (n,) of the parameter.
        gaps: (n,) at these settings; NaN where there is none.
    """
    by_curve = np.full(len(gaps), np.nan)
    known = np.isfinite(gaps)
    values, gaps = values[known], gaps[known]
    if len(values) < 8 or not np.ptp(values):
        return None
    low, high = float(values.min()), float(values.max())
    scan = np.linspace(low, high, _SCAN)

    def curve(rows: Any) -> Array:
        scaled = 2 * (values[rows] - low) / (high - low) - 1
        parabola = np.polynomial.polynomial.polyfit(scaled, gaps[rows] ** 2, 2)
        unit = 2 * (scan - low) / (high - low) - 1
        return np.asarray(np.polynomial.polynomial.polyval(unit, parabola), dtype=np.float64)

    squares = curve(slice(None))
    place = int(np.argmin(squares))
    again = [scan[int(np.argmin(curve(rows)))] for rows in drawn_again(len(values))]
    predicted = np.sqrt(np.maximum(squares, 0.0))
    value = float(scan[place])
    by_curve[known] = predicted[place]
    return Figures(
        value=value,
        error=float(np.std(again)),
        of=f"{len(values)} settings drawn again",
        gap=float(predicted[place]),
        bounds=(low, high),
        edge=place in (0, _SCAN - 1),
        curves=len(values),
        _scan=(tuple(scan.tolist()), tuple(predicted.tolist())),
        _by_curve=by_curve,
    )


def _comparable(left: Array, right: Array) -> Flags:
    """(c, m, d): which numbers of a curve both sides have at every value, at the same moment.

    A short run keeps fewer moments. Where the runs of a curve have not the same number of them,
    only the last one is the same.
    """
    there = [np.isfinite(side) for side in (left, right)]
    counts = np.concatenate([side.any(axis=3).sum(axis=2) for side in there], axis=1)
    used = np.array(np.concatenate(there, axis=1).all(axis=1), dtype=bool)
    used[np.ptp(counts, axis=1) > 0, :-1] = False
    return used


def _refined(gap: Any, scan: Array, centre: Array) -> float:
    """The minimum of a function near the least value of its scan."""
    from scipy.optimize import minimize_scalar

    place = int(np.argmin(centre))
    low, high = scan[max(0, place - 1)], scan[min(len(scan) - 1, place + 1)]
    minimum = minimize_scalar(gap, bounds=(low, high), method="bounded",
                            options={"xatol": 1e-6 * (scan[-1] - scan[0])})  # fmt: skip
    return float(minimum.x) if minimum.fun < centre[place] else float(scan[place])


def _best_again(scan: Array, table: Array) -> Array:
    """The best value (n,) of curves that are drawn again from those there are."""
    best = []
    for columns in drawn_again(table.shape[1]):
        centre = table[:, columns].mean(axis=1)
        place = int(np.argmin(centre))
        shift = 0.0
        if 0 < place < len(scan) - 1:
            a, b, c = centre[place - 1 : place + 2] ** 2  # a parabola, unlike the gap itself
            bend = a - 2 * b + c
            shift = 0.5 * (a - c) / bend if bend > 0 else 0.0
        best.append(scan[place] + shift * (scan[1] - scan[0]))
    return np.array(best)


def _curvature(difference: Array, slope: Array) -> float | None:
    """The standard error of one unknown in a least-squares fit, from what is left of it."""
    bend = float((slope**2).sum())
    count = int(difference.size)
    if not bend or count < 2:
        return None
    return float(np.sqrt((difference**2).sum() / (count - 1) / bend))
