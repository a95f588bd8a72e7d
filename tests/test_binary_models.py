"""Binary models: ours are read, and any other only where the user says so."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import binary
from statemachine.errors import BadInputError, EngineWarning, ModelError

from .support.claims import refused
from .support.motions import after
from .support.processes import Cli, in_its_own_python, one_line
from .support.requirements import need_engine

LOAD = "import statemachine as sm; print(sm.load('arm.mjb').nq)"
REFUSED = "if you trust who made it"


@pytest.fixture(autouse=True)
def nothing_is_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(binary, "trusted_digests", set[str]())
    monkeypatch.delenv(binary.TRUST, raising=False)


@pytest.fixture
def strange(tmp_path: Path) -> Path:
    """A sound file that MuJoCo wrote."""
    file = tmp_path / "arm.mjb"
    mujoco.mj_saveModel(sm.load("so101").raw, str(file))
    return file


def test_a_binary_model_that_was_saved_is_read_where_it_is_trusted(
    tmp_path: Path, mujoco_box: sm.Model
) -> None:
    model: Any = mujoco_box
    model.save_binary(tmp_path / "arm.mjb")
    refused((ModelError, REFUSED, lambda: sm.load(tmp_path / "arm.mjb")))
    with pytest.warns(EngineWarning, match="is trusted"):
        again = sm.load(tmp_path / "arm.mjb", trust_binary=True)
    assert np.array_equal(after(mujoco_box, 20), after(again, 20))


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_a_binary_model_that_is_not_trusted_is_refused(strange: Path, backend: str) -> None:
    need_engine(backend)
    refused((ModelError, "trust_binary=True", lambda: sm.load(strange, backend=backend)))


def test_trust_is_warned_of_once(strange: Path) -> None:
    """The same bytes are read again by what works on that model."""
    with pytest.warns(EngineWarning, match="is trusted"):
        assert sm.load(strange, trust_binary=True).nq == 6
    with warnings.catch_warnings(action="error"):
        assert sm.load(strange).nq == 6


def test_trust_is_of_the_bytes_and_not_of_the_name(strange: Path) -> None:
    with pytest.warns(EngineWarning, match="is trusted"):
        sm.load(strange, trust_binary=True)
    strange.write_bytes(strange.read_bytes() + b"\0")
    refused((ModelError, REFUSED, lambda: sm.load(strange)))


@pytest.mark.parametrize("value", ["", "0", "no", "true"])
def test_the_environment_trusts_by_one_value_alone(
    strange: Path, value: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(binary.TRUST, value)
    refused((ModelError, REFUSED, lambda: sm.load(strange)))


def test_trust_is_true_or_false(strange: Path) -> None:
    trust: Any = "False"
    refused((BadInputError, "must be True or False", lambda: sm.load(strange, trust_binary=trust)))


def test_trust_is_of_one_process(strange: Path) -> None:
    with pytest.warns(EngineWarning):
        sm.load(strange, trust_binary=True)
    assert REFUSED in in_its_own_python(LOAD, strange.parent).stderr


def test_a_broken_binary_model_is_refused_though_it_is_trusted(tmp_path: Path) -> None:
    file = tmp_path / "bad.mjb"
    file.write_bytes(b"nonsense" * 10)
    with pytest.warns(EngineWarning), pytest.raises(ModelError, match="cannot read"):
        sm.load(file, trust_binary=True)


def test_a_command_reads_a_binary_model_when_asked(
    strange: Path, here: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(binary.TRUST, "")
    words = ["fingertip", str(strange), "--poses", "2"]
    one_line(here(*words), "--trust-binary")
    trusted = here(*words, "--trust-binary")
    assert (trusted.returncode, "is trusted" in trusted.stderr) == (0, True), trusted.stderr


@pytest.mark.slow
def test_the_processes_of_a_command_read_a_binary_model_too(strange: Path, cli: Cli) -> None:
    words = ("robots", str(strange), "--quick", "--jobs", "1", "--json")
    assert REFUSED in cli(*words).stdout
    assert REFUSED not in cli(*words, "--trust-binary").stdout
