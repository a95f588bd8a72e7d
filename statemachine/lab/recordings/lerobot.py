"""Data sets of LeRobot, version 3.0 (several episodes in a file) and 2.0 and 2.1 (one in each).

LeRobot itself is not needed. Its layout is in `lerobot/datasets/utils.py`: `meta/info.json` has
rate and names, `meta/episodes/chunk-*/file-*.parquet` or `meta/episodes.jsonl` the episodes, and
`data/` their frames.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Ints
from ...models import kind_of_path
from .lerobot_description import (
    ACTION,
    STATE,
    DataSetDescription,
    EpisodePlace,
    joint_name,
    read_description,
)
from .lerobot_files import read_columns

FEWEST_FRAMES = 30
_LATEST = 1e-3  # s, between a timestamp and frame / fps: float32 rounds to 0.1 ms after 30 minutes
_COLUMNS = ("episode_index", "frame_index", "timestamp", STATE, ACTION)


@dataclass(frozen=True, eq=False)
class LerobotEpisode:
    """Frames of an episode, in the unit of the file.

    Attributes:
        number: Its number in the data set.
        action: (K, n) what was commanded.
        state: (K, n) what was measured.
    """

    number: int
    action: Array
    state: Array


@dataclass(frozen=True)
class LerobotDataSet:
    """A data set whose description was read and checked.

    Attributes:
        description: What it says of itself.
    """

    description: DataSetDescription

    @property
    def folder(self) -> Path:
        """Return where it is."""
        return self.description.folder

    @property
    def fps(self) -> float:
        """Return its frames per second [1/s]."""
        return self.description.fps

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the joints: "shoulder_pan" of shoulder_pan.pos, main_shoulder_pan."""
        return tuple(joint_name(column) for column in self.description.columns)

    @property
    def robot(self) -> str:
        """Return the type of its robot; "" where it does not say."""
        return self.description.robot

    @property
    def has_old_zero(self) -> bool:
        """Tell whether it was recorded before LeRobot's calibration took the middle as zero.

        Columns were then named "main_shoulder_pan".
        """
        return all(column.startswith("main_") for column in self.description.columns)

    @property
    def episodes(self) -> tuple[int, ...]:
        """Return the numbers of the episodes, ascending."""
        return tuple(sorted(self.description.places))

    @property
    def downloaded(self) -> tuple[int, ...]:
        """Return the numbers of the episodes whose file is here, ascending."""
        places = self.description.places
        return tuple(
            number for number in self.episodes if kind_of_path(places[number].file) == "a file"
        )

    def place(self, number: int) -> EpisodePlace:
        """Return where an episode lies.

        Raises:
            BadInputError: There is no such episode; the message says which there are.
        """
        places = self.description.places
        if number not in places:
            raise BadInputError(
                f"{self.folder} has no episode {number}; it has {_ranges(self.episodes)}"
            )
        return places[number]

    def measured(self, numbers: Iterable[int]) -> Array:
        """Return the measured values of some episodes, (rows, n), in the unit of the file.

        Nothing of them is checked but that they are numbers.

        Raises:
            BadInputError: A file is not there, or damaged, or has columns of another width.
            MissingEngineError: pyarrow is not installed.
        """
        chosen = sorted(set(numbers))
        parts: list[Array] = []
        for file in dict.fromkeys(self.place(number).file for number in chosen):
            columns = read_columns(file, ("episode_index", STATE))
            rows = np.isin(columns.integers("episode_index"), chosen)
            parts.append(columns.lists(STATE, len(self.names))[rows])
        return np.concatenate(parts)

    def episode(self, number: int) -> LerobotEpisode:
        """Return the frames of an episode.

        Raises:
            BadInputError: There is no such episode, or it has too few frames, or they are missing,
                out of order or not finite, or its file is not there or damaged.
            MissingEngineError: pyarrow is not installed.
        """
        place = self.place(number)
        columns = read_columns(place.file, _COLUMNS)
        rows = columns.integers("episode_index") == number
        self._check_frames(place, columns.integers("frame_index")[rows])
        self._check_times(place, columns.numbers("timestamp")[rows])
        action = columns.lists(ACTION, len(self.names))[rows]
        state = columns.lists(STATE, len(self.names))[rows]
        self._check_finite(place, ACTION, action)
        self._check_finite(place, STATE, state)
        return LerobotEpisode(number, action, state)

    def _check_frames(self, place: EpisodePlace, frames: Ints) -> None:
        episode = f"{self.folder}, episode {place.number}"
        if len(frames) != place.length:
            raise BadInputError(
                f"{episode}: {place.file.name} has {len(frames)} frames of it, and meta/ states "
                f"{place.length}: frames are missing, or too many"
            )
        if len(frames) < FEWEST_FRAMES:
            raise BadInputError(
                f"{episode} has {len(frames)} frames; at least {FEWEST_FRAMES} are needed"
            )
        wrong = np.flatnonzero(frames != np.arange(len(frames)))
        if len(wrong):
            raise BadInputError(
                f"{episode}: frames are missing or out of order: frame_index is "
                f"{int(frames[wrong[0]])} where {int(wrong[0])} is expected"
            )

    def _check_times(self, place: EpisodePlace, times: Array) -> None:
        expected = np.arange(len(times)) / self.fps
        wrong = np.flatnonzero(~(np.abs(times - expected) <= _LATEST))  # of NaN, too
        if len(wrong):
            first = int(wrong[0])
            raise BadInputError(
                f"{self.folder}, episode {place.number}: timestamp is {float(times[first]):.4f} s "
                f"in frame {first}, where frame / fps is {float(expected[first]):.4f} s"
            )

    def _check_finite(self, place: EpisodePlace, name: str, values: Array) -> None:
        wrong = np.argwhere(~np.isfinite(values))
        if len(wrong):
            frame, joint = (int(index) for index in wrong[0])
            raise BadInputError(
                f"{self.folder}, episode {place.number}: {name} of {self.names[joint]} is "
                f"{values[frame, joint]:g} in frame {frame}"
            )


def open_data_set(folder: Path) -> LerobotDataSet:
    """Open a data set; frames are read when they are asked for.

    Raises:
        BadInputError: There is no such folder, or it is no data set, or of another version.
        MissingEngineError: Version 3.0, and pyarrow is not installed.
    """
    return LerobotDataSet(read_description(folder))


def _ranges(numbers: tuple[int, ...]) -> str:
    """Return numbers as text: "0 to 3, 7"."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and parts[-1][-1] == number - 1:
            parts[-1] = [parts[-1][0], number]
        else:
            parts.append([number])
    return ", ".join(" to ".join(map(str, part)) for part in parts)
