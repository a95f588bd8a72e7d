"""The page of a comparison of two runs; and comparisons as tests in JUnit's XML, for CI."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from ...measures import QUANTITIES
from ...measures.text import NONE, grouped, milliseconds, quantity, sentence
from ...show import report_template as template
from ...show.blocks import Block, Code, Items, Page, Section, Table, TableCell, Text, Verdict
from ...show.report_template import if_true, slots_of
from ...witness import SAME_READING
from ..compare import Agreement, Comparison, SidesRun
from ..compare.agreement import WitnessResult
from ..compare.instead import Instead
from ..compare.perturbed import ChaosFloor
from ..compare.stillness import nothing_moved
from ..why import page as why
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
    traces_of,
    window,
)
from .over_time import BothRuns, charts_of
from .sides_page import (
    also_open,
    commanded,
    contact_words,
    emulated,
    loop_note,
    loops,
    provenance,
    unmatched,
)

if TYPE_CHECKING:
    from ..why import Explanation

_ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
_CONTACTS_SHOWN = 12  # rows; the rest is folded away
_SPOKEN = 2  # charts that are spoken as the slider moves
_EMULATED = ("emulated", "What is emulated")


@dataclass(frozen=True)
class PageParts:
    """What a page says beside the figures of a comparison.

    Attributes:
        explanation: What the two sides differ in, and what each of it explains; None if that was
            not asked, or could not be found.
        why_not: Why there is none, or what to ask next, as a sentence; "" for neither.
        models: The differences between what the engines make of the model; None if that was not
            asked, or there are none.
        command: What makes the page again; "" where that is not said.
        instead: What to run where nothing moved; None where that was not looked for.
    """

    explanation: Explanation | None = None
    why_not: str = ""
    models: Page | None = None
    command: str = ""
    instead: Instead | None = None


_NO_PARTS = PageParts()


def page(
    comparison: Comparison,
    *,
    said: Sequence[str] = (),
    witness: WitnessResult | None = None,
    floor: ChaosFloor | None = None,
    run: SidesRun | None = None,
    played: Comparison | None = None,
    parts: PageParts = _NO_PARTS,
) -> Page:
    """Return the page of what was found in comparing two runs.

    Args:
        comparison: The figures.
        said: What stood in for a run, line by line.
        witness: What a third party says of both sides' fingertips, if asked.
        floor: The chaos floor, if it was looked for.
        run: How two sides were run, if sides were given.
        played: The comparison of their open loop, where it is not that of the closed one.
        parts: What the page says besides.
    """
    events = events_of(comparison)
    both = _over_time(comparison, events, parts.explanation, floor)
    sections = _sections(comparison, parts, both, _figures(comparison, witness, floor))
    blocks = _opening(comparison, said, run)
    blocks.append(both)
    blocks += loops(comparison, played)
    blocks += [section for section in sections if section.blocks]
    if parts.why_not and not parts.command:
        blocks.append(Text(parts.why_not))
    answer = headline(comparison, events, parts.explanation, floor, parts.instead)
    return Page(
        f"{both.title}: {' and '.join(long_labels(comparison))}",
        _origin(comparison),
        blocks,
        also_open(answer, played),
    )


def _opening(comparison: Comparison, said: Sequence[str], run: SidesRun | None) -> list[Block]:
    """Return what stands above the curves and the figures."""
    blocks = unmatched(run)
    says = comparison.left.trace.header.says
    if says:
        blocks.append(Text(says))
    blocks += loop_note(run)
    blocks += commanded(comparison)
    blocks += in_words(comparison)
    notes = [sentence(line) for line in (*said, *comparison.notes)]
    if notes:
        blocks.append(Items(notes))
    return blocks


def _sections(
    comparison: Comparison, parts: PageParts, both: BothRuns, figures: Sequence[Block]
) -> list[Section]:
    """Return the sections below the curves; some of them may have no blocks."""
    emulated_parts = emulated(comparison)
    sections = [
        Section("why", "What causes it", _causes(parts)),
        Section("curves", "How far apart, over time", _sorted(both), detail=True),
        Section("figures", "The figures", figures),
        Section("events", "What happens when", [events_table(comparison)], detail=True),
    ]
    if parts.models is not None:
        sections.append(_models(parts.models, bool(emulated_parts)))
    sections.append(Section(*_EMULATED, emulated_parts))
    if parts.explanation is not None:
        sections.append(Section("agree", "To make them agree", why.steps(parts.explanation)))
    sections.append(_where_from(comparison, parts.command))
    return sections


def _causes(parts: PageParts) -> list[Block]:
    """Return what explains the gap, or why that is not known.

    In a terminal the latter stands at the end of the page, where one reads on.
    """
    if parts.explanation is not None:
        return [*why.causes(parts.explanation), *why.three_parts(parts.explanation)]
    if parts.command and parts.why_not:
        return [Text(parts.why_not)]
    return []


def _where_from(comparison: Comparison, command: str) -> Section:
    """Return what made the runs and the page."""
    blocks: list[Block] = [provenance(comparison)]
    if command:
        blocks += [Text("This page was made by:"), Code([command])]
    return Section("origin", "Where this comes from", blocks, detail=True)


def _over_time(
    comparison: Comparison,
    events: Sequence[Event],
    explanation: Explanation | None,
    floor: ChaosFloor | None,
) -> BothRuns:
    """Return the scene and a chart for each quantity that is a number throughout."""
    charts = charts_of(comparison, floor)
    _, _, start, _ = subject(comparison, explanation, floor)
    name = leading(comparison, floor).name
    lead = [k for k, chart in enumerate(charts) if chart.curve.name == name]
    lead += [k for k, chart in enumerate(charts) if chart.curve.kind == "tip"]
    spoken = tuple(dict.fromkeys(lead))[:_SPOKEN]
    return BothRuns(
        comparison.left.trace.header.experiment,
        comparison=comparison,
        start=start,
        events=tuple(events),
        charts=charts,
        lead=spoken if spoken else (0,),
    )


def _sorted(runs: BothRuns) -> list[Block]:
    """Return the charts, those that differ first; those that agree are folded away if not all."""
    order = {"differs": 0, "settles": 1, "agrees": 2}
    ranked = sorted(
        runs.charts,
        key=lambda chart: (order[chart.agreement.verdict], -chart.agreement.tolerances()),
    )
    blocks: list[Block] = [chart for chart in ranked if chart.agreement.verdict != "agrees"]
    within: list[Block] = [*ranked[len(blocks) :]]
    if blocks and within:
        heading = f"Charts of quantities that agree: {len(within)}"
        blocks.append(Section("", heading, within, folded=True))
    else:
        blocks += within
    more = len(runs.comparison.curves) - len(runs.charts)
    if more:
        text = f"Quantities without a chart, nearer to agreement or not finite: {more}."
        blocks.append(Text(text))
    return blocks


def _figures(
    comparison: Comparison, witness: WitnessResult | None, floor: ChaosFloor | None
) -> list[Block]:
    """Return the figures: verdicts, the floor, reasons of tolerances, what a third party says."""
    left, right = short_labels(comparison)
    return template.blocks(
        "lab/questions/compare_figures",
        left=left,
        right=right,
        moments=comparison.moments,
        until=comparison.until,
        window=window(comparison),
        floor=floor_words(comparison, floor) if floor else [],
        **slots_of(_agreements_of(comparison, floor), _witness_of(witness)),
    )


@dataclass(frozen=True)
class _Witness:
    """What a third party says of the fingertips; None where none was asked.

    Attributes:
        checked: What that checks, and how.
        site: Which site.
        rows: How many poses were compared.
        by: Who was asked.
        left_off: How far the left side is from it at most [mm].
        right_off: How far the right side is [mm].
    """

    checked: list[Block]
    site: str | None = None
    rows: int | None = None
    by: str | None = None
    left_off: str | None = None
    right_off: str | None = None


def _witness_of(witness: WitnessResult | None) -> _Witness:
    if witness is None:
        return _Witness([])
    is_compiled = if_true(witness.grade == SAME_READING)
    text = template.blocks("lab/questions/compare_witness", site=witness.site, compiled=is_compiled)
    return _Witness(
        [Section("", "", text, detail=True)],
        site=witness.site,
        rows=witness.rows,
        by=witness.by,
        left_off=f"{1e3 * witness.left:.0e}",
        right_off=f"{1e3 * witness.right:.0e}",
    )


@dataclass(frozen=True)
class _Agreements:
    """The figures of a comparison.

    Attributes:
        figures: A row for each quantity of the motion, and for the energy.
        contacts: A row for each quantity of contacts, the farthest apart.
        others: The other contacts, folded away.
        pressing: Who presses hardest.
        reasons: Why a tolerance is what it is.
    """

    figures: Table
    contacts: Table
    others: list[Block]
    pressing: list[Block]
    reasons: Table


def _agreements_of(comparison: Comparison, floor: ChaosFloor | None) -> _Agreements:
    left, right = short_labels(comparison)
    title = f"{left} against {right}: how far apart"
    motion = [a for a in comparison.agreements if a.kind not in ("force", "contact")]
    contacts = [a for a in comparison.agreements if a.kind in ("force", "contact")]
    farthest = sorted(contacts, key=lambda a: (a.verdict == "agrees", -a.tolerances()))
    shown, rest = farthest[:_CONTACTS_SHOWN], farthest[_CONTACTS_SHOWN:]
    columns = _figure_columns(floor)
    wide = {"tolerance", "inside from, s"}
    wide.add("RMS" if _is_noisy(comparison, floor) else "floor")
    of_contacts = f"Contacts, the farthest apart ({len(shown)} of {len(contacts)})"
    others: list[Block] = []
    if rest:
        table = _figure_table(rest, columns, title, wide)
        others.append(Section("", f"Other contacts: {len(rest)}", [table], True, detail=True))
    return _Agreements(
        figures=_figure_table(motion, columns, title, wide),
        contacts=_figure_table(shown, columns, of_contacts, wide | {"RMS", "from, s"}),
        others=others,
        pressing=[contact_words(comparison)] if comparison.touches else [],
        reasons=_reasons(comparison.agreements),
    )


def _is_noisy(comparison: Comparison, floor: ChaosFloor | None) -> bool:
    """Tell whether chance makes more than a tolerance of a quantity that is no first touch.

    What it makes of each quantity is then seen before other figures.
    """
    if floor is None:
        return False
    levels = {band.name: band.most for band in floor.bands}
    return any(
        levels.get(agreement.name, 0.0) > agreement.tolerance
        for agreement in comparison.agreements
        if agreement.kind != "contact"
    )


Columns = Mapping[str, Callable[[Agreement], str]]


def _figure_table(
    rows: Sequence[Agreement], columns: Columns, title: str, wide: Collection[str]
) -> Table:
    return Table.of(
        rows,
        columns,
        title,
        words={"verdict"},
        emphasis=lambda agreement: agreement.verdict == "differs",
        wide=wide,
    )


def _figure_columns(floor: ChaosFloor | None) -> Columns:
    """Return what stands under each header of the tables of figures."""
    columns: dict[str, Callable[[Agreement], str]] = {
        "quantity": _name_cell,
        "verdict": _verdict_cell,
        "largest": _largest_cell,
        "at, s": _at_cell,
        "RMS": _rms_cell,
        "settled": _settled_cell,
        "from, s": _since_cell,
        "tolerance": _tolerance_cell,
    }
    return columns if floor is None else {**columns, **_floor_columns(floor)}


def _name_cell(agreement: Agreement) -> str:
    return name_of(agreement.name)


def _verdict_cell(agreement: Agreement) -> str:
    return TableCell(agreement.verdict, verdict=agreement.verdict)


def _largest_cell(agreement: Agreement) -> str:
    if agreement.kind != "contact":
        return _small(agreement.max, agreement)
    return agreement.note if agreement.note else quantity(agreement.max, agreement.unit)


def _at_cell(agreement: Agreement) -> str:
    return moment(agreement.at)


def _rms_cell(agreement: Agreement) -> str:
    return NONE if agreement.kind == "contact" else _small(agreement.rms, agreement)


def _settled_cell(agreement: Agreement) -> str:
    return NONE if agreement.kind == "contact" else _small(agreement.settled, agreement)


def _since_cell(agreement: Agreement) -> str:
    return NONE if agreement.kind == "contact" else moment(agreement.since)


def _tolerance_cell(agreement: Agreement) -> str:
    return quantity(agreement.tolerance, agreement.unit)


def _floor_columns(floor: ChaosFloor) -> Columns:
    """Return how high the chaos floor is, and from when on the gap is inside."""
    bands = {band.name: band for band in floor.bands}

    def floor_cell(agreement: Agreement) -> str:
        if agreement.name not in bands:
            return NONE
        return quantity(bands[agreement.name].most, agreement.unit)

    def inside_cell(agreement: Agreement) -> str:
        if agreement.name not in bands:
            return NONE
        return moment(bands[agreement.name].inside_from)

    return {"floor": floor_cell, "inside from, s": inside_cell}


def _small(value: float, agreement: Agreement) -> str:
    """Return a difference as text; what is a millionth of its tolerance is rounding."""
    if 0 < abs(value) < _ROUNDING * agreement.tolerance:
        return "≈ 0"
    return quantity(value, agreement.unit)


def _reasons(agreements: Sequence[Agreement]) -> Table:
    """Return a row for each reason of a tolerance: which quantities share it, how much it is."""
    shared = grouped(((agreement.reason, agreement.unit), agreement) for agreement in agreements)
    rows = []
    for (reason, unit), of_reason in shared.items():
        kinds = dict.fromkeys(QUANTITIES[agreement.kind].plural for agreement in of_reason)
        tolerances = [agreement.tolerance for agreement in of_reason]
        rows.append((", ".join(kinds), _span(tolerances, unit), reason))
    return Table(
        ("quantities", "tolerance", "because"),
        rows,
        "What does not matter, and why",
        words=frozenset({0, 2}),
    )


def _span(values: Sequence[float], unit: str) -> str:
    """Return what values [SI unit] lie between."""
    ends = dict.fromkeys(quantity(end, unit) for end in (min(values), max(values)))
    return " to ".join(ends)


def _models(models: Page, has_emulated: bool) -> Section:
    """Return what each engine makes of the model: the verdict, and what it is of on demand."""
    blocks: list[Block] = [Text("Before anything moves.")]
    if has_emulated:
        more = "Before anything moves. What the backends then do about it for the runs above is in"
        blocks = [Text(more, see=_EMULATED)]
    blocks += [block for block in models.blocks if isinstance(block, Verdict)]
    rest = [block for block in models.blocks if not isinstance(block, Verdict)]
    blocks.append(Section("", models.title, rest, folded=True))
    return Section("models", "What each engine makes of the model", blocks, detail=True)


def _origin(comparison: Comparison) -> str:
    """Return the files that were run, on what, and with which steps, in one line."""
    files: dict[str, None] = {}
    sides, labels = list[str](), long_labels(comparison)
    for label, trace in zip(labels, traces_of(comparison), strict=True):
        source = trace.header.provenance
        files[f"{source.model_file} ({source.model_sha256[:8]})"] = None
        side = f"{label}, {milliseconds(trace.header.timestep)}"
        if source.seed is not None:
            side += f", seed {source.seed}"
        sides.append(side)
    parts = list(files)
    engine = comparison.left.trace.header.label
    if engine not in labels[0]:
        parts.append(f"both on {engine}")
    return "; ".join([*parts, *sides])


FAILED = "{largest} apart at {at:g} s; the tolerance is {tolerance}, {reason}"
ENDED = "ended early: {why}"


def junit(comparisons: Sequence[Comparison]) -> str:
    """Return the text of the file: a suite for each comparison."""
    root = ElementTree.Element("testsuites")
    for comparison in comparisons:
        left, right = comparison.left, comparison.right
        experiment = left.trace.header.experiment
        _add_suite(root, f"{experiment}: {left.label}, {right.label}", comparison)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _add_suite(root: ElementTree.Element, name: str, comparison: Comparison) -> None:
    """Add a comparison as a suite: a test for each quantity, and one for a run that ended early."""
    failures = _failures(comparison)
    tests = dict.fromkeys([*(agreement.name for agreement in comparison.agreements), *failures])
    about = {"name": name, "tests": str(len(tests)), "failures": str(len(failures))}
    suite = ElementTree.SubElement(root, "testsuite", about)
    for test in tests:
        case = ElementTree.SubElement(suite, "testcase", classname=name, name=test)
        if test in failures:
            ElementTree.SubElement(case, "failure", message=failures[test])


def _failures(comparison: Comparison) -> dict[str, str]:
    """Return the message of each test that fails."""
    failures = {}
    for agreement in comparison.agreements:
        if agreement.verdict != "agrees":
            failures[agreement.name] = FAILED.format(
                largest=quantity(agreement.max, agreement.unit),
                at=agreement.at,
                tolerance=quantity(agreement.tolerance, agreement.unit),
                reason=agreement.reason,
            )
    if comparison.outcome == "nothing moved":
        failures["motion"] = nothing_moved(comparison.motion)
    for side in (comparison.left, comparison.right):
        ended = side.trace.header.ended
        if ended:
            failures[f"end of {side.label}"] = ENDED.format(why=ended)
    return failures
