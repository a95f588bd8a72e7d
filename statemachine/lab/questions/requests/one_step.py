"""Which stage of a step differs first."""

from __future__ import annotations

from dataclasses import dataclass

from ....errors import BadInputError
from ...compare import one_step
from ...compare.prepared_sides import prepare_sides
from ...compare.sides import Request
from ...runs.reporter import QUIET, Reporter


@dataclass(frozen=True)
class OneStepRequest:
    """Question what one step gives on each side, from each state of the left one.

    Attributes:
        run: What is run on two sides; not recorded traces alone.
    """

    run: Request

    def __post_init__(self) -> None:
        check_runs(self.run, "--one-step")


def check_runs(run: Request, flag: str) -> None:
    """Check that both sides can be run.

    Raises:
        BadInputError: They are recorded traces, without sides to play them on.
    """
    if run.is_traces and not run.sides:
        raise BadInputError(
            f"{flag} runs both sides, and a trace is a run that was made: statemachine compare hold"
        )


def answer(request: OneStepRequest, reporter: Reporter = QUIET) -> one_step.OneStep:
    """Compare one step of both sides from each recorded state of the left one.

    Raises:
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    (left, right), _, _ = prepare_sides(request.run)
    with reporter.stage("one step") as progress:
        return one_step.one_step(left, right.model, names=request.run.names, progress=progress)
