"""What a sweep says of two engines, as a page."""

from __future__ import annotations

from ..comparison.text import (
    NONE,
    capital,
    count,
    few,
    listed,
    quantity,
    reading,
    rough,
)
from ..page import Block, Headline, Page, Section, Table, TableCell, Text
from ..sweep.analysis import VERDICTS, SettingGap, SweepReport
from ..sweep.analysis_map import GapMap
from ..sweep.analysis_together import BroughtTogether
from .sweep_pictures import bars, fit_curve, map_picture, size_word, value_word

_SHOWN = 5  # settings of the largest gaps
_COLUMNS = 7  # of a map that 80 characters have room for
_SAYS = {
    "agrees": "agree at every seed",
    "some seeds": "agree at some seeds",
    "chaos": "inside the chaos floor",
    "differs": "differ",
    "no runs": "no runs on both",
}
_METHODS = {
    "sobol": "Sobol indices by Saltelli's design and estimators",
    "factorial": "a full factorial, its variance taken apart (ANOVA): first-order and total "
    "shares mean what Sobol indices mean, over the values of the design",
    "rank": "squares of Spearman's rank correlation",
}


def page(found: SweepReport, command: str = "") -> Page:
    """The answer of a sweep.

    Args:
        found: The report.
        command: What was typed, or "".
    """
    blocks: list[Block] = [Text(_made(found)), Text(_floor(found))]
    blocks += _left_out(found)
    blocks.append(Section("where", "Where they agree", _where(found)))
    if found.parameters:
        blocks.append(Section("sensitive", "What the gap is sensitive to", _sensitive(found)))
        blocks.append(Section("together", "What brings them together", _together(found)))
    versions = ", ".join(f"{name} {version}" for name, version in found.versions.items())
    origin = f"{versions}; {found.folder}" + (f"; {command}" if command else "")
    title = f"Sweep of {found.what}: {found.sides[0]} and {found.sides[1]}"
    return Page(title, origin, blocks, _headline(found))


def _headline(found: SweepReport) -> Headline:
    main = found.quantity
    pair = listed(list(found.sides))
    lead = (
        f"In {found.agreed} of {count(len(found.settings), 'setting')} {pair} agree within "
        f"{size_word(main.tolerance, main.unit)} ({main.says})"
    )
    causes = []
    shares = found.sensitivity
    if found.only_rounding:
        causes.append("Every gap is inside the chaos floor: no more than rounding makes of a run.")
    elif shares is not None and len(shares.indices) > 1:
        top = shares.indices[0]
        how = "goes most with" if shares.method == "rank" else "is most sensitive to"
        share = "" if shares.method == "rank" else f" (total {_index(top.total)})"
        causes.append(f"The gap {how} {top.label}{share}.")
    causes += [_line(found, each) for each in found.together if each.fit is not None]
    agree = found.agreed == len(found.settings)
    return Headline(lead, tuple(causes), holds=agree)


def _made(found: SweepReport) -> str:
    varied = f" over {listed(found.parameters)}" if found.parameters else ""
    return (
        f"{count(len(found.settings), 'setting')}{varied}, {count(found.seeds, 'seed')} each. The "
        "gap of a setting is the median over its seeds; that of the fingertip or of the joint "
        "angles is the largest of the moments that the dataset keeps. A setting agrees if the "
        "gap is within tolerance at every seed."
    )


def _quantities(found: SweepReport) -> Table:
    rows = []
    for each in found.quantities:
        counts = [str(each.counts.get(v, 0)) for v in VERDICTS[:4]]
        rows.append(
            (
                each.says,
                size_word(each.tolerance, each.unit),
                *counts,
                quantity(each.median, each.unit),
                quantity(each.worst, each.unit),
            )
        )
    return Table(
        ("gap of", "within", "agree", "some seeds", "chaos", "differ", "median", "worst"),
        rows,
        f"How many of the {count(len(found.settings), 'setting')}",
        emphasis=frozenset(
            k for k, each in enumerate(found.quantities) if each.name == found.quantity.name
        ),
        wide=frozenset({6}),
    )


def _floor(found: SweepReport) -> str:
    floor, main = found.floor, found.quantity
    if floor is None:
        return f"The chaos floor is not known: {found.no_floor}."
    widths = [each.floor for each in found.settings if each.floor is not None]
    inside = sum(each.inside_floor for each in found.settings)
    where = "each setting" if floor.settings == len(found.settings) else (
        f"{floor.settings} of {len(found.settings)} settings (the others have that of the nearest "
        "one)"
    )  # fmt: skip
    return (
        f"The chaos floor is what rounding alone makes of a run: {floor.backend} ran again, its "
        f"starts and commands changed by {floor.rounding:g}, at {where}: "
        f"{count(floor.cells, 'cell')}, {floor.seconds:.2g} s. The largest gap that this makes is "
        f"{rough(max(widths), main.unit)}. "
        + (
            f"In {count(inside, 'setting')} the gap between the engines is inside it: nothing can "
            "be concluded there."
            if inside
            else "No gap between the engines is inside it."
        )
    )


def _left_out(found: SweepReport) -> list[Block]:
    """What is told of cells that have no run."""
    said = []
    if found.failed:
        kinds = [f"{number} {kind}" for kind, number in found.failed.items()]
        said.append(f"{count(sum(found.failed.values()), 'cell')} failed ({listed(kinds)})")
    if found.missing:
        said.append(f"{count(found.missing, 'cell')} have not run")
    if not said:
        return []
    none = found.quantity.counts.get("no runs", 0)
    gone = (
        f" {count(none, 'setting')} thereby {'has' if none == 1 else 'have'} no gap."
        if none
        else ""
    )
    return [Text(f"Left out: {listed(said)}.{gone}")]


def _where(found: SweepReport) -> list[Block]:
    blocks: list[Block] = [_quantities(found)]
    picture = map_picture(found)
    if found.map is not None:
        blocks.append(_map_table(found, found.map))
        notes = []
        if found.map.others:
            notes.append(f"Each figure is the median over {listed(found.map.others)}.")
        if found.map.sampled:
            notes.append(f"{listed(found.map.sampled)}: the middles of equal parts of the range.")
        marks = "~: inside the chaos floor. =: within tolerance."
        notes.append(marks)
        blocks.append(Text(" ".join(notes), small=True))
    if picture is not None:
        blocks.append(picture)
    if len(found.settings) > _SHOWN or found.map is None:
        blocks.append(_largest(found))
    return blocks


def _map_table(found: SweepReport, chart: GapMap) -> Table:
    unit, tolerance = found.quantity.unit, found.quantity.tolerance
    scale, name = reading(unit)

    def cell(r: int, c: int) -> str:
        value = chart.gap[r][c]
        if value is None:
            return NONE
        mark = "~" if chart.inside[r][c] else "=" if value <= tolerance else ""
        return f"{mark}{rough(value * scale)}"

    places = [value_word(value) for value in chart.columns]
    rows = [
        (
            value_word(chart.rows[r]) if chart.up else "gap",
            *(cell(r, c) for c in range(len(places))),
        )
        for r in reversed(range(len(chart.gap)))
    ]
    kept = {round(k * (len(places) - 1) / (_COLUMNS - 1)) for k in range(_COLUMNS)}
    wide = {k + 1 for k in range(len(places)) if len(places) > _COLUMNS and k not in kept}
    down = f"{chart.up} down, " if chart.up else ""
    return Table(
        (f"{chart.up or chart.across}", *places),
        rows,
        f"The gap of the {found.quantity.says},{name}: {down}{chart.across} across",
        wide=frozenset(wide),
    )


def _largest(found: SweepReport) -> Table:
    known = [each for each in found.settings if each.median is not None]
    known.sort(key=lambda each: -(each.median or 0.0))
    unit = found.quantity.unit
    rows = [
        (
            _setting(found, each),
            quantity(each.median, unit),
            quantity(each.worst, unit),
            _SAYS[each.verdict],
        )
        for each in known[:_SHOWN]
    ]
    return Table(
        ("setting", "median", "worst", "they"), rows, "The largest gaps", words=frozenset({0, 3})
    )


def _setting(found: SweepReport, setting: SettingGap) -> str:
    pairs = zip(found.parameters, setting.values, strict=True)
    return few([f"{name} {value_word(value)}" for name, value in pairs], 4) or "as it is"


def _sensitive(found: SweepReport) -> list[Block]:
    shares = found.sensitivity
    if found.only_rounding:
        return [Text("To nothing: every gap is inside the chaos floor.")]
    if shares is not None and len(shares.indices) == 1:
        return [Text("One parameter was varied: what changes the gap is that alone.")]
    if shares is None:
        return [Text("Nothing can be said: the gap is the same everywhere, or there are too few.")]
    rank = shares.method == "rank"
    rows = []
    for each in shares.indices:
        rows.append(
            (
                each.label,
                TableCell(_index(each.first), share=each.first),
                _interval(each.first_interval),
                TableCell(_index(each.total), share=each.total),
                _interval(each.total_interval),
            )
        )
    if rank:
        table = Table(("parameter", "rank²"), [row[:2] for row in rows], "What the gap goes with")
    else:
        table = Table(
            ("parameter", "first order", "95 %", "total", "95 %"),
            rows,
            "Shares of the gap's variance",
        )
    error = f" Intervals: {shares.error}." if shares.error else ""
    if not (rank or shares.error):
        error = " They have no error here: it takes three seeds."
    where = "samples in each block" if shares.method == "sobol" else "settings"
    text = f"{capital(_METHODS[shares.method])}; {shares.samples} {where}.{error}"
    blocks: list[Block] = [table, Text(" ".join([text, *shares.notes]), small=True)]
    picture = bars(found)
    return [*blocks, picture] if picture else blocks


def _together(found: SweepReport) -> list[Block]:
    if not found.together and found.only_rounding:
        return [Text("Nothing is to be brought together: every gap is inside the chaos floor.")]
    if not found.together:
        return [Text("No parameter has three numbers or a range: nothing is fitted.")]
    blocks: list[Block] = []
    for each in found.together:
        blocks.append(Text(_line(found, each)))
        if each.fit is not None:
            blocks.append(Text(_how(found, each), small=True))
        picture = fit_curve(found, each)
        if picture is not None:
            blocks.append(picture)
    return blocks


def _line(found: SweepReport, each: BroughtTogether) -> str:
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


def _index(value: float) -> str:
    return f"{value:.2f}".replace("-0.00", "0.00")


def _interval(pair: tuple[float, float] | None) -> str:
    return NONE if pair is None else f"{_index(pair[0])} to {_index(pair[1])}"
