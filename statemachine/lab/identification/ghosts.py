"""The arm as it was measured and as it is simulated, as two traces that a page draws."""

from __future__ import annotations

import math

import numpy as np

from ...interface import Array, Model, forward, make_data, step
from ..recordings import Header, Trace
from ..recordings.arm_recording import ArmRecording
from ..recordings.recorder import layout_of
from ..runs.provenance import provenance
from ..runs.robot import scalar_joint
from .results import IdentificationResult, RecordingResult

MEASURED, AS_IT_IS, FITTED = "the arm", "the model as it is", "the fitted model"
_WHOLE = 1e-9  # of a step: rounding
_INPUTS = ("qpos", "qvel", "ctrl")
_POSES = ("xpos", "xquat", "site_xpos")


def traces_of(result: RecordingResult | IdentificationResult) -> tuple[Trace, Trace]:
    """Return the arm as it was measured, and as it is simulated: fitted, where it was fitted.

    Of a fit it is the episode that was not fitted, if there is one.
    """
    if isinstance(result, RecordingResult):
        recording = result.recordings.fitted
        angles = simulated_angles(result.arm, recording)
        return _both(result.arm, recording, angles, AS_IT_IS)
    recording = result.recordings.held_out or result.recordings.fitted
    offsets = _offsets(result, recording)
    angles = simulated_angles(result.fitted_arm, recording, offsets, _delay(result))
    return _both(result.arm, recording, angles, FITTED)


def _both(
    model: Model, recording: ArmRecording, simulated: Array, name: str
) -> tuple[Trace, Trace]:
    """Return measured and simulated angles as traces of one model."""
    return (
        trace_of_angles(model, recording, recording.state, MEASURED),
        trace_of_angles(model, recording, simulated, name),
    )


def _offsets(result: IdentificationResult, recording: ArmRecording) -> Array:
    """Return the offset of each joint of a recording (n,) [rad]."""
    fitted = {each.joint: each.fitted for each in result.parameters if each.kind == "offset"}
    return np.array([fitted.get(joint, 0.0) for joint in recording.joints])


def _delay(result: IdentificationResult) -> float:
    """Return the delay between command and measurement [s]."""
    return sum(each.fitted for each in result.parameters if each.kind == "delay")


def simulated_angles(
    model: Model, recording: ArmRecording, offsets: Array | float = 0.0, delay: float = 0.0
) -> Array:
    """Play the commands of a recording into a model, and return its angles at each frame.

    Args:
        model: The arm.
        recording: Its commands, and the angles that it starts from.
        offsets: (n,) what a measured angle is more than that of the model [rad].
        delay: How much later a measured angle is than that of the model [s].

    Returns:
        (K, n) angles [rad], with offsets and delay as of the measured ones.
    """
    per_frame = math.ceil(1.0 / (recording.fps * model.timestep) - _WHOLE)
    model = model.replace(timestep=1.0 / (recording.fps * per_frame))
    qpos = [scalar_joint(model, joint)[0] for joint in recording.joints]
    ctrl = _commands_of(model, recording)
    angles = np.empty_like(recording.state)
    with make_data(model) as data:
        data.qpos[qpos] = recording.state[0] - offsets
        for k, action in enumerate(recording.action):
            angles[k] = data.qpos[qpos]
            data.ctrl[ctrl] = action - offsets
            step(model, data, per_frame)
    times = np.arange(len(angles)) / recording.fps
    columns = [np.interp(times - delay, times, column) for column in angles.T]
    return np.column_stack(columns) + offsets


def _commands_of(model: Model, recording: ArmRecording) -> list[int]:
    """Return the place in ctrl of the servo of each joint of a recording."""
    driven = model.actuator_jntid.tolist()
    return [driven.index(model.joint_id(joint)) for joint in recording.joints]


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
    for column in (*_INPUTS, *_POSES, "site_xmat"):
        columns[column] = np.zeros((len(angles), *header.shape(column)))
    columns["ctrl"][:, _commands_of(model, recording)] = recording.action
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
