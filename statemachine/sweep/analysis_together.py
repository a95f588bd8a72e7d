"""For each parameter: the value at which two sides come together, and a run of both there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from ..interface import Array, Ints
from ..runs.drive import Progress, silent
from .analysis_fit import FittedValue, Verdict, fit_curves, fit_scatter
from .analysis_gaps import SweepGaps, SweepRuns, alike, gap_between, joined, median
from .analysis_runs import CellRunner, Setting, evenly
from .factors import Vary

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
    cells: int = field(default=0)
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
    gaps: SweepGaps,
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
        gaps: Of the sweep.
        vary: One of its factors, with numbers.
        quantity: Whose gap.
        good: The gap that is as good as none [SI].
        varied: Whether the left side keeps the model's own value.
        own: That value; None where the model's parts have several.
        runner: Runs what the dataset has not; None for nothing.
        progress: Told the fraction that is done.
    """
    case = _Case(gaps, vary, quantity, varied, own, runner, progress)
    if varied == "right" and vary.kind != "option":
        return case.told("the model has no value of its own that the left side could keep")
    fit = case.scatter() if vary.bounds is not None else case.grid()
    if fit is None:
        return case.told(case.why_not or "it needs three values of the parameter with runs")
    measured = case.check(fit) if runner is not None else None
    best, gap, there = None, fit.gap, fit
    if measured is not None:
        gap = measured[0]
        if abs(measured[1] - gap) > max(_NEAR * gap, good):
            best = case.refined(fit, gap)
            gap = best.gap
            there = replace(fit, edge=best.value in fit.bounds)
    before = case.before if case.before is not None else case.own_gap()
    return BroughtTogether(
        vary.label, vary.times, varied, own, before, fit,
        *(measured or (None, None, 0)),
        there.verdict(gap, before, good),
        "" if measured else "nothing was run at that value",
        case.cells, best,
    )  # fmt: skip


@dataclass
class _Case:
    """One parameter of one sweep, and what was run for it."""

    gaps: SweepGaps
    vary: Vary
    quantity: str
    varied: Varied
    own: float | None
    runner: CellRunner | None
    progress: Progress
    why_not: str = ""
    before: float | None = None
    cells: int = 0
    kept: list[Setting] = field(default_factory=list)

    def told(self, why_not: str) -> BroughtTogether:
        return BroughtTogether(
            self.vary.label, self.vary.times, self.varied, self.own, why_not=why_not,
            cells=self.cells,
        )  # fmt: skip

    @property
    def place(self) -> int:
        return [vary.label for vary in self.gaps.design.factors].index(self.vary.label)

    def _curves(self, values: Array) -> Array:
        """(c, k, …) of what is (p, s, …): by the other values and seeds, and by the parameter."""
        design = self.gaps.design
        lengths = [len(vary.values) for vary in design.listed]
        samples = len(self.gaps.points) // int(np.prod(lengths))
        axis = 1 + [vary.label for vary in design.listed].index(self.vary.label)
        rest = values.shape[2:]
        cube = values.reshape(samples, *lengths, values.shape[1], *rest)
        cube = np.moveaxis(cube, axis, len(lengths) + 1)
        order = np.argsort([float(value) for value in self.vary.values])
        return cube.reshape(-1, lengths[axis - 1], *rest)[:, order]

    def _settings(self) -> list[Setting]:
        """(c) the values and the seed of each curve, the parameter at its least value."""
        points, seeds = len(self.gaps.points), len(self.gaps.seeds)
        number = np.arange(points * seeds).reshape(points, seeds)
        first = self._curves(number.astype(float))[:, 0].astype(int)
        return [
            (self.gaps.points[k // seeds].values, self.gaps.seeds[k % seeds])
            for k in first.tolist()
        ]

    def grid(self) -> FittedValue | None:
        """From the values of a list or a grid."""
        levels = np.sort(np.array(self.vary.values, dtype=float))
        one, two = (each.vectors(self.quantity) for each in (self.gaps.left, self.gaps.right))
        left, right = self._curves(one), self._curves(two)
        settings = self._settings()
        if self.varied == "right":
            near = np.flatnonzero(np.isclose(levels, np.nan if self.own is None else self.own))
            if len(near):
                left = left[:, near[:1]]
            else:
                chosen = evenly(len(settings), MOST_REFERENCES)
                runs = self._references([settings[k] for k in chosen])
                if runs is None:
                    return None
                runs, others = alike(runs, self.gaps.right)
                left = runs.vectors(self.quantity)[:, None]
                right = self._curves(others.vectors(self.quantity))[chosen]
                settings = [settings[k] for k in chosen]
        self.kept = settings
        seeds = [seed for _, seed in settings]
        return fit_curves(self.quantity, levels, left, right, seeds)

    def scatter(self) -> FittedValue | None:
        """From samples of a range."""
        values = np.array([float(point.values[self.place]) for point in self.gaps.points])
        if self.varied == "both":
            self.kept = [(point.values, self.gaps.seeds[0]) for point in self.gaps.points]
            return fit_scatter(values, median(self.gaps.gap(self.quantity)))
        chosen = evenly(len(values), MOST_REFERENCES)
        self.kept = [(self.gaps.points[k].values, self.gaps.seeds[0]) for k in chosen]
        runs = self._references(self.kept)
        if runs is None:
            return None
        gap = gap_between(self.quantity, *alike(runs, self.gaps.right[chosen, 0]))
        return fit_scatter(values[chosen], gap)

    def _references(self, settings: Sequence[Setting]) -> SweepRuns | None:
        """The left side at the model's own value."""
        if self.runner is None:
            self.why_not = (
                "the design has no run of the left side at the model's own value, and nothing "
                "may be run"
            )
            return None
        return self._run([(self.gaps.sides[0], settings, True)], 0.0)

    def _run(
        self, groups: Sequence[tuple[str, Sequence[Setting], bool]], start: float
    ) -> SweepRuns:
        """Runs (n,) of groups of a backend, settings, and whether the model's own value is meant.

        Groups of the same kind go together: each start of processes takes a second.
        """
        assert self.runner is not None
        told: list[tuple[str, Setting]] = []
        apart: list[tuple[str, Setting]] = []
        order: list[tuple[bool, int]] = []
        for backend, settings, is_own in groups:
            for values, seed in settings:
                without = is_own and self.own is None
                kept = values
                if is_own and self.own is not None:
                    kept = self._with(values, self.own)
                into = apart if without else told
                order.append((without, len(into)))
                into.append((backend, (kept, seed)))
        found = {}
        for k, (batch, without) in enumerate(((told, False), (apart, True))):
            if batch:
                found[without] = self.runner.run(
                    [backend for backend, _ in batch],
                    [setting for _, setting in batch],
                    own=self.vary if without else None,
                    progress=lambda f, k=k: self.progress(min(1.0, start + (f + k) / 4)),
                )
        self.cells += len(order)
        rows = [k + (len(told) if without else 0) for without, k in order]
        return joined([found[key] for key in sorted(found)])[rows]

    def check(self, fit: FittedValue) -> tuple[float, float, int] | None:
        """Run both sides at the value: the gap, what the fit says, and of how many pairs."""
        assert self.runner is not None
        picked = self._picked(fit)
        chosen = [self.kept[k] for k in picked]
        left, right = self.gaps.sides
        at = [(self._with(values, fit.value), seed) for values, seed in chosen]
        groups = [(right, at, False)]
        groups.append((left, chosen, True) if self.varied == "right" else (left, at, False))
        own = self.vary.kind == "option"
        if own:
            groups.append((right, chosen, True))
            if self.varied == "both":
                groups.append((left, chosen, True))
        runs = self._run(groups, 0.5)
        found = [runs[k * len(chosen) : (k + 1) * len(chosen)] for k in range(len(groups))]
        gap = gap_between(self.quantity, found[1], found[0])
        if own:
            other = found[3] if self.varied == "both" else found[1]
            before = gap_between(self.quantity, other, found[2])
            if np.isfinite(before).any():
                self.before = float(np.nanmean(before))
        if not np.isfinite(gap).any():
            return None
        predicted = np.mean(fit.each[picked]) if len(fit.each) else fit.gap
        return float(np.nanmean(gap)), float(predicted), int(np.isfinite(gap).sum())

    def refined(self, fit: FittedValue, measured: float) -> BestRun:
        """Run both sides between the neighbours of the value, and keep the best.

        A gap over a contact has jumps, which neither an interpolation nor a search for one
        minimum stands; values side by side do.
        """
        chosen = [self.kept[k] for k in self._picked(fit)]
        low, high = self._around(fit)
        values = np.linspace(low, high, REFINED)
        at = [(self._with(v, value), seed) for value in values.tolist() for v, seed in chosen]
        left, right = self.gaps.sides
        own = self.varied == "right"
        runs = self._run([(right, at, False), (left, chosen if own else at, own)], 0.75)
        other = np.tile(np.arange(len(chosen)), REFINED) if own else np.arange(len(at))
        gap = gap_between(self.quantity, runs[len(at) + other], runs[: len(at)])
        tried = [*values.tolist(), fit.value]
        by_value = gap.reshape(REFINED, -1)
        stood = np.isfinite(by_value).all(axis=0)  # the same pairs at every value
        means = by_value[:, stood].mean(axis=1) if stood.any() else np.full(REFINED, np.nan)
        gaps = [*means.tolist(), measured]
        place = int(np.nanargmin(gaps))
        apart = (high - low) / (REFINED - 1)
        return BestRun(tried[place], gaps[place], apart, (tuple(tried), tuple(gaps)))

    def _around(self, fit: FittedValue) -> tuple[float, float]:
        """The values of the design on both sides; of a range an eighth of it to each side."""
        (low, high), eighth = fit.bounds, (fit.bounds[1] - fit.bounds[0]) / 8
        if self.vary.bounds is not None:
            return max(low, fit.value - eighth), min(high, fit.value + eighth)
        levels = np.sort(np.array(self.vary.values, dtype=float))
        below, above = levels[levels < fit.value], levels[levels > fit.value]
        return float(below[-1]) if len(below) else low, float(above[0]) if len(above) else high

    def _picked(self, fit: FittedValue) -> Ints:
        """The settings that are run at a value."""
        known = (
            np.flatnonzero(np.isfinite(fit.each)) if len(fit.each) else np.arange(len(self.kept))
        )
        return known[evenly(len(known), CHECKED)]

    def _with(self, values: tuple[Any, ...], value: float) -> tuple[Any, ...]:
        return (*values[: self.place], value, *values[self.place + 1 :])

    def own_gap(self) -> float | None:
        """The gap of the dataset with the parameter as the model has it."""
        if self.own is None:
            return None
        values = np.array([float(value) for value in self.gaps.values(self.vary.label)])
        near = np.isclose(values, self.own)
        gap = self.gaps.gap(self.quantity)[near]
        return float(np.nanmean(gap)) if np.isfinite(gap).any() else None
