"""For each parameter: the value at which two sides come together, and a run of both there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from ..interface import Array
from ..page import Figures
from ..runs.drive import Progress, silent
from .analysis_data import Runs, SweepData, gap_between, median, vectors
from .analysis_fit import fit_curves, fit_scatter
from .analysis_runs import CellRunner, evenly
from .design import Value, Vary

Setting = tuple[tuple[Value | None, ...], int]  # values of the factors, and a seed
Varied = Literal["right", "both"]
MOST_REFERENCES = 24  # runs of the left side at the model's own value
CHECKED = 4  # pairs of runs at a value
REFINED = 9  # values that are run where a check contradicts the fit
_LESS = 0.9  # of the gap before: what is above it is not an improvement
_NEAR = 0.5  # of the measured gap: a prediction that is farther off is contradicted


def brought_together(
    data: SweepData,
    vary: Vary,
    quantity: str,
    good: float,
    *,
    varied: Varied,
    own: float | None = None,
    runner: CellRunner | None = None,
    progress: Progress = silent,
) -> Figures:
    """The value of a parameter that brings the two sides of a sweep together.

    Args:
        data: Of the sweep.
        vary: One of its factors, with numbers.
        quantity: Whose gap.
        good: The gap that is as good as none [SI].
        varied: Whether the left side keeps the model's own value.
        own: That value; None where the model's parts have several.
        runner: Runs what the dataset has not; None for nothing.
        progress: Told the fraction that is done.

    Returns:
        label: The parameter; times: whether its values are times the model's own.
        varied: "right": the left side keeps the model's own value; "both": both have the same.
        own: The model's own value; None where it is not known or has several.
        before: The gap with the parameter as the model has it, as all of these the mean of
            settings and seeds [SI]; None where that is not known.
        fit: The value of the least gap, see `fit_curves`; None where the design allows none.
        value: The best known: of runs, else of the fit.
        error: How far it is known: the distance of the runs, else the standard error of the fit.
        after: The gap there: of runs, else as predicted [SI].
        measured: The gap of runs at the fitted value; None where none was run.
        predicted: What the fit says of the same runs.
        pairs: How many pairs of runs.
        verdict: "together": within tolerance or the chaos floor; "closer"; "edge": least at the
            end of the range; "none": no value is better than the model's own; "" without a fit.
        why_not: Why there is no fit, or no measurement.
        cells: How many cells were run for it.
        tried: Where `measured` contradicts `predicted`, (n,) values near that one which were run,
            and (n,) the gap of each, NaN where a run failed; the best of them is the value then,
            and their distance the error.
    """
    unknown = dict.fromkeys(("before", "fit", "value", "error", "after", "measured", "predicted"))
    answer = Figures(
        **{"label": vary.label, "times": vary.times, "varied": varied, "own": own},
        **{**unknown, "pairs": 0, "verdict": "", "why_not": "", "cells": 0, "tried": None},
    )
    if varied == "right" and vary.kind != "option":
        answer.why_not = "the model has no value of its own that the left side could keep"
        return answer
    case = _Case(data, vary, quantity, varied, own, runner, progress)
    if runner is None and case.lacks_references:
        answer.why_not = (
            "the design has no run of the left side at the model's own value, and nothing may be "
            "run"
        )
        return answer
    answer.fit = fit = case.scatter() if vary.bounds is not None else case.grid()
    answer.cells = case.cells
    if fit is None:
        answer.why_not = "it needs three values of the parameter with runs"
        return answer
    answer.before, edge = case.own_gap(), fit.edge
    answer.value, answer.error, answer.after = fit.value, fit.error, fit.gap
    answer.why_not = "nothing was run at that value"
    if runner is not None:
        before, gap, predicted, pairs = case.check(fit)
        answer.before = answer.before if before is None else before
        if gap is not None:
            answer.after, answer.measured, answer.predicted = gap, gap, predicted
            answer.pairs, answer.why_not = pairs, ""
            if abs(predicted - gap) > max(_NEAR * gap, good):
                values, gaps, answer.error = case.refined(fit, gap)
                best = int(np.nanargmin(gaps))
                answer.tried = tuple(values), tuple(gaps)
                answer.value, answer.after = values[best], gaps[best]
                edge = values[best] in fit.bounds
    before = max(fit._scan[1]) if answer.before is None else answer.before
    answer.verdict, answer.cells = _verdict(answer.after or 0.0, before, good, edge), case.cells
    return answer


def _verdict(gap: float, before: float, good: float, edge: bool) -> str:
    """What a value does whose gap was another one before, where one is as good as none."""
    if gap <= good:
        return "together"
    if gap > _LESS * before:
        return "none"
    return "edge" if edge else "closer"


class _Case:
    """One parameter of one sweep, and what was run for it.

    Attributes:
        lacks_references: Whether the left side is to keep the model's own value, and the dataset
            has no such run.
        cells: How many were run.
    """

    def __init__(
        self,
        data: SweepData,
        vary: Vary,
        quantity: str,
        varied: Varied,
        own: float | None,
        runner: CellRunner | None,
        progress: Progress,
    ) -> None:
        self._data, self._vary, self._quantity, self._both = data, vary, quantity, varied == "both"
        self._own, self._runner, self._progress, self.cells = own, runner, progress, 0
        self._place = [factor.label for factor in data.design.factors].index(vary.label)
        self._levels = np.sort(
            np.array(vary.values or np.linspace(*(vary.bounds or (0, 0)), 9), float)
        )
        self._at_own = np.nan if own is None else own
        self._near = np.flatnonzero(np.isclose(self._levels, self._at_own))[:1]
        self.lacks_references = not (self._both or len(self._near))
        self._settings: list[Setting] = []  # those that the fit is of

    def _curves(self, values: Array) -> Array:
        """(c, k, …) of what is (p, s, …): by the other values and seeds, and by the parameter."""
        listed = self._data.design.listed
        lengths = [len(vary.values) for vary in listed]
        axis = [vary.label for vary in listed].index(self._vary.label)
        cube = values.reshape(-1, *lengths, *values.shape[1:])
        cube = np.moveaxis(cube, axis + 1, len(lengths) + 1)
        order = np.argsort([float(value) for value in self._vary.values])
        return cube.reshape(-1, lengths[axis], *values.shape[2:])[:, order]

    def grid(self) -> Figures | None:
        """From the values of a list or a grid."""
        left, right = (self._curves(vectors(self._quantity, runs)) for runs in self._data.runs)
        points, seeds = self._data.runs.shape[1:]
        # The first point of each curve, its parameter at the least value.
        first = self._curves(np.arange(points * seeds).reshape(points, seeds))[:, 0]
        chosen = evenly(len(first), MOST_REFERENCES if self.lacks_references else len(first))
        self._settings = [
            (self._data.points[k // seeds].values, k % seeds) for k in first[chosen].tolist()
        ]
        if self.lacks_references:
            (runs,) = self._run([(0, self._at(self._settings, self._own))], 0.0)
            left, right = vectors(self._quantity, runs)[:, None], right[chosen]
        elif not self._both:
            left = left[:, self._near]
        seeds = [seed for _, seed in self._settings]
        return fit_curves(self._quantity, self._levels, left, right, seeds)

    def scatter(self) -> Figures | None:
        """From samples of a range."""
        values = np.array(self._data.values(self._vary.label), dtype=float)
        chosen = evenly(len(values), len(values) if self._both else MOST_REFERENCES)
        self._settings = [(self._data.points[k].values, 0) for k in chosen]
        if self._both:
            return fit_scatter(values, median(self._data.gaps[self._quantity]))
        (runs,) = self._run([(0, self._at(self._settings, self._own))], 0.0)
        gap = gap_between(self._quantity, runs, self._data.runs[1, chosen, 0])
        return fit_scatter(values[chosen], gap)

    def _at(self, settings: Sequence[Setting], value: float | None) -> list[Setting]:
        """Settings with a value of the parameter; None is what the model has."""
        k = self._place
        return [((*values[:k], value, *values[k + 1 :]), seed) for values, seed in settings]

    def _run(self, groups: Sequence[tuple[int, Sequence[Setting]]], start: float) -> list[Runs]:
        """Runs of each group of settings on a side; all at once, as processes start slowly."""
        assert self._runner is not None
        asked = [
            (self._data.sides[side], *setting) for side, settings in groups for setting in settings
        ]
        self.cells += len(asked)
        runs = self._runner.run(asked, progress=lambda f: self._progress(start + f / 4))
        return np.split(runs, np.cumsum([len(settings) for _, settings in groups])[:-1])

    def _gaps(self, settings: Sequence[Setting], values: Sequence[Any], start: float) -> Array:
        """(v, n) the gap of each setting at each value, with both sides run there."""
        at = [setting for value in values for setting in self._at(settings, value)]
        left_at = at if self._both else self._at(settings, self._own)
        right, left = self._run([(1, at), (0, left_at)], start)
        pairs = left.reshape(-1, len(settings)), right.reshape(len(values), -1)
        return gap_between(self._quantity, *pairs)

    def check(self, fit: Figures) -> tuple[float | None, float | None, float, int]:
        """Run both sides at the value.

        Returns:
            The gap at the model's own value, if it has one and it was run; the gap, if any pair
            ended; what the fit says of it; of how many pairs it is.
        """
        picked = self._picked(fit)
        values = [fit.value, self._own] if self._vary.kind == "option" else [fit.value]
        gap, *before = self._gaps([self._settings[k] for k in picked], values, 0.5)
        own = _mean(before[0]) if before else None
        return own, _mean(gap), float(np.mean(fit._by_curve[picked])), int(np.isfinite(gap).sum())

    def refined(self, fit: Figures, measured: float) -> tuple[list[float], list[float], float]:
        """Run both sides between the neighbours of the value in the design.

        A gap over a contact has jumps, which neither an interpolation nor a search for one
        minimum stands; values side by side do.

        Returns:
            The values, that of the fit among them; the gap of each; how far apart they are.
        """
        low = self._levels[self._levels < fit.value].max(initial=fit.bounds[0])
        high = self._levels[self._levels > fit.value].min(initial=fit.bounds[1])
        values = np.linspace(low, high, REFINED).tolist()
        by_value = self._gaps([self._settings[k] for k in self._picked(fit)], values, 0.75)
        stood = np.isfinite(by_value).all(axis=0)  # the same pairs at every value
        means = by_value[:, stood].mean(axis=1) if stood.any() else np.full(REFINED, np.nan)
        apart = float(high - low) / (REFINED - 1)
        return [*values, fit.value], [*means.tolist(), measured], apart

    def _picked(self, fit: Figures) -> list[int]:
        """The settings that are run at a value."""
        known = np.flatnonzero(np.isfinite(fit._by_curve))
        return known[evenly(len(known), CHECKED)].tolist()

    def own_gap(self) -> float | None:
        """The gap of the dataset with the parameter as the model has it."""
        values = np.array(self._data.values(self._vary.label), dtype=float)
        return _mean(self._data.gaps[self._quantity][np.isclose(values, self._at_own)])


def _mean(gaps: Array) -> float | None:
    """Of what is a number; None where nothing is."""
    return float(np.nanmean(gaps)) if np.isfinite(gaps).any() else None
