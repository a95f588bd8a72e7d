"""Fit a model to a recording of a real arm, and say what the recording tells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...interface import Array, Model
from ..runs.drive import Progress, no_progress
from ..runs.provenance import provenance
from ..runs.reporter import QUIET, Reporter
from .fit import Objective
from .hypotheses import tried_hypotheses
from .motions import motion_informations
from .parameters import ArmParameters
from .recorded_gap import FitSplit, RecordedArm, gap_between, recorded_arm_of, split_of
from .refinements import tried_refinements
from .residuals import Residuals
from .results import (
    CauseShare,
    IdentificationResult,
    InterruptedIdentification,
    RecordingGap,
    RecordingRequest,
    StartOutcome,
)
from .shares import cause_shares
from .simulation import ArmSimulation
from .starts import Fits, fits_from_starts
from .verdicts import fitted_parameters


@dataclass(frozen=True, eq=False)
class FittedArm:
    """An arm that was fitted to a recording, and what was not fitted.

    Attributes:
        fits: From all starts.
        held_out: Plays what was not fitted.
        split: What was fitted, and what was not.
        before: (K, n) angles of what was not fitted, with the model as it is [rad].
        after: (K, n) the same with the best fit [rad].
    """

    fits: Fits
    held_out: ArmSimulation
    split: FitSplit
    before: Array
    after: Array

    def holds(self) -> bool:
        """Tell whether of what was not fitted no more is left than is to be expected."""
        errors = (self.after - self.held_out.state)[self._first_frame :]
        return Residuals.of(errors, self.split.held_out).holds(self.predicted())

    def gap(self) -> RecordingGap:
        """Return how far the arm is from what was not fitted."""
        split = self.split
        return gap_between(self.held_out, self.before, self.after, split.part, split.first_held_out)

    def fitted_gap(self) -> RecordingGap:
        """Return how far the arm is from what was fitted."""
        simulation, best = self.fits.best.objective.simulation, self.fits.best.vector
        as_it_is = simulation.angles(np.zeros(len(best)))
        return gap_between(simulation, as_it_is, simulation.angles(best))

    def predicted(self) -> Array:
        """Return the standard deviation (n,) of the angles of what was not fitted [rad].

        By the covariance of the fit: what was not fitted may depend on what it hardly tells.
        """
        objective = replace(self.fits.best.objective, simulation=self.held_out)
        free = objective.free
        jacobian = objective.without_prior(objective.jacobian(self.fits.best.vector[free]))
        by_joint = jacobian.reshape(-1, len(objective.deviation), len(free))
        rows = by_joint[self._first_frame - self.held_out.first_frame :]
        variance = np.einsum("kni,ij,knj->n", rows, self.fits.covariance, rows) / len(rows)
        return objective.deviation * np.sqrt(variance)

    @property
    def _first_frame(self) -> int:
        """Return the first frame of what was not fitted that counts."""
        return max(self.split.first_held_out, self.held_out.first_frame)


def fitted_arm(
    arm: RecordedArm, starts: int, seed: int, progress: Progress = no_progress
) -> FittedArm:
    """Fit all parameters from several starts.

    Args:
        arm: The arm and its recordings.
        starts: How many.
        seed: Of their draws.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
        UnsupportedError: The model has a figure of zero, which no factor changes.
        DivergedError: The simulation diverges with the figures of the model.
    """
    parameters = arm.parameters
    parameters.check_factors()
    split = split_of(arm.recordings)
    objective = Objective(
        simulation=ArmSimulation.of(parameters, split.fitted),
        deviation=split.fitted.resolution,
        free=np.arange(len(parameters)),
        fixed=np.zeros(len(parameters)),
    )
    fits = fits_from_starts(objective, starts, seed, progress)
    held_out = ArmSimulation.of(parameters, split.held_out)
    before = held_out.finite_angles(np.zeros(len(parameters)))
    after = held_out.finite_angles(fits.best.vector)
    return FittedArm(fits, held_out, split, before, after)


def identify(request: RecordingRequest, reporter: Reporter = QUIET) -> IdentificationResult:
    """Fit the model to the recording, from several starts, and say what is determined.

    Raises:
        StateMachineError: The recording or the model cannot be read, or they do not fit.
        MissingEngineError: The extra `recordings` is not installed.
        DivergedError: The simulation diverges with the figures of the model.
        InterruptedIdentification: Ctrl-C while the gap was divided; it holds the fit. One that
            comes earlier is a plain KeyboardInterrupt.
    """
    arm = recorded_arm_of(request)
    with reporter.stage(f"fitting {request.recording}") as progress:
        fitted = fitted_arm(arm, request.starts, request.seed, progress)
    fits, model = fitted.fits, arm.parameters.model
    holds = fitted.holds()
    saturated = float(fits.best.objective.simulation.saturated(fits.best.vector).max())
    with reporter.stage("trying other motions"):
        motions = motion_informations(fits.best)
    with reporter.stage("trying other readings") as progress:
        refinements = tried_refinements(fits)
        hypotheses = tried_hypotheses(fits, saturated, progress)
        hypotheses += tuple(each.hypothesis for each in refinements)
    shares, ended_by = _shares_if_not_ended(fits, fitted.held_out, reporter)
    result = IdentificationResult(
        request=request,
        provenance=provenance(model, request.seed),
        gap=fitted.gap(),
        recordings=arm.recordings,
        arm=model,
        fitted_gap=fitted.fitted_gap(),
        residual=fits.residuals.overall,
        floor=fits.residuals.floor,
        holds=holds,
        at_floor=fits.residuals.at_floor,
        parameters=fitted_parameters(fits, holds, motions, refinements),
        shares=shares,
        hypotheses=hypotheses,
        starts=_outcomes(fits),
        saturated=saturated,
        fitted_arm=fitted_model(arm.parameters, fits.best.vector),
        ended_by=ended_by,
    )
    if ended_by:
        raise InterruptedIdentification(result)
    return result


def _shares_if_not_ended(
    fits: Fits, held_out: ArmSimulation, reporter: Reporter
) -> tuple[tuple[CauseShare, ...], Literal["", "interrupt"]]:
    """Divide the gap among its causes; of a Ctrl-C before that is done, say so.

    Args:
        fits: Of all parameters.
        held_out: Plays what was not fitted.
        reporter: Told how it gets on.

    Returns:
        The shares, none where Ctrl-C came, and whether it did.
    """
    try:
        with reporter.stage("dividing the gap among its causes") as progress:
            return cause_shares(fits, held_out, progress), ""
    except KeyboardInterrupt:
        return (), "interrupt"


def _outcomes(fits: Fits) -> tuple[StartOutcome, ...]:
    """Return where each start ended, the best first."""
    as_good = fits.as_good
    return tuple(
        StartOutcome(cost=each.cost, as_good=each in as_good, evaluations=each.evaluations)
        for each in fits.each
    )


def fitted_model(parameters: ArmParameters, vector: Array) -> Model:
    """Return the Model with gains, friction, armature and payload of a vector (P,)."""
    options = parameters.options(vector[None])
    return parameters.model.replace(**{name: values[0] for name, values in options.items()})
