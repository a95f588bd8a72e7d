"""A recording of a real arm by the words that name it: "lerobot:DIR#3"."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import BadInputError, did_you_mean, shown
from ...interface import Array, JointType, Model
from ...models import AnyPath, expanded, kind_of_path
from .arm_recording import PREFIX, SYNTHETIC, ArmRecording, ArmRecordings
from .calibration import COUNT, read_calibration
from .joint_units import JointUnit
from .lerobot import FEWEST_FRAMES, LerobotDataSet, LerobotEpisode, open_data_set
from .lerobot_cache import kept_data_set
from .lerobot_description import joint_name
from .robot_types import check_robot
from .unit_inference import MeasuredJoint, infer_units, measured_joint

_FORM = f"{PREFIX}DIR or {PREFIX}DIR#EPISODE"
_SYNTHETIC_FOLDER = Path(__file__).resolve().parent / "synthetic"
_MOST_EPISODES = 100  # whose values are looked at for their quantum
_FURTHEST = 360.0  # degrees: a servo turns once, and its counts are from -180 to 180
_MOST_DIGITS = 18  # of the number of an episode, which is one of 64 bits
_FASTEST = 20.0  # rad/s: three times what a servo of the SO-101 turns without a load
_MOVES = 12 * COUNT  # rad, about 1°: an arm whose joints all stay within that does not move


@dataclass(frozen=True, eq=False)
class _Arm:
    """A data set, and what its numbers mean.

    Attributes:
        data_set: What is read.
        joints: What was measured of each joint.
        units: What the numbers of each mean.
    """

    data_set: LerobotDataSet
    joints: tuple[MeasuredJoint, ...]
    units: tuple[JointUnit, ...]

    def sent(self, action: Array) -> Array:
        """Return what the servos are told, (K, n): LeRobot truncates it to counts.

        So does _unnormalize of its `motors/motors_bus.py`, after it clamps what is not in
        degrees to the range. Of a joint that does not move the counts are not known.
        """
        sent = action.copy()
        for column, (joint, unit) in enumerate(zip(self.joints, self.units, strict=True)):
            values = action[:, column]
            if unit.unit != "degrees":
                values = np.clip(values, 100.0 - joint.width, 100.0)
            if joint.grid is not None:
                is_inverted = unit.unit != "degrees" and unit.radians < 0.0  # by drive_mode
                values = joint.grid.ceil(values) if is_inverted else joint.grid.floor(values)
            sent[:, column] = values
        return sent


def read_arm_recordings(
    source: str, model: Model, calibration: AnyPath | None, names: Mapping[str, str]
) -> ArmRecordings:
    """Read an episode of a data set of LeRobot, and one to hold out.

    Args:
        source: "lerobot:DIR#EPISODE"; "lerobot:DIR" for the first episode. DIR may be the name
            of a data set that LeRobot keeps, "user/name". The folder "synthetic" is the recording
            that comes with the package; it was simulated.
        model: Of the arm; its joints give names, zero and, where a joint does not move, scale.
        calibration: LeRobot's calibration file; None to take unit and scale from the numbers.
        names: Joints of the recording that have other names in the model.

    Raises:
        BadInputError: The source names no episode of a data set; or it is damaged, is of another
            arm, does not fit the model, has a unit that cannot be told, commands no servo reaches,
            or an arm that does not move.
        MissingEngineError: pyarrow is not installed.
    """
    folder, number = folder_and_episode(source)
    data_set = open_data_set(folder)
    if number is None:
        number = data_set.episodes[0]
    data_set.place(number)
    check_robot(data_set.robot, model)
    joints = _joints_of(data_set, model, names)
    motors = None
    if calibration is not None:
        motors = {joint_name(name): each for name, each in read_calibration(calibration).items()}
    episode = data_set.episode(number)
    measured = tuple(_measured_joints(data_set, number, model, joints))
    arm = _Arm(data_set, measured, infer_units(measured, motors, data_set.has_old_zero))
    fitted = _recording(source, arm, episode)
    if not _moves(fitted):
        raise BadInputError(
            f"the arm does not move in episode {number} of {folder}: no joint by more than "
            f"{np.degrees(_MOVES):.0f}°; name another episode as {PREFIX}{folder}#NUMBER"
        )
    return ArmRecordings(fitted, _held_out(source, arm, number))


def folder_and_episode(source: str) -> tuple[Path, int | None]:
    """Return the folder that a source names, and the episode; None for the first.

    Raises:
        BadInputError: It does not begin with "lerobot:", or its episode is no number.
    """
    if not source.startswith(PREFIX):
        raise BadInputError(f"a recording is {_FORM}; got {shown(source)}")
    named = source.removeprefix(PREFIX)
    folder, mark, episode = named.rpartition("#")
    if not mark or kind_of_path(expanded(named)) == "a folder":
        folder, episode = named, ""
    elif not (episode.isascii() and episode.isdigit() and len(episode) <= _MOST_DIGITS):
        raise BadInputError(f"an episode is a number, as in {PREFIX}DIR#3; got {shown(source)}")
    if not folder:
        raise BadInputError(f"a recording is {_FORM}; got {shown(source)}")
    return _path_of(folder), int(episode) if episode else None


def _path_of(folder: str) -> Path:
    """Return the folder that a word names, which may be a data set that LeRobot keeps."""
    if folder == SYNTHETIC:
        return _SYNTHETIC_FOLDER
    path = expanded(folder)
    if kind_of_path(path) == "nothing":
        return kept_data_set(folder) or path
    return path


def _joints_of(data_set: LerobotDataSet, model: Model, names: Mapping[str, str]) -> tuple[str, ...]:
    """Return the model's joint of each column.

    Raises:
        BadInputError: A column has none, or a joint with an actuator has no column.
    """
    unused = [name for name in names if joint_name(name) not in data_set.names]
    if unused:
        hint = did_you_mean(unused[0], data_set.names, show=repr)
        known = ", ".join(data_set.names)
        raise BadInputError(f"the recording has no joint {shown(unused[0])}; it has {known}{hint}")
    renamed = {joint_name(name): joint for name, joint in names.items()}
    joints = tuple(renamed.get(name, name) for name in data_set.names)
    for name, joint in zip(data_set.names, joints, strict=True):
        if joint not in model.joint_names:
            hint = did_you_mean(joint, model.joint_names, show=repr)
            known = ", ".join(model.joint_names)
            raise BadInputError(
                f"the model has no joint {shown(joint)} for {name} of the recording; it has "
                f"{known}{hint}"
            )
        if model.jnt_type[model.joint_id(joint)] != JointType.HINGE:
            raise BadInputError(f"joint {joint} of the model is not a hinge")
        if joints.count(joint) > 1:
            raise BadInputError(f"two joints of the recording are {joint} of the model")
    for joint in (int(each) for each in model.actuator_jntid if each >= 0):
        if model.joint_names[joint] not in joints:
            raise BadInputError(
                f"the recording has no joint for {model.joint_names[joint]} of the model; it has "
                f"{', '.join(data_set.names)}"
            )
    return joints


def _measured_joints(
    data_set: LerobotDataSet, number: int, model: Model, joints: tuple[str, ...]
) -> list[MeasuredJoint]:
    """Return the values of each joint over the episode and the others of its data set."""
    others = [each for each in data_set.downloaded if each != number]
    episodes = (number, *others[: _MOST_EPISODES - 1])
    values = data_set.measured(episodes)
    measured: list[MeasuredJoint] = []
    for column, (name, joint) in enumerate(zip(data_set.names, joints, strict=True)):
        low, high = (float(end) for end in model.jnt_range[model.joint_id(joint)])
        measured.append(measured_joint(name, joint, values[:, column], (low, high)))
    return measured


def _recording(source: str, arm: _Arm, episode: LerobotEpisode) -> ArmRecording:
    """Return an episode with angles of the model's joints.

    Raises:
        BadInputError: A command is one that no servo reaches.
    """
    _check_reach(arm, episode)
    _check_commands(arm, episode)
    joints = tuple(unit.joint for unit in arm.units)
    action = _angles(arm.sent(episode.action), arm.units)
    recording = ArmRecording(
        source=source,
        episode=episode.number,
        fps=arm.data_set.fps,
        joints=joints,
        action=action,
        state=_angles(episode.state, arm.units),
        units=arm.units,
        robot=arm.data_set.robot,
    )
    _check_speeds(arm, recording)
    return recording


def _check_reach(arm: _Arm, episode: LerobotEpisode) -> None:
    """Refuse commands in degrees that are more than a turn away: they are no degrees."""
    in_degrees = np.array([unit.unit == "degrees" for unit in arm.units])
    beyond = np.argwhere((np.abs(episode.action) > _FURTHEST) & in_degrees)
    if len(beyond):
        frame, joint = (int(index) for index in beyond[0])
        raise BadInputError(
            f"{arm.data_set.folder}, episode {episode.number}: action of {arm.joints[joint].name} "
            f"is {episode.action[frame, joint]:g} in frame {frame}, where its measured values are "
            f"degrees: no servo turns that far. Is the action in another unit?"
        )


def _check_speeds(arm: _Arm, recording: ArmRecording) -> None:
    """Refuse measured angles that change faster than a servo can turn.

    Between two frames that is a count that went round its end, a damaged value, or a gap.
    """
    changes = np.abs(np.diff(recording.state, axis=0))
    too_fast = np.argwhere(changes * recording.fps > _FASTEST)
    if not len(too_fast):
        return
    frame, joint = (int(index) for index in too_fast[0])
    degrees = math.degrees(changes[frame, joint])
    raise BadInputError(
        f"{arm.data_set.folder}, episode {recording.episode}: {arm.joints[joint].name} turns by "
        f"{degrees:.0f}° from frame {frame} to {frame + 1}, {degrees * recording.fps:.0f}°/s, "
        "which no servo of this arm does: an encoder that went over its end, a damaged value, or "
        "frames that are missing"
    )


def _check_commands(arm: _Arm, episode: LerobotEpisode) -> None:
    """Refuse actions that are the measured values themselves, of the same frame or the next.

    An arm that is guided by hand is recorded so: what its servos were told is not known.
    """
    action, state = episode.action, episode.state
    same = bool((action == state).all())
    if same or bool((action[:-1] == state[1:]).all()):
        frame = "the same" if same else "the next"
        raise BadInputError(
            f"{arm.data_set.folder}, episode {episode.number}: each action is what was measured in "
            f"{frame} frame, as of an arm that is guided by hand: what its servos were told is not "
            "recorded"
        )


def _angles(values: Array, units: tuple[JointUnit, ...]) -> Array:
    """Return values as angles of the model's joints [rad]."""
    zeros = np.array([unit.zero for unit in units])
    scales = np.array([unit.radians for unit in units])
    return zeros + scales * values


def _moves(recording: ArmRecording) -> bool:
    return bool(np.ptp(recording.state, axis=0).max() > _MOVES)


def _held_out(source: str, arm: _Arm, number: int) -> ArmRecording | None:
    """Return the next episode in which the arm moves; after the last comes the first."""
    episodes = arm.data_set.downloaded
    here = episodes.index(number)
    for other in (*episodes[here + 1 :], *episodes[:here]):
        if arm.data_set.place(other).length < FEWEST_FRAMES:
            continue
        recording = _recording(source, arm, arm.data_set.episode(other))
        if _moves(recording):
            return recording
    return None
