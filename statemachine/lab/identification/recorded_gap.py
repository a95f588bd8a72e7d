"""How far a model is from a recording of a real arm, as it is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...backends import load
from ...errors import BadInputError, DivergedError, UnsupportedError
from ...installed import DEFAULT
from ...interface import Array, Model
from ..recordings.arm_recording import ArmRecording, ArmRecordings
from ..recordings.arm_source import read_arm_recordings
from ..recordings.lerobot import FEWEST_FRAMES
from ..runs.provenance import provenance
from ..runs.reporter import QUIET, Reporter
from .parameters import ArmParameters
from .residuals import root_mean_square
from .results import EpisodePart, JointGap, RecordingGap, RecordingRequest, RecordingResult
from .simulation import ArmSimulation

_SECONDS = 20.0  # of an episode, where nobody says how much
_FITTED = 2.0 / 3.0  # of the only episode; the rest shows whether it holds


@dataclass(frozen=True, eq=False)
class RecordedArm:
    """The arm of a question, loaded, and its recordings.

    Attributes:
        parameters: Of the arm.
        recordings: Both episodes, no longer than asked for.
    """

    parameters: ArmParameters
    recordings: ArmRecordings


def recorded_arm_of(request: RecordingRequest) -> RecordedArm:
    """Read the recording and load the model of a question.

    Raises:
        StateMachineError: One of them cannot be read, or the joints do not fit.
    """
    model = load(request.model, backend=DEFAULT, menagerie=request.menagerie)
    recordings = read_arm_recordings(request.recording, model, request.calibration, request.names)
    seconds = _SECONDS if request.seconds is None else request.seconds
    held_out = recordings.held_out
    cut = ArmRecordings(
        fitted=shortened(recordings.fitted, seconds),
        held_out=None if held_out is None else shortened(held_out, seconds),
    )
    return RecordedArm(ArmParameters.of(model, recordings.fitted.joints), cut)


def shortened(recording: ArmRecording, seconds: float) -> ArmRecording:
    """Return the first seconds of a recording.

    Raises:
        BadInputError: They are too few frames.
    """
    frames = round(seconds * recording.fps)
    if frames < FEWEST_FRAMES:
        raise BadInputError(
            f"{seconds:g} s are {frames} frames of {recording.fps:g} a second; at least "
            f"{FEWEST_FRAMES} are needed: take {math.ceil(FEWEST_FRAMES / recording.fps)} s or more"
        )
    return _first_frames(recording, frames)


def _first_frames(recording: ArmRecording, frames: int) -> ArmRecording:
    return replace(recording, action=recording.action[:frames], state=recording.state[:frames])


@dataclass(frozen=True, eq=False)
class FitSplit:
    """What of two episodes, or of the only one, is fitted, and what shows whether that holds.

    Attributes:
        fitted: What is fitted.
        held_out: The recording with what is not fitted.
        first_held_out: The first frame of it that is not fitted.
        part: Which part of that episode is not fitted.
    """

    fitted: ArmRecording
    held_out: ArmRecording
    first_held_out: int
    part: EpisodePart


def split_of(recordings: ArmRecordings) -> FitSplit:
    """Return what is fitted: an episode, or two thirds of the only one."""
    whole = recordings.fitted
    if recordings.held_out is not None:
        return FitSplit(whole, recordings.held_out, 0, "all")
    frames = round(_FITTED * len(whole.state))
    return FitSplit(_first_frames(whole, frames), whole, frames, "last third")


def answer(request: RecordingRequest, reporter: Reporter = QUIET) -> RecordingResult:
    """Play the commands of a recording into the model as it is, and compare the angles.

    Raises:
        StateMachineError: The recording or the model cannot be read, or they do not fit.
        DivergedError: The simulation diverges.
    """
    arm = recorded_arm_of(request)
    simulation = ArmSimulation.of(arm.parameters, arm.recordings.fitted)
    with reporter.stage(f"playing {request.recording}"):
        angles = simulation.finite_angles(np.zeros(len(arm.parameters)))
    return RecordingResult(
        request=request,
        provenance=provenance(arm.parameters.model, request.seed),
        gap=gap_between(simulation, angles),
        recordings=arm.recordings,
        arm=arm.parameters.model,
    )


def gap_held_out(model: Model, recordings: ArmRecordings) -> float | None:
    """Return how far a model is, as it is, from what was not fitted [rad].

    None where its joints have no servos, or its simulation diverges.
    """
    split = split_of(recordings)
    try:
        parameters = ArmParameters.of(model, split.held_out.joints)
        simulation = ArmSimulation.of(parameters, split.held_out)
        angles = simulation.finite_angles(np.zeros(len(parameters)))
    except (UnsupportedError, DivergedError):
        return None
    return gap_between(simulation, angles, first=split.first_held_out).model


def gap_between(
    simulation: ArmSimulation,
    angles: Array,
    fitted: Array | None = None,
    part: EpisodePart = "all",
    first: int = 0,
) -> RecordingGap:
    """Return how far simulated angles are from the measured ones.

    Args:
        simulation: Of the recording.
        angles: (K, n) of the model as it is [rad].
        fitted: (K, n) of the fitted model [rad]; None where nothing was fitted.
        part: Which part of the recording counts.
        first: The first frame that counts.
    """
    state = simulation.state
    # The command that the arm had when it was read is the one of the frame before.
    told = np.vstack([simulation.action[:1], simulation.action[:-1]])
    rows = slice(max(first, simulation.first_frame), None)
    of_told, of_model = (told - state)[rows], (angles - state)[rows]
    of_fitted = None if fitted is None else (fitted - state)[rows]
    joints: list[JointGap] = []
    for place, joint in enumerate(simulation.parameters.joints):
        joints.append(
            JointGap(
                joint=joint,
                commanded=root_mean_square(of_told[:, place]),
                model=root_mean_square(of_model[:, place]),
                fitted=None if of_fitted is None else root_mean_square(of_fitted[:, place]),
            )
        )
    return RecordingGap(
        episode=simulation.recording.episode,
        part=part,
        seconds=len(of_told) / simulation.recording.fps,
        joints=tuple(joints),
        commanded=root_mean_square(of_told),
        model=root_mean_square(of_model),
        fitted=None if of_fitted is None else root_mean_square(of_fitted),
    )
