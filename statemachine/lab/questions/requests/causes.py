"""Which difference of two sides explains how much of their gap."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ....errors import BadInputError, check_name
from ....processes import checked_jobs
from ... import why
from ...compare.alike import for_left
from ...compare.perturbed import EXACT, Uncertainty
from ...compare.recorded import recorded_sides
from ...compare.sides import Request, with_options
from ...compare.typed_command import typed_command
from ...runs.reporter import QUIET, Reporter
from ...why.trials import Measure

_PLAYED = "the models were run again, with the recorded starts and commands"
MEASURES: tuple[Measure, ...] = ("worst", "end", "rms")


@dataclass(frozen=True)
class ExplainRequest:
    """Question which difference of two sides explains how much of their gap.

    Attributes:
        run: What is run on two sides, or recorded traces, whose models are run again.
        quantity: What the gap is measured in, such as "joints", one joint or a body; None for what
            `why.explain` chooses.
        measure: Which figure of the gap is explained.
        finer: Whether every difference is divided into its entries.
        budget: Number of sets of causes that may be run where they interact, at least 1.
        uncertainty: How uncertain the start is, for the chaos floor; None for no floor.
        jobs: Number of processes; None for one a processor where that pays.
    """

    run: Request
    quantity: str | None = None
    measure: Measure = "worst"
    finer: bool = False
    budget: int = 200
    uncertainty: Uncertainty | None = EXACT
    jobs: int | None = None

    def __post_init__(self) -> None:
        check_name("measure", self.measure, MEASURES)
        if self.budget < 1:
            raise BadInputError(f"--budget wants a number of runs, at least 1; got {self.budget}")
        checked_jobs(self.jobs)


def answer(request: ExplainRequest, reporter: Reporter = QUIET) -> why.Explanation:
    """Explain what two sides differ in.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    run = request.run
    with reporter.stage("why") as progress:
        if run.is_traces:
            asked, sides, traces = recorded_sides(run)
        else:
            asked, traces = run.scenario(), ()
            sides = run.both_sides(asked.model)
        labels = sides[0].label, sides[1].label
        sides, common = with_options(sides, {**asked.options, **run.options})
        models = [side.load() for side in sides]
        recordings = [
            for_left(trace, model, run) for trace, model in zip(traces, models, strict=False)
        ]
        question = why.WhyRequest(
            models[0],
            models[1],
            replace(asked, options=common),
            recordings=tuple(recordings),
            seconds=run.seconds,
            seed=run.seed,
            names=run.names,
            quantity=request.quantity,
            measure=request.measure,
            finer=request.finer,
            budget=request.budget,
            labels=None if labels[0] == labels[1] else labels,
            uncertain=request.uncertainty,
            jobs=request.jobs,
        )
        result = why.explain(question, progress)
    notes = [*run.taken]
    if run.is_traces:
        notes.append(_PLAYED)
    return replace(result, notes=(*notes, *result.notes), command=typed_command(run))
