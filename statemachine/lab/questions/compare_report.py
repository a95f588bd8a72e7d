"""The page of a comparison that stands alone: both runs in 3-D, curves, causes, all figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import StateMachineError
from ...show.blocks import Block, Page, Section
from ...show.templates import PageContent, render_blocks
from .. import model_differences as models
from ..compare import Comparison
from ..compare.sides import Request
from ..model_differences import page as model_diff
from ..recordings import Trace
from ..runs.reporter import QUIET, Reporter
from ..why import Explanation
from ..why import page as why
from ..why.answer_page import answer, proofs
from .compare_details import details_of
from .compare_verdict import headline_of
from .compared_names import traces_of
from .comparison import origin_of, title_of
from .events import events_of
from .requests import causes
from .requests.causes import ExplainRequest
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
class CompareReport(PageContent):
    """What a page of a comparison shows that stands alone, below its verdict.

    Attributes:
        runs: Both runs in 3-D.
        worst: The quantities that are farthest apart.
        causes: What explains the gap; empty where that was not asked.
        why_not: Why nothing explains it; "" where something does, or nobody asked.
        curves: A chart for each quantity, those that agree folded away.
        details: Everything else, in sections.
        models: What each engine makes of the model; None where that is the same, or not known.
        steps: What to change so that both sides agree.
        command: What makes the page again.
    """

    template = "compare_report.md.j2"
    runs: BothRuns
    worst: WorstQuantities
    causes: Sequence[Block]
    why_not: str
    curves: Sequence[Block]
    details: Sequence[Block]
    models: Page | None
    steps: Sequence[Block]
    command: str

    @property
    def total(self) -> int:
        """How many quantities there are."""
        return len(self.runs.comparison.agreements)

    @property
    def uncharted(self) -> int:
        """How many quantities have no chart."""
        return len(self.runs.comparison.curves) - len(self.runs.charts)


def whole_page(
    result: CompareResult, ask_why: ExplainRequest | None, typed: str, reporter: Reporter = QUIET
) -> Page:
    """Return the page of a comparison that stands alone: with causes, models and its command.

    Args:
        result: How far apart two runs are.
        ask_why: What is asked of causes; None for nothing.
        typed: The command that makes it again.
        reporter: Told how the search for causes gets on.
    """
    comparison, finding = result.comparison, result.finding
    explanation, why_not = None, ""
    if ask_why is not None and finding.outcome not in ("ended", "nothing moved"):
        explanation, why_not = _explained(ask_why, comparison, reporter)
    runs = _both_runs(result, explanation)
    explained: list[str] = []
    causes_blocks: list[Block] = []
    steps: list[Block] = []
    if explanation is not None:
        explained = [*proofs(explanation), f"{answer(explanation)}."]
        causes_blocks = [*why.causes(explanation), *why.three_parts(explanation)]
        steps = [*why.steps(explanation)]
    content = CompareReport(
        runs=runs,
        worst=worst_of(comparison, finding, result.floor),
        causes=causes_blocks,
        why_not=why_not,
        curves=_ranked_charts(runs),
        details=details_of(result),
        models=_models_page(result.request.run, traces_of(comparison)),
        steps=steps,
        command=typed,
    )
    headline = headline_of(finding, comparison, result.instead, explained)
    blocks = render_blocks(content)
    return Page(title_of(comparison), origin_of(comparison), blocks, headline)


def _explained(
    request: ExplainRequest, comparison: Comparison, reporter: Reporter
) -> tuple[Explanation | None, str]:
    """Return what explains a gap, or None and why nothing does."""
    if any(trace.header.recorded for trace in traces_of(comparison)):
        return None, _RECORDED
    try:
        return causes.answer(request, reporter), ""
    except StateMachineError as error:
        return None, f"What causes it could not be found: {error}."


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
        return model_diff.page(replace(differences, labels=labels))
    except (StateMachineError, OSError):
        return None


def _both_runs(result: CompareResult, explanation: Explanation | None) -> BothRuns:
    """Return the scene, which opens where the gap is largest, and the charts below it."""
    comparison, finding = result.comparison, result.finding
    charts = charts_of(comparison, result.floor)
    start = finding.lead.at
    if explanation is not None and explanation.verdict.divides:
        start = explanation.first[explanation.quantity].at
    lead = [k for k, chart in enumerate(charts) if chart.curve.name == finding.lead.name]
    lead += [k for k, chart in enumerate(charts) if chart.curve.kind == "tip"]
    spoken = tuple(dict.fromkeys(lead))[:_SPOKEN]
    return BothRuns(
        comparison.left.trace.header.experiment,
        comparison=comparison,
        start=start,
        events=tuple(events_of(comparison)),
        charts=charts,
        lead=spoken if spoken else (0,),
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
