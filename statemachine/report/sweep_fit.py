"""Which value brings two engines of a sweep together, in words."""

from __future__ import annotations

from ..measures.text import listed, quantity
from ..page import Block, Table, Text
from ..sweep.analysis import SweepReport
from ..sweep.analysis_together import BroughtTogether
from . import template
from .sweep_pictures import fit_curve
from .template import if_true

NONE_FITTED = {
    True: "Nothing is to be brought together: every gap is inside the chaos floor.",
    False: "No parameter has three numbers or a range: nothing is fitted.",
}
LINES = {
    "not fitted": "{label} is not fitted: {why_not}.",
    "own": "The model's own {label} is the best already: at {value}, {sizes}.",
    "none": "No value of {label} is better than {other}: at the best, {value}, {sizes}.",
    "edge": "{label} {where}: the gap is least at the edge of the range, {value} ({sizes}): look "
    "beyond it.",
    "together": "{label} = {value} {where} brings {pair} together: {sizes}.",
    "closer": "{label} = {value} {where} brings {pair} closer, not together: {sizes}.",
}


def together(sweep: SweepReport) -> list[Block]:
    """The sentence of each fit, how it was made, and its picture."""
    blocks = [block for fit in sweep.together for block in _fit(sweep, fit)]
    return blocks or [Text(NONE_FITTED[sweep.only_rounding])]


def line(sweep: SweepReport, parameter: BroughtTogether) -> str:
    """What a fit says, in a sentence."""
    unit, what = sweep.quantity.unit, sweep.quantity.says
    if parameter.fit is None:
        return LINES["not fitted"].format(label=parameter.label, why_not=parameter.why_not)
    before, after = quantity(parameter.before, unit), quantity(parameter.after, unit)
    own = parameter.verdict == "none" and _is_own(parameter)
    return LINES["own" if own else parameter.verdict].format(
        label=parameter.label,
        value=_fitted(parameter),
        where=f"in {sweep.sides[1]}" if parameter.varied == "right" else "in both",
        pair=listed(list(sweep.sides)),
        other="any other" if parameter.own is None else "the model's own",
        sizes=f"{what} {before} → {after}",
    )


def _is_own(parameter: BroughtTogether) -> bool:
    """Whether the value is the model's own, as far as its error tells."""
    if parameter.fit is None or parameter.value is None or parameter.own is None:
        return False
    wide = parameter.fit.bounds[1] - parameter.fit.bounds[0]
    return abs(parameter.value - parameter.own) <= max(2 * (parameter.error or 0.0), 0.02 * wide)


def _fit(sweep: SweepReport, parameter: BroughtTogether) -> list[Block]:
    """What a fit says, how it was made, and what a run says of it."""
    unit, fit = sweep.quantity.unit, parameter.fit
    if fit is None:
        return [Text(line(sweep, parameter))]
    within, measured = fit.within(sweep.quantity.tolerance), parameter.measured is not None
    figures = {
        "the model's own value": parameter.own is not None and _times(parameter, parameter.own),
        "values looked at": " to ".join(_times(parameter, end) for end in fit.bounds),
        "predicted within tolerance": within
        and " to ".join(_times(parameter, end) for end in within),
        "curves in the mean, over settings and seeds": str(fit.curves),
        "± is the standard error, from": fit.error is not None and not parameter.tried and fit.of,
        "gap of runs there": measured and quantity(parameter.measured, unit),
        "predicted for them": measured and quantity(parameter.predicted, unit),
        "pairs of runs": measured and str(parameter.pairs),
    }
    rows = [(name, value) for name, value in figures.items() if value]
    values = (
        parameter.tried[0] if parameter.tried is not None and parameter.error is not None else None
    )
    right = parameter.varied == "right"
    return template.blocks(
        "sweep_fit",
        line=line(sweep, parameter),
        table=Table(("the fit", parameter.label), rows, words=frozenset({0, 1})),
        left=sweep.sides[0] if right else None,
        right=sweep.sides[1],
        both=if_true(not right),
        label=parameter.label,
        why_not=None if measured else parameter.why_not,
        number=str(len(values) - 1) if values else None,
        low=_times(parameter, min(values or [0.0])),
        high=_times(parameter, max(values or [0.0])),
        apart=_times(parameter, parameter.error or 0.0),
        picture=fit_curve(sweep, parameter),
    )


def _fitted(parameter: BroughtTogether) -> str:
    """The value with its error, to the digits that the error leaves."""
    fit, value, error = parameter.fit, parameter.value, parameter.error
    assert fit is not None
    times = "x" if parameter.times else ""
    if error is None or not error > 0:
        return f"{value:.3g}{times}"
    error = max(error, 1e-4 * (fit.bounds[1] - fit.bounds[0]))  # the interpolation knows no more
    digits = max(0, -int(f"{error:e}".partition("e")[2]) + 1)
    return f"{value:.{digits}f}{times} ± {error:.{digits}f}{times}"


def _times(parameter: BroughtTogether, value: float) -> str:
    return f"{value:.4g}{'x' if parameter.times else ''}"
