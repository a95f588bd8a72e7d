"""The page of a comparison of two runs: what stands on it, and in which order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...measures.text import milliseconds, sentence
from ...show.blocks import Block, Code, Items, Page, Section, Text, Verdict
from ..compare import Comparison, SidesRun
from ..compare.chaos import ChaosFloor
from ..compare.instead import Instead
from ..compare.witnessed import WitnessResult
from ..why import page as why
from .compared_names import long_labels, traces_of
from .events import Event, events_of, events_table
from .finding import headline, in_words, leading, subject
from .sides_page import (
    also_open,
    commanded,
    emulated,
    loop_note,
    loops,
    provenance,
    unmatched,
)
from .stage.both_runs import BothRuns
from .stage.quantity_chart import charts_of

if TYPE_CHECKING:
    from ..why import Explanation
from .compare_figures import figures_of

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
    sections = _sections(comparison, parts, both, figures_of(comparison, witness, floor))
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
