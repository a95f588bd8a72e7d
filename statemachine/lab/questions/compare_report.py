"""The page of a comparison that stands alone: both runs in 3-D, curves, causes, all figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import StateMachineError
from ...show.blocks import Block, Page, Section
from ...show.templates import PageContent, render_blocks
from .. import model_differences as models
from ..compare import Agreement, Comparison
from ..compare.sides import Request
from ..model_differences import page as model_diff
from ..recordings import Trace
from ..runs.reporter import QUIET, Reporter
from ..why import Explanation
from ..why.answer_page import answer, proofs
from ..why.causes_page import causes as causes_blocks
from ..why.changes_page import steps as steps_blocks
from ..why.cited_case_page import cited_case_blocks
from ..why.page import three_parts
from ..why.split_page import split_blocks
from .compare_details import details_of
from .compare_verdict import headline_of
from .compared_names import traces_of
from .comparison import origin_of, title_of
from .events import events_of
from .finding import Finding, finding_about, leading
from .policy_outcomes import policy_outcomes_blocks
from .requests import causes
from .requests.causes import ExplainRequest, ExplainResult
from .requests.gap import CompareResult
from .stage.both_runs import BothRuns
from .stage.quantity_chart import charts_of
from .worst import WorstQuantities, worst_of

_SPOKEN = 2  # charts that are spoken as the slider moves
_RECORDED = (
    "What causes it was not looked for: one side is a recorded run, and causes are found by "
    "running both again."
)


@dataclass(frozen=True)
class ReportParts:
    """What a page that stands alone shows beside a comparison.

    Attributes:
        explanation: What explains the gap; None where that was not asked, or not found.
        why_not: Why nothing explains it; "" where something does, or nobody asked.
        models: What each engine makes of the model; None where that is the same, or not known.
        command: What makes the page again; "" where that is not said.
    """

    explanation: ExplainResult | None = None
    why_not: str = ""
    models: Page | None = None
    command: str = ""


@dataclass(frozen=True)
class CompareReport(PageContent):
    """What a page of a comparison shows that stands alone, below its verdict.

    Attributes:
        runs: Both runs in 3-D.
        worst: The quantities that are farthest apart.
        causes: What explains the gap; empty where that was not asked.
        curves: A chart for each quantity, those that agree folded away.
        details: Everything else, in sections.
        steps: What to change so that both sides agree.
        parts: What it was asked to show besides.
        outcomes: What came of a policy on both sides; empty of anything else.
    """

    template = "compare_report.md.j2"
    runs: BothRuns
    worst: WorstQuantities
    causes: Sequence[Block]
    curves: Sequence[Block]
    details: Sequence[Block]
    steps: Sequence[Block]
    parts: ReportParts
    outcomes: Sequence[Block]

    @property
    def total(self) -> int:
        """Return the number of quantities."""
        return len(self.runs.comparison.agreements)

    @property
    def uncharted(self) -> int:
        """Return the number of quantities that have no chart."""
        return len(self.runs.comparison.curves) - len(self.runs.charts)


def whole_page(
    result: CompareResult, ask_why: ExplainRequest | None, typed: str, reporter: Reporter = QUIET
) -> Page:
    """Return the page of a comparison that stands alone: with causes, models and its command.

    Args:
        result: How far apart two runs are.
        ask_why: What is asked of causes; None for nothing. Of recorded runs none are looked for.
        typed: The command that makes it again.
        reporter: Told how the search for causes gets on.
    """
    is_recorded = any(trace.header.recorded for trace in traces_of(result.comparison))
    if ask_why is None or not is_recorded or not _can_be_explained(result.comparison):
        return report_page(result, report_parts(result, ask_why, typed, reporter))
    parts = report_parts(result, None, typed, reporter)
    return report_page(result, replace(parts, why_not=_RECORDED))


def report_parts(
    result: CompareResult, ask_why: ExplainRequest | None, typed: str, reporter: Reporter = QUIET
) -> ReportParts:
    """Return what a page shows beside a comparison: causes, of recorded runs too, and models.

    Args:
        result: How far apart two runs are.
        ask_why: What is asked of causes; None for nothing.
        typed: The command that makes the page again.
        reporter: Told how the search for causes gets on.
    """
    explanation, why_not = None, ""
    if ask_why is not None and _can_be_explained(result.comparison):
        try:
            explanation = causes.answer(ask_why, reporter)
        except StateMachineError as error:
            why_not = f"What causes it could not be found: {error}."
    models_page = _models_page(result.request.run, traces_of(result.comparison))
    return ReportParts(explanation, why_not, models_page, typed)


def _can_be_explained(comparison: Comparison) -> bool:
    """Tell whether there is a gap of whole runs, in which something moved."""
    return comparison.outcome not in ("ended", "nothing moved")


def report_page(result: CompareResult, parts: ReportParts) -> Page:
    """Return the page of a comparison that stands alone, from all that stands on it."""
    comparison, finding = result.comparison, result.finding
    explanation = parts.explanation
    headline_causes: list[str] = []
    why: list[Block] = []
    steps: list[Block] = []
    if explanation is not None:
        why = [
            *causes_blocks(explanation),
            *three_parts(explanation),
            *split_blocks(explanation, details=True),
            *cited_case_blocks(explanation, details=True),
        ]
        steps = steps_blocks(explanation)
        subject = explained_quantity(comparison, explanation)
        if subject is not None:
            finding = finding_about(finding, subject, comparison, result.floor)
            headline_causes = [*proofs(explanation), f"{answer(explanation)}."]
    runs = _both_runs(result, finding)
    content = CompareReport(
        runs=runs,
        worst=worst_of(comparison, finding, result.floor),
        causes=why,
        curves=_ranked_charts(runs),
        details=details_of(result),
        steps=steps,
        parts=parts,
        outcomes=policy_outcomes_blocks(comparison),
    )
    headline = headline_of(finding, comparison, result.instead, headline_causes)
    blocks = render_blocks(content)
    return Page(title_of(comparison), origin_of(comparison), blocks, headline)


def explained_quantity(comparison: Comparison, explanation: Explanation) -> Agreement | None:
    """Return the quantity of the comparison whose gap was explained.

    None where no quantity of the comparison has that gap: it may be measured otherwise.
    """
    if not explanation.verdict.divides:
        return leading(comparison)
    gap, name = explanation.first[explanation.quantity], explanation.quantity
    kind = {"joints": "joint", "slides": "slide"}.get(name)
    same = [
        agreement
        for agreement in comparison.agreements
        if _is_of(agreement, name, kind) and abs(agreement.max - gap.worst) <= 1e-6 * gap.worst
    ]
    return max(same, key=lambda agreement: agreement.max, default=None)


def _is_of(agreement: Agreement, name: str, kind: str | None) -> bool:
    """Tell whether a quantity is of a kind, or where there is none, of a name."""
    if kind is not None:
        return agreement.kind == kind
    return agreement.name in (name, f"{name}, position")


def _models_page(run: Request, traces: Sequence[Trace]) -> Page | None:
    """Return the page of what each engine makes of the model; None where that cannot be read."""
    names = [str(side.path) for side in run.sides]
    if not names:
        names = [trace.header.provenance.model_file for trace in traces]
    left, right = (trace.header.backend for trace in traces)
    if left == right and names[0] == names[1]:
        return None
    files = [run.model or name for name in names]
    labels = f"{Path(names[0]).name}@{left}", f"{Path(names[1]).name}@{right}"
    try:
        differences = models.compare(
            files[0], files[1], (left, right), rename=run.names, menagerie=run.menagerie
        )
        return model_diff.whole_page(replace(differences, labels=labels))
    except (StateMachineError, OSError):
        return None


def _both_runs(result: CompareResult, finding: Finding) -> BothRuns:
    """Return the scene, which opens where the gap is largest, and the charts below it."""
    comparison = result.comparison
    charts = charts_of(comparison, result.floor)
    lead = [k for k, chart in enumerate(charts) if chart.curve.name == finding.lead.name]
    lead += [k for k, chart in enumerate(charts) if chart.curve.kind == "tip"]
    named_first = tuple(dict.fromkeys(lead))[:_SPOKEN]
    return BothRuns(
        comparison.left.trace.header.experiment,
        comparison=comparison,
        start=finding.lead.at,
        events=tuple(events_of(comparison)),
        charts=charts,
        lead=named_first if named_first else (0,),
    )


def _ranked_charts(runs: BothRuns) -> list[Block]:
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
        return [*blocks, Section("", heading, within, folded=True)]
    return [*blocks, *within]
