"""Why two sides differ, whatever they are: files, engines, settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ...errors import BadInputError, EndedEarlyError
from ..compare.prepared_sides import on_left
from ..runs.reporter import QUIET, Reporter
from .assembly import explanation_of
from .deadline import Deadline, TimeIsUp
from .explained_gap import named_quantity
from .explanation import Explanation, InterruptedExplanation
from .request import WhyRequest
from .search import Search
from .trials import Trials


def _tell_nobody(_so_far: Explanation) -> None:
    """Take an explanation that is not complete."""


def explain(
    request: WhyRequest,
    reporter: Reporter = QUIET,
    so_far: Callable[[Explanation], None] = _tell_nobody,
    began: float | None = None,
) -> Explanation:
    """Equalize what two sides differ in, one by one, and run both again.

    Each difference is taken alone first, and last: that ranks them. What stays is looked for by
    leaving out, on both sides, what no setting holds. Then the gap is divided among them.

    Args:
        request: The two sides, and what is run on them.
        reporter: Told how it gets on.
        so_far: Given what is known once the differences are ranked, if the rest takes long.
        began: When the time of the request's time limit began, as `time.monotonic` tells it;
            None for now.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        BadInputError: Nothing can be measured, the commands do not repeat, or the time limit is
            over before both sides were run once.
        UnknownNameError: There is no such quantity, or name.
        InterruptedExplanation: Ctrl-C; it holds what is known by then. One that comes before both
            sides were run once is a plain KeyboardInterrupt.
    """
    deadline = Deadline(request.time_limit, began)
    if not request.recordings:
        request = replace(request, scenario=on_left(request.scenario, request.left, request.right))
    search = _begun(request, deadline, reporter)
    try:
        search.run(ranked=lambda: so_far(explanation_of(search)))
    except KeyboardInterrupt:
        raise InterruptedExplanation(explanation_of(search)) from None
    return explanation_of(search)


def _begun(request: WhyRequest, deadline: Deadline, reporter: Reporter) -> Search:
    """Run both sides as they come, and find what differs.

    Raises:
        BadInputError: The time is over before that.
        EndedEarlyError: A side does not reach the end.
    """
    try:
        with reporter.stage("why: both sides"):
            trials = Trials(request, request.matched(), deadline)
            quantity = named_quantity(trials, request.quantity)
            causes = trials.setup.causes(request.finer)
            first = trials.gaps(frozenset())
    except TimeIsUp:
        raise BadInputError(
            f"the time limit of {deadline.seconds:g} s was over before both sides were run once, "
            "as they come: give it more, or run for less than "
            f"{request.duration:g} simulated seconds"
        ) from None
    if not first:
        raise _ended(trials, [cause.name for cause in causes if not cause.refused])
    return Search(request, trials, deadline, first, causes, quantity, reporter)


def _ended(trials: Trials, equalizable: list[str]) -> EndedEarlyError:
    """Return the error that a side does not reach the end, and by which causes alone it would."""
    reason, sufficient = trials.ended, list[str]()
    try:
        for name in equalizable:
            if trials.gaps(frozenset({name})):
                sufficient.append(name)
    except TimeIsUp:  # those that are known by then
        pass
    text = f"as they come, a side does not reach the end: {reason}"
    if sufficient:
        text += f"; both reach it if one of these is brought to the same: {', '.join(sufficient)}"
    return EndedEarlyError(text, ended=reason)
