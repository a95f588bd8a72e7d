"""What a sweep says of two engines, as a page."""

from __future__ import annotations

from ..measures.text import NONE, few, fixed, listed, quantity, reading, rough, rounded
from ..page import Block, Headline, Page, Section, Table, TableCell, Text
from ..sweep.analysis import SweepReport
from ..sweep.analysis_gaps import VERDICTS, GapMap, SettingGap
from .sweep_fit import line, together
from .sweep_pictures import axis, bars, map_picture, setting_word

_SHOWN = 5  # settings of the largest gaps
_COLUMNS = 7  # of a map that 80 characters have room for

LEAD = "In {agreed} of {settings} settings {pair} agree within {tolerance} ({what})"
CAUSES = {
    "rounding": "Every gap is inside the chaos floor: no more than rounding makes of a run.",
    "rank": "The gap goes most with {label}.",
    "share": "The gap is most sensitive to {label} (total {total}).",
}
DESIGN = (
    "{settings} settings{varied}; starts (seeds) of each: {seeds}. The gap of a setting is the "
    "median over its seeds; that of the fingertip or of the joint angles is the largest of the "
    "moments that the dataset keeps. A setting agrees if the gap is within tolerance at every seed."
)
FLOOR = (
    "The chaos floor is what rounding alone makes of a run: {backend} ran again, its starts and "
    "commands changed by {rounding:g}, at {where} of {settings} settings (the nearest one stands "
    "for others): {cells} cells, {seconds:.2g} s. The largest gap that this makes is {width}. "
    "Settings in which the gap between the engines is inside it, so that nothing can be concluded: "
    "{inside}."
)
NO_FLOOR = "The chaos floor is not known: {why}."
LEFT_OUT = "Left out: cells that {what}. Settings that thereby have no gap: {none}."
MEDIAN = "Each figure is the median over {others}. "
MIDDLES = "{sampled}: the middles of equal parts of the range. "
MARKS = "~: inside the chaos floor. =: within tolerance."
MAP = "The gap of the {what},{unit}: {down}{across} across"
NO_SHARES = {
    "rounding": "To nothing: every gap is inside the chaos floor.",
    "same": "Nothing can be said: the gap is the same everywhere, or there are too few.",
    "alone": "One parameter was varied: what changes the gap is that alone.",
}
METHODS = {
    "sobol": "Sobol indices by Saltelli's design and estimators; samples in each block: {samples}.",
    "factorial": "Computed from a full factorial, which has every combination of the values "
    "(ANOVA, the analysis of variance): the shares mean what Sobol indices mean, over these "
    "values; settings: {samples}.",
    "rank": "Squares of Spearman's rank correlation; settings: {samples}.",
}
SHARES = (
    "First order: the share of the gap's variance that a parameter explains alone. Total: with "
    "what it does together with others. Where the total is near 0 the parameter does not matter."
)
INTERVALS = "Intervals: {error}."
NO_INTERVALS = "They have no error here: it takes three seeds."


def page(found: SweepReport, command: str = "") -> Page:
    """The answer of a sweep.

    Args:
        found: The report.
        command: What was typed, or "".
    """
    varied = f" over {listed(found.parameters)}" if found.parameters else ""
    design = DESIGN.format(settings=len(found.settings), varied=varied, seeds=found.seeds)
    blocks: list[Block] = [Text(design), Text(_floor(found)), *_left_out(found)]
    blocks.append(Section("where", "Where they agree", _where(found)))
    if found.parameters:
        blocks.append(Section("sensitive", "What the gap is sensitive to", _sensitive(found)))
        blocks.append(Section("together", "What brings them together", together(found)))
    versions = ", ".join(f"{name} {version}" for name, version in found.versions.items())
    origin = f"{versions}; {found.folder}" + (f"; {command}" if command else "")
    title = f"Sweep of {found.what}: {found.sides[0]} and {found.sides[1]}"
    return Page(title, origin, blocks, _headline(found))


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


def _quantities(found: SweepReport) -> Table:
    rows = []
    for each in found.quantities:
        counts = [str(each.counts.get(v, 0)) for v in VERDICTS[:4]]
        rows.append(
            (
                each.says,
                rounded(each.tolerance, each.unit, 2),
                *counts,
                quantity(each.median, each.unit),
                quantity(each.worst, each.unit),
            )
        )
    return Table(
        ("gap of", "within", "agree", "some seeds", "chaos", "differ", "median", "worst"),
        rows,
        f"How many settings, of {len(found.settings)}",
        emphasis=frozenset(
            k for k, each in enumerate(found.quantities) if each.name == found.quantity.name
        ),
        wide=frozenset({6}),
    )


def _floor(found: SweepReport) -> str:
    floor = found.floor
    if floor is None:
        return NO_FLOOR.format(why=found.no_floor)
    widths = [each.floor for each in found.settings if each.floor is not None]
    return FLOOR.format(
        backend=floor.backend,
        rounding=floor.rounding,
        where=floor.settings,
        settings=len(found.settings),
        cells=floor.cells,
        seconds=floor.seconds,
        width=rough(max(widths), found.quantity.unit),
        inside=sum(each.inside_floor for each in found.settings),
    )


def _left_out(found: SweepReport) -> list[Block]:
    """What is told of cells that have no run."""
    kinds = {f"failed with {kind}": number for kind, number in found.failed.items()}
    counts = {**kinds, "have not run": found.missing}
    what = [f"{kind}: {number}" for kind, number in counts.items() if number]
    none = found.quantity.counts.get("no runs", 0)
    return [Text(LEFT_OUT.format(what=", ".join(what), none=none))] if what else []


def _where(found: SweepReport) -> list[Block]:
    blocks: list[Block] = [_quantities(found)]
    picture = map_picture(found)
    if found.map is not None:
        blocks += _map_tables(found, found.map)
        others, sampled = listed(found.map.others), listed(found.map.sampled)
        notes = MEDIAN.format(others=others) if others else ""
        notes += MIDDLES.format(sampled=sampled) if sampled else ""
        blocks.append(Text(notes + MARKS, small=True))
    if picture is not None:
        blocks.append(picture)
    if len(found.settings) > _SHOWN or found.map is None:
        blocks.append(_largest(found))
    return blocks


def _map_tables(found: SweepReport, chart: GapMap) -> list[Table]:
    """The map; of many columns, in parts that a terminal has room for."""
    unit, tolerance = found.quantity.unit, found.quantity.tolerance
    scale, name = reading(unit)

    def cell(r: int, c: int) -> str:
        value = chart.gap[r][c]
        if value is None:
            return NONE
        mark = "~" if chart.inside[r][c] else "=" if value <= tolerance else ""
        return f"{mark}{rough(value * scale)}"

    places = [setting_word(found, chart.across, value) for value in chart.columns]
    rows = [
        (
            setting_word(found, chart.up, chart.rows[r]) if chart.up else "gap",
            *(cell(r, c) for c in range(len(places))),
        )
        for r in reversed(range(len(chart.gap)))
    ]
    up, across = (
        label if label in found.scaled else axis(found, label)  # an x behind each value says it
        for label in (chart.up, chart.across)
    )
    down = f"{up} down, " if chart.up else ""
    title = MAP.format(what=found.quantity.says, unit=name, down=down, across=across)
    return [
        Table(
            (chart.up or chart.across, *places[k : k + _COLUMNS]),
            [(row[0], *row[1 + k : 1 + k + _COLUMNS]) for row in rows],
            title,
        )
        for k in range(0, len(places), _COLUMNS)
    ]


def _largest(found: SweepReport) -> Table:
    known = [each for each in found.settings if each.median is not None]
    known.sort(key=lambda each: -(each.median or 0.0))
    unit = found.quantity.unit
    rows = [
        (
            _setting(found, each),
            quantity(each.median, unit),
            quantity(each.worst, unit),
            each.verdict,
        )
        for each in known[:_SHOWN]
    ]
    return Table(
        ("setting", "median", "worst", "verdict"), rows, "The largest gaps", words=frozenset({0, 3})
    )


def _setting(found: SweepReport, setting: SettingGap) -> str:
    pairs = zip(found.parameters, setting.values, strict=True)
    words = [f"{name} {setting_word(found, name, value)}" for name, value in pairs]
    return few(words, 4) or "as it is"


def _sensitive(found: SweepReport) -> list[Block]:
    shares = found.sensitivity
    if found.only_rounding or shares is None:
        return [Text(NO_SHARES["rounding" if found.only_rounding else "same"])]
    if len(shares.indices) == 1:
        return [Text(NO_SHARES["alone"])]
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
    heads, title = (
        ("parameter", "first order", "95 %", "total", "95 %"),
        "Shares of the gap's variance",
    )
    if rank:
        heads, rows, title = ("parameter", "rank²"), [r[:2] for r in rows], "What the gap goes with"
    error = INTERVALS.format(error=shares.error) if shares.error else NO_INTERVALS * (not rank)
    method = METHODS[shares.method].format(samples=shares.samples)
    lines = [SHARES * (not rank), method, error, *shares.notes]
    text = Text(" ".join(text for text in lines if text), small=True)
    picture = bars(found)
    return [Table(heads, rows, title), text, *([picture] if picture else [])]


def _interval(pair: tuple[float, float] | None) -> str:
    return NONE if pair is None else f"{fixed(pair[0], 2)} to {fixed(pair[1], 2)}"
