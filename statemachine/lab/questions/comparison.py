"""The page of a comparison, in a terminal and alone, and what to ask next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import StateMachineError
from ...measures import QUANTITIES
from ...show.blocks import Page
from .. import model_differences as models
from ..compare.sides import Request
from ..model_differences import page as model_diff
from ..recordings import Trace
from ..runs.reporter import QUIET, Reporter
from ..why import Explanation
from . import compare_page as compare
from .compared_names import name_of
from .finding import leading
from .requests import causes
from .requests.causes import ExplainRequest
from .requests.gap import CompareResult

NEXT = (
    "Next: --why --quantity {name} tells which difference causes this gap, --one-step where in a "
    "step it begins, --converge whether it vanishes with the timestep."
)
_OTHER_EXPERIMENT = (
    "Next: another experiment, such as gravity or waves, may move what this does not."
)
_RECORDED = (
    "What causes it was not looked for: one side is a recorded run, and causes are found by "
    "running both again."
)


def page(result: CompareResult, no_cause: str = "", details: bool = False) -> Page:
    """Return the page of a comparison, for a terminal.

    Args:
        result: What was found.
        no_cause: Why no cause can be named, where one was asked for.
        details: Whether all of it is shown, and not the first screen alone.
    """
    return _page(result, why_not=_what_next(result, no_cause))


def whole_page(
    result: CompareResult, ask_why: ExplainRequest | None, typed: str, reporter: Reporter = QUIET
) -> Page:
    """Return the page of a comparison that stands alone: with causes, models and its command.

    Args:
        result: What was found.
        ask_why: What is asked of causes; None for nothing.
        typed: The command that makes it again.
        reporter: Told how the search for causes gets on.
    """
    traces = result.run.traces
    explanation, why_not = None, ""
    if ask_why is not None and result.comparison.outcome not in ("ended", "nothing moved"):
        if any(trace.header.recorded for trace in traces):
            why_not = _RECORDED
        else:
            explanation, why_not = _explained(ask_why, reporter)
    return _page(
        result,
        explanation=explanation,
        why_not=why_not,
        models_page=_models_page(result.request.run, traces),
        typed=typed,
    )


def _page(
    result: CompareResult,
    *,
    explanation: Explanation | None = None,
    why_not: str = "",
    models_page: Page | None = None,
    typed: str = "",
) -> Page:
    """Return the page of a comparison, and what it says besides."""
    parts = compare.PageParts(explanation, why_not, models_page, typed, result.instead)
    return compare.page(
        result.comparison,
        said=result.run.said,
        run=result.run if result.request.names_sides else None,
        played=result.played,
        witness=result.witness,
        floor=result.floor,
        parts=parts,
    )


def _what_next(result: CompareResult, no_cause: str) -> str:
    """Return what to ask next, or why no cause is named; "" where the page says all of it."""
    comparison = result.comparison
    if comparison.outcome != "differs":
        return ""
    moving = [gap for gap in comparison.agreements if QUANTITIES[gap.kind].moves]
    if all(gap.verdict == "agrees" for gap in moving):
        return _OTHER_EXPERIMENT
    if no_cause:
        return no_cause
    lead = leading(comparison, result.floor)
    return NEXT.format(name=shlex.quote(name_of(lead.name)))


def _explained(request: ExplainRequest, reporter: Reporter) -> tuple[Explanation | None, str]:
    """Return what explains a gap, or None and why nothing does."""
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
