"""What a data set of LeRobot says of itself, read and checked: rate, names, episodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from ...errors import BadInputError, printable, shown
from ...models import kind_of_path
from .arm_recording import DESCRIPTION
from .lerobot_cache import is_name_of_data_set, lerobot_home
from .lerobot_files import parse_object, read_columns, read_text

STATE, ACTION = "observation.state", "action"
VERSIONS = ("v2.0", "v2.1", "v3.0")
_ONE_FILE_EACH = ("v2.0", "v2.1")
_CHUNK_SIZE = 1000  # episodes in a folder, where info.json does not say
_MOST_FPS = 1000.0  # no bus of servos is read as often


@dataclass(frozen=True)
class EpisodePlace:
    """Where an episode lies.

    Attributes:
        number: Its number in the data set.
        length: How many frames it has, as the data set states it.
        file: The parquet file of its frames.
    """

    number: int
    length: int
    file: Path


@dataclass(frozen=True)
class DataSetDescription:
    """What a data set says of itself.

    Attributes:
        folder: Where it is.
        version: Of its layout.
        fps: Frames per second [1/s].
        columns: (n,) names of the columns of state and action, as the file has them.
        places: Where each episode lies, by its number.
        robot: Type of the robot, such as "so101_follower"; "" where it does not say.
    """

    folder: Path
    version: str
    fps: float
    columns: tuple[str, ...]
    places: Mapping[int, EpisodePlace]
    robot: str


def joint_name(column: str) -> str:
    """Return the joint's name of a column: "gripper" of gripper.pos and of main_gripper."""
    return column.removesuffix(".pos").removeprefix("main_")


def read_description(folder: Path) -> DataSetDescription:
    """Read and check what a data set says of itself.

    Raises:
        BadInputError: There is no such folder, or it is no data set, or of another version.
        MissingEngineError: Version 3.0, and pyarrow is not installed.
    """
    kind = kind_of_path(folder)
    if kind == "nothing":
        raise _no_data_set(folder)
    if kind != "a folder":
        raise BadInputError(f"{folder} is {kind}; lerobot: takes the folder of a data set")
    path = folder / DESCRIPTION
    if not path.is_file():
        raise BadInputError(f"{folder} has no {DESCRIPTION}: it is not a data set of LeRobot")
    info = parse_object(read_text(path), path)
    version = info.get("codebase_version")
    if not isinstance(version, str) or version not in VERSIONS:
        raise BadInputError(
            f"{path}: codebase_version is {shown(version)}; known: {', '.join(VERSIONS)}"
        )
    fps = _checked_fps(info.get("fps"), path)
    columns = _checked_columns(info.get("features"), path)
    robot = _checked_robot(info.get("robot_type"), path)
    if version in _ONE_FILE_EACH:
        places = _places_of_lines(folder, info.get("chunks_size", _CHUNK_SIZE))
    else:
        places = _places_of_tables(folder)
    if not places:
        raise BadInputError(f"{folder} has no episode")
    return DataSetDescription(folder, version, fps, columns, places, robot)


def _no_data_set(folder: Path) -> BadInputError:
    """Return the error of a folder that is not there, which says where else was looked."""
    home = lerobot_home()
    if is_name_of_data_set(str(folder)):
        looked = f"nor a data set of that name in {home}, where LeRobot keeps them"
    else:
        looked = f"and a data set that LeRobot keeps in {home} is named as lerobot:USER/NAME"
    return BadInputError(
        f"there is no folder {folder}, {looked}; lerobot:synthetic is the recording that comes "
        "with this package"
    )


def _checked_robot(robot: object, path: Path) -> str:
    """Return the type of the robot; "" where there is none, or LeRobot did not know it."""
    if robot is None or robot == "unknown":
        return ""
    if not isinstance(robot, str) or printable(robot) != robot:
        raise BadInputError(f"{path}: robot_type is {shown(robot)}, which is no word")
    return robot


def _checked_fps(fps: object, path: Path) -> float:
    if isinstance(fps, bool) or not isinstance(fps, int | float):
        raise BadInputError(f"{path}: fps is {shown(fps)}, not a number")
    if not fps > 0.0:  # of NaN, too
        raise BadInputError(f"{path}: fps must be positive; got {fps:g}")
    if fps > _MOST_FPS:
        raise BadInputError(f"{path}: fps is {shown(fps)}, and at most {_MOST_FPS:g} are read")
    return float(fps)


def _checked_columns(features: object, path: Path) -> tuple[str, ...]:
    """Return the names of the columns of state and action, which are the same."""
    state = _names_of_feature(features, STATE, path)
    action = _names_of_feature(features, ACTION, path)
    if len(state) != len(action):
        raise BadInputError(
            f"{path}: {STATE} has {len(state)} numbers and {ACTION} has {len(action)}; both "
            "must be of the same joints"
        )
    for measured, commanded in zip(state, action, strict=True):
        if joint_name(measured) != joint_name(commanded):
            raise BadInputError(
                f"{path}: {STATE} has {shown(measured)} where {ACTION} has {shown(commanded)}; "
                "both must be of the same joints in the same order"
            )
    joints = [joint_name(column) for column in state]
    for joint in joints:
        if joints.count(joint) > 1:
            raise BadInputError(f"{path}: {STATE} has {shown(joint)} twice")
    return state


def _names_of_feature(features: object, feature: str, path: Path) -> tuple[str, ...]:
    """Return the names of a feature: a list, or a mapping with one list, as of "motors"."""
    described: object = None
    if isinstance(features, dict):
        described = cast("dict[str, object]", features).get(feature)
    if not isinstance(described, dict):
        raise BadInputError(f"{path}: features has no {feature}")
    names = cast("dict[str, object]", described).get("names")
    if isinstance(names, dict):
        lists = list(cast("dict[str, object]", names).values())
        names = lists[0] if len(lists) == 1 else None
    if not isinstance(names, list) or not names:
        raise BadInputError(f"{path}: {feature} has no names: which column is which joint?")
    for name in cast("list[object]", names):
        if not isinstance(name, str) or printable(name) != name:
            raise BadInputError(f"{path}: {feature} has a name {shown(name)}, which is no word")
    return tuple(cast("list[str]", names))


def _places_of_lines(folder: Path, chunk_size: object) -> dict[int, EpisodePlace]:
    """Return where each episode of version 2 lies, as meta/episodes.jsonl states."""
    path = folder / "meta" / "episodes.jsonl"
    if not path.is_file():
        raise BadInputError(f"{folder} has no meta/episodes.jsonl, which version 2 has")
    size = _whole(chunk_size, "chunks_size", folder / DESCRIPTION)
    if size == 0:
        raise BadInputError(f"{folder}/meta/info.json: chunks_size is 0")
    places: dict[int, EpisodePlace] = {}
    for line in read_text(path).splitlines():
        if not line.strip():
            continue
        described = parse_object(line, path)
        number = _whole(described.get("episode_index"), "episode_index", path)
        length = _whole(described.get("length"), "length", path)
        file = folder / "data" / f"chunk-{number // size:03d}" / f"episode_{number:06d}.parquet"
        places[number] = EpisodePlace(number, length, file)
    return places


def _places_of_tables(folder: Path) -> dict[int, EpisodePlace]:
    """Return where each episode of version 3 lies, as the tables in meta/episodes state."""
    files = sorted((folder / "meta" / "episodes").glob("chunk-*/file-*.parquet"))
    if not files:
        raise BadInputError(
            f"{folder} has no meta/episodes/chunk-*/file-*.parquet, which version 3.0 has"
        )
    names = ("episode_index", "length", "data/chunk_index", "data/file_index")
    places: dict[int, EpisodePlace] = {}
    for path in files:
        table = read_columns(path, names)
        rows = zip(*(table.integers(name).tolist() for name in names), strict=True)
        for number, length, chunk, index in rows:
            file = folder / "data" / f"chunk-{chunk:03d}" / f"file-{index:03d}.parquet"
            places[number] = EpisodePlace(number, length, file)
    return places


def _whole(value: object, name: str, path: Path) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise BadInputError(f"{path}: {name} is {shown(value)}, not a whole number")
    return value
