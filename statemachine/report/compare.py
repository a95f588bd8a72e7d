"""The page of a comparison of two runs: all that is said of it, in every medium."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from ..measures.text import NONE, grouped, milliseconds, quantity, sentence
from ..page import Block, Code, Items, Page, Section, Table, TableCell, Text, Verdict
from ..runs import Trace
from ..witness import SAME_READING
from . import template, why
from .finding import (
    Event,
    events_of,
    events_table,
    floor_words,
    headline,
    in_words,
    leading,
    long_labels,
    moment,
    name_of,
    short_labels,
    subject,
    window,
)
from .over_time import BothRuns, QuantityChart, charts_of
from .sides import (
    also_open,
    commanded,
    contact_words,
    emulated,
    loop_note,
    loops,
    provenance,
    unmatched,
)
from .template import if_true

_ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
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
    emulated_parts = emulated(comparison)
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
        *([_models(models, bool(emulated_parts))] if models is not None else []),
        Section(*_EMULATED, emulated_parts),
        Section("agree", "To make them agree", agree),
        Section("origin", "Where this comes from", origin, detail=True),
    ]
    blocks: list[Block] = [
        *unmatched(run),
        *([Text(one.header.says)] if one.header.says else []),
        *loop_note(run),
        *commanded(one, two, labels),
        *in_words(comparison),
        *([] if comparison.ended or not touching else [contact_words(comparison, touching)]),
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
    _, _, at, _ = subject(comparison, explanation)
    lead = [k for k, c in enumerate(charts) if c.curve.name == leading(comparison).name]
    lead += [k for k, chart in enumerate(charts) if chart.curve.kind == "tip"]
    return BothRuns(
        comparison.one.experiment,
        one,
        two,
        comparison,
        default_tip(one.header, two.header) if tip is None else tip,
        at,
        tuple(events),
        charts,
        tuple(dict.fromkeys(lead))[:2] or (0,),
    )


def _sorted(charts: Sequence[QuantityChart], total: int) -> list[Block]:
    """Charts, those that differ first; those that agree folded away if they are not all."""
    order = {"differs": 0, "settles": 1, "agrees": 2}
    ranked = sorted(charts, key=lambda c: (order[c.agreement.verdict], -c.agreement.tolerances()))
    beyond: list[Block] = [chart for chart in ranked if chart.agreement.verdict != "agrees"]
    within: list[Block] = [*ranked[len(beyond) :]]
    if beyond and within:
        within = [Section("", f"Those that agree: {len(within)}", within, folded=True)]
    text = f"Quantities without a chart, nearer to agreement or not finite: {total - len(charts)}."
    return [*beyond, *within, *([Text(text)] if total > len(charts) else [])]


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
    figures = Table.of(
        agreements,
        {
            "quantity": lambda agreement: name_of(agreement.name),
            "verdict": lambda agreement: TableCell(agreement.verdict, verdict=agreement.verdict),
            "largest": lambda agreement: (
                agreement.note or quantity(agreement.max, agreement.unit)
                if agreement.kind == "contact"
                else _small(agreement.max, agreement)
            ),
            "at, s": lambda agreement: moment(agreement.at),
            "RMS": lambda agreement: (
                NONE if agreement.kind == "contact" else _small(agreement.rms, agreement)
            ),
            "settled": lambda f: NONE if f.kind == "contact" else _small(f.settled, f),
            "from, s": lambda agreement: (
                NONE if agreement.kind == "contact" else moment(agreement.since)
            ),
            "tolerance": lambda agreement: quantity(agreement.tolerance, agreement.unit),
            **(_floor_columns(floor) if floor else {}),
        },
        f"{one} against {two}: how far apart",
        words={"verdict"},
        emphasis=lambda agreement: agreement.verdict == "differs",
        wide={"tolerance", "floor", "inside from, s"},
    )
    # One row for each tolerance: who shares it, how much, why.
    shared = grouped(
        (
            (quantity(agreement.tolerance, agreement.unit), agreement.reason),
            QUANTITIES[agreement.kind].plural,
        )
        for agreement in agreements
    )
    reasons = Table.of(
        shared.items(),
        {
            "quantities": lambda row: ", ".join(dict.fromkeys(row[1])),
            "tolerance": lambda row: row[0][0],
            "because": lambda row: row[0][1],
        },
        "What does not matter, and why",
        words={"because"},
    )
    return template.blocks(
        "compare_figures",
        figures=figures,
        moments=comparison.moments,
        until=comparison.until,
        window=window(comparison),
        floor=floor_words(comparison, floor) if floor else [],
        reasons=reasons,
        left=one,
        right=two,
        checked=checked,
        **sides,
    )


def _floor_columns(floor: ChaosFloor) -> dict[str, Callable[[Agreement], str]]:
    """How high the chaos floor is, and from when on the gap is inside."""
    bands = {band.name: band for band in floor.bands}
    return {
        "floor": lambda f: quantity(bands[f.name].most, f.unit) if f.name in bands else NONE,
        "inside from, s": lambda f: moment(bands[f.name].inside_from) if f.name in bands else NONE,
    }


def _small(value: float, agreement: Agreement) -> str:
    """A difference as text; what is a millionth of its tolerance is rounding."""
    if 0 < abs(value) < _ROUNDING * agreement.tolerance:
        return "≈ 0"
    return quantity(value, agreement.unit)


def _models(models: Page, has_emulated: bool) -> Section:
    """What each engine makes of the model: the verdict, and what it is of on demand."""
    verdicts = [block for block in models.blocks if isinstance(block, Verdict)]
    rest = [block for block in models.blocks if not isinstance(block, Verdict)]
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
    sides = (comparison.one, comparison.two)
    made_by = [side.provenance for side in sides]
    files = dict.fromkeys(f"{source.model_file} ({source.model_sha256[:8]})" for source in made_by)
    engine = [] if sides[0].engine in sides[0].label else [f"both on {sides[0].engine}"]
    seeds = ["" if source.seed is None else f", seed {source.seed}" for source in made_by]
    words = [
        f"{side.label}, {milliseconds(side.timestep)}{seed}"
        for side, seed in zip(sides, seeds, strict=True)
    ]
    return "; ".join([*files, *engine, *words])
