"""The gap between two sides in one quantity, measured again with another right side."""

from __future__ import annotations

from dataclasses import replace

from ...interface import Model
from ..compare.matching import match_models
from .deadline import Deadline
from .gap import Measure, size_of
from .request import WhyRequest
from .setup import NONE
from .trials import Trials


def measured_gap(
    request: WhyRequest, right: Model, quantity: str, measure: Measure
) -> float | None:
    """Return how far two sides are apart; None where a side does not reach the end.

    Args:
        request: The question that was asked.
        right: The right side, instead of the one that was asked of.
        quantity: What the gap is measured in.
        measure: Which figure of it.
    """
    scenario = request.scenario
    if not request.recordings:
        scenario = scenario.on(request.left)
    again = replace(request, right=right, scenario=scenario, quantity=quantity)
    matched = match_models(again.left, right, again.names)
    gaps = Trials(again, matched, Deadline(None)).gaps(NONE)
    return size_of(gaps[quantity], measure) if quantity in gaps else None
