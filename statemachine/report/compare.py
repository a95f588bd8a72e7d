"""The page of a comparison of two runs: all that is said of it, in every medium."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..compare import (
    Agreement,
    ChaosFloor,
    Comparison,
    Series,
    SidesRun,
    Witness,
    default_tip,
    series,
    touches,
)
from ..compare.why import Explanation
from ..measures import QUANTITIES
from ..measures.text import NONE, milliseconds, quantity, sentence
from ..page import Block, Code, Items, Page, Section, Table, TableCell, Text, Verdict
from ..runs import Trace
from ..witness import SAME_READING
from . import template, why
from .commanded import commanded
from .contacts import contact_words
from .events import Event, events_of, events_table
from .finding import (
    headline,
    in_words,
    leading,
    long_labels,
    name_of,
    short_labels,
    subject,
    window,
)
from .floor import floor_words
from .loops import also_open, loops, told, unmatched
from .over_time import BothRuns, QuantityChart, charts_of
from .provenance import emulated, provenance
from .template import if_true

_ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
_HEADERS = ("quantity", "verdict", "largest", "at, s", "RMS", "settled", "from, s", "tolerance")
_EMULATED = ("emulated", "What is emulated")


def page(
    comparison: Comparison,
    one: Trace,
    two: Trace,
    *,
    tip: str | None = None,
    said: Sequence[str] = (),
    witness: Witness | None = None,
    explanation: Explanation | None = None,
    why_not: str = "",
    models: Page | None = None,
    command: str = "",
    run: SidesRun | None = None,
    played: Comparison | None = None,
    floor: ChaosFloor | None = None,
) -> Page:
    """What was found in comparing two runs.

    Args:
        comparison: The figures.
        one: The first run.
        two: The second.
        tip: The site that was compared, as given to `compare`.
        said: What stood in for a run, line by line.
        witness: What a third party says of both sides' fingertips, if asked.
        explanation: What two sides differ in, and what each of it explains, if that was asked.
        why_not: Why there is none, as a sentence.
        models: The differences between what the engines make of the model, if asked.
        command: What makes the page again.
        run: How two sides were run, if sides were given.
        played: The comparison of their open loop, where it is not that of the closed one.
        floor: The chaos floor, if it was looked for.
    """
    labels = long_labels(comparison)
    curves = series(one, two, tip)
    touching = touches(one, two)
    events = events_of(comparison, touching)
    notes = [sentence(line) for line in (*said, *comparison.notes)]
    both = _over_time(comparison, one, two, curves, events, explanation, tip, floor)
    reasons: list[Block] = [Text(why_not)] if why_not else []
    if explanation is not None:
        reasons = [*why.causes(explanation), *why.three_parts(explanation)]
    kept = emulated(comparison)
    agree = why.steps(explanation) if explanation is not None else []
    made_by = [Text("This page was made by:"), Code([command])] if command else []
    origin = [provenance((one.header, two.header), comparison), *made_by]
    sections = [
        Section("why", "What causes it", reasons),
        Section(
            "curves", "How far apart, over time", _sorted(both.charts, len(curves)), detail=True
        ),
        Section("figures", "The figures", _figures(comparison, witness, floor)),
        Section("events", "What happens when", [events_table(events, labels)], detail=True),
        *([_models(models, bool(kept))] if models is not None else []),
        Section(*_EMULATED, kept),
        Section("agree", "To make them agree", agree),
        Section("origin", "Where this comes from", origin, detail=True),
    ]
    blocks: list[Block] = [
        *unmatched(run),
        *([Text(one.header.says)] if one.header.says else []),
        *told(run),
        *commanded(one, two, labels),
        *in_words(comparison),
        *(() if comparison.ended else contact_words(comparison, touching)),
        *([Items(notes)] if notes else []),
        both,
        *loops(comparison, played),
        *(section for section in sections if section.blocks),
    ]
    return Page(
        f"{one.header.experiment}: {comparison.one.label} and {comparison.two.label}",
        _origin(comparison),
        blocks,
        also_open(headline(comparison, events, explanation, curves), played),
    )


def _over_time(
    comparison: Comparison,
    one: Trace,
    two: Trace,
    curves: Sequence[Series],
    events: Sequence[Event],
    explanation: Explanation | None,
    tip: str | None,
    floor: ChaosFloor | None,
) -> BothRuns:
    """The scene and a chart for each quantity that is a number throughout."""
    charts = charts_of(comparison, one, two, curves, floor)
    of, most = subject(comparison, explanation), leading(comparison)
    lead = [k for k, chart in enumerate(charts) if most and chart.curve.name == most.name]
    lead += [k for k, chart in enumerate(charts) if chart.curve.kind == "tip"]
    return BothRuns(
        comparison.one.experiment,
        one,
        two,
        comparison,
        default_tip(one.header, two.header) if tip is None else tip,
        0.0 if of is None else of.at,
        tuple(events),
        charts,
        tuple(dict.fromkeys(lead))[:2] or (0,),
    )


def _sorted(charts: Sequence[QuantityChart], total: int) -> list[Block]:
    """Charts, those that differ first; those that agree folded away if they are not all."""
    order = {"differs": 0, "settles": 1, "agrees": 2}
    ranked = sorted(charts, key=lambda c: (order[c.agreement.verdict], -c.agreement.tolerances()))
    beyond: list[Block] = [chart for chart in ranked if chart.agreement.verdict != "agrees"]
    within: list[Block] = [chart for chart in ranked if chart.agreement.verdict == "agrees"]
    if beyond and within:
        within = [Section("", f"Those that agree: {len(within)}", within, folded=True)]
    left_out = total - len(charts)
    text = f"Quantities without a chart, nearer to agreement or not finite: {left_out}."
    return [*beyond, *within, *([Text(text)] if left_out else [])]


def _figures(
    comparison: Comparison, witness: Witness | None, floor: ChaosFloor | None
) -> list[Block]:
    """Figures and verdicts, the floor, the reasons of tolerances, what a third party says."""
    one, two = short_labels(comparison)
    agreements, checked = comparison.agreements, list[Block]()
    sides: dict[str, Any] = dict.fromkeys(("site", "rows", "by", "left_off", "right_off"))
    if witness is not None:
        compiled = if_true(witness.grade == SAME_READING)
        text = template.blocks("compare_witness", site=witness.site, compiled=compiled)
        checked.append(Section("", "", text, detail=True))
        sides = {name: getattr(witness, name) for name in ("site", "rows", "by")}
        sides |= {"left_off": f"{1e3 * witness.one:.0e}", "right_off": f"{1e3 * witness.two:.0e}"}
    figures = Table(
        _HEADERS if floor is None else (*_HEADERS, "floor", "inside from, s"),
        [(*_row(found), *_floor_cells(found, floor)) for found in agreements],
        f"{one} against {two}: how far apart",
        words=frozenset({0, 1}),
        emphasis=frozenset(k for k, found in enumerate(agreements) if found.verdict == "differs"),
        wide=frozenset({7, 8, 9}) if floor else frozenset({7}),
    )
    heads, title = ("quantities", "tolerance", "because"), "What does not matter, and why"
    return template.blocks(
        "compare_figures",
        figures=[figures],
        moments=comparison.moments,
        until=comparison.until,
        window=window(comparison),
        floor=floor_words(comparison, floor) if floor else [],
        reasons=[Table(heads, _reasons(comparison), title, words=frozenset({0, 2}))],
        left=one,
        right=two,
        checked=checked,
        **sides,
    )


def _row(found: Agreement) -> tuple[str, ...]:
    verdict = TableCell(found.verdict, verdict=found.verdict)
    at, tolerance = _moment(found.at), quantity(found.tolerance, found.unit)
    name = name_of(found.name)
    if found.kind == "contact":
        gap = found.note or quantity(found.max, found.unit)
        return name, verdict, gap, at, NONE, NONE, NONE, tolerance
    return (
        name,
        verdict,
        _small(found.max, found),
        at,
        _small(found.rms, found),
        _small(found.settled, found),
        "never" if found.since is None else _moment(found.since),
        tolerance,
    )


def _floor_cells(found: Agreement, floor: ChaosFloor | None) -> tuple[str, ...]:
    """How high the chaos floor is, and from when on the gap is inside."""
    if floor is None:
        return ()
    band = floor.of(found.name)
    if band is None:
        return NONE, NONE
    inside = "never" if band.inside_from is None else _moment(band.inside_from)
    return quantity(band.most, found.unit), inside


def _moment(time: float) -> TableCell:
    return TableCell(f"{time:.3f}", at=time)


def _small(value: float, found: Agreement) -> str:
    """A difference as text; what is a millionth of its tolerance is rounding."""
    if 0 < abs(value) < _ROUNDING * found.tolerance:
        return "≈ 0"
    return quantity(value, found.unit)


def _reasons(comparison: Comparison) -> list[tuple[str, str, str]]:
    """One row for each tolerance: who shares it, how much, why."""
    shared: dict[tuple[str, str], list[str]] = {}
    for found in comparison.agreements:
        key = (quantity(found.tolerance, found.unit), found.reason)
        shared.setdefault(key, []).append(found.kind)
    return [
        (", ".join(dict.fromkeys(QUANTITIES[kind].plural for kind in kinds)), value, reason)
        for (value, reason), kinds in shared.items()
    ]


def _models(models: Page, has_emulated: bool) -> Section:
    """What each engine makes of the model: the verdict, and what it is of on demand."""
    verdicts: list[Block] = [each for each in models.blocks if isinstance(each, Verdict)]
    rest = [each for each in models.blocks if not isinstance(each, Verdict)]
    first = Text("Before anything moves.")
    if has_emulated:
        first = Text(
            "Before anything moves. What the backends then do about it for the runs above is in",
            see=_EMULATED,
        )
    folded = Section("", models.title, rest, folded=True)
    heading = "What each engine makes of the model"
    return Section("models", heading, [first, *verdicts, folded], detail=True)


def _origin(comparison: Comparison) -> str:
    one, two = comparison.one, comparison.two
    words = []
    for side in (one, two):
        seed = side.provenance.seed
        text = f"{side.label}, {milliseconds(side.timestep)}"
        words.append(text + (f", seed {seed}" if seed is not None else ""))
    files = dict.fromkeys(
        f"{side.provenance.model_file} ({side.provenance.model_sha256[:8]})" for side in (one, two)
    )
    engine = [] if one.engine in one.label else [f"both on {one.engine}"]
    return "; ".join([*files, *engine, *words])
