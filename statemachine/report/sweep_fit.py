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


def together(found: SweepReport) -> list[Block]:
    """The sentence of each fit, how it was made, and its picture."""
    blocks = [block for fit in found.together for block in _fit(found, fit)]
    return blocks or [Text(NONE_FITTED[found.only_rounding])]


def line(found: SweepReport, each: BroughtTogether) -> str:
    """What a fit says, in a sentence."""
    unit, what = found.quantity.unit, found.quantity.says
    if each.fit is None:
        return LINES["not fitted"].format(label=each.label, why_not=each.why_not)
    before, after = quantity(each.before, unit), quantity(each.after, unit)
    own = each.verdict == "none" and _is_own(each)
    return LINES["own" if own else each.verdict].format(
        label=each.label,
        value=_fitted(each),
        where=f"in {found.sides[1]}" if each.varied == "right" else "in both",
        pair=listed(list(found.sides)),
        other="any other" if each.own is None else "the model's own",
        sizes=f"{what} {before} → {after}",
    )


def _is_own(each: BroughtTogether) -> bool:
    """Whether the value is the model's own, as far as its error tells."""
    if each.fit is None or each.value is None or each.own is None:
        return False
    wide = each.fit.bounds[1] - each.fit.bounds[0]
    return abs(each.value - each.own) <= max(2 * (each.error or 0.0), 0.02 * wide)


def _fit(found: SweepReport, each: BroughtTogether) -> list[Block]:
    """What a fit says, how it was made, and what a run says of it."""
    unit, fit = found.quantity.unit, each.fit
    if fit is None:
        return [Text(line(found, each))]
    within, measured = fit.within(found.quantity.tolerance), each.measured is not None
    figures = {
        "the model's own value": each.own is not None and _times(each, each.own),
        "values looked at": " to ".join(_times(each, end) for end in fit.bounds),
        "predicted within tolerance": within and " to ".join(_times(each, end) for end in within),
        "curves in the mean, over settings and seeds": str(fit.curves),
        "± is the standard error, from": fit.error is not None and not each.tried and fit.of,
        "gap of runs there": measured and quantity(each.measured, unit),
        "predicted for them": measured and quantity(each.predicted, unit),
        "pairs of runs": measured and str(each.pairs),
    }
    rows = [(name, value) for name, value in figures.items() if value]
    values = each.tried[0] if each.tried is not None and each.error is not None else None
    right = each.varied == "right"
    return template.blocks(
        "sweep_fit",
        line=line(found, each),
        table=Table(("the fit", each.label), rows, words=frozenset({0, 1})),
        left=found.sides[0] if right else None,
        right=found.sides[1],
        both=if_true(not right),
        label=each.label,
        why_not=None if measured else each.why_not,
        number=str(len(values) - 1) if values else None,
        low=_times(each, min(values or [0.0])),
        high=_times(each, max(values or [0.0])),
        apart=_times(each, each.error or 0.0),
        picture=fit_curve(found, each),
    )


def _fitted(each: BroughtTogether) -> str:
    """The value with its error, to the digits that the error leaves."""
    fit, value, error = each.fit, each.value, each.error
    assert fit is not None
    times = "x" if each.times else ""
    if error is None or not error > 0:
        return f"{value:.3g}{times}"
    error = max(error, 1e-4 * (fit.bounds[1] - fit.bounds[0]))  # the interpolation knows no more
    digits = max(0, -int(f"{error:e}".partition("e")[2]) + 1)
    return f"{value:.{digits}f}{times} ± {error:.{digits}f}{times}"


def _times(each: BroughtTogether, value: float) -> str:
    return f"{value:.4g}{'x' if each.times else ''}"
