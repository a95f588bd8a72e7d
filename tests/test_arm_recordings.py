"""Recordings of an arm in data sets of LeRobot: what is read, and what is refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError, MissingEngineError
from statemachine.lab.recordings.arm_recording import ArmRecordings
from statemachine.lab.recordings.arm_source import read_arm_recordings
from statemachine.lab.recordings.lerobot_files import MOST_ROWS, read_columns
from statemachine.lab.recordings.robot_types import is_so_arm

from .support.arm_data_sets import (
    COUNT,
    COUNTS,
    JOINTS,
    calibration_file,
    data_set,
    frames_of,
    moved_counts,
    servos,
    with_state,
    written,
)

pytest.importorskip("pyarrow")
DEGREES = servos("degrees")
INFO, LINES = Path("meta") / "info.json", Path("meta") / "episodes.jsonl"
V3_DATA = Path("data") / "chunk-000" / "file-000.parquet"
V2_DATA = Path("data") / "chunk-000" / "episode_000001.parquet"


@pytest.fixture(scope="module")
def arm() -> sm.Model:
    return sm.load("so101")


def recordings(source: str, arm: sm.Model, **names: str) -> ArmRecordings:
    """Return what a source has, without a calibration."""
    return read_arm_recordings(source, arm, None, names)


def set_info(folder: Path, **values: Any) -> None:
    """Change meta/info.json."""
    info = json.loads((folder / INFO).read_text("utf-8"))
    (folder / INFO).write_text(json.dumps({**info, **values}), "utf-8")


def set_names(folder: Path, feature: str, names: object) -> None:
    """Change the names of a feature in meta/info.json."""
    info = json.loads((folder / INFO).read_text("utf-8"))
    info["features"][feature]["names"] = names
    (folder / INFO).write_text(json.dumps(info), "utf-8")


def set_columns(path: Path, **columns: Any) -> None:
    """Change columns of a parquet file."""
    import pyarrow as pa
    from pyarrow import parquet

    table = parquet.read_table(path)
    for name, values in columns.items():
        index = table.column_names.index(name)
        table = table.set_column(index, name, pa.array(values, table.schema.field(name).type))
    parquet.write_table(table, path)


# What is read.


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
@pytest.mark.parametrize("unit", ["degrees", "-100 to 100"])
def test_measured_counts_come_back_as_angles(
    version: Any, unit: str, arm: sm.Model, tmp_path: Path
) -> None:
    each = servos(unit)
    source = written(tmp_path, data_set(each), version)
    counts = moved_counts(each, seed=1)
    expected = (counts - [servo.middle for servo in each]) * COUNT
    expected[:, 5] = arm.jnt_range[5, 0] + (counts[:, 5] - each[5].range_min) * COUNT
    found = recordings(f"{source}#1", arm)
    np.testing.assert_allclose(found.fitted.state, expected, atol=1e-6)
    np.testing.assert_allclose(found.fitted.resolution, COUNT)
    assert found.fitted.joints == JOINTS


@pytest.mark.parametrize("version", ["v3.0", "v2.1"])
def test_the_next_episode_is_held_out_and_after_the_last_the_first(
    version: Any, arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, data_set(DEGREES, episodes=3), version)
    for number, following in ((0, 1), (1, 2), (2, 0)):
        found = recordings(f"{source}#{number}", arm)
        assert (found.fitted.episode, found.held_out.episode) == (number, following)


def test_of_one_episode_nothing_is_held_out(arm: sm.Model, tmp_path: Path) -> None:
    source = written(tmp_path, data_set(DEGREES, episodes=1))
    assert recordings(source, arm).held_out is None


def test_an_episode_in_which_the_arm_rests_is_not_held_out(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES, episodes=3)
    still = np.repeat(made.episodes[1].state[:1], 120, axis=0)
    source = written(tmp_path, with_state(made, still, episode=1))
    assert recordings(source, arm).held_out.episode == 2


def test_an_episode_that_is_too_short_is_not_held_out(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES, episodes=3)
    short = frames_of(DEGREES, moved_counts(DEGREES, frames=20))
    made = replace(made, episodes=[made.episodes[0], short, made.episodes[2]])
    assert recordings(written(tmp_path, made), arm).held_out.episode == 2


def test_an_episode_that_was_not_downloaded_is_not_held_out(arm: sm.Model, tmp_path: Path) -> None:
    source = written(tmp_path, data_set(DEGREES, episodes=3), "v2.1")
    (tmp_path / V2_DATA).unlink()
    found = recordings(source, arm)
    assert (found.fitted.episode, found.held_out.episode) == (0, 2)


def test_lists_of_any_length_are_read_as_those_of_a_fixed_length(
    arm: sm.Model, tmp_path: Path
) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    source = written(tmp_path, data_set(DEGREES))
    expected = recordings(source, arm).fitted.state
    table = parquet.read_table(tmp_path / V3_DATA)
    for name in ("action", "observation.state"):
        lists = table[name].cast(pa.list_(pa.float32()))
        table = table.set_column(table.column_names.index(name), name, lists)
    parquet.write_table(table, tmp_path / V3_DATA)
    np.testing.assert_array_equal(recordings(source, arm).fitted.state, expected)


def test_old_names_of_columns_are_those_of_the_joints(arm: sm.Model, tmp_path: Path) -> None:
    old = tuple(f"main_{joint}" for joint in JOINTS)
    source = written(tmp_path, replace(data_set(DEGREES), columns=old), "v2.1")
    fitted = recordings(source, arm).fitted
    assert fitted.joints == JOINTS
    assert fitted.units[2].zero == -np.pi / 2


def test_names_under_motors_are_read(arm: sm.Model, tmp_path: Path) -> None:
    source = written(tmp_path, data_set(DEGREES), "v2.1")
    for feature in ("action", "observation.state"):
        set_names(tmp_path, feature, {"motors": list(JOINTS)})
    assert recordings(source, arm).fitted.joints == JOINTS


def test_a_joint_with_another_name_in_the_model_is_named(arm: sm.Model, tmp_path: Path) -> None:
    columns = ("base_yaw.pos", *(f"{joint}.pos" for joint in JOINTS[1:]))
    source = written(tmp_path, replace(data_set(DEGREES), columns=columns))
    assert recordings(source, arm, base_yaw="shoulder_pan").fitted.joints == JOINTS


def test_commands_are_truncated_to_counts_as_they_were_sent(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES)
    first = made.episodes[0]
    half_a_count = 0.5 * 360 / 4095
    told = replace(first, action=first.state + half_a_count)
    source = written(tmp_path, replace(made, episodes=[told, made.episodes[1]]))
    fitted = recordings(source, arm).fitted
    np.testing.assert_allclose(fitted.action[:, :5], fitted.state[:, :5], atol=1e-6)


def test_commands_that_drive_mode_inverts_are_truncated_the_other_way(
    arm: sm.Model, tmp_path: Path
) -> None:
    each = tuple(replace(servo, drive_mode=1) for servo in servos("-100 to 100"))
    counts = moved_counts(each)
    between = frames_of(each, counts + 0.5).state
    told = replace(frames_of(each, counts), action=between)
    source = written(tmp_path / "data", replace(data_set(each), episodes=[told]))
    file = calibration_file(tmp_path, each)
    fitted = read_arm_recordings(source, arm, file, {}).fitted
    np.testing.assert_allclose(fitted.action, fitted.state, atol=1e-6)


def test_commands_beyond_the_range_are_sent_as_its_end(arm: sm.Model, tmp_path: Path) -> None:
    each = servos("-100 to 100")
    made = data_set(each, episodes=1)
    told = replace(made.episodes[0], action=np.full((120, 6), 130.0))
    fitted = recordings(written(tmp_path, replace(made, episodes=[told])), arm).fitted
    upper = [0.5 * number * COUNT for number in COUNTS[:5]]
    np.testing.assert_allclose(fitted.action[:, :5], np.tile(upper, (120, 1)), atol=1.01 * COUNT)


def test_a_command_on_a_count_stays_there(arm: sm.Model, tmp_path: Path) -> None:
    each = servos("-100 to 100")
    made = data_set(each)
    first = made.episodes[0]
    told = replace(first, action=np.roll(first.state, 7, axis=0))
    source = written(tmp_path, replace(made, episodes=[told, made.episodes[1]]))
    fitted = recordings(source, arm).fitted
    np.testing.assert_allclose(fitted.action, np.roll(fitted.state, 7, axis=0), atol=1e-9)


def test_several_files_of_version_3_are_one_data_set(arm: sm.Model, tmp_path: Path) -> None:
    from pyarrow import parquet

    source = written(tmp_path, data_set(DEGREES))
    table = parquet.read_table(tmp_path / V3_DATA)
    parquet.write_table(table.slice(0, 120), tmp_path / V3_DATA)
    parquet.write_table(table.slice(120), (tmp_path / V3_DATA).with_name("file-001.parquet"))
    meta = tmp_path / "meta" / "episodes" / "chunk-000" / "file-000.parquet"
    set_columns(meta, **{"data/file_index": [0, 1]})
    found = recordings(source, arm)
    assert (found.fitted.episode, found.held_out.episode) == (0, 1)


SO_ARMS = ["so101_follower", "so100", "so100_follower_end_effector", "so_follower", "so101_sim"]


@pytest.mark.parametrize("robot", [*SO_ARMS, "my_own_arm"])
def test_the_robot_is_that_of_the_data_set(robot: str, arm: sm.Model, tmp_path: Path) -> None:
    source = written(tmp_path, replace(data_set(DEGREES), robot=robot))
    assert recordings(source, arm).fitted.robot == robot
    assert is_so_arm(robot) == (robot in SO_ARMS)


@pytest.mark.parametrize("robot", [None, "unknown"])
def test_a_data_set_may_not_say_which_robot_it_is_of(
    robot: str | None, arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, data_set(DEGREES))
    set_info(tmp_path, robot_type=robot)
    assert recordings(source, arm).fitted.robot == ""


@pytest.mark.parametrize("robot", ["koch_follower", "koch", "aloha", "bi_so101_follower", "moss"])
def test_another_arm_with_joints_of_the_same_names_is_refused(
    robot: str, arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, replace(data_set(DEGREES), robot=robot))
    with pytest.raises(BadInputError, match=f"of a {robot} .* another arm"):
        recordings(source, arm)


def test_another_arm_is_read_with_a_model_of_its_own(arm: sm.Model, tmp_path: Path) -> None:
    shutil.copytree(arm.path.parent, tmp_path / "so101")
    file = tmp_path / "so101" / "koch.xml"
    (tmp_path / "so101" / arm.path.name).rename(file)
    source = written(tmp_path / "recorded", replace(data_set(DEGREES), robot="koch_follower"))
    assert recordings(source, sm.load(file)).fitted.robot == "koch_follower"


# What is refused, in one clear error.


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("DIR", "a recording is lerobot:DIR"),
        ("lerobot:", "a recording is lerobot:DIR"),
        ("lerobot:#3", "a recording is lerobot:DIR"),
        ("lerobot:DIR#three", "an episode is a number"),
        ("lerobot:DIR#-1", "an episode is a number"),
        ("lerobot:DIR#0-2", "an episode is a number"),
        ("lerobot:DIR#" + 5000 * "1", "an episode is a number"),
        ("lerobot:nowhere/at/all", "there is no folder"),
        ("lerobot:~nobody-of-that-name/x", "there is no folder ~nobody-of-that-name/x"),
        ("lerobot:" + 300 * "a", "there is no folder"),
    ],
)
def test_words_that_name_no_recording_are_refused(source: str, message: str, arm: sm.Model) -> None:
    with pytest.raises(BadInputError, match=message):
        recordings(source, arm)


def test_a_file_in_place_of_a_folder_is_refused(arm: sm.Model, tmp_path: Path) -> None:
    (tmp_path / "x").write_text("")
    with pytest.raises(BadInputError, match="takes the folder of a data set"):
        recordings(f"lerobot:{tmp_path / 'x'}", arm)


def _lfs_pointer(path: Path) -> None:
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 3\n", "utf-8")


def _truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


V3_FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "no meta": (lambda d: (d / INFO).unlink(), "has no meta/info.json"),
    "no json": (lambda d: (d / INFO).write_text("{"), "is not JSON"),
    "a list": (lambda d: (d / INFO).write_text("[]"), "not an object of JSON"),
    "version": (lambda d: set_info(d, codebase_version="v1.6"), "known: v2.0, v2.1, v3.0"),
    "no version": (lambda d: set_info(d, codebase_version=None), "codebase_version is None"),
    "fps 0": (lambda d: set_info(d, fps=0), "fps must be positive; got 0"),
    "fps below 0": (lambda d: set_info(d, fps=-30), "fps must be positive; got -30"),
    "fps of 400 digits": (
        lambda d: set_info(d, fps=10**400),
        r"fps is 10+\.\.\., and at most 1000",
    ),
    "fps no number": (lambda d: set_info(d, fps=float("nan")), "fps must be positive; got nan"),
    "fps text": (lambda d: set_info(d, fps="30"), "fps is '30', not a number"),
    "no features": (lambda d: set_info(d, features={}), "features has no observation.state"),
    "no names": (lambda d: set_names(d, "action", None), "action has no names"),
    "fewer names": (
        lambda d: set_names(d, "action", ["gripper.pos"]),
        "observation.state has 6 numbers and action has 1",
    ),
    "other names": (
        lambda d: set_names(d, "action", [*JOINTS[:4], "gripper", "wrist_roll"]),
        "the same joints in the same order",
    ),
    "a name twice": (
        lambda d: [set_names(d, f, ["gripper"] * 6) for f in ("action", "observation.state")],
        "'gripper.pos' twice|'gripper' twice",
    ),
    "no episodes": (
        lambda d: (d / "meta/episodes/chunk-000/file-000.parquet").unlink(),
        "has no meta/episodes",
    ),
    "no data": (lambda d: (d / V3_DATA).unlink(), "there is no file"),
    "truncated": (lambda d: _truncated(d / V3_DATA), "is not a whole parquet file"),
    "pointer": (lambda d: _lfs_pointer(d / V3_DATA), "git lfs pull"),
    "pointer of info": (lambda d: _lfs_pointer(d / INFO), "git lfs pull"),
    "a frame twice": (
        lambda d: set_columns(d / V3_DATA, frame_index=[0, *range(119), *range(120)]),
        "frame_index is 0 where 1 is expected",
    ),
    "out of order": (
        lambda d: set_columns(d / V3_DATA, frame_index=[1, 0, *range(2, 120), *range(120)]),
        "frame_index is 1 where 0 is expected",
    ),
    "timestamps": (
        lambda d: set_columns(d / V3_DATA, timestamp=np.arange(240) / 25.0),
        "timestamp is 0.0400 s in frame 1, where frame / fps is 0.0333 s",
    ),
    "fewer frames than stated": (
        lambda d: set_columns(d / V3_DATA, episode_index=[0] * 100 + [1] * 140),
        "has 100 frames of it, and meta/ states 120",
    ),
    "a frame without a number": (
        lambda d: set_columns(d / V3_DATA, timestamp=[None, *np.arange(239) / 30.0]),
        "has rows without a number",
    ),
    "no column": (
        lambda d: _without_column(d / V3_DATA, "timestamp"),
        "has no column timestamp",
    ),
    "rows of several lengths": (
        lambda d: _with_ragged_lists(d / V3_DATA, "observation.state"),
        "column observation.state has more numbers in some rows than in others",
    ),
    "frame_index of text": (
        lambda d: _with_text(d / V3_DATA, "frame_index"),
        "does not hold whole numbers",
    ),
}


def _without_column(path: Path, name: str) -> None:
    from pyarrow import parquet

    parquet.write_table(parquet.read_table(path).drop_columns([name]), path)


def _with_ragged_lists(path: Path, name: str) -> None:
    """Move a number from a row to the one before."""
    import pyarrow as pa
    from pyarrow import parquet

    table = parquet.read_table(path)
    rows = table[name].to_pylist()
    rows[3] = [*rows[3], rows[4].pop(0)]
    ragged = pa.array(rows, pa.list_(pa.float32()))
    parquet.write_table(table.set_column(table.column_names.index(name), name, ragged), path)


def _with_text(path: Path, name: str) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    table = parquet.read_table(path)
    text = pa.array(["a"] * table.num_rows)
    parquet.write_table(table.set_column(table.column_names.index(name), name, text), path)


@pytest.mark.parametrize("fault", V3_FAULTS)
def test_a_fault_of_a_data_set_of_version_3_is_named(
    fault: str, arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, data_set(DEGREES))
    damage, message = V3_FAULTS[fault]
    damage(tmp_path)
    with pytest.raises(BadInputError, match=message):
        recordings(source, arm)


V2_FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "no episodes": (lambda d: (d / LINES).unlink(), "has no meta/episodes.jsonl"),
    "empty": (lambda d: (d / LINES).write_text(""), "has no episode"),
    "no json": (lambda d: (d / LINES).write_text("{\n"), "is not JSON"),
    "no length": (lambda d: (d / LINES).write_text('{"episode_index": 1}\n'), "length is None"),
    "no data": (lambda d: (d / V2_DATA).unlink(), "there is no file"),
    "chunks": (lambda d: set_info(d, chunks_size=0), "chunks_size is 0"),
}


def test_rows_with_fewer_numbers_than_names_are_refused(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES)
    first = made.episodes[0]
    narrow = replace(first, state=first.state[:, 1:], action=first.action[:, 1:])
    source = written(tmp_path, replace(made, episodes=[narrow, narrow]))
    with pytest.raises(BadInputError, match="does not hold 6 numbers in every frame"):
        recordings(source, arm)


@pytest.mark.parametrize("fault", V2_FAULTS)
def test_a_fault_of_a_data_set_of_version_2_is_named(
    fault: str, arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, data_set(DEGREES), "v2.1")
    damage, message = V2_FAULTS[fault]
    damage(tmp_path)
    with pytest.raises(BadInputError, match=message):
        recordings(f"{source}#1", arm)


def test_an_episode_that_is_not_there_is_refused_with_those_that_are(
    arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, data_set(DEGREES, episodes=3))
    with pytest.raises(BadInputError, match="has no episode 7; it has 0 to 2"):
        recordings(f"{source}#7", arm)


@pytest.mark.parametrize("column", ["action", "observation.state"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_named(
    column: str, value: float, arm: sm.Model, tmp_path: Path
) -> None:
    made = data_set(DEGREES)
    first = made.episodes[0]
    damaged = np.array(first.action if column == "action" else first.state)
    damaged[17, 2] = value
    name = "action" if column == "action" else "state"
    episodes = [replace(first, **{name: damaged}), made.episodes[1]]
    source = written(tmp_path, replace(made, episodes=episodes))
    with pytest.raises(BadInputError, match=f"{column} of elbow_flex is {value:g} in frame 17"):
        recordings(source, arm)


def test_a_command_of_more_than_a_turn_is_refused(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES)
    first = made.episodes[0]
    far = np.array(first.action)
    far[17, 2] = 2048.0
    source = written(tmp_path, replace(made, episodes=[replace(first, action=far)]))
    with pytest.raises(BadInputError, match="action of elbow_flex is 2048 in frame 17"):
        recordings(source, arm)


@pytest.mark.parametrize("later", [0, 1])
def test_actions_that_are_what_was_measured_are_no_commands(
    later: int, arm: sm.Model, tmp_path: Path
) -> None:
    made = data_set(DEGREES)
    first = made.episodes[0]
    guided = replace(first, action=np.roll(first.state, -later, axis=0))
    source = written(tmp_path, replace(made, episodes=[guided]))
    with pytest.raises(BadInputError, match="guided by hand"):
        recordings(source, arm)


def test_an_encoder_that_goes_over_its_end_is_named_with_its_frame(
    arm: sm.Model, tmp_path: Path
) -> None:
    made = data_set(DEGREES)
    over = np.array(made.episodes[0].state)
    over[60:, 4] -= 4096 * 360 / 4095
    with pytest.raises(BadInputError, match=r"wrist_roll turns by 3..° from frame 59 to 60"):
        recordings(written(tmp_path, with_state(made, over)), arm)


def test_a_change_that_a_fast_servo_can_make_is_read(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES)
    turned = np.array(made.episodes[0].state)
    turned[60:, 4] += 340 * 360 / 4095  # counts: 900° a second
    state = recordings(written(tmp_path, with_state(made, turned)), arm).fitted.state
    assert state[60, 4] - state[59, 4] > np.radians(29.0)


def test_too_few_frames_are_refused(arm: sm.Model, tmp_path: Path) -> None:
    source = written(tmp_path, data_set(DEGREES, frames=29))
    with pytest.raises(BadInputError, match="has 29 frames; at least 30 are needed"):
        recordings(source, arm)


def test_an_arm_that_does_not_move_is_refused(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES)
    still = np.repeat(made.episodes[0].state[:1], 120, axis=0)
    source = written(tmp_path, with_state(made, still))
    with pytest.raises(BadInputError, match="does not move in episode 0"):
        recordings(source, arm)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ({"elbow": "elbow_flex"}, "the recording has no joint 'elbow'.* Did you mean 'elbow_flex'"),
        ({"elbow_flex": "elbow"}, "the model has no joint 'elbow' .* Did you mean 'elbow_flex'"),
        ({"elbow_flex": "gripper"}, "two joints of the recording are gripper"),
    ],
)
def test_names_that_do_not_fit_are_refused(
    names: dict[str, str], message: str, arm: sm.Model, tmp_path: Path
) -> None:
    source = written(tmp_path, data_set(DEGREES))
    with pytest.raises(BadInputError, match=message):
        recordings(source, arm, **names)


def test_a_joint_of_the_model_that_was_not_recorded_is_named(arm: sm.Model, tmp_path: Path) -> None:
    made = data_set(DEGREES)
    episodes = [
        replace(frames, state=frames.state[:, 1:], action=frames.action[:, 1:])
        for frames in made.episodes
    ]
    source = written(tmp_path, replace(made, columns=made.columns[1:], episodes=episodes))
    with pytest.raises(BadInputError, match="no joint for shoulder_pan of the model"):
        recordings(source, arm)


def test_a_joint_that_is_no_hinge_is_refused(tmp_path: Path) -> None:
    box = sm.load("so101/scene_box")
    free = next(name for name in box.joint_names if name not in JOINTS)
    source = written(tmp_path, data_set(DEGREES))
    with pytest.raises(BadInputError, match="is not a hinge"):
        recordings(source, box, shoulder_pan=free)


def test_more_rows_than_an_arm_ever_records_are_refused(tmp_path: Path) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    path = tmp_path / "long.parquet"
    parquet.write_table(pa.table({"frame_index": np.zeros(MOST_ROWS + 1, dtype=np.int8)}), path)
    with pytest.raises(BadInputError, match="10,000,001 rows; at most 10,000,000"):
        read_columns(path, ("frame_index",))


def test_without_pyarrow_the_extra_is_named(
    arm: sm.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = written(tmp_path, data_set(DEGREES))
    monkeypatch.setitem(__import__("sys").modules, "pyarrow.parquet", None)
    with pytest.raises(MissingEngineError, match=r"pyarrow.*\[recordings\]"):
        recordings(source, arm)
