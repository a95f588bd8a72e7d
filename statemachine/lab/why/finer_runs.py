"""How far each of two sides is from its own run with finer steps: what the timestep costs it.

Where both sides approach one motion with finer steps, that motion is the truth of the run that was
asked. The side that is nearer to its own run with finer steps is then nearer to it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import StateMachineError
from ...measures import Deviation
from ..compare.matching import match_alike, match_models
from ..compare.prepared_sides import on_left
from .cited_case import ErrorsInRun
from .deadline import Deadline, TimeIsUp
from .explanation import Explanation
from .gap import size_of
from .request import WhyRequest
from .trials import Trials

FINER = 8  # engine steps to one of the run that was asked


def errors_in_run(result: Explanation, question: WhyRequest) -> ErrorsInRun | None:
    """Run both sides again, as they come and with finer steps.

    Args:
        result: What the gap comes from; its quantity and its figure of the gap are measured.
        question: Whose sides are run, within what is left of its time limit.

    Returns:
        How far each side is from its own run with finer steps; None where a run does not reach the
        end, or no time is left.
    """
    limit = question.time_limit
    deadline = Deadline(None if limit is None else limit - result.took)
    try:
        return _measured(result, question, deadline)
    except (StateMachineError, TimeIsUp):  # then the run decides nothing
        return None


def _measured(result: Explanation, question: WhyRequest, deadline: Deadline) -> ErrorsInRun | None:
    """Return how far each side is from its own run with finer steps; None as `errors_in_run`.

    Raises:
        TimeIsUp: No time is left.
        StateMachineError: A side does not run with finer steps.
    """
    scenario = question.scenario
    if not question.recordings:
        scenario = on_left(scenario, question.left, question.right)
    request = replace(question, scenario=scenario, quantity=result.quantity)
    if request.are_compiled:
        matched = match_models(request.left, request.right, request.names)
    else:
        matched = match_alike(request.left, request.right)
    deadline.check()
    trials = Trials(request, matched, deadline)
    left, right = trials.curves_as_they_come(0), trials.curves_as_they_come(1)
    finer_left = trials.curves_with_finer_steps(0, FINER)
    finer_right = trials.curves_with_finer_steps(1, FINER)
    if left is None or right is None or finer_left is None or finer_right is None:
        return None

    def size(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> float:
        gap: Deviation = trials.ruler.gap(result.quantity, one, other)
        return size_of(gap, result.measure)

    return ErrorsInRun(
        quantity=result.quantity,
        unit=result.unit,
        finer=FINER,
        left=size(left, finer_left),
        right=size(right, finer_right),
        gap=size(left, right),
        finer_gap=size(finer_left, finer_right),
        negligible=result.negligible,
    )
