"""Runs of cases, several at once; what is measured does not depend on how many."""

from __future__ import annotations

import math
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

from ...backends import BACKENDS
from ...engines import raw_engine_of
from ...errors import (
    DivergedError,
    ModelError,
    StateMachineError,
    UnsupportedError,
    cut,
    one_line,
)
from ...interface import make_data
from ...processes.parallel import forks_for, in_forks, unwinding
from ..runs.drive import Progress
from .case import TIMESTEPS, Case
from .run import Run, TimestepError
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
        measurement: What was measured; None if the model was refused, or the run failed.
        refusal: Why it was refused, or how it failed; "" otherwise.
        failed: Whether the engine or its backend raised an error that is no refusal.
    """

    measurement: CaseMeasurement | None
    refusal: str = ""
    failed: bool = False


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
    names = {run.variant.backend.name for run in runs}
    can_fork = all(raw_engine_of(name).survives_fork for name in names)
    return forks_for(len(runs), _MEAN, jobs, can_fork)


def outcomes_of(runs: Sequence[CaseRun], jobs: int, progress: Progress) -> list[CaseOutcome]:
    """Make runs in this process, or in forks of it. An interrupt ends them all.

    Args:
        runs: What is run.
        jobs: Number of processes.
        progress: Told the fraction that is done.

    Returns:
        What came of each, in the order of `runs`.

    Raises:
        TimestepError: A case cannot be run at a timestep.
    """
    count = 0

    def ended(_number: int, _outcome: CaseOutcome) -> None:
        nonlocal count
        count += 1
        progress(count / len(runs))

    if jobs > 1:
        return _outcomes_of_forks(runs, jobs, ended)
    outcomes: list[CaseOutcome] = []
    for number, run in enumerate(runs):
        outcomes.append(outcome_of_run(run))
        ended(number, outcomes[-1])
    return outcomes


def _outcomes_of_forks(
    runs: Sequence[CaseRun], jobs: int, ended: Callable[[int, CaseOutcome], None]
) -> list[CaseOutcome]:
    """Make runs in forks of this process, as `outcomes_of` does; `ended` is told each outcome."""
    shortest = min(run.timestep for run in runs)
    slowest = _SLOWEST * max(TIMESTEPS[-1] / shortest, 1.0)
    outcomes: list[CaseOutcome] = []
    # A fork that is killed leaves its files behind: they lie in a folder that is removed here.
    with unwinding(at_once=False) as raise_if_ended, tempfile.TemporaryDirectory() as folder:
        work = [partial(_outcome_in, folder, run) for run in runs]
        for outcome in in_forks(work, jobs, ended, slowest, raise_if_ended):
            if outcome is None:
                outcomes.append(CaseOutcome(None, "it ended its process twice", failed=True))
            else:
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
    """Make a run in this process. What an engine or its backend raises is its outcome.

    Raises:
        TimestepError: The case cannot be run at the timestep.
    """
    with warnings.catch_warnings(action="ignore"):
        try:
            return CaseOutcome(measure(run.case, run.variant, run.timestep))
        except (ModelError, UnsupportedError) as error:
            return CaseOutcome(None, str(error))
        except TimestepError as error:
            raise TimestepError(f"{run.case.name}: {error}") from error
        except Exception as error:  # a backend of another package may raise anything
            return CaseOutcome(None, _failure(run.variant, error), failed=True)


def _failure(variant: Variant, error: Exception) -> str:
    """Return what is told of an error: of one that is no error of ours, where it comes from."""
    if isinstance(error, StateMachineError):
        return cut(one_line(error))
    name = variant.backend.name
    place = BACKENDS.get(name, "a release")
    return cut(one_line(f"{type(error).__name__} in backend {name} ({place}): {error}"))


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
    if math.isnan(measured):
        return CaseMeasurement(timestep, None, None, None, run.steps, None)
    discrete_error = None
    if variant.integrator in case.discrete:
        discrete_truth = case.discrete[variant.integrator](timestep)
        discrete_error = case.error_of(measured, discrete_truth)
    return CaseMeasurement(
        timestep=timestep,
        measured=measured,
        error=case.error_of(measured, case.truth_of(run.time)),
        discrete_error=discrete_error,
        steps=run.steps,
        seconds_per_step=run.seconds / max(run.steps, 1),
    )
