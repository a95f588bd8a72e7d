"""A Data of another Model is refused with both Models named, so that they can be told apart."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import ForeignDataError
from statemachine.interface.model_labels import distinct_labels

from .support.claims import assert_in
from .support.files import written
from .support.small_models import mjcf

PENDULUM = mjcf('<body><joint name="swing" axis="0 1 0"/><geom size=".1" mass="1"/></body>')


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return written(tmp_path / "pendulum.xml", PENDULUM)


def refusal(model: sm.Model, other: sm.Model) -> str:
    """Return what a step says of the Data of another Model."""
    with sm.make_data(other) as data, pytest.raises(ForeignDataError) as refused:
        sm.step(model, data)
    return str(refused.value)


def test_backends_are_named(file: Path) -> None:
    text = refusal(sm.load(file), sm.load(file, backend="pybullet"))
    assert "pendulum.xml on mujoco:" in text


def test_the_option_that_differs_is_named_on_both_sides(file: Path) -> None:
    model = sm.load(file)
    text = refusal(model.replace(damping=0.5), model.replace(damping=0.25))
    assert "(damping=0.25)" in text
    assert "(damping=0.5)" in text


def test_an_option_that_only_one_has_is_that_of_the_file_on_the_other(file: Path) -> None:
    model = sm.load(file)
    text = refusal(model, model.replace(timestep=0.001))
    assert_in(text, "(timestep of", "(timestep=0.001)")


def test_options_of_load_and_of_replace_add_up(file: Path) -> None:
    model = sm.load(file, timestep=0.001).replace(damping=np.array([0.5])).replace(damping=0.25)
    assert model.options == {"timestep": 0.001, "damping": 0.25}
    assert pickle.loads(pickle.dumps(model)).options == model.options


def test_an_array_that_changes_afterwards_changes_no_model(file: Path) -> None:
    damping = np.array([0.5])
    model = sm.load(file).replace(damping=damping)
    damping[0] = 7.0
    assert model.options["damping"] == 0.5


def test_two_models_that_are_alike_are_told_apart_by_their_id(file: Path) -> None:
    one, two = sm.load(file), sm.load(file)
    text = refusal(one, two)
    assert f"{id(one):#x}" in text
    assert f"{id(two):#x}" in text


def test_files_of_one_name_are_named_with_their_folders(file: Path, tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    other = written(tmp_path / "b" / "pendulum.xml", PENDULUM)
    left, right = distinct_labels(sm.load(file), sm.load(other))
    assert str(file) in left
    assert str(other) in right


def test_an_engine_as_it_comes_is_named(file: Path) -> None:
    emulated, native = (
        sm.load(file, backend="pybullet", defaults=defaults) for defaults in ("model", "engine")
    )
    left, right = distinct_labels(emulated, native)
    assert 'with defaults="model"' in left
    assert 'with defaults="engine"' in right
