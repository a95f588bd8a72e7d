"""Data sets that LeRobot keeps, by their names at Hugging Face."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

import statemachine as sm
from statemachine.errors import BadInputError
from statemachine.lab.recordings.arm_recording import DESCRIPTION
from statemachine.lab.recordings.arm_source import folder_and_episode, read_arm_recordings
from statemachine.lab.recordings.lerobot_cache import kept_data_set

from .support.arm_data_sets import data_set, servos, written

pytest.importorskip("pyarrow")


@pytest.fixture(scope="module")
def arm() -> sm.Model:
    return sm.load("so101")


def _kept_as_recorded(home: Path) -> None:
    written(home / "somebody" / "pushes.v1", data_set(servos("degrees")))


def _kept_as_downloaded(home: Path) -> None:
    snapshots = home / "hub" / "datasets--somebody--pushes.v1" / "snapshots"
    written(snapshots / "0123abc", data_set(servos("degrees")))


@pytest.mark.parametrize("kept", [_kept_as_recorded, _kept_as_downloaded])
@pytest.mark.parametrize(
    ("variable", "below"),
    [("HF_LEROBOT_HOME", ""), ("HF_HOME", "lerobot"), ("XDG_CACHE_HOME", "huggingface/lerobot")],
)
def test_a_data_set_that_lerobot_keeps_goes_by_its_name(
    kept: Callable[[Path], None],
    variable: str,
    below: str,
    arm: sm.Model,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for other in ("HF_LEROBOT_HOME", "HF_HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(other, raising=False)
    monkeypatch.setenv(variable, str(tmp_path))
    kept(tmp_path / below)
    assert read_arm_recordings("lerobot:somebody/pushes.v1#1", arm, None, {}).fitted.episode == 1


def test_of_two_downloads_the_later_one_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_LEROBOT_HOME", str(tmp_path))
    snapshots = tmp_path / "hub" / "datasets--somebody--pushes" / "snapshots"
    for revision, time in (("a", 2_000), ("b", 3_000), ("c", 1_000)):
        written(snapshots / revision, data_set(servos("degrees")))
        os.utime(snapshots / revision / DESCRIPTION, (time, time))
    assert kept_data_set("somebody/pushes") == snapshots / "b"


def test_a_folder_comes_before_what_lerobot_keeps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_LEROBOT_HOME", str(tmp_path / "home"))
    for home in (tmp_path / "home", tmp_path):
        written(home / "somebody" / "pushes", data_set(servos("degrees")))
    monkeypatch.chdir(tmp_path)
    assert folder_and_episode("lerobot:somebody/pushes") == (Path("somebody/pushes"), None)


@pytest.mark.parametrize("name", ["somebody/pushes", "no/name/of/one"])
def test_where_no_data_set_is_it_is_told_where_lerobot_keeps_them(
    name: str, arm: sm.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_LEROBOT_HOME", str(tmp_path))
    with pytest.raises(BadInputError, match=f"no folder {name}, .*{tmp_path}"):
        read_arm_recordings(f"lerobot:{name}#3", arm, None, {})
