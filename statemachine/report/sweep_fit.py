"""Which value brings two engines of a sweep together, in words."""

from __future__ import annotations

from ..measures.text import count, listed, quantity
from ..page import Block, Text
from ..sweep.analysis import SweepReport
from ..sweep.analysis_together import BroughtTogether
from .sweep_pictures import fit_curve


def together(found: SweepReport) -> list[Block]:
    """The sentence of each fit, how it was made, and its picture."""
    if not found.together and found.only_rounding:
        return [Text("Nothing is to be brought together: every gap is inside the chaos floor.")]
    if not found.together:
        return [Text("No parameter has three numbers or a range: nothing is fitted.")]
    blocks: list[Block] = []
    for each in found.together:
        blocks.append(Text(line(found, each)))
        if each.fit is not None:
            blocks.append(Text(_how(found, each), small=True))
        picture = fit_curve(found, each)
        if picture is not None:
            blocks.append(picture)
    return blocks


def line(found: SweepReport, each: BroughtTogether) -> str:
    """What a fit says, in a sentence."""
    unit, fit = found.quantity.unit, each.fit
    what = found.quantity.says
    if fit is None:
        return f"{each.label} is not fitted: {each.why_not}."
    before = f"{quantity(each.before, unit)} → " if each.before is not None else ""
    sizes = f"{what} {before}{quantity(each.after, unit)}"
    value = _fitted(each)
    if each.verdict == "none" and _is_own(each):
        return f"The model's own {each.label} is the best already: at {value}, {sizes}."
    if each.verdict == "none":
        own = "than the model's own" if each.own is not None else "than any other"
        return f"No value of {each.label} is better {own}: at the best, {value}, {sizes}."
    where = f"in {found.sides[1]}" if each.varied == "right" else "in both"
    pair = listed(list(found.sides))
    if each.verdict == "edge":
        return (
            f"{each.label} {where}: the gap is least at the edge of the range, {value} ({sizes}): "
            "look beyond it."
        )
    brings = "together" if each.verdict == "together" else "closer, not together"
    return f"{each.label} = {value} {where} brings {pair} {brings}: {sizes}."


def _is_own(each: BroughtTogether) -> bool:
    """Whether the value is the model's own, as far as its error tells."""
    if each.fit is None or each.value is None or each.own is None:
        return False
    wide = each.fit.bounds[1] - each.fit.bounds[0]
    return abs(each.value - each.own) <= max(2 * (each.error or 0.0), 0.02 * wide)


def _how(found: SweepReport, each: BroughtTogether) -> str:
    """How a fit was made, and what a run says of it."""
    unit, fit = found.quantity.unit, each.fit
    left, right = found.sides
    if each.varied == "right":
        own = f" ({_times(each, each.own)})" if each.own is not None else ""
        said = [f"{left} keeps the model's own {each.label}{own}, {right} has the values."]
    else:
        said = [f"Both sides have the same {each.label}."]
    assert fit is not None
    error = "" if fit.error is None or each.best else f"; ± is its standard error, from {fit.of}"
    said.append(
        f"Least gap between {_times(each, fit.bounds[0])} and {_times(each, fit.bounds[1])}, "
        f"in the mean of {count(fit.curves, 'curve')} over settings and seeds{error}."
    )
    if (fine := fit.within(found.quantity.tolerance)) is not None:
        said.append(
            f"The predicted gap is within tolerance between {_times(each, fine[0])} and "
            f"{_times(each, fine[1])}."
        )
    if each.measured is None:
        said.append(f"It is not checked by a run: {each.why_not}.")
    else:
        said.append(
            f"Run there, {count(each.pairs, 'pair')}: {quantity(each.measured, unit)}; predicted "
            f"{quantity(each.predicted, unit)}."
        )
        if each.best is not None:
            values = each.best.tried[0]
            said.append(
                "That is far off: between its values the design is too coarse for this gap. So "
                f"{len(values) - 1} values from {_times(each, min(values))} to "
                f"{_times(each, max(values))} were run, {_times(each, each.best.apart)} apart: "
                "the value above is the best of them, and ± is that distance."
            )
    return " ".join(said)


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
