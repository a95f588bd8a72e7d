"""For each parameter: the value at which two sides come together, and a run of both there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..interface import Array
from ..runs.drive import Progress, silent
from .analysis_data import Runs, SweepData, gap_between, median, vectors
from .analysis_fit import FittedValue, Verdict, fit_curves, fit_scatter
from .analysis_runs import CellRunner, evenly
from .factors import Value, Vary

Setting = tuple[tuple[Value | None, ...], int]  # values of the factors, and a seed
Varied = Literal["right", "both"]
MOST_REFERENCES = 24  # runs of the left side at the model's own value
CHECKED = 4  # pairs of runs at a value
REFINED = 9  # values that are run where a check contradicts the fit
_NEAR = 0.5  # of the measured gap: a prediction that is farther off is contradicted


@dataclass(frozen=True)
class BestRun:
    """The least gap of runs near a value that a fit got wrong.

    Attributes:
        value: Of the parameter.
        gap: There, the mean of its pairs [SI].
        apart: How far apart the values are that were run: so far is the best one known.
        tried: (n,) these values, and (n,) the gap of each; NaN where a run failed.
    """

    value: float
    gap: float
    apart: float
    tried: tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class BroughtTogether:
    """What varying one parameter does to the gap between two sides.

    Attributes:
        label: The parameter; times: whether its values are times the model's own.
        times: See label.
        varied: "right": the left side keeps the model's own value; "both": both have the same.
        own: The model's own value; None where it is not known or has several.
        before: The gap with the parameter as the model has it, as all of these the mean of
            settings and seeds [SI]; None where that is not known.
        fit: The value of the least gap; None where the design does not allow one.
        measured: The gap of runs at that value; None where none was run.
        predicted: What the fit says of the same runs.
        pairs: How many pairs of runs.
        best: The best of further runs near that value, where `measured` contradicts `predicted`;
            else None.
        verdict: "together": within tolerance or the chaos floor; "closer"; "edge": least at the
            end of the range; "none": no value is better than the model's own; "" without a fit.
        why_not: Why there is no fit, or no measurement.
        cells: How many cells were run for it.
    """

    label: str
    times: bool
    varied: Varied
    own: float | None
    before: float | None = None
    fit: FittedValue | None = None
    measured: float | None = None
    predicted: float | None = None
    pairs: int = 0
    verdict: Verdict | Literal[""] = ""
    why_not: str = ""
    cells: int = 0
    best: BestRun | None = None

    @property
    def value(self) -> float | None:
        """The value that is the best known: of runs, else of the fit."""
        if self.best is not None:
            return self.best.value
        return None if self.fit is None else self.fit.value

    @property
    def error(self) -> float | None:
        """How far it is known: the distance of the runs, else the standard error of the fit."""
        if self.best is not None:
            return self.best.apart
        return None if self.fit is None else self.fit.error

    @property
    def after(self) -> float | None:
        """The gap there: of runs, else as predicted [SI]."""
        if self.best is not None:
            return self.best.gap
        return self.fit.gap if self.measured is None and self.fit else self.measured


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
) -> BroughtTogether:
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
    """
    nothing = BroughtTogether(vary.label, vary.times, varied, own)
    if varied == "right" and vary.kind != "option":
        why = "the model has no value of its own that the left side could keep"
        return replace(nothing, why_not=why)
    case = _Case(data, vary, quantity, varied, own, runner, progress)
    if runner is None and case.lacks_references:
        why = (
            "the design has no run of the left side at the model's own value, and nothing may be "
            "run"
        )
        return replace(nothing, why_not=why)
    fit = case.scatter() if vary.bounds is not None else case.grid()
    if fit is None:
        why = "it needs three values of the parameter with runs"
        return replace(nothing, why_not=why, cells=case.cells)
    before, measured, best, gap, there = case.own_gap(), None, None, fit.gap, fit
    if runner is not None:
        run_before, measured = case.check(fit)
        before = before if run_before is None else run_before
    if measured is not None:
        gap, predicted, _ = measured
        if abs(predicted - gap) > max(_NEAR * gap, good):
            best = case.refined(fit, gap)
            gap = best.gap
            there = replace(fit, edge=best.value in fit.bounds)
    return BroughtTogether(
        vary.label, vary.times, varied, own, before, fit,
        *(measured or (None, None, 0)),
        there.verdict(gap, before, good),
        "" if measured else "nothing was run at that value",
        case.cells, best,
    )  # fmt: skip


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
        self._place = [each.label for each in data.design.factors].index(vary.label)
        self._levels = np.sort(np.array(vary.values, dtype=float))
        self._near = np.flatnonzero(np.isclose(self._levels, np.nan if own is None else own))[:1]
        self.lacks_references = not (self._both or len(self._near))
        self._kept: list[Setting] = []  # those that the fit is of

    def _curves(self, values: Array) -> Array:
        """(c, k, …) of what is (p, s, …): by the other values and seeds, and by the parameter."""
        listed = self._data.design.listed
        lengths = [len(vary.values) for vary in listed]
        axis = [vary.label for vary in listed].index(self._vary.label)
        cube = values.reshape(-1, *lengths, *values.shape[1:])
        cube = np.moveaxis(cube, axis + 1, len(lengths) + 1)
        order = np.argsort([float(value) for value in self._vary.values])
        return cube.reshape(-1, lengths[axis], *values.shape[2:])[:, order]

    def grid(self) -> FittedValue | None:
        """From the values of a list or a grid."""
        left, right = (self._curves(vectors(self._quantity, runs)) for runs in self._data.runs)
        points, seeds = self._data.runs.shape[1:]
        # The first point of each curve, its parameter at the least value.
        first = self._curves(np.arange(points * seeds).reshape(points, seeds))[:, 0]
        chosen = evenly(len(first), MOST_REFERENCES if self.lacks_references else len(first))
        self._kept = [
            (self._data.points[k // seeds].values, k % seeds) for k in first[chosen].tolist()
        ]
        if self.lacks_references:
            (runs,) = self._run([(0, self._at(self._kept, self._own))], 0.0)
            left, right = vectors(self._quantity, runs)[:, None], right[chosen]
        elif not self._both:
            left = left[:, self._near]
        seeds = [seed for _, seed in self._kept]
        return fit_curves(self._quantity, self._levels, left, right, seeds)

    def scatter(self) -> FittedValue | None:
        """From samples of a range."""
        values = np.array(self._data.values(self._vary.label), dtype=float)
        chosen = evenly(len(values), len(values) if self._both else MOST_REFERENCES)
        self._kept = [(self._data.points[k].values, 0) for k in chosen]
        if self._both:
            return fit_scatter(values, median(self._data.gaps[self._quantity]))
        (runs,) = self._run([(0, self._at(self._kept, self._own))], 0.0)
        gap = gap_between(self._quantity, runs, self._data.runs[1, chosen, 0])
        return fit_scatter(values[chosen], gap)

    def _at(self, settings: Sequence[Setting], value: float | None) -> list[Setting]:
        """Settings with a value of the parameter; None is what the model has."""
        k = self._place
        return [((*values[:k], value, *values[k + 1 :]), seed) for values, seed in settings]

    def _run(self, groups: Sequence[tuple[int, Sequence[Setting]]], start: float) -> list[Runs]:
        """Runs of each group of settings on a side; all at once, as processes start slowly."""
        assert self._runner is not None
        asked = [(self._data.sides[side], *each) for side, settings in groups for each in settings]
        self.cells += len(asked)
        runs = self._runner.run(asked, progress=lambda f: self._progress(start + f / 4))
        return np.split(runs, np.cumsum([len(settings) for _, settings in groups])[:-1])

    def check(self, fit: FittedValue) -> tuple[float | None, tuple[float, float, int] | None]:
        """Run both sides at the value.

        Returns:
            The gap at the model's own value, if it has one and it was run; and the gap, what the
            fit says of it, and of how many pairs, if any ended.
        """
        picked = self._picked(fit)
        chosen = [self._kept[k] for k in picked]
        at, own = self._at(chosen, fit.value), self._at(chosen, self._own)
        groups = [(1, at), (0, at if self._both else own)]
        if self._vary.kind == "option":
            groups += [(1, own), (0, own)] if self._both else [(1, own)]
        right, left, *others = self._run(groups, 0.5)
        gap = gap_between(self._quantity, left, right)
        before = np.array([])
        if others:
            before = gap_between(self._quantity, others[-1] if self._both else left, others[0])
        predicted = np.mean(fit.each[picked]) if len(fit.each) else fit.gap
        count = int(np.isfinite(gap).sum())
        measured = (float(np.nanmean(gap)), float(predicted), count) if count else None
        return _mean(before), measured

    def refined(self, fit: FittedValue, measured: float) -> BestRun:
        """Run both sides between the neighbours of the value, and keep the best.

        A gap over a contact has jumps, which neither an interpolation nor a search for one
        minimum stands; values side by side do.
        """
        chosen = [self._kept[k] for k in self._picked(fit)]
        low, high = self._around(fit)
        values = np.linspace(low, high, REFINED).tolist()
        at = [setting for value in values for setting in self._at(chosen, value)]
        left_at = at if self._both else self._at(chosen, self._own)
        right, left = self._run([(1, at), (0, left_at)], 0.75)
        pairs = right.reshape(REFINED, -1)
        by_value = gap_between(self._quantity, left.reshape(-1, len(chosen)), pairs)
        stood = np.isfinite(by_value).all(axis=0)  # the same pairs at every value
        means = by_value[:, stood].mean(axis=1) if stood.any() else np.full(REFINED, np.nan)
        tried, gaps = [*values, fit.value], [*means.tolist(), measured]
        place = int(np.nanargmin(gaps))
        apart = (high - low) / (REFINED - 1)
        return BestRun(tried[place], gaps[place], apart, (tuple(tried), tuple(gaps)))

    def _around(self, fit: FittedValue) -> tuple[float, float]:
        """The values of the design on both sides; of a range an eighth of it to each side."""
        (low, high), eighth = fit.bounds, (fit.bounds[1] - fit.bounds[0]) / 8
        if self._vary.bounds is not None:
            return max(low, fit.value - eighth), min(high, fit.value + eighth)
        levels = self._levels.tolist()
        return (
            max((level for level in levels if level < fit.value), default=low),
            min((level for level in levels if level > fit.value), default=high),
        )

    def _picked(self, fit: FittedValue) -> list[int]:
        """The settings that are run at a value."""
        known = np.arange(len(self._kept))
        if len(fit.each):
            known = np.flatnonzero(np.isfinite(fit.each))
        return known[evenly(len(known), CHECKED)].tolist()

    def own_gap(self) -> float | None:
        """The gap of the dataset with the parameter as the model has it."""
        if self._own is None:
            return None
        values = np.array(self._data.values(self._vary.label), dtype=float)
        return _mean(self._data.gaps[self._quantity][np.isclose(values, self._own)])


def _mean(gaps: Array) -> float | None:
    """Of what is a number; None where nothing is."""
    return float(np.nanmean(gaps)) if np.isfinite(gaps).any() else None
