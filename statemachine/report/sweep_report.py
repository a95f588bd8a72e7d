"""What a sweep says of two engines, as a page; which value brings them together."""

from __future__ import annotations

from functools import partial
from typing import Any

from ..measures.text import NONE, count, few, fixed, listed, quantity, reading, rough, rounded
from ..page import Block, Figures, Headline, Page, Section, Table, TableCell, Text
from ..sweep import PreparedSweep
from ..sweep.analysis_fit import values_within
from . import template
from .sweep_pictures import axis, bars, fit_curve, map_picture, setting_word
from .template import if_true, versions_of

_SHOWN = 5  # settings of the largest gaps
_COLUMNS = 7  # of a map that 80 characters have room for

LEAD = "In {agreed} of {settings} settings {pair} agree within {tolerance} ({what})"
CAUSES = {
    "rounding": "Every gap is inside the chaos floor: no more than rounding makes of a run.",
    "rank": "The gap goes most with {label}.",
    "share": "The gap is most sensitive to {label} (total {total}).",
}


def page(sweep: Figures, command: str = "") -> Page:
    """The answer of a sweep.

    Args:
        sweep: The report.
        command: What was typed, or "".
    """
    sections = [Section("where", "Where they agree", _where(sweep))]
    if sweep.parameters:
        sections.append(Section("sensitive", "What the gap is sensitive to", _sensitive(sweep)))
        sections.append(Section("together", "What brings them together", together(sweep)))
    failed = {f"failed with {kind}": number for kind, number in sweep.failed.items()}
    counts = {**failed, "have not run": sweep.missing}
    left_out = [f"{kind}: {number}" for kind, number in counts.items() if number]
    return template.page(
        "sweep_report",
        _headline(sweep),
        what=sweep.what,
        left=sweep.sides[0],
        right=sweep.sides[1],
        origin="; ".join(filter(None, (versions_of(sweep.versions), str(sweep.folder), command))),
        settings=len(sweep.settings),
        varied=f" over {listed(sweep.parameters)}" if sweep.parameters else "",
        seeds=sweep.seeds,
        **_floor_slots(sweep),
        left_out=", ".join(left_out) or None,
        none=sweep.quantity.counts.get("no runs", 0),
        sections=sections,
    )


def _headline(sweep: Figures) -> Headline:
    main, shares, causes = sweep.quantity, sweep.sensitivity, []
    lead = LEAD.format(
        agreed=sweep.agreed,
        settings=len(sweep.settings),
        pair=listed(list(sweep.sides)),
        tolerance=rounded(main.tolerance, main.unit, 2),
        what=main.says,
    )
    if sweep.only_rounding:
        causes.append(CAUSES["rounding"])
    elif shares is not None and len(shares.indices) > 1:
        top, kind = shares.indices[0], "rank" if shares.method == "rank" else "share"
        causes.append(CAUSES[kind].format(label=top.label, total=fixed(top.total, 2)))
    causes += [line(sweep, fit) for fit in sweep.together if fit.fit is not None]
    return Headline(lead, tuple(causes), holds=sweep.agreed == len(sweep.settings))


def _floor_slots(sweep: Figures) -> dict[str, Any]:
    """How high the chaos floor is, and how it was made; or why it is not known."""
    floor = sweep.floor
    if floor is None:
        return {"no_floor": sweep.no_floor, "backend": None, "width": None}
    widths = [setting.floor for setting in sweep.settings if setting.floor is not None]
    return {
        **{"no_floor": None, "backend": listed(list(floor.backends)), "rounding": floor.rounding},
        **{"where": floor.settings, "cells": floor.cells, "seconds": floor.seconds},
        "width": rough(max(widths), sweep.quantity.unit),
        "inside": sum(setting.inside_floor for setting in sweep.settings),
    }


def _where(sweep: Figures) -> list[Block]:
    chart = sweep.map
    return template.blocks(
        "sweep_map",
        quantities=Table.of(
            sweep.quantities,
            {
                "gap of": lambda gaps: gaps.says,
                "within": lambda gaps: rounded(gaps.tolerance, gaps.unit, 2),
                "agree": lambda gaps: str(gaps.counts.get("agrees", 0)),
                "some seeds": lambda gaps: str(gaps.counts.get("some seeds", 0)),
                "chaos": lambda gaps: str(gaps.counts.get("chaos", 0)),
                "differ": lambda gaps: str(gaps.counts.get("differs", 0)),
                "median": lambda gaps: quantity(gaps.median, gaps.unit),
                "worst": lambda gaps: quantity(gaps.worst, gaps.unit),
            },
            f"How many settings, of {len(sweep.settings)}",
            emphasis=lambda gaps: gaps.name == sweep.quantity.name,
            wide={"median"},
        ),
        tables=_map_tables(sweep, chart) if chart else [],
        legend=if_true(chart),
        others=(chart and listed(chart.others)) or None,
        sampled=(chart and listed(chart.sampled)) or None,
        picture=map_picture(sweep),
        largest=_largest(sweep) if len(sweep.settings) > _SHOWN or chart is None else None,
    )


def _map_tables(sweep: Figures, chart: Figures) -> list[Table]:
    """The map; of many columns, in parts that a terminal has room for."""
    tolerance = sweep.quantity.tolerance
    scale, unit = reading(sweep.quantity.unit)

    def cell(r: int, c: int) -> str:
        value = chart.gap[r][c]
        if value is None:
            return NONE
        mark = "~" if chart.inside[r][c] else "=" if value <= tolerance else ""
        return f"{mark}{rough(value * scale)}"

    up, across = (
        label if label in sweep.scaled else axis(sweep, label)  # an x behind each value says it
        for label in (chart.up, chart.across)
    )
    places = [setting_word(sweep, chart.across, value) for value in chart.columns]
    names = [setting_word(sweep, chart.up, value) for value in chart.rows] if chart.up else ["gap"]
    rows = [(name, *(cell(r, c) for c in range(len(places)))) for r, name in enumerate(names)]
    down = f"{up} down, " if chart.up else ""
    title = f"The gap of the {sweep.quantity.says}, {unit.strip()}: {down}{across} across"
    return [
        Table(
            (chart.up or chart.across, *places[k : k + _COLUMNS]),
            [(row[0], *row[1 + k : 1 + k + _COLUMNS]) for row in reversed(rows)],
            title,
        )
        for k in range(0, len(places), _COLUMNS)
    ]


def _largest(sweep: Figures) -> Table:
    known = [setting for setting in sweep.settings if setting.median is not None]
    known.sort(key=lambda setting: -(setting.median or 0.0))
    unit = sweep.quantity.unit
    return Table.of(
        known[:_SHOWN],
        {
            "setting": partial(_setting, sweep),
            "median": lambda setting: quantity(setting.median, unit),
            "worst": lambda setting: quantity(setting.worst, unit),
            "verdict": lambda setting: setting.verdict,
        },
        "The largest gaps",
        words={"verdict"},
    )


def _setting(sweep: Figures, setting: Figures) -> str:
    pairs = zip(sweep.parameters, setting.values, strict=True)
    words = [f"{name} {setting_word(sweep, name, value)}" for name, value in pairs]
    return few(words, 4) or "as it is"


def _sensitive(sweep: Figures) -> list[Block]:
    shares = None if sweep.only_rounding else sweep.sensitivity
    alone = shares is not None and len(shares.indices) == 1
    if shares is None or alone:
        return template.blocks(
            "sweep_no_shares",
            rounding=if_true(sweep.only_rounding),
            same=if_true(not sweep.only_rounding and not alone),
            alone=if_true(alone),
        )
    rank = shares.method == "rank"
    rows = [
        (
            index.label,
            TableCell(fixed(index.first, 2), share=index.first),
            _interval(index.first_interval),
            TableCell(fixed(index.total, 2), share=index.total),
            _interval(index.total_interval),
        )
        for index in shares.indices
    ]
    heads = ("parameter", "first order", "95 %", "total", "95 %")
    ranks = Table(("parameter", "rank²"), [row[:2] for row in rows], "What the gap goes with")
    samples = {shares.method: shares.samples}
    return template.blocks(
        "sweep_shares",
        table=ranks if rank else Table(heads, rows, "Shares of the gap's variance"),
        shares=if_true(not rank),
        sobol=samples.get("sobol"),
        factorial=samples.get("factorial"),
        rank=samples.get("rank"),
        error=shares.error or None,
        no_error=if_true(not rank and not shares.error),
        notes=" ".join(shares.notes) or None,
        picture=bars(sweep),
    )


def _interval(pair: tuple[float, float] | None) -> str:
    return NONE if pair is None else f"{fixed(pair[0], 2)} to {fixed(pair[1], 2)}"


def summary_page(ready: PreparedSweep, summary: Figures) -> Page:
    """The summary, and how the dataset is read."""
    asked, failed = ready.sweep, sum(summary.failed.values())
    before = summary.cells - summary.ran
    rows = [(kind, str(n)) for kind, n in {"done": summary.done, **summary.failed}.items()]
    outcomes = Table(("what became of them", "cells"), rows, words=frozenset({0}))
    return template.page(
        "sweep",
        what=asked.what.rpartition("/")[2],
        versions=versions_of(ready.versions),
        points=count(summary.points, "point"),
        varied=f" ({listed(asked.vary)})" if asked.vary else "",
        seeds=count(asked.seeds, "seed"),
        backends=listed(list(ready.backends)),
        cells=count(summary.cells, "cell"),
        idle=if_true(not summary.ran),
        ran=summary.ran or None,
        seconds=summary.seconds,
        before=f"; {count(before, 'cell')} there before" if before else "",
        outcomes=outcomes if summary.failed else None,
        read=summary.read,
        bad=False if failed else None,
        failed=count(failed, "cell"),
        good=None if failed else True,
        done=count(summary.done, "cell"),
    )


NONE_FITTED = {
    True: "Nothing is to be brought together: every gap is inside the chaos floor.",
    False: "No property of the robot has three numbers or a range (the timestep is none): nothing "
    "is fitted.",
}
LINES = {
    "not fitted": "{label} is not fitted: {why_not}.",
    "own": "The model's own {label} is the best already: at {value}, {sizes}.",
    "none": "No value of {label} is better than {other} by more than 10 %: at the best, "
    "{value}, {sizes}.",
    "edge": "{label} {where}: the gap is least at the edge of the range, {value} ({sizes}). That "
    "is not the best value: look beyond it, and ask compare --why what causes the gap.",
    "together": "{label} = {value} {where} brings {pair} together: {sizes}.",
    "closer": "{label} = {value} {where} brings {pair} closer, not together: {sizes}.",
}


def together(sweep: Figures) -> list[Block]:
    """The sentence of each fit, how it was made, and its picture."""
    blocks = [block for fit in sweep.together for block in _fit(sweep, fit)]
    return blocks or [Text(NONE_FITTED[sweep.only_rounding])]


def line(sweep: Figures, parameter: Figures) -> str:
    """What a fit says, in a sentence."""
    unit, what = sweep.quantity.unit, sweep.quantity.says
    if parameter.fit is None:
        return LINES["not fitted"].format(label=parameter.label, why_not=parameter.why_not)
    before, after = quantity(parameter.before, unit), quantity(parameter.after, unit)
    own = parameter.verdict == "none" and _is_own(parameter)
    return LINES["own" if own else parameter.verdict].format(
        label=parameter.label,
        value=(
            _times(parameter, parameter.value)
            if parameter.verdict == "edge"
            else _fitted(parameter)
        ),
        where=f"in {sweep.sides[1]}" if parameter.varied == "right" else "in both",
        pair=listed(list(sweep.sides)),
        other="any other" if parameter.own is None else "the model's own",
        sizes=f"{what} {before} → {after}",
    )


def _is_own(parameter: Figures) -> bool:
    """Whether the value is the model's own, as far as its error tells."""
    if parameter.fit is None or parameter.value is None or parameter.own is None:
        return False
    wide = parameter.fit.bounds[1] - parameter.fit.bounds[0]
    return abs(parameter.value - parameter.own) <= max(2 * (parameter.error or 0.0), 0.02 * wide)


def _fit(sweep: Figures, parameter: Figures) -> list[Block]:
    """What a fit says, how it was made, and what a run says of it."""
    unit, fit = sweep.quantity.unit, parameter.fit
    if fit is None:
        return [Text(line(sweep, parameter))]
    within, measured = values_within(fit, sweep.quantity.tolerance), parameter.measured is not None
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


def _fitted(parameter: Figures) -> str:
    """The value with its error, to the digits that the error leaves."""
    fit, value, error = parameter.fit, parameter.value, parameter.error
    assert fit is not None
    times = "x" if parameter.times else ""
    if error is None or not error > 0:
        return f"{value:.3g}{times}"
    error = max(error, 1e-4 * (fit.bounds[1] - fit.bounds[0]))  # the interpolation knows no more
    digits = max(0, -int(f"{error:e}".partition("e")[2]) + 1)
    return f"{value:.{digits}f}{times} ± {error:.{digits}f}{times}"


def _times(parameter: Figures, value: float) -> str:
    return f"{value:.4g}{'x' if parameter.times else ''}"
