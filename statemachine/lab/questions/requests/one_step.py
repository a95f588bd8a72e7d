"""Which stage of a step differs first."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from ....errors import BadInputError
from ...compare.one_step import OneStep, one_step
from ...compare.prepared_sides import prepare_sides
from ...compare.sides import Request
from ...runs.reporter import QUIET, Reporter
from ...shown_result import Column, ShownResult, columns_of


@dataclass(frozen=True)
class OneStepRequest:
    """Question what one step gives on each side, from each state of the left one.

    Attributes:
        run: What is run on two sides; not recorded traces alone.
    """

    run: Request

    def __post_init__(self) -> None:
        check_runs(self.run, "--one-step")


_COLUMNS = (
    *(
        "stage",
        "unit",
        "worst",
        "at",
        "where",
        "tolerance",
        "beyond",
        "first",
        "first_count",
        "scale",
    ),
    *("null", "is_available", "reason"),
)


@dataclass(frozen=True, repr=False)
class OneStepResult(ShownResult, OneStep):
    """What one step gives on each side, and what was asked.

    Attributes:
        request: What was asked.
    """

    page_function: ClassVar[str] = "questions.one_step:page"

    request: OneStepRequest = field(kw_only=True, metadata={"json": False})

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each stage of a step: the fields of `StageGap`."""
        return columns_of(self.stages, _COLUMNS)


def check_runs(run: Request, flag: str) -> None:
    """Check that both sides can be run.

    Raises:
        BadInputError: They are recorded traces, without sides to play them on.
    """
    if run.is_traces and not run.sides:
        raise BadInputError(
            f"{flag} runs both sides, and a trace is a run that was made: statemachine compare hold"
        )


def answer(request: OneStepRequest, reporter: Reporter = QUIET) -> OneStepResult:
    """Compare one step of both sides from each recorded state of the left one.

    Raises:
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    left, right = prepare_sides(request.run).reruns
    with reporter.stage("one step") as progress:
        steps = one_step(left, right.model, names=request.run.names, progress=progress)
    return OneStepResult(**vars(steps), request=request)
