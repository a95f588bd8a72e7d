"""What a student is told to write instead, for errors that Python, NumPy and MuJoCo raise."""

from __future__ import annotations

import re
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.course.grading.inside.error_hints import hint_of
from statemachine.interface import Data, Model


@pytest.fixture(scope="module")
def model() -> Model:
    """Return the Model of the arm with a box: 13 coordinates, 12 velocities and 6 servos."""
    return sm.load("so101/scene_box")


@pytest.fixture
def data(model: Model) -> Data:
    """Return a new Data of it."""
    return sm.make_data(model)


def hint_for(line: str, model: Model, data: Data, **names: Any) -> str:
    """Run a line of a student's, and return what is said of the error that it raises."""
    names |= {"sm": sm, "np": np, "model": model, "data": data, "mujoco": mujoco}
    try:
        exec(line, names)
    except Exception as error:
        return hint_of(error, line, model)
    raise AssertionError(f"{line} raises nothing")


# A line, and what stands there instead of the name.
IN_BRACKETS = (
    ('data.qpos["elbow_flex"]', 'data.qpos[model.jnt_qposadr[model.joint_id("elbow_flex")]]'),
    ('data.qvel["elbow_flex"]', 'data.qvel[model.jnt_dofadr[model.joint_id("elbow_flex")]]'),
    ('data.qacc["elbow_flex"]', 'data.qacc[model.jnt_dofadr[model.joint_id("elbow_flex")]]'),
    ('data.qfrc_bias["a"]', 'data.qfrc_bias[model.jnt_dofadr[model.joint_id("a")]]'),
    ('data.ctrl["gripper"] = 1', 'data.ctrl[model.actuator_id("gripper")]'),
    ('data.site_xpos["tip"]', 'data.site_xpos[model.site_id("tip")]'),
    ('model.jnt_type["elbow_flex"]', 'model.jnt_type[model.joint_id("elbow_flex")]'),
    ("data.xpos['box']", 'data.xpos[model.body_id("box")]'),
    ("data.qpos[name]", "data.qpos[model.jnt_qposadr[model.joint_id(name)]]"),
    ("data.ctrl[ name ]", "data.ctrl[model.actuator_id(name)]"),
)


@pytest.mark.parametrize(("line", "instead"), IN_BRACKETS)
def test_a_name_in_brackets_is_told_its_number(
    line: str, instead: str, model: Model, data: Data
) -> None:
    hint = hint_for(line, model, data, name="elbow_flex")
    assert hint.endswith(f": write {instead}")
    assert hint.startswith(f"{instead.partition('[')[0]} ")


def test_a_name_in_brackets_of_an_array_of_his_own_is_told_a_joints_number(
    model: Model, data: Data
) -> None:
    hint = hint_for('own["elbow_flex"]', model, data, own=np.zeros(3))
    assert "model.joint_id(…)" in hint


def test_the_first_array_in_the_line_that_is_ours_is_told(model: Model, data: Data) -> None:
    hint = hint_for('own[k] + data.ctrl["a"]', model, data, own=np.zeros(3), k=0)
    assert hint.startswith("data.ctrl ")


@pytest.mark.parametrize(
    ("line", "instead"),
    [
        ("data.xpos[1] = 0", "sm.forward(model, data)"),
        ("data.site_xpos[0, 0] = 1", "sm.forward(model, data)"),
        ("model.jnt_qposadr[0] = 1", "model.replace(…)"),
        ("model.actuator_ctrlrange[0] = 1", "model.replace(…)"),
    ],
)
def test_what_may_be_written_instead_of_an_array_that_may_not(
    line: str, instead: str, model: Model, data: Data
) -> None:
    others = {"sm.forward(model, data)", "model.replace(…)"} - {instead}
    hint = hint_for(line, model, data)
    assert instead in hint
    assert not any(other in hint for other in others)


@pytest.mark.parametrize(("length", "line"), [(5, "data.ctrl[:] = x"), (6, "data.qpos[:] = x")])
def test_lengths_are_told_where_an_array_does_not_fit(
    length: int, line: str, model: Model, data: Data
) -> None:
    hint = hint_for(line, model, data, x=np.zeros(length))
    array = data.ctrl if "ctrl" in line else data.qpos
    assert hint.startswith(f"{length} numbers were written into {len(array)}. ")
    assert re.findall(r"(\d+) \(model\.(\w+)\)", hint) == [
        ("13", "nq"),
        ("12", "nv"),
        ("6", "nu"),
    ]


@pytest.mark.parametrize("verb", ["step", "forward", "reset"])
def test_how_a_verb_is_called(verb: str, model: Model, data: Data) -> None:
    assert f"sm.{verb}(model, data)" in hint_for(f"sm.{verb}(model)", model, data)
    assert hint_for(f"sm.{verb}()", model, data).startswith(f"{verb} ")


@pytest.mark.parametrize(
    ("name", "meant"), [("make_date", "sm.make_data"), ("steps", "sm.step"), ("loda", "sm.load")]
)
def test_the_name_that_was_meant(name: str, meant: str, model: Model, data: Data) -> None:
    hint = hint_for(f"sm.{name}", model, data)
    assert f" {name}. Did you mean {meant}?" in hint


def test_of_a_name_that_is_like_none_no_other_is_told(model: Model, data: Data) -> None:
    hint = hint_for("sm.zzzzzz", model, data)
    assert hint.endswith(" zzzzzz")


def test_an_error_that_says_what_to_write_says_it_itself(model: Model, data: Data) -> None:
    error = AttributeError(
        "module 'statemachine' has no attribute 'x'; write sm.y", name="x", obj=sm
    )
    assert hint_of(error, "sm.x", model) == ""


def test_an_attribute_that_no_module_lacks_has_no_hint(model: Model) -> None:
    text = "module 'statemachine' has no attribute 'x'"
    assert hint_of(AttributeError(text), "x", model) == ""
    assert hint_of(AttributeError(text, name="x", obj=3), "x", model) == ""


@pytest.mark.parametrize(
    ("line", "instead"),
    [
        ("mujoco.mj_step(model, data)", "model.raw"),
        ("model.jnt_type[0].nq", "JointType(model.jnt_type[k])"),
        ("assert data.time > 0", "assert"),
        ("data.qpos[0.5:]", "round("),
        ("data.qpos[:2.0]", "round("),
        ("range(2.0)", "round("),
        ("del data; data", "sm.make_data(model)"),
    ],
)
def test_what_may_be_written_instead(line: str, instead: str, model: Model, data: Data) -> None:
    assert instead in hint_for(line, model, data)


@pytest.mark.parametrize(
    "line",
    [
        "1 / 0",
        "data.qpos[99]",
        "model.step",
        "assert False, 'with a text'",
        "unknown",
        "int('a')",
        "np.zeros(3) + np.zeros(4)",
    ],
)
def test_an_error_that_speaks_for_itself_has_no_hint(line: str, model: Model, data: Data) -> None:
    assert hint_for(line, model, data) == ""
