"""Every engine against closed forms: which cases are asked, on what, and what came of it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

from ...backends import BackendChoice
from ...backends.chosen import ALL, chosen_backends
from ...errors import BadInputError, MissingEngineError, StateMachineError
from ...installed import DEFAULT
from ...processes import checked_jobs
from ...processes.parallel import unwinding
from ..runs.each_backend import note_missing
from ..runs.reporter import QUIET, Reporter
from .case import Case, Cause, Expectation, Group, Integrator, Verdict
from .case_runs import (
    CaseOutcome,
    CaseRun,
    outcome_of_run,
    outcomes_of,
    processes_for,
    timesteps_of,
)
from .cases import cases_of
from .variants import OWN, Variant, variants_of
from .verdict import CaseMeasurement, Status, failure_judgement, judgement_of

_LONGEST = 0.1  # [s] of a timestep
_UNKNOWN = "unknown"
_PENDULUM = (
    "<mujoco><worldbody><body><joint/><geom size='1' pos='1 0 0'/></body></worldbody></mujoco>"
)


@dataclass(frozen=True)
class ValidateRequest:
    """Question which engine is right where the truth is known.

    Attributes:
        backends: As `parse_backend` reads them; "all" for those that are installed.
        cases: Names of cases or of groups; empty for all.
        timesteps: At which each case is run [s]; empty for the case's own.
        jobs: Number of processes; None for one a processor where that pays. The errors do not
            depend on it.
    """

    backends: tuple[str, ...] = (DEFAULT,)
    cases: tuple[str, ...] = ()
    timesteps: tuple[float, ...] = ()
    jobs: int | None = None

    def __post_init__(self) -> None:
        if not self.backends:
            raise BadInputError("no backend is named: name one, or all")
        chosen_backends(self.backends)
        cases_of(self.cases)
        checked_jobs(self.jobs)
        for timestep in self.timesteps:
            if not 0.0 < timestep <= _LONGEST:
                raise BadInputError(
                    f"a timestep is above 0 s and at most {_LONGEST:g} s; got {timestep:g}"
                )


@dataclass(frozen=True)
class CaseResult:
    """What one engine did in one case, with one integrator.

    Attributes:
        case: What was run.
        backend: As it is typed behind --backend.
        integrator: How it steps.
        truth: The closed form [unit of the case].
        measurements: One for each timestep, from the longest to the shortest; empty if refused.
        order: With which power of the timestep the error vanishes; None where that cannot be seen.
        verdict: How the engine does; "failed" if it, or its backend, raised an error.
        status: Whether that is what its record says.
        expectation: The record; None if there is none.
        refusal: Why it was refused, or how it failed; "" otherwise.
    """

    case: Case = field(metadata={"json": False})
    backend: str
    integrator: Integrator
    truth: float
    measurements: tuple[CaseMeasurement, ...]
    order: float | None
    verdict: Verdict
    status: Status
    expectation: Expectation | None
    refusal: str = ""

    @property
    def way(self) -> str:
        """Return the engine and how it steps: "mujoco Euler"."""
        return self.backend if self.integrator == OWN else f"{self.backend} {self.integrator}"

    @property
    def name(self) -> str:
        """Name of the case."""
        return self.case.name

    @property
    def group(self) -> Group:
        """Group of the case."""
        return self.case.group

    @property
    def description(self) -> str:
        """Return what happens and what is measured."""
        return self.case.description

    @property
    def source(self) -> str:
        """Return textbook and section, or paper, of the closed form."""
        return self.case.source

    @property
    def unit(self) -> str:
        """Return the unit of the truth and of what is measured."""
        return self.case.unit

    @property
    def error_unit(self) -> str:
        """Return the unit of the errors; "" where they are relative."""
        return self.case.error_unit

    @property
    def cause(self) -> Cause | None:
        """Return what the error comes from; None where that is not on record."""
        return None if self.expectation is None else self.expectation.cause

    @property
    def worst(self) -> float | None:
        """Return the largest size of an error [error_unit]; None if a run has none."""
        sizes: list[float] = []
        for measurement in self.measurements:
            if measurement.error is None:
                return None
            sizes.append(abs(measurement.error))
        return max(sizes, default=None)

    @property
    def holds(self) -> bool:
        """Tell whether the engine is right, or as wrong as its record says."""
        if self.verdict == "failed":
            return False
        if self.status == "not on record":
            return self.verdict not in ("wrong", "diverges")
        return self.status != "worse"


@dataclass(frozen=True)
class ValidateResult:
    """Which engine is right where the truth is known, and by how much.

    Attributes:
        request: What was asked.
        versions: Version of each engine, by backend.
        results: One for each case and way of stepping.
    """

    request: ValidateRequest
    versions: dict[str, str]
    results: tuple[CaseResult, ...]

    @property
    def holds(self) -> bool:
        """Tell whether all is as its record says, or better."""
        return all(result.holds for result in self.results)


def answer(request: ValidateRequest, reporter: Reporter = QUIET) -> ValidateResult:
    """Run the cases on each backend, with each of its integrators.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or all are missing.
        TimestepError: A case cannot be run at a timestep.
    """
    with unwinding():  # a signal to end leaves no file of a case behind
        ways = _ways_of(request, reporter)
        results: list[CaseResult] = []
        versions: dict[str, str] = {}
        for backend, variants in ways.items():
            versions[str(backend)] = version_of_engine(variants[0])
            results += _run_all(cases_of(request.cases), variants, request, reporter)
    return ValidateResult(request, versions, tuple(results))


def _ways_of(
    request: ValidateRequest, reporter: Reporter
) -> dict[BackendChoice, Sequence[Variant]]:
    """Return the ways in which each backend steps, at least one; what is missing is noted.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or all are missing.
    """
    ways: dict[BackendChoice, Sequence[Variant]] = {}
    missing: list[StateMachineError] = []
    for backend in dict.fromkeys(chosen_backends(request.backends)):
        try:
            variants = variants_of(backend)
        except MissingEngineError as error:
            if ALL not in request.backends:
                raise
            missing.append(error)
        else:
            ways[backend] = variants
    note_missing(missing, bool(ways), reporter)
    return ways


def _run_all(
    cases: Sequence[Case], variants: Sequence[Variant], request: ValidateRequest, reporter: Reporter
) -> list[CaseResult]:
    """Return what each way of stepping of a backend does in each case."""
    pairs = [(case, variant) for case in cases for variant in variants]
    runs: list[CaseRun] = []
    for case, variant in pairs:
        for timestep in timesteps_of(case, request.timesteps):
            runs.append(CaseRun(case, variant, timestep))
    jobs = processes_for(runs, request.jobs)
    what = f"{len(cases)} cases on {variants[0].backend}"
    with reporter.stage(what, jobs) as progress:
        outcomes = iter(outcomes_of(runs, jobs, progress))
    results: list[CaseResult] = []
    for case, variant in pairs:
        count = len(timesteps_of(case, request.timesteps))
        results.append(_judged(case, variant, list(itertools.islice(outcomes, count))))
    return results


def version_of_engine(variant: Variant) -> str:
    """Return the version of the engine that steps; "unknown" where it takes no pendulum."""
    try:
        with variant.loaded(_PENDULUM, 0.005) as model:
            return model.engine_version
    except Exception:  # of another package, which may raise anything: each case tells of it
        return _UNKNOWN


def run_case(case: Case, variant: Variant, timesteps: Sequence[float] = ()) -> CaseResult:
    """Run a case at each timestep in this process, and judge what comes of it.

    Args:
        case: What is run.
        variant: On what.
        timesteps: [s]; empty for the case's own.

    Raises:
        TimestepError: The case cannot be run at a timestep.
    """
    outcomes: list[CaseOutcome] = []
    for timestep in timesteps_of(case, timesteps):
        outcomes.append(outcome_of_run(CaseRun(case, variant, timestep)))
        if outcomes[-1].measurement is None:
            break
    return _judged(case, variant, outcomes)


def _judged(case: Case, variant: Variant, outcomes: Sequence[CaseOutcome]) -> CaseResult:
    """Return the result of a case from what came of it at each timestep."""
    measurements: list[CaseMeasurement] = []
    refusal, failed = "", False
    for outcome in outcomes:
        if outcome.measurement is None:
            measurements, refusal, failed = [], outcome.refusal, outcome.failed
            break
        measurements.append(outcome.measurement)
    expectation = case.expectation(str(variant.backend), variant.integrator)
    judgement = failure_judgement(expectation)
    if not failed:
        judgement = judgement_of(case, measurements, expectation)
    return CaseResult(
        case=case,
        backend=str(variant.backend),
        integrator=variant.integrator,
        truth=case.true_value,
        measurements=tuple(measurements),
        order=judgement.order,
        verdict=judgement.verdict,
        status=judgement.status,
        expectation=expectation,
        refusal=refusal,
    )
