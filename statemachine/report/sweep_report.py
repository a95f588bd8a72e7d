"""What a sweep says of two engines, as a page."""

from __future__ import annotations

from ..measures.text import (
    NONE,
    capital,
    count,
    few,
    fixed,
    listed,
    quantity,
    reading,
    rough,
    rounded,
)
from ..page import Block, Headline, Page, Section, Table, TableCell, Text
from ..sweep.analysis import SweepReport
from ..sweep.analysis_gaps import VERDICTS, GapMap, SettingGap
from .sweep_fit import line, together
from .sweep_pictures import axis, bars, map_picture, setting_word

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
    "factorial": "Computed from a full factorial, which has every combination of the values "
    "(ANOVA, the analysis of variance): the shares mean what Sobol indices mean, over these "
    "values",
    "rank": "squares of Spearman's rank correlation",
}
_SHARES = (
    "First order: the share of the gap's variance that a parameter explains alone. Total: with "
    "what it does together with others. Where the total is near 0 the parameter does not matter."
)


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
        blocks.append(Section("together", "What brings them together", together(found)))
    versions = ", ".join(f"{name} {version}" for name, version in found.versions.items())
    origin = f"{versions}; {found.folder}" + (f"; {command}" if command else "")
    title = f"Sweep of {found.what}: {found.sides[0]} and {found.sides[1]}"
    return Page(title, origin, blocks, _headline(found))


def _headline(found: SweepReport) -> Headline:
    main = found.quantity
    pair = listed(list(found.sides))
    lead = (
        f"In {found.agreed} of {count(len(found.settings), 'setting')} {pair} agree within "
        f"{rounded(main.tolerance, main.unit, 2)} ({main.says})"
    )
    causes = []
    shares = found.sensitivity
    if found.only_rounding:
        causes.append("Every gap is inside the chaos floor: no more than rounding makes of a run.")
    elif shares is not None and len(shares.indices) > 1:
        top = shares.indices[0]
        how = "goes most with" if shares.method == "rank" else "is most sensitive to"
        share = "" if shares.method == "rank" else f" (total {fixed(top.total, 2)})"
        causes.append(f"The gap {how} {top.label}{share}.")
    causes += [line(found, each) for each in found.together if each.fit is not None]
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
                rounded(each.tolerance, each.unit, 2),
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

    places = [setting_word(found, chart.across, value) for value in chart.columns]
    rows = [
        (
            setting_word(found, chart.up, chart.rows[r]) if chart.up else "gap",
            *(cell(r, c) for c in range(len(places))),
        )
        for r in reversed(range(len(chart.gap)))
    ]
    kept = {round(k * (len(places) - 1) / (_COLUMNS - 1)) for k in range(_COLUMNS)}
    wide = {k + 1 for k in range(len(places)) if len(places) > _COLUMNS and k not in kept}

    def name_of(label: str) -> str:  # an x behind each value says the rest
        return label if label in found.scaled else axis(found, label)

    down = f"{name_of(chart.up)} down, " if chart.up else ""
    return Table(
        (f"{chart.up or chart.across}", *places),
        rows,
        f"The gap of the {found.quantity.says},{name}: {down}{name_of(chart.across)} across",
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
    words = [f"{name} {setting_word(found, name, value)}" for name, value in pairs]
    return few(words, 4) or "as it is"


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
                TableCell(fixed(each.first, 2), share=each.first),
                _interval(each.first_interval),
                TableCell(fixed(each.total, 2), share=each.total),
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
    says = "" if rank else f"{_SHARES} "
    text = f"{says}{capital(_METHODS[shares.method])}; {shares.samples} {where}.{error}"
    blocks: list[Block] = [table, Text(" ".join([text, *shares.notes]), small=True)]
    picture = bars(found)
    return [*blocks, picture] if picture else blocks


def _interval(pair: tuple[float, float] | None) -> str:
    return NONE if pair is None else f"{fixed(pair[0], 2)} to {fixed(pair[1], 2)}"
