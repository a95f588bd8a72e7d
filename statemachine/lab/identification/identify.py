"""Fit a model to a recording of a real arm, and say what the recording tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import DivergedError
from ...interface import Array, Model
from ..recordings.arm_recording import ArmRecording, ArmRecordings
from ..runs.provenance import provenance
from ..runs.reporter import QUIET, Reporter
from .fit import Objective
from .hypotheses import tried_hypotheses
from .motions import motion_informations
from .parameters import ArmParameters
from .recorded_gap import asked_of, gap_between
from .residuals import Residuals
from .results import IdentificationResult, RecordingRequest, StartOutcome
from .shares import cause_shares
from .simulation import ArmSimulation
from .starts import Fits, fits_from_starts
from .verdicts import fitted_parameters

_FITTED = 2.0 / 3.0  # of the only episode; the rest shows whether it holds


def identify(request: RecordingRequest, reporter: Reporter = QUIET) -> IdentificationResult:
    """Fit the model to the recording, from several starts, and say what is determined.

    Raises:
        StateMachineError: The recording or the model cannot be read, or they do not fit.
        MissingEngineError: The extra `recordings` is not installed.
        DivergedError: The simulation diverges with the figures of the model.
    """
    asked = asked_of(request)
    parameters = asked.parameters
    fitted_part, elsewhere, first = _parts(asked.recordings)
    objective = Objective(
        simulation=ArmSimulation.of(parameters, fitted_part),
        deviation=fitted_part.resolution,
        free=np.arange(len(parameters)),
        fixed=np.zeros(len(parameters)),
    )
    with reporter.stage(f"fitting {request.recording}") as progress:
        fits = fits_from_starts(objective, request.starts, request.seed, progress)
    simulation, held_out = objective.simulation, ArmSimulation.of(parameters, elsewhere)
    nothing, best = np.zeros(len(parameters)), fits.best.vector
    before, after = held_out.angles(nothing), held_out.angles(best)
    if not (np.isfinite(before).all() and np.isfinite(after).all()):
        raise DivergedError("the simulation of the recorded commands diverges")
    rows = slice(max(first, held_out.first_frame), None)
    holds = Residuals.of((after - held_out.state)[rows], elsewhere).holds
    saturated = float(simulation.saturated(best).max())
    with reporter.stage("trying other motions"):
        motions = motion_informations(fits.best)
    with reporter.stage("trying other readings") as progress:
        hypotheses = tried_hypotheses(fits, saturated, progress)
    with reporter.stage("dividing the gap among its causes") as progress:
        shares = cause_shares(fits, held_out, progress)
    only = asked.recordings.held_out is None
    return IdentificationResult(
        request=request,
        provenance=provenance(parameters.model, request.seed),
        units=fitted_part.units,
        fps=fitted_part.fps,
        fitted_gap=gap_between(simulation, simulation.angles(nothing), simulation.angles(best)),
        gap=gap_between(held_out, before, after, "last third" if only else "all", first),
        residual=fits.residuals.overall,
        floor=fits.residuals.floor,
        holds=holds,
        at_floor=fits.residuals.at_floor,
        parameters=fitted_parameters(fits, holds, motions),
        shares=shares,
        hypotheses=hypotheses,
        starts=_outcomes(fits),
        saturated=saturated,
        recordings=asked.recordings,
        arm=parameters.model,
        fitted_arm=fitted_model(parameters, best),
    )


def _parts(recordings: ArmRecordings) -> tuple[ArmRecording, ArmRecording, int]:
    """Return what is fitted, what is not, and from which frame on that was not fitted."""
    whole = recordings.fitted
    if recordings.held_out is not None:
        return whole, recordings.held_out, 0
    frames = round(_FITTED * len(whole.state))
    return replace(whole, action=whole.action[:frames], state=whole.state[:frames]), whole, frames


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
