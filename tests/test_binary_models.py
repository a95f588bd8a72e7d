"""Binary models: ours are read, and any other only where the user says so."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import binary
from statemachine.errors import EngineWarning, ModelError

from .conftest import Cli, after, in_its_own_python, need_engine, one_line, refused

LOAD = "import statemachine as sm; print(sm.load('arm.mjb').nq)"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the digests, of a user who has never saved a model."""
    monkeypatch.setenv("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME", str(tmp_path / "c"))
    monkeypatch.setattr(binary, "_trusted", set[str]())
    return tmp_path / "c" / "statemachine" / "binary-models"


@pytest.fixture
def strange(tmp_path: Path, cache: Path) -> Path:
    """A sound file that somebody else wrote."""
    file = tmp_path / "arm.mjb"
    mujoco.mj_saveModel(sm.load("so101").raw, str(file))
    return file


def _saved(folder: Path) -> Path:
    model: Any = sm.load("so101/scene_box")
    model.save_binary(folder / "arm.mjb")
    return folder / "arm.mjb"


def test_what_this_process_wrote_is_read(tmp_path: Path, cache: Path, mujoco_box: sm.Model) -> None:
    with warnings.catch_warnings(action="error"):
        model = sm.load(_saved(tmp_path))
    assert np.array_equal(after(mujoco_box, 20), after(model, 20))


def test_another_process_of_the_user_reads_it_too(tmp_path: Path, cache: Path) -> None:
    _saved(tmp_path)
    assert in_its_own_python(LOAD, tmp_path).stdout == "13\n"
    if os.name == "posix":
        assert cache.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_any_other_is_refused(strange: Path, backend: str) -> None:
    need_engine(backend)
    refused((ModelError, "trust_binary=True", lambda: sm.load(strange, backend=backend)))


def test_one_that_was_ours_is_refused_once_a_byte_is_another(tmp_path: Path, cache: Path) -> None:
    file = _saved(tmp_path)
    # The ids of bodies that geoms belong to are read as they are in the file.
    ids, whole = sm.load("so101/scene_box").raw.geom_bodyid, file.read_bytes()
    assert whole.count(ids.tobytes()) >= 1
    file.write_bytes(whole.replace(ids.tobytes(), np.full_like(ids, 2**30).tobytes()))
    refused((ModelError, "did not write", lambda: sm.load(file)))


@pytest.mark.skipif(os.name != "posix", reason="of modes and links")
@pytest.mark.parametrize("how", ["entered by others", "a link", "beside the file", "no home"])
def test_digests_count_only_from_a_folder_of_the_users_own(
    tmp_path: Path, cache: Path, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _saved(tmp_path)
    monkeypatch.setattr(binary, "_trusted", set[str]())
    monkeypatch.chdir(tmp_path)
    assert sm.load("arm.mjb").nq == 13
    if how == "entered by others":
        cache.chmod(0o770)
    elif how == "a link":
        cache.rename(tmp_path / "elsewhere")
        cache.symlink_to(tmp_path / "elsewhere")
    elif how == "beside the file":  # as an archive brings it
        monkeypatch.setenv("XDG_CACHE_HOME", "c")
        monkeypatch.setenv("HOME", str(tmp_path / "nobody"))
    else:
        (tmp_path / "c").rename(tmp_path / ".cache")
        monkeypatch.setenv("XDG_CACHE_HOME", "")
        monkeypatch.setattr(os.path, "expanduser", lambda path: path.removeprefix("~/"))
    refused((ModelError, "did not write", lambda: sm.load("arm.mjb")))


def test_a_cache_that_cannot_be_written_keeps_nobody_from_saving(
    tmp_path: Path, cache: Path
) -> None:
    (tmp_path / "c").write_text("a file")
    assert sm.load(_saved(tmp_path)).nq == 13


def test_any_other_is_read_when_asked_and_said_once(strange: Path) -> None:
    with pytest.warns(EngineWarning, match="is trusted"):
        assert sm.load(strange, trust_binary=True).nq == 6
    with warnings.catch_warnings(action="error"):
        assert sm.load(strange).nq == 6  # the same bytes, by what works on that model
    strange.write_bytes(strange.read_bytes() + b"\0")
    refused((ModelError, "did not write", lambda: sm.load(strange)))


def test_trust_is_of_one_process(strange: Path, cache: Path) -> None:
    with pytest.warns(EngineWarning):
        sm.load(strange, trust_binary=True)
    assert "did not write" in in_its_own_python(LOAD, strange.parent).stderr
    assert not cache.exists()


def test_a_broken_one_is_refused_though_it_is_trusted(tmp_path: Path, cache: Path) -> None:
    file = tmp_path / "bad.mjb"
    file.write_bytes(b"nonsense" * 10)
    with pytest.warns(EngineWarning), pytest.raises(ModelError, match="cannot read"):
        sm.load(file, trust_binary=True)


def test_commands_take_it_when_asked(
    strange: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(binary.TRUST, "")
    words = ["lesson", "state", "--model", str(strange)]
    one_line(here(*words), "--trust-binary")
    trusted = here(*words, "--trust-binary")
    assert (trusted.returncode, "is trusted" in trusted.stderr) == (0, True), trusted.stderr


@pytest.mark.slow
def test_the_processes_of_a_command_take_it_too(strange: Path, cli: Cli) -> None:
    words = ("robots", str(strange), "--quick", "--jobs", "1", "--json")
    assert "did not write" in cli(*words).stdout
    assert "did not write" not in cli(*words, "--trust-binary").stdout
