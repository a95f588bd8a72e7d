"""Results of comparing two runs that a test has at hand, and their pages."""

from __future__ import annotations

from typing import Any

from statemachine.lab.compare import Comparison, Request, SidesRun
from statemachine.lab.questions.comparison import page
from statemachine.lab.questions.requests.gap import CompareRequest, CompareResult
from statemachine.show.blocks import Page


def result_of(comparison: Comparison, run: SidesRun | None = None, **parts: Any) -> CompareResult:
    """Return the result of a comparison; `parts` are fields of it that are no default."""
    left, right = comparison.left.trace, comparison.right.trace
    known: dict[str, Any] = {"played": None, "witness": None, "floor": None, "instead": None}
    experiment = left.header.experiment
    return CompareResult(
        request=CompareRequest(Request((experiment,))),
        run=SidesRun(left, right, right) if run is None else run,
        comparison=comparison,
        **known | parts,
    )


def page_of(comparison: Comparison, *, details: bool = False, **parts: Any) -> Page:
    """Return the page of a comparison; `parts` as of `result_of`."""
    return page(result_of(comparison, **parts), details)
