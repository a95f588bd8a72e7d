"""An attribute that a Model or a Data does not have: the message says what to write."""

from __future__ import annotations

import subprocess
import sys

import pytest

import statemachine as sm
from statemachine.errors import ReadOnlyError
from statemachine.interface.unknown_attributes import OF_PACKAGE


@pytest.mark.parametrize(
    ("name", "end"),
    [
        pytest.param("jnt_names", ": write model.joint_names", id="almost MuJoCo's"),
        pytest.param("dt", ": write model.timestep", id="usual elsewhere"),
        pytest.param("step", ": write sm.step(model, data)", id="a verb"),
        pytest.param("actuation", ": model.replace(actuation=…) gives another", id="an option"),
        pytest.param("qpos", ": a Data has it, data.qpos", id="of the other object"),
        pytest.param("joint_nmaes", ". Did you mean model.joint_names?", id="misspelled"),
        pytest.param("jnt_stiffness", "; the engine's own is model.raw.jnt_stiffness", id="raw"),
    ],
)
def test_an_unknown_attribute_of_a_model_says_what_to_write(name: str, end: str) -> None:
    model = sm.load("so101")
    with pytest.raises(AttributeError) as caught:
        getattr(model, name)
    assert str(caught.value).startswith(f"a Model has no attribute {name!r}{end}")


@pytest.mark.parametrize(
    ("name", "end"),
    [
        pytest.param("t", ": write data.time", id="usual elsewhere"),
        pytest.param("contact", ": write data.contacts", id="MuJoCo's"),
        pytest.param("forward", ": write sm.forward(model, data)", id="a verb"),
        pytest.param("timestep", ": a Model has it, model.timestep", id="of the other object"),
        pytest.param("site_xpo", ". Did you mean data.site_xpos?", id="misspelled"),
        pytest.param("sensordata", "; the engine's own is data.raw.sensordata", id="raw"),
        pytest.param("zzz", "", id="nothing near"),
    ],
)
def test_an_unknown_attribute_of_a_data_says_what_to_write(name: str, end: str) -> None:
    model = sm.load("so101")
    with sm.make_data(model) as data, pytest.raises(AttributeError) as caught:
        getattr(data, name)
    assert str(caught.value).startswith(f"a Data has no attribute {name!r}{end}")


def test_what_stands_for_mujocos_names_is_there() -> None:
    written = " ".join(OF_PACKAGE.values())
    verbs = {name.partition("(")[0] for name in written.split("sm.")[1:]}
    assert verbs
    assert all(hasattr(sm, verb) for verb in verbs)


def test_mujocos_names_in_the_package_say_what_to_write() -> None:
    with pytest.raises(AttributeError, match=r"'mj_step'; write sm\.step\(model, data\)$"):
        _ = sm.mj_step


def test_a_submodule_that_is_looked_for_loads_no_engine() -> None:
    code = "import sys, statemachine; hasattr(statemachine, 'cli'); print('numpy' in sys.modules)"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    assert printed.split() == [b"False"]


def test_a_misspelled_input_that_is_assigned_says_which_is_meant() -> None:
    model = sm.load("so101")
    with sm.make_data(model) as data, pytest.raises(ReadOnlyError, match=r"Did you mean ctrl\?$"):
        data.crtl = [0.0] * 6


def test_what_is_no_option_of_a_model_is_said_to_be_none() -> None:
    with pytest.raises(ReadOnlyError, match=r"'nq' is no option of model\.replace"):
        sm.load("so101").nq = 3
