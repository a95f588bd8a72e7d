"""What a sweep says of two engines, as a page."""

from __future__ import annotations

from functools import partial
from typing import Any

from ..measures.text import NONE, count, few, fixed, listed, quantity, reading, rough, rounded
from ..page import Block, Headline, Page, Section, Table, TableCell
from ..sweep import PreparedSweep, SweepSummary
from ..sweep.analysis import SweepReport
from ..sweep.analysis_gaps import GapMap, SettingGap
from . import template
from .sweep_fit import line, together
from .sweep_pictures import axis, bars, map_picture, setting_word
from .template import if_true, versions_of

_SHOWN = 5  # settings of the largest gaps
_COLUMNS = 7  # of a map that 80 characters have room for

LEAD = "In {agreed} of {settings} settings {pair} agree within {tolerance} ({what})"
CAUSES = {
    "rounding": "Every gap is inside the chaos floor: no more than rounding makes of a run.",
    "rank": "The gap goes most with {label}.",
    "share": "The gap is most sensitive to {label} (total {total}).",
}


def page(found: SweepReport, command: str = "") -> Page:
    """The answer of a sweep.

    Args:
        found: The report.
        command: What was typed, or "".
    """
    sections = [Section("where", "Where they agree", _where(found))]
    if found.parameters:
        sections.append(Section("sensitive", "What the gap is sensitive to", _sensitive(found)))
        sections.append(Section("together", "What brings them together", together(found)))
    failed = {f"failed with {kind}": number for kind, number in found.failed.items()}
    counts = {**failed, "have not run": found.missing}
    left_out = [f"{kind}: {number}" for kind, number in counts.items() if number]
    return template.page(
        "sweep_report",
        _headline(found),
        what=found.what,
        left=found.sides[0],
        right=found.sides[1],
        origin="; ".join(filter(None, (versions_of(found.versions), str(found.folder), command))),
        settings=len(found.settings),
        varied=f" over {listed(found.parameters)}" if found.parameters else "",
        seeds=found.seeds,
        **_floor_slots(found),
        left_out=", ".join(left_out) or None,
        none=found.quantity.counts.get("no runs", 0),
        sections=sections,
    )


def _headline(found: SweepReport) -> Headline:
    main, shares, causes = found.quantity, found.sensitivity, []
    lead = LEAD.format(
        agreed=found.agreed,
        settings=len(found.settings),
        pair=listed(list(found.sides)),
        tolerance=rounded(main.tolerance, main.unit, 2),
        what=main.says,
    )
    if found.only_rounding:
        causes.append(CAUSES["rounding"])
    elif shares is not None and len(shares.indices) > 1:
        top, kind = shares.indices[0], "rank" if shares.method == "rank" else "share"
        causes.append(CAUSES[kind].format(label=top.label, total=fixed(top.total, 2)))
    causes += [line(found, each) for each in found.together if each.fit is not None]
    return Headline(lead, tuple(causes), holds=found.agreed == len(found.settings))


def _floor_slots(found: SweepReport) -> dict[str, Any]:
    """How high the chaos floor is, and how it was made; or why it is not known."""
    floor = found.floor
    if floor is None:
        return {"no_floor": found.no_floor, "backend": None, "width": None}
    widths = [each.floor for each in found.settings if each.floor is not None]
    return {
        **{"no_floor": None, "backend": floor.backend, "rounding": floor.rounding},
        **{"where": floor.settings, "cells": floor.cells, "seconds": floor.seconds},
        "width": rough(max(widths), found.quantity.unit),
        "inside": sum(each.inside_floor for each in found.settings),
    }


def _where(found: SweepReport) -> list[Block]:
    chart = found.map
    return template.blocks(
        "sweep_map",
        quantities=Table.of(
            found.quantities,
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
            f"How many settings, of {len(found.settings)}",
            emphasis=lambda gaps: gaps.name == found.quantity.name,
            wide={"median"},
        ),
        tables=_map_tables(found, chart) if chart else [],
        legend=if_true(chart),
        others=(chart and listed(chart.others)) or None,
        sampled=(chart and listed(chart.sampled)) or None,
        picture=map_picture(found),
        largest=_largest(found) if len(found.settings) > _SHOWN or chart is None else None,
    )


def _map_tables(found: SweepReport, chart: GapMap) -> list[Table]:
    """The map; of many columns, in parts that a terminal has room for."""
    tolerance = found.quantity.tolerance
    scale, unit = reading(found.quantity.unit)

    def cell(r: int, c: int) -> str:
        value = chart.gap[r][c]
        if value is None:
            return NONE
        mark = "~" if chart.inside[r][c] else "=" if value <= tolerance else ""
        return f"{mark}{rough(value * scale)}"

    up, across = (
        label if label in found.scaled else axis(found, label)  # an x behind each value says it
        for label in (chart.up, chart.across)
    )
    places = [setting_word(found, chart.across, value) for value in chart.columns]
    names = [setting_word(found, chart.up, value) for value in chart.rows] if chart.up else ["gap"]
    rows = [(name, *(cell(r, c) for c in range(len(places)))) for r, name in enumerate(names)]
    down = f"{up} down, " if chart.up else ""
    title = f"The gap of the {found.quantity.says},{unit}: {down}{across} across"
    return [
        Table(
            (chart.up or chart.across, *places[k : k + _COLUMNS]),
            [(row[0], *row[1 + k : 1 + k + _COLUMNS]) for row in reversed(rows)],
            title,
        )
        for k in range(0, len(places), _COLUMNS)
    ]


def _largest(found: SweepReport) -> Table:
    known = [setting for setting in found.settings if setting.median is not None]
    known.sort(key=lambda setting: -(setting.median or 0.0))
    unit = found.quantity.unit
    return Table.of(
        known[:_SHOWN],
        {
            "setting": partial(_setting, found),
            "median": lambda setting: quantity(setting.median, unit),
            "worst": lambda setting: quantity(setting.worst, unit),
            "verdict": lambda setting: setting.verdict,
        },
        "The largest gaps",
        words={"verdict"},
    )


def _setting(found: SweepReport, setting: SettingGap) -> str:
    pairs = zip(found.parameters, setting.values, strict=True)
    words = [f"{name} {setting_word(found, name, value)}" for name, value in pairs]
    return few(words, 4) or "as it is"


def _sensitive(found: SweepReport) -> list[Block]:
    shares = None if found.only_rounding else found.sensitivity
    alone = shares is not None and len(shares.indices) == 1
    if shares is None or alone:
        return template.blocks(
            "sweep_no_shares",
            rounding=if_true(found.only_rounding),
            same=if_true(not found.only_rounding and not alone),
            alone=if_true(alone),
        )
    rank = shares.method == "rank"
    rows = [
        (
            each.label,
            TableCell(fixed(each.first, 2), share=each.first),
            _interval(each.first_interval),
            TableCell(fixed(each.total, 2), share=each.total),
            _interval(each.total_interval),
        )
        for each in shares.indices
    ]
    heads = ("parameter", "first order", "95 %", "total", "95 %")
    table = Table(heads, rows, "Shares of the gap's variance")
    if rank:
        table = Table(("parameter", "rank²"), [row[:2] for row in rows], "What the gap goes with")
    samples = {shares.method: shares.samples}
    return template.blocks(
        "sweep_shares",
        table=table,
        shares=if_true(not rank),
        sobol=samples.get("sobol"),
        factorial=samples.get("factorial"),
        rank=samples.get("rank"),
        error=shares.error or None,
        no_error=if_true(not rank and not shares.error),
        notes=" ".join(shares.notes) or None,
        picture=bars(found),
    )


def _interval(pair: tuple[float, float] | None) -> str:
    return NONE if pair is None else f"{fixed(pair[0], 2)} to {fixed(pair[1], 2)}"


def summary_page(ready: PreparedSweep, summary: SweepSummary) -> Page:
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
