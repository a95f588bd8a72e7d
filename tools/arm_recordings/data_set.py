"""A data set in LeRobot's layout: what its reader needs, no pictures and no statistics."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from statemachine.interface import Array

Version = Literal["v2.1", "v3.0"]
_CHUNK_SIZE = 1000
_V3 = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_V2 = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames of an episode, as a file holds them.

    Attributes:
        action: (K, n) what is commanded, in the unit of the file.
        state: (K, n) what is measured, in the unit of the file.
    """

    action: Array
    state: Array


@dataclass(frozen=True, eq=False)
class WrittenDataSet:
    """What is written as a data set.

    Attributes:
        columns: (n,) names of the columns, such as "shoulder_pan.pos".
        fps: Frames per second [1/s].
        episodes: Its episodes, of which the first is number 0.
        robot: Type of the robot, as LeRobot calls it.
        task: What is done, in words.
    """

    columns: tuple[str, ...]
    fps: int
    episodes: Sequence[Frames]
    robot: str = "so101_follower"
    task: str = "synthetic: simulated, not measured"


def write_data_set(folder: Path, data_set: WrittenDataSet, version: Version = "v3.0") -> None:
    """Write a data set; all episodes in one file in version 3.0, each in its own in 2.1."""
    (folder / "meta").mkdir(parents=True, exist_ok=True)
    info = json.dumps(_info(data_set, version), indent=4) + "\n"
    (folder / "meta" / "info.json").write_text(info, encoding="utf-8")
    tables: list[pa.Table] = []
    start = 0
    for number, frames in enumerate(data_set.episodes):
        tables.append(_table(frames, number, start, data_set.fps))
        start += len(frames.state)
    if version == "v3.0":
        _write_in_one_file(folder, data_set, tables)
    else:
        _write_in_files(folder, data_set, tables)


def _write_in_one_file(folder: Path, data_set: WrittenDataSet, tables: list[pa.Table]) -> None:
    _write(pa.concat_tables(tables), folder / "data" / "chunk-000" / "file-000.parquet")
    lengths = np.array([len(frames.state) for frames in data_set.episodes])
    ends = np.cumsum(lengths)
    zeros = np.zeros(len(lengths), dtype=np.int64)
    episodes = {
        "episode_index": np.arange(len(lengths)),
        "tasks": [[data_set.task]] * len(lengths),
        "length": lengths,
        "data/chunk_index": zeros,
        "data/file_index": zeros,
        "dataset_from_index": ends - lengths,
        "dataset_to_index": ends,
        "meta/episodes/chunk_index": zeros,
        "meta/episodes/file_index": zeros,
    }
    _write(pa.table(episodes), folder / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
    tasks = pa.table({"task_index": np.array([0]), "task": [data_set.task]})
    _write(tasks, folder / "meta" / "tasks.parquet")


def _write_in_files(folder: Path, data_set: WrittenDataSet, tables: list[pa.Table]) -> None:
    lines: list[str] = []
    for number, table in enumerate(tables):
        chunk = number // _CHUNK_SIZE
        _write(table, folder / _V2.format(episode_chunk=chunk, episode_index=number))
        described = {"episode_index": number, "tasks": [data_set.task], "length": table.num_rows}
        lines.append(json.dumps(described) + "\n")
    (folder / "meta" / "episodes.jsonl").write_text("".join(lines), encoding="utf-8")
    task = json.dumps({"task_index": 0, "task": data_set.task}) + "\n"
    (folder / "meta" / "tasks.jsonl").write_text(task, encoding="utf-8")


def _table(frames: Frames, number: int, start: int, fps: int) -> pa.Table:
    count = len(frames.state)
    index = np.arange(count)
    return pa.table(
        {
            "action": _lists(frames.action),
            "observation.state": _lists(frames.state),
            "timestamp": (index / fps).astype(np.float32),
            "frame_index": index,
            "episode_index": np.full(count, number),
            "index": start + index,
            "task_index": np.zeros(count, dtype=np.int64),
        }
    )


def _lists(values: Array) -> pa.Array:
    flat = pa.array(np.ascontiguousarray(values, dtype=np.float32).reshape(-1))
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


def _write(table: pa.Table, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path, compression="zstd")


def _info(data_set: WrittenDataSet, version: Version) -> dict[str, Any]:
    width = len(data_set.columns)
    joints = {"dtype": "float32", "names": list(data_set.columns), "shape": [width]}
    features: dict[str, Any] = {"action": joints, "observation.state": joints}
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    for name in ("frame_index", "episode_index", "index", "task_index"):
        features[name] = {"dtype": "int64", "shape": [1], "names": None}
    return {
        "codebase_version": version,
        "robot_type": data_set.robot,
        "total_episodes": len(data_set.episodes),
        "total_frames": sum(len(frames.state) for frames in data_set.episodes),
        "total_tasks": 1,
        "chunks_size": _CHUNK_SIZE,
        "fps": data_set.fps,
        "splits": {"train": f"0:{len(data_set.episodes)}"},
        "data_path": f"data/{_V3}" if version == "v3.0" else _V2,
        "features": features,
    }
