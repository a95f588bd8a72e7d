"""Fit a model to a recording of a real arm, and say what the recording tells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ...errors import DivergedError
from ...interface import Array, Model
from ..runs.drive import Progress, no_progress
from ..runs.provenance import provenance
from ..runs.reporter import QUIET, Reporter
from .fit import Objective
from .hypotheses import tried_hypotheses
from .motions import motion_informations
from .parameters import ArmParameters
from .recorded_gap import Asked, asked_of, gap_between, parts_of
from .refinements import tried_refinements
from .residuals import Residuals
from .results import (
    CauseShare,
    IdentificationResult,
    InterruptedIdentification,
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
        elsewhere: Plays what was not fitted.
        first: The first frame of it that counts.
        before: (K, n) its angles with the model as it is [rad].
        after: (K, n) its angles with the best fit [rad].
    """

    fits: Fits
    elsewhere: ArmSimulation
    first: int
    before: Array
    after: Array

    @property
    def holds(self) -> bool:
        """Tell whether of what was not fitted no more is left than is to be expected."""
        errors = (self.after - self.elsewhere.state)[self._first_row :]
        return Residuals.of(errors, self.elsewhere.recording).holds(self.predicted)

    @property
    def predicted(self) -> Array:
        """Return the standard deviation (n,) of the angles of what was not fitted [rad].

        By the covariance of the fit: what was not fitted may depend on what it hardly tells.
        """
        objective = replace(self.fits.best.objective, simulation=self.elsewhere)
        free = objective.free
        jacobian = objective.jacobian(self.fits.best.vector[free])[: -len(free)]
        by_joint = jacobian.reshape(-1, len(objective.deviation), len(free))
        rows = by_joint[self._first_row - self.elsewhere.first_frame :]
        variance = np.einsum("kni,ij,knj->n", rows, self.fits.covariance, rows) / len(rows)
        return objective.deviation * np.sqrt(variance)

    @property
    def _first_row(self) -> int:
        """Return the first frame of what was not fitted that counts."""
        return max(self.first, self.elsewhere.first_frame)


def fitted_arm(asked: Asked, starts: int, seed: int, progress: Progress = no_progress) -> FittedArm:
    """Fit all parameters from several starts.

    Args:
        asked: The recording and the arm.
        starts: How many.
        seed: Of their draws.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
        UnsupportedError: The model has a figure of zero, which no factor changes.
        DivergedError: The simulation diverges with the figures of the model.
    """
    parameters = asked.parameters
    parameters.check_factors()
    fitted_part, elsewhere, first = parts_of(asked.recordings)
    objective = Objective(
        simulation=ArmSimulation.of(parameters, fitted_part),
        deviation=fitted_part.resolution,
        free=np.arange(len(parameters)),
        fixed=np.zeros(len(parameters)),
    )
    fits = fits_from_starts(objective, starts, seed, progress)
    held_out = ArmSimulation.of(parameters, elsewhere)
    before = held_out.angles(np.zeros(len(parameters)))
    after = held_out.angles(fits.best.vector)
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        raise DivergedError("the simulation of the recorded commands diverges")
    return FittedArm(fits, held_out, first, before, after)


def identify(request: RecordingRequest, reporter: Reporter = QUIET) -> IdentificationResult:
    """Fit the model to the recording, from several starts, and say what is determined.

    Raises:
        StateMachineError: The recording or the model cannot be read, or they do not fit.
        MissingEngineError: The extra `recordings` is not installed.
        DivergedError: The simulation diverges with the figures of the model.
        InterruptedIdentification: Ctrl-C while the gap was divided; it holds the fit. One that
            comes earlier is a plain KeyboardInterrupt.
    """
    asked = asked_of(request)
    with reporter.stage(f"fitting {request.recording}") as progress:
        fitted = fitted_arm(asked, request.starts, request.seed, progress)
    fits, held_out = fitted.fits, fitted.elsewhere
    simulation, best = fits.best.objective.simulation, fits.best.vector
    holds = fitted.holds
    saturated = float(simulation.saturated(best).max())
    with reporter.stage("trying other motions"):
        motions = motion_informations(fits.best)
    with reporter.stage("trying other readings") as progress:
        refinements = tried_refinements(fits)
        hypotheses = tried_hypotheses(fits, saturated, progress)
        hypotheses += tuple(each.hypothesis for each in refinements)
    shares, ended_by = _shares_if_not_ended(fits, held_out, reporter)
    as_it_is = simulation.angles(np.zeros(len(best)))
    part = "last third" if asked.recordings.held_out is None else "all"
    fitted_gap = gap_between(simulation, as_it_is, simulation.angles(best))
    gap = gap_between(held_out, fitted.before, fitted.after, part, fitted.first)
    source = provenance(asked.parameters.model, request.seed)
    parameters = fitted_parameters(fits, holds, motions, refinements)
    starts = _outcomes(fits)
    recording, residuals = simulation.recording, fits.residuals
    arm, recordings = asked.parameters.model, asked.recordings
    arm_after = fitted_model(asked.parameters, best)
    result = IdentificationResult(
        request=request,
        provenance=source,
        units=recording.units,
        fps=recording.fps,
        fitted_gap=fitted_gap,
        gap=gap,
        residual=residuals.overall,
        floor=residuals.floor,
        holds=holds,
        at_floor=residuals.at_floor,
        parameters=parameters,
        shares=shares,
        hypotheses=hypotheses,
        starts=starts,
        saturated=saturated,
        recordings=recordings,
        arm=arm,
        fitted_arm=arm_after,
        ended_by=ended_by,
    )
    if ended_by:
        raise InterruptedIdentification(result)
    return result


def _shares_if_not_ended(
    fits: Fits, elsewhere: ArmSimulation, reporter: Reporter
) -> tuple[tuple[CauseShare, ...], Literal["", "interrupt"]]:
    """Divide the gap among its causes; of a Ctrl-C before that is done, say so.

    Args:
        fits: Of all parameters.
        elsewhere: Plays what was not fitted.
        reporter: Told how it gets on.

    Returns:
        The shares, none where Ctrl-C came, and whether it did.
    """
    try:
        with reporter.stage("dividing the gap among its causes") as progress:
            return cause_shares(fits, elsewhere, progress), ""
    except KeyboardInterrupt:
        return (), "interrupt"


def _outcomes(fits: Fits) -> tuple[StartOutcome, ...]:
    """Return where each start ended, the best first."""
    as_good = set(map(id, fits.as_good))
    return tuple(
        StartOutcome(cost=each.cost, as_good=id(each) in as_good, evaluations=each.evaluations)
        for each in fits.each
    )


def fitted_model(parameters: ArmParameters, vector: Array) -> Model:
    """Return the Model with gains, friction, armature and payload of a vector (P,)."""
    options = parameters.options(vector[None])
    return parameters.model.replace(**{name: values[0] for name, values in options.items()})
