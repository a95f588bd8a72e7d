"""Which value brings two engines of a sweep together, in words."""

from __future__ import annotations

from ..measures.text import listed, quantity
from ..page import Block, Table, Text
from ..sweep.analysis import SweepReport
from ..sweep.analysis_together import BroughtTogether
from .sweep_pictures import fit_curve

ROUNDING = "Nothing is to be brought together: every gap is inside the chaos floor."
NO_RANGE = "No parameter has three numbers or a range: nothing is fitted."
NOT_FITTED = "{label} is not fitted: {why_not}."
OWN_IS_BEST = "The model's own {label} is the best already: at {value}, {sizes}."
LINES = {
    "none": "No value of {label} is better than {other}: at the best, {value}, {sizes}.",
    "edge": "{label} {where}: the gap is least at the edge of the range, {value} ({sizes}): look "
    "beyond it.",
    "together": "{label} = {value} {where} brings {pair} together: {sizes}.",
    "closer": "{label} = {value} {where} brings {pair} closer, not together: {sizes}.",
}
SIZES = "{what} {before} → {after}"
VARIED = {
    "right": "{left} keeps the model's own {label}, {right} has the values.",
    "both": "Both sides have the same {label}.",
}
UNCHECKED = "It is not checked by a run: {why_not}."
REFINED = (
    "The run is far off what was predicted: between its values the design is too coarse for this "
    "gap. So {number} values from {low} to {high} were run, {apart} apart: the value above is the "
    "best of them, and ± is that distance."
)


def together(found: SweepReport) -> list[Block]:
    """The sentence of each fit, how it was made, and its picture."""
    if not found.together:
        return [Text(ROUNDING if found.only_rounding else NO_RANGE)]
    blocks: list[Block] = []
    for each in found.together:
        blocks.append(Text(line(found, each)))
        if each.fit is not None:
            blocks += _how(found, each)
        picture = fit_curve(found, each)
        if picture is not None:
            blocks.append(picture)
    return blocks


def line(found: SweepReport, each: BroughtTogether) -> str:
    """What a fit says, in a sentence."""
    unit, what = found.quantity.unit, found.quantity.says
    if each.fit is None:
        return NOT_FITTED.format(label=each.label, why_not=each.why_not)
    before, after = quantity(each.before, unit), quantity(each.after, unit)
    own = each.verdict == "none" and _is_own(each)
    return (OWN_IS_BEST if own else LINES[each.verdict]).format(
        label=each.label,
        value=_fitted(each),
        where=f"in {found.sides[1]}" if each.varied == "right" else "in both",
        pair=listed(list(found.sides)),
        other="any other" if each.own is None else "the model's own",
        sizes=SIZES.format(what=what, before=before, after=after),
    )


def _is_own(each: BroughtTogether) -> bool:
    """Whether the value is the model's own, as far as its error tells."""
    if each.fit is None or each.value is None or each.own is None:
        return False
    wide = each.fit.bounds[1] - each.fit.bounds[0]
    return abs(each.value - each.own) <= max(2 * (each.error or 0.0), 0.02 * wide)


def _how(found: SweepReport, each: BroughtTogether) -> list[Block]:
    """How a fit was made, and what a run says of it."""
    unit, fit = found.quantity.unit, each.fit
    assert fit is not None
    left, right = found.sides
    lines = [VARIED[each.varied].format(left=left, right=right, label=each.label)]
    figures = {
        "the model's own value": None if each.own is None else _times(each, each.own),
        "values looked at": " to ".join(_times(each, end) for end in fit.bounds),
        "predicted within tolerance": _between(each, fit.within(found.quantity.tolerance)),
        "curves in the mean, over settings and seeds": str(fit.curves),
        "± is the standard error, from": fit.of if fit.error is not None and not each.tried else "",
    }
    if each.measured is None:
        lines.append(UNCHECKED.format(why_not=each.why_not))
    else:
        figures["gap of runs there"] = quantity(each.measured, unit)
        figures["predicted for them"] = quantity(each.predicted, unit)
        figures["pairs of runs"] = str(each.pairs)
    if each.tried is not None and each.error is not None:
        values = each.tried[0]
        ends = {"low": _times(each, min(values)), "high": _times(each, max(values))}
        apart = _times(each, each.error)
        lines.append(REFINED.format(number=len(values) - 1, apart=apart, **ends))
    rows = [(name, value) for name, value in figures.items() if value]
    table = Table(("the fit", each.label), rows, words=frozenset({0, 1}))
    return [table, Text(" ".join(lines), small=True)]


def _between(each: BroughtTogether, ends: tuple[float, float] | None) -> str:
    return "" if ends is None else f"{_times(each, ends[0])} to {_times(each, ends[1])}"


def _fitted(each: BroughtTogether) -> str:
    """The value with its error, to the digits that the error leaves."""
    fit, value, error = each.fit, each.value, each.error
    assert fit is not None
    times = "x" if each.times else ""
    if error is None or not error > 0:
        return f"{value:.3g}{times}"
    wide = fit.bounds[1] - fit.bounds[0]
    error = max(error, 1e-4 * wide)  # the interpolation knows no more
    digits = max(0, -int(f"{error:e}".partition("e")[2]) + 1)
    return f"{value:.{digits}f}{times} ± {error:.{digits}f}{times}"


def _times(each: BroughtTogether, value: float) -> str:
    return f"{value:.4g}{'x' if each.times else ''}"
