"""The arm as it was measured and as it is simulated, as two traces that a page draws."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...interface import INPUTS, Array, Model, forward, make_data
from ..recordings import Header, Trace
from ..recordings.arm_recording import ArmRecording
from ..recordings.recorder import layout_of
from ..runs.provenance import provenance
from ..runs.robot import scalar_joint
from .parameters import ArmParameters
from .results import IdentificationResult, Kind, RecordingResult
from .simulation import ArmSimulation

MEASURED, AS_IT_IS, FITTED = "the arm", "the model as it is", "the fitted model"
_POSES = ("xpos", "xquat", "site_xpos")


def traces_of(result: RecordingResult | IdentificationResult) -> tuple[Trace, Trace]:
    """Return the arm as it was measured, and as it is simulated: fitted, where it was fitted.

    Of a fit it is the episode that was not fitted, if there is one.

    Raises:
        DivergedError: The simulation diverges.
    """
    recording, name = result.recordings.fitted, AS_IT_IS
    figures: dict[tuple[Kind, str | None], float] = {}
    if isinstance(result, IdentificationResult):
        recording, name = result.recordings.held_out or recording, FITTED
        figures = {(each.kind, each.joint): each.fitted for each in result.parameters}
    simulated = simulated_angles(result.arm, recording, figures)
    return (
        trace_of_angles(result.arm, recording, recording.state, MEASURED),
        trace_of_angles(result.arm, recording, simulated, name),
    )


def simulated_angles(
    model: Model, recording: ArmRecording, figures: Mapping[tuple[Kind, str | None], float]
) -> Array:
    """Play the commands of a recording into an arm, and return what would be measured.

    Args:
        model: The arm.
        recording: Its commands, and the angles that it starts from.
        figures: What parameters are, in SI units, by kind and joint; the others as in the model.

    Returns:
        (K, n) angles at each frame [rad].

    Raises:
        DivergedError: The simulation diverges.
    """
    parameters = ArmParameters.of(model, recording.joints)
    vector = np.zeros(len(parameters))
    for place, parameter in enumerate(parameters.each):
        figure = figures.get((parameter.kind, parameter.joint))
        if figure is not None:
            vector[place] = parameter.value(figure)
    return ArmSimulation.of(parameters, recording).finite_angles(vector)


def trace_of_angles(model: Model, recording: ArmRecording, angles: Array, name: str) -> Trace:
    """Return angles of a recording's joints as a trace: bodies and sites where they then are.

    Args:
        model: The arm.
        recording: Whose frames and commands they belong to.
        angles: (K, n) [rad].
        name: What a page calls the run.
    """
    header = _header(model, recording, name)
    qpos = [scalar_joint(model, joint)[0] for joint in recording.joints]
    dofs = [scalar_joint(model, joint)[1] for joint in recording.joints]
    columns: dict[str, Array] = {"time": np.arange(len(angles)) / recording.fps}
    for column in (*INPUTS, *_POSES, "site_xmat"):
        columns[column] = np.zeros((len(angles), *header.shape(column)))
    servos = ArmParameters.of(model, recording.joints).servo
    columns["ctrl"][:, servos] = recording.action
    columns["qvel"][:, dofs] = np.gradient(angles, 1.0 / recording.fps, axis=0)
    with make_data(model) as data:
        for k, frame in enumerate(angles):
            data.qpos[qpos] = frame
            forward(model, data)
            columns["qpos"][k] = data.qpos
            for column in _POSES:
                columns[column][k] = getattr(data, column)
            columns["site_xmat"][k] = np.reshape(data.site_xmat, (model.nsite, 9))
    return Trace(header, columns)


def _header(model: Model, recording: ArmRecording, name: str) -> Header:
    """Return what a trace of a recording's frames is of."""
    return Header(
        experiment=name,
        description="",
        command="",
        provenance=provenance(model),
        defaults=model.defaults,
        options={},
        keyframe=None,
        timestep=1.0 / recording.fps,
        substeps=1,
        gravity=tuple(model.gravity.tolist()),
        **layout_of(model),
    )
