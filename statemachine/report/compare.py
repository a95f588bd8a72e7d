"""The page of a comparison of two runs; and comparisons as tests in JUnit's XML, for CI."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from ..compare import (
    Agreement,
    Comparison,
    SidesRun,
)
from ..compare.perturbed import ChaosFloor
from ..measures import QUANTITIES
from ..measures.text import NONE, grouped, milliseconds, quantity, sentence
from ..page import Block, Code, Figures, Items, Page, Section, Table, TableCell, Text, Verdict
from ..witness import SAME_READING
from . import template, why
from .finding import (
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

if TYPE_CHECKING:
    from ..compare.why import Explanation

_ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
_CONTACTS_SHOWN = 12  # rows; the rest is folded away
_EMULATED = ("emulated", "What is emulated")


def page(
    comparison: Comparison,
    *,
    said: Sequence[str] = (),
    witness: Figures | None = None,
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
        said: What stood in for a run, line by line.
        witness: What a third party says of both sides' fingertips, if asked.
        explanation: What two sides differ in, and what each of it explains, if that was asked.
        why_not: Why there is none, or what to ask next, as a sentence.
        models: The differences between what the engines make of the model, if asked.
        command: What makes the page again.
        run: How two sides were run, if sides were given.
        played: The comparison of their open loop, where it is not that of the closed one.
        floor: The chaos floor, if it was looked for.
    """
    events, says = events_of(comparison), comparison.left.trace.header.says
    notes = [sentence(line) for line in (*said, *comparison.notes)]
    both = _over_time(comparison, events, explanation, floor)
    note: list[Block] = [Text(why_not)] if why_not else []
    reasons = note if command else []  # in a terminal it stands at the end, where one reads on
    if explanation is not None:
        reasons = [*why.causes(explanation), *why.three_parts(explanation)]
    emulated_parts = emulated(comparison)
    agree = why.steps(explanation) if explanation is not None else []
    made_by = [Text("This page was made by:"), Code([command])] if command else []
    sections = [
        Section("why", "What causes it", reasons),
        Section("curves", "How far apart, over time", _sorted(both), detail=True),
        Section("figures", "The figures", _figures(comparison, witness, floor)),
        Section("events", "What happens when", [events_table(comparison)], detail=True),
        *([_models(models, bool(emulated_parts))] if models is not None else []),
        Section(*_EMULATED, emulated_parts),
        Section("agree", "To make them agree", agree),
        Section("origin", "Where this comes from", [provenance(comparison), *made_by], detail=True),
    ]
    blocks: list[Block] = [
        *unmatched(run),
        *([Text(says)] if says else []),
        *loop_note(run),
        *commanded(comparison),
        *in_words(comparison),
        *([Items(notes)] if notes else []),
        both,
        *loops(comparison, played),
        *(section for section in sections if section.blocks),
        *([] if command else note),
    ]
    return Page(
        f"{both.title}: {' and '.join(long_labels(comparison))}",
        _origin(comparison),
        blocks,
        also_open(headline(comparison, events, explanation, floor), played),
    )


def _over_time(
    comparison: Comparison,
    events: Sequence[Figures],
    explanation: Explanation | None,
    floor: ChaosFloor | None,
) -> BothRuns:
    """The scene and a chart for each quantity that is a number throughout."""
    charts = charts_of(comparison, floor)
    _, _, at, _ = subject(comparison, explanation, floor)
    lead = [k for k, c in enumerate(charts) if c.curve.name == leading(comparison, floor).name]
    lead += [k for k, chart in enumerate(charts) if chart.curve.kind == "tip"]
    return BothRuns(
        comparison.left.trace.header.experiment,
        comparison,
        at,
        tuple(events),
        charts,
        tuple(dict.fromkeys(lead))[:2] or (0,),
    )


def _sorted(runs: BothRuns) -> list[Block]:
    """Charts, those that differ first; those that agree folded away if they are not all."""
    order = {"differs": 0, "settles": 1, "agrees": 2}
    more = len(runs.comparison.curves) - len(runs.charts)
    ranked = sorted(
        runs.charts, key=lambda c: (order[c.agreement.verdict], -c.agreement.tolerances())
    )
    beyond: list[Block] = [chart for chart in ranked if chart.agreement.verdict != "agrees"]
    within: list[Block] = [*ranked[len(beyond) :]]
    if beyond and within:
        within = [
            Section("", f"Charts of quantities that agree: {len(within)}", within, folded=True)
        ]
    text = f"Quantities without a chart, nearer to agreement or not finite: {more}."
    return [*beyond, *within, *([Text(text)] if more else [])]


def _figures(
    comparison: Comparison, witness: Figures | None, floor: ChaosFloor | None
) -> list[Block]:
    """Figures and verdicts, the floor, the reasons of tolerances, what a third party says."""
    left, right = short_labels(comparison)
    agreements, checked = comparison.agreements, list[Block]()
    sides: dict[str, Any] = dict.fromkeys(("site", "rows", "by", "left_off", "right_off"))
    if witness is not None:
        text = template.blocks(
            "compare_witness", site=witness.site, compiled=if_true(witness.grade == SAME_READING)
        )
        checked.append(Section("", "", text, detail=True))
        sides = {name: getattr(witness, name) for name in ("site", "rows", "by")}
        sides |= {
            "left_off": f"{1e3 * witness.left:.0e}",
            "right_off": f"{1e3 * witness.right:.0e}",
        }
    columns: dict[str, Callable[[Agreement], str]] = {
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
    }

    # Where chance makes more than a tolerance, what it makes of each quantity is seen first.
    levels = {band.name: band.most for band in floor.bands} if floor else {}
    noisy = any(levels.get(a.name, 0.0) > a.tolerance for a in agreements if a.kind != "contact")

    def table(rows: Sequence[Agreement], title: str, *wide: str) -> Table:
        return Table.of(
            rows,
            columns,
            title,
            words={"verdict"},
            emphasis=lambda agreement: agreement.verdict == "differs",
            wide={"tolerance", "RMS" if noisy else "floor", "inside from, s", *wide},
        )

    motion, contacts = (
        [a for a in agreements if (a.kind in ("force", "contact")) is touching]
        for touching in (False, True)
    )
    farthest = sorted(contacts, key=lambda a: (a.verdict == "agrees", -a.tolerances()))
    shown, rest = farthest[:_CONTACTS_SHOWN], farthest[_CONTACTS_SHOWN:]
    title = f"{left} against {right}: how far apart"
    farther = f"Contacts, the farthest apart ({len(shown)} of {len(contacts)})"
    folded = Section("", f"Other contacts: {len(rest)}", [table(rest, title)], True, detail=True)
    # One row for each reason: who shares it, how much.
    shared = grouped(((agreement.reason, agreement.unit), agreement) for agreement in agreements)
    reasons = Table.of(
        shared.items(),
        {
            "quantities": lambda row: ", ".join(
                dict.fromkeys(QUANTITIES[f.kind].plural for f in row[1])
            ),
            "tolerance": lambda row: _span([f.tolerance for f in row[1]], row[0][1]),
            "because": lambda row: row[0][0],
        },
        "What does not matter, and why",
        words={"because"},
    )
    return template.blocks(
        "compare_figures",
        figures=table(motion, title),
        contacts=table(shown, farther, "RMS", "from, s"),
        others=[folded] if rest else [],
        pressing=[contact_words(comparison)] if comparison.touches else [],
        moments=comparison.moments,
        until=comparison.until,
        window=window(comparison),
        floor=floor_words(comparison, floor) if floor else [],
        reasons=reasons,
        left=left,
        right=right,
        checked=checked,
        **sides,
    )


def _span(values: Sequence[float], unit: str) -> str:
    """What values [SI unit] lie between."""
    return " to ".join(dict.fromkeys(quantity(end(values), unit) for end in (min, max)))


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
    more = "Before anything moves. What the backends then do about it for the runs above is in"
    folded = Section("", models.title, rest, folded=True)
    heading = "What each engine makes of the model"
    return Section(
        "models",
        heading,
        [Text(more, see=_EMULATED) if has_emulated else first, *verdicts, folded],
        detail=True,
    )


def _origin(comparison: Comparison) -> str:
    files: dict[str, None] = {}
    words, labels = list[str](), long_labels(comparison)
    for label, trace in zip(labels, traces_of(comparison), strict=True):
        source = trace.header.provenance
        files[f"{source.model_file} ({source.model_sha256[:8]})"] = None
        seed = "" if source.seed is None else f", seed {source.seed}"
        words.append(f"{label}, {milliseconds(trace.header.timestep)}{seed}")
    engine = comparison.left.trace.header.label
    return "; ".join([*files, *([] if engine in labels[0] else [f"both on {engine}"]), *words])


FAILED = "{largest} apart at {at:g} s; the tolerance is {tolerance}, {reason}"
ENDED = "ended early: {why}"


def junit(comparisons: Sequence[Comparison]) -> str:
    """The text of the file: a suite for each comparison."""
    root = ElementTree.Element("testsuites")
    for comparison in comparisons:
        sides = comparison.left, comparison.right
        name = f"{sides[0].trace.header.experiment}: {sides[0].label}, {sides[1].label}"
        failures = {
            agreement.name: FAILED.format(
                largest=quantity(agreement.max, agreement.unit),
                at=agreement.at,
                tolerance=quantity(agreement.tolerance, agreement.unit),
                reason=agreement.reason,
            )
            for agreement in comparison.agreements
            if agreement.verdict != "agrees"
        }
        ended = {side.label: side.trace.header.ended for side in sides if side.trace.header.ended}
        failures |= {f"end of {label}": ENDED.format(why=why) for label, why in ended.items()}
        names = dict.fromkeys(
            [agreement.name for agreement in comparison.agreements] + list(failures)
        )
        about = {"name": name, "tests": str(len(names)), "failures": str(len(failures))}
        suite = ElementTree.SubElement(root, "testsuite", about)
        for test in names:
            case = ElementTree.SubElement(suite, "testcase", classname=name, name=test)
            if test in failures:
                ElementTree.SubElement(case, "failure", message=failures[test])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
