"""How much each parameter of a design moves a figure by itself: shares of the figure's variance."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...interface import Array, Ints
from .design import Design, Value

Flags = NDArray[np.bool_]

_RESAMPLES = 400  # of a bootstrap
_MIN_SEEDS = 3  # of which a bootstrap says something
_MIN_SAMPLES = 8  # the same
_MIN_CLASS_SAMPLES = 4  # samples that can be divided into two classes of two


@dataclass(frozen=True)
class LevelMean:
    """The mean of a figure where one parameter has one value, whatever the others are.

    Attributes:
        value: Of the parameter; of a sampled range the mean of a class of samples.
        mean: In the unit of the figure.
    """

    value: Value
    mean: float


@dataclass(frozen=True)
class MainEffects:
    """The main effect of each parameter on a figure.

    Attributes:
        shares: Of each parameter, in the order of the design, its share of the variance [1], from
            0 to 1; None where there is nothing to compute it from.
        errors: The standard error of each [1]; None where there is nothing to compute it from.
        levels: Of each parameter the mean of the figure at each value; of a range, in each class
            of samples; empty of too few samples.
        why_none: Why no parameter has a share; "" where one has.
        mean: The mean over the settings, in the unit of the figure.
        deviation: The standard deviation over them: the root of the variance that is shared.
        settings: How many settings that is of.
        left_out: The values of a list or a grid that are left out, by parameter.
    """

    shares: Mapping[str, float | None]
    errors: Mapping[str, float | None]
    levels: Mapping[str, tuple[LevelMean, ...]]
    why_none: str
    mean: float
    deviation: float
    settings: int
    left_out: Mapping[str, tuple[Value, ...]]


def main_effects(design: Design, values: Array, rounding: float = 0.0) -> MainEffects:
    """Compute the share of the variance that each parameter explains alone.

    The main effect of a parameter X on a figure Y is its first-order sensitivity index

        S = Var(E[Y | X]) / Var(Y)

    (A. Saltelli et al., Global Sensitivity Analysis: The Primer, Wiley 2008, chapter 4). It is
    computed from the settings that there are, without a design of its own (E. Plischke,
    Reliability Engineering & System Safety 95, 2010; with classes: E. Plischke, E. Borgonovo and
    C. L. Smith, European Journal of Operational Research 226, 2013). The settings are divided
    into classes by the value of X, and E[Y | X] is the mean of a class. The levels of a list or a
    grid are its classes; n samples of a range make about √n classes of equally many samples, and
    what the figure does within a class is lost: of a straight line 1 / n of its share.

    The means of classes also differ where the other parameters do not have the same values in
    each class. In a grid they have; in a Sobol sequence they nearly have. So no correction is made
    for it: that for independent samples, (c - 1) / (n - c) of the variance within c classes of n
    samples, takes away what is not there. From 64 samples on, on the functions of Ishigami and
    Sobol and on a sum of eight parameters, it puts the shares two to ten times farther from the
    closed form. It is a bound, on average, of what a share may be too large by.

    The standard error is a bootstrap over the samples of a range; it takes them for independent,
    and is rather too large for a Sobol sequence. The settings of a grid are no sample: there it is
    a bootstrap over the seeds.

    Samples and levels without a figure are left out until every combination of what stays has
    one: with other holes in each class, classes would differ by what is missing.

    Args:
        design: Of the sweep.
        values: (p, s) the figure at each point and seed; NaN where there is none, but not
            everywhere. Of the seeds of a setting the median counts.
        rounding: What figures may differ by and be the same.
    """
    balanced = _complete_design(design, values)
    centre = _median(balanced.cube)
    shares = errors = np.full(len(design.factors), np.nan)
    why_none = _why_none(design, centre, rounding)
    if not why_none:
        shares = _first_order_indices(balanced, centre, balanced.sampled)
        if np.isnan(shares).all():
            why_none = "each parameter has too few values left"
        drawn = list(_bootstrap_shares(balanced, rounding))
        if drawn:
            errors = np.where(np.isnan(shares), np.nan, np.std(drawn, axis=0))
    return MainEffects(
        shares=_by_label(design, shares),
        errors=_by_label(design, errors),
        levels=_levels(balanced, centre),
        why_none=why_none,
        mean=float(centre.mean()),
        deviation=float(centre.std()),
        settings=centre.size,
        left_out=balanced.left_out,
    )


def _why_none(design: Design, centre: Array, rounding: float) -> str:
    """Return why settings with these figures have no variance to share; "" if they have."""
    if not design.factors:
        return "nothing is varied"
    if centre.size < 2:
        return "no two settings are left to be compared"
    if not np.ptp(centre) > rounding:
        return "it is the same at every setting, but for rounding"
    return ""


def _by_label(design: Design, figures: Array) -> dict[str, float | None]:
    """Return figures (k,) of the k factors by their labels; None for NaN."""
    numbers: dict[str, float | None] = {}
    for vary, figure in zip(design.factors, figures.tolist(), strict=True):
        numbers[vary.label] = None if np.isnan(figure) else figure
    return numbers


@dataclass(frozen=True, eq=False)
class _CompleteDesign:
    """The settings of a design that have a figure, at every combination of what stays.

    Attributes:
        design: Of the sweep.
        cube: (n, n1, …, nk, s) the figure, for n samples of the ranges, the levels of each of the
            k lists and grids, and s seeds. Each setting has one at one seed at least; others may
            be NaN.
        sampled: (n, r) the samples of the r ranges.
        values: Of each of the k lists and grids, the levels that stay.
        left_out: The levels that are left out, by parameter.
    """

    design: Design
    cube: Array
    sampled: Array
    values: Sequence[Sequence[Value]]
    left_out: Mapping[str, tuple[Value, ...]]


def _complete_design(design: Design, values: Array) -> _CompleteDesign:
    """Leave out samples and levels, until no setting is without a figure.

    Args:
        design: Of the sweep.
        values: (p, s) at each point and seed; NaN where there is none.
    """
    samples = design.samples if design.sampled else 1
    # The samples change slowest; see `Design.points`.
    lengths = [len(vary.values) for vary in design.listed]
    cube = values.reshape(samples, *lengths, values.shape[-1])
    indices = _complete_indices(np.asarray(np.isnan(cube).all(axis=-1)))
    left_out: dict[str, tuple[Value, ...]] = {}
    values_left: list[tuple[Value, ...]] = []
    for vary, levels in zip(design.listed, indices[1:], strict=True):
        values_left.append(tuple(vary.values[k] for k in levels))
        gone = tuple(value for k, value in enumerate(vary.values) if k not in levels)
        if gone:
            left_out[vary.label] = gone
    sampled = design.sample_values()[indices[0]]
    return _CompleteDesign(design, cube[np.ix_(*indices)], sampled, values_left, left_out)


def _complete_indices(holes: Flags) -> list[list[int]]:
    """Return the places along each axis that stay where those with holes go, the worst first.

    Args:
        holes: (n, n1, …, nk) whether there is no figure; somewhere there is one.
    """
    indices = [list(range(length)) for length in holes.shape]
    while (left := holes[np.ix_(*indices)]).any():
        worst_axis, worst = 0, np.zeros(0)
        for axis in range(left.ndim):
            shares = left.mean(axis=_other_axes(left.ndim, axis))
            # The last place of an axis stays: somewhere in it there is a figure.
            if len(shares) > 1 and shares.max() > worst.max(initial=0.0):
                worst_axis, worst = axis, shares
        gone = np.flatnonzero(worst == 1.0).tolist() or [int(worst.argmax())]
        for place in reversed(gone):
            del indices[worst_axis][place]
    return indices


def _other_axes(count: int, axis: int) -> tuple[int, ...]:
    """Return all axes but one."""
    return tuple(other for other in range(count) if other != axis)


def _first_order_indices(balanced: _CompleteDesign, centre: Array, sampled: Array) -> Array:
    """Return Var(E[Y | X]) / Var(Y) of each parameter [1], in the order of the design.

    It is NaN of a list that has one value left of several, and of a range with too few samples.

    Args:
        balanced: What of.
        centre: (n, n1, …, nk) the figure at the settings.
        sampled: (n, r) the samples of the ranges.
    """
    by_sample = centre.mean(axis=_other_axes(centre.ndim, 0))
    between: list[float] = []
    column, axis = 0, 0
    for vary in balanced.design.factors:
        if vary.bounds is not None:
            between.append(_variance_of_class_means(sampled[:, column], by_sample))
            column += 1
            continue
        axis += 1
        means = centre.mean(axis=_other_axes(centre.ndim, axis))
        is_known = len(means) > 1 or vary.label not in balanced.left_out
        between.append(float(means.var()) if is_known else np.nan)
    return np.array(between) / centre.var()


def _levels(balanced: _CompleteDesign, centre: Array) -> dict[str, tuple[LevelMean, ...]]:
    """Return the mean of the figure at each value of each parameter, by label.

    Args:
        balanced: What of.
        centre: (n, n1, …, nk) the figure at the settings.
    """
    by_sample = centre.mean(axis=_other_axes(centre.ndim, 0))
    levels: dict[str, tuple[LevelMean, ...]] = {}
    column, axis = 0, 0
    for vary in balanced.design.factors:
        if vary.bounds is not None:
            levels[vary.label] = _means_of_classes(balanced.sampled[:, column], by_sample)
            column += 1
            continue
        axis += 1
        means = centre.mean(axis=_other_axes(centre.ndim, axis)).tolist()
        values = balanced.values[axis - 1]
        levels[vary.label] = tuple(map(LevelMean, values, means))
    return levels


def _means_of_classes(values: Array, figures: Array) -> tuple[LevelMean, ...]:
    """Return the mean value and the mean figure of each class of samples; none of too few."""
    if len(values) < _MIN_CLASS_SAMPLES:
        return ()
    parts = zip(_classes(values, values), _classes(values, figures), strict=True)
    return tuple(LevelMean(float(part.mean()), float(of.mean())) for part, of in parts)


def _classes(values: Array, figures: Array) -> list[Array]:
    """Return figures (n,) in classes of equally many samples, in the order of values (n,)."""
    classes = 2 ** int(np.ceil(np.log2(len(values)) / 2 - 0.5))  # the power nearest to the root
    return np.array_split(figures[np.argsort(values, kind="stable")], classes)


def _variance_of_class_means(values: Array, figures: Array) -> float:
    """Return the variance of the means of classes of equally many samples; NaN of too few.

    Args:
        values: (n,) of a parameter, which make the classes.
        figures: (n,) whose means are taken.
    """
    if len(values) < _MIN_CLASS_SAMPLES:
        return np.nan
    parts = _classes(values, figures)
    means = np.array([part.mean() for part in parts])
    sizes = [len(part) for part in parts]
    return float(np.average((means - figures.mean()) ** 2, weights=sizes))


def _bootstrap_shares(balanced: _CompleteDesign, rounding: float) -> Iterator[Array]:
    """Yield the shares of a bootstrap: over samples, else over seeds; none of too few.

    What is the same everywhere, or has no figure somewhere, has no shares and is passed over.
    """
    if balanced.design.sampled:
        centre = _median(balanced.cube)
        for places in _resampled_indices(len(centre), _MIN_SAMPLES):
            if np.ptp(centre[places]) > rounding:
                yield _first_order_indices(balanced, centre[places], balanced.sampled[places])
    else:
        for places in _resampled_indices(balanced.cube.shape[-1], _MIN_SEEDS):
            centre = _median(balanced.cube[..., places])
            if np.ptp(centre) > rounding:
                yield _first_order_indices(balanced, centre, balanced.sampled)


def _resampled_indices(count: int, least: int) -> Iterator[Ints]:
    """Yield places that are drawn again from `count` of them, many times; none of too few."""
    draw = np.random.default_rng(0)
    for _ in range(_RESAMPLES if count >= least else 0):
        yield draw.integers(0, count, count)


def _median(values: Array) -> Array:
    """Return the median over the last axis of what is a number; NaN where nothing is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a setting without any
        return np.asarray(np.nanmedian(values, axis=-1))
