"""Runs of cases, several at once; what is measured does not depend on how many."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

from ...errors import DivergedError, EngineError, ModelError, UnsupportedError
from ...interface import make_data
from ...processes.parallel import forks_for, in_forks
from ..runs.drive import Progress
from .case import TIMESTEPS, Case
from .run import Run
from .variants import Variant
from .verdict import CaseMeasurement

_MEAN = 0.03  # [s] that a run takes, in the mean of all cases on the fastest engine
_SLOWEST = 2.0  # [s] that one takes at the shortest of the timesteps, on the slowest


@dataclass(frozen=True)
class CaseRun:
    """One run of a case.

    Attributes:
        case: What is run.
        variant: On what.
        timestep: Length of a step [s].
    """

    case: Case
    variant: Variant
    timestep: float


@dataclass(frozen=True)
class CaseOutcome:
    """What came of a run.

    Attributes:
        measurement: What was measured; None if the model was refused.
        refusal: Why it was refused; "" if it was not.
    """

    measurement: CaseMeasurement | None
    refusal: str = ""


def timesteps_of(case: Case, timesteps: Sequence[float]) -> list[float]:
    """Return the timesteps at which a case is run, from the longest to the shortest [s].

    Args:
        case: Whose own they are, where none is asked for.
        timesteps: What is asked for [s]; empty for the case's own.
    """
    return sorted(timesteps if timesteps else case.timesteps, reverse=True)


def processes_for(runs: Sequence[CaseRun], jobs: int | None) -> int:
    """Return how many processes are to share some runs.

    Args:
        runs: What is run.
        jobs: How many at most; None for as many as there are processors.
    """
    return forks_for(len(runs), _MEAN, jobs)


def outcomes_of(runs: Sequence[CaseRun], jobs: int, progress: Progress) -> list[CaseOutcome]:
    """Make runs in this process, or in forks of it. An interrupt ends them all.

    Args:
        runs: What is run.
        jobs: Number of processes.
        progress: Told the fraction that is done.

    Returns:
        What came of each, in the order of `runs`.

    Raises:
        EngineError: A process ended before its run was done, twice.
        StateMachineError: As an engine raises it, but for refusals and divergence.
    """
    count = 0

    def ended(_number: int, _outcome: CaseOutcome) -> None:
        nonlocal count
        count += 1
        progress(count / len(runs))

    outcomes: list[CaseOutcome] = []
    if jobs == 1:
        for number, run in enumerate(runs):
            outcomes.append(outcome_of_run(run))
            ended(number, outcomes[-1])
        return outcomes
    shortest = min(run.timestep for run in runs)
    slowest = _SLOWEST * max(TIMESTEPS[-1] / shortest, 1.0)
    # A fork that is killed leaves its files behind: they lie in a folder that is removed here.
    with tempfile.TemporaryDirectory() as folder:
        work = [partial(_outcome_in, folder, run) for run in runs]
        for run, outcome in zip(runs, in_forks(work, jobs, ended, slowest), strict=True):
            if outcome is None:
                raise EngineError(f"{run.case.name} on {run.variant} ended its process twice")
            outcomes.append(outcome)
    return outcomes


def _outcome_in(folder: str, run: CaseRun) -> CaseOutcome:
    """Make a run whose temporary files lie in a folder."""
    with _temporary_files_in(folder):
        return outcome_of_run(run)


@contextmanager
def _temporary_files_in(folder: str) -> Iterator[None]:
    """Let temporary files lie in a folder for a while."""
    before = tempfile.tempdir
    tempfile.tempdir = folder
    try:
        yield
    finally:
        tempfile.tempdir = before


def outcome_of_run(run: CaseRun) -> CaseOutcome:
    """Make a run in this process.

    Raises:
        StateMachineError: As an engine raises it, but for refusals and divergence.
    """
    with warnings.catch_warnings(action="ignore"):
        try:
            return CaseOutcome(measure(run.case, run.variant, run.timestep))
        except (ModelError, UnsupportedError) as error:
            return CaseOutcome(None, str(error))


def measure(case: Case, variant: Variant, timestep: float) -> CaseMeasurement:
    """Run a case once.

    Raises:
        UnsupportedError: The backend does not take the model.
        ModelError: The engine does not read it.
    """
    text = case.model_text(timestep, variant.integrator)
    with (
        variant.loaded(text, timestep, case.gravity) as model,
        make_data(model) as data,
    ):
        run = Run(model, data)
        try:
            measured = case.measure(run)
        except DivergedError:
            return CaseMeasurement(timestep, None, None, None, run.steps, None)
    discrete_error = None
    if variant.integrator in case.discrete:
        discrete_truth = case.discrete[variant.integrator](timestep)
        discrete_error = case.error_of(measured, discrete_truth)
    return CaseMeasurement(
        timestep=timestep,
        measured=measured,
        error=case.error_of(measured, case.true_value),
        discrete_error=discrete_error,
        steps=run.steps,
        seconds_per_step=run.seconds / max(run.steps, 1),
    )
