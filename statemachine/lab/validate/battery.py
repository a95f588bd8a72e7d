"""Every engine against closed forms: which cases are asked, on what, and what came of it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field

from ...backends import BackendChoice
from ...backends.chosen import ALL, chosen_backends
from ...errors import (
    BadInputError,
    DivergedError,
    MissingEngineError,
    ModelError,
    StateMachineError,
    UnsupportedError,
)
from ...installed import DEFAULT
from ...interface import make_data
from ..runs.drive import Progress
from ..runs.each_backend import note_missing
from ..runs.reporter import QUIET, Reporter
from .case import Case, Cause, Expectation, Group, Integrator, Verdict
from .cases import cases_of
from .run import Run
from .variants import OWN, Variant, variants_of
from .verdict import CaseMeasurement, Status, observed_order, status_of, verdict_of

_LONGEST = 0.1  # [s] of a timestep
_EMPTY = "<mujoco><worldbody/></mujoco>"


@dataclass(frozen=True)
class ValidateRequest:
    """Question which engine is right where the truth is known.

    Attributes:
        backends: As `parse_backend` reads them; "all" for those that are installed.
        cases: Names of cases or of groups; empty for all.
        timesteps: At which each case is run [s]; empty for the case's own.
    """

    backends: tuple[str, ...] = (DEFAULT,)
    cases: tuple[str, ...] = ()
    timesteps: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.backends:
            raise BadInputError("no backend is named: name one, or all")
        chosen_backends(self.backends)
        cases_of(self.cases)
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
        verdict: How the engine does.
        status: Whether that is what its record says.
        expectation: The record; None if there is none.
        refusal: Why it was refused; "" if it was not.
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
        """The engine and how it steps: "mujoco Euler"."""
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
        """What happens and what is measured."""
        return self.case.description

    @property
    def source(self) -> str:
        """Textbook and section, or paper, of the closed form."""
        return self.case.source

    @property
    def unit(self) -> str:
        """Unit of the truth and of what is measured."""
        return self.case.unit

    @property
    def error_unit(self) -> str:
        """Unit of the errors; "" where they are relative."""
        return self.case.error_unit

    @property
    def cause(self) -> Cause | None:
        """What the error comes from; None where that is not on record."""
        return None if self.expectation is None else self.expectation.cause

    @property
    def worst(self) -> float | None:
        """Largest size of an error [error_unit]; None if a run has none."""
        sizes: list[float] = []
        for measurement in self.measurements:
            if measurement.error is None:
                return None
            sizes.append(abs(measurement.error))
        return max(sizes, default=None)

    @property
    def holds(self) -> bool:
        """Whether the engine is right, or as wrong as its record says."""
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
        """Whether all is as its record says, or better."""
        return all(result.holds for result in self.results)


def answer(request: ValidateRequest, reporter: Reporter = QUIET) -> ValidateResult:
    """Run the cases on each backend, with each of its integrators.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or all are missing.
        StateMachineError: As an engine raises it, but for refusals and divergence.
    """
    cases = cases_of(request.cases)
    results: list[CaseResult] = []
    versions: dict[str, str] = {}
    missing: list[StateMachineError] = []
    for backend in dict.fromkeys(chosen_backends(request.backends)):
        try:
            variants = variants_of(backend)
        except MissingEngineError as error:
            if ALL not in request.backends:
                raise
            missing.append(error)
            continue
        versions[str(backend)] = version_of_engine(backend, variants)
        with reporter.stage(f"{len(cases)} cases on {backend}") as progress:
            results += _run_all(cases, variants, request.timesteps, progress)
    note_missing(missing, bool(versions), reporter)
    return ValidateResult(request, versions, tuple(results))


def _run_all(
    cases: Sequence[Case],
    variants: Sequence[Variant],
    timesteps: Sequence[float],
    progress: Progress,
) -> list[CaseResult]:
    """Return what each way of stepping does in each case."""
    results: list[CaseResult] = []
    total = len(cases) * len(variants)
    for case in cases:
        for variant in variants:
            results.append(run_case(case, variant, timesteps))
            progress(len(results) / total)
    return results


def version_of_engine(backend: BackendChoice, variants: Sequence[Variant]) -> str:
    """Return the version of the engine that steps.

    Args:
        backend: The engine.
        variants: Its ways of stepping, at least one.
    """
    if not variants:
        raise ModelError(f"{backend} reads none of the integrators", backend=backend.name)
    with variants[0].loaded(_EMPTY, 0.005) as model:
        return model.engine_version


def run_case(case: Case, variant: Variant, timesteps: Sequence[float] = ()) -> CaseResult:
    """Run a case at each timestep, and judge what comes of it.

    Args:
        case: What is run.
        variant: On what.
        timesteps: [s]; empty for the case's own.

    Raises:
        StateMachineError: As an engine raises it, but for refusals and divergence.
    """
    chosen = timesteps if timesteps else case.timesteps
    measurements, refusal = _measurements(case, variant, sorted(chosen, reverse=True))
    expectation = case.expectation(str(variant.backend), variant.integrator)
    status = status_of(case, measurements, expectation)
    return CaseResult(
        case=case,
        backend=str(variant.backend),
        integrator=variant.integrator,
        truth=case.true_value,
        measurements=measurements,
        order=observed_order(case, measurements),
        verdict=verdict_of(case, measurements),
        status=status,
        expectation=expectation,
        refusal=refusal,
    )


def _measurements(
    case: Case, variant: Variant, timesteps: Sequence[float]
) -> tuple[tuple[CaseMeasurement, ...], str]:
    """Return what each timestep gives, or nothing and why the model was refused."""
    measurements: list[CaseMeasurement] = []
    with warnings.catch_warnings(action="ignore"):
        try:
            for timestep in timesteps:
                measurements.append(measure(case, variant, timestep))
        except (ModelError, UnsupportedError) as error:
            return (), str(error)
    return tuple(measurements), ""


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
