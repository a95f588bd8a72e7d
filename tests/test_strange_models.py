"""Numbers of a model that nothing can be computed with are refused by name, on each engine."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import EngineWarning, ModelError

from .conftest import ROOT, need_engine

_BODY = '<body name="arm"{}><joint name="lift"{}/><geom name="part" size="0.1"{}/></body>'


def _model(
    body: str = "", joint: str = "", geom: str = "", before: str = "", after: str = ""
) -> str:
    inside = _BODY.format(body, joint, geom)
    return f"<mujoco>{before}<worldbody>{inside}</worldbody>{after}</mujoco>"


# The file, and how the error names what is wrong in it.
STRANGE = {
    "timestep NaN": (_model(before='<option timestep="nan"/>'), "timestep is nan"),
    "timestep 0": (_model(before='<option timestep="0"/>'), "timestep is 0, .* above 0"),
    "timestep -1": (_model(before='<option timestep="-1"/>'), "timestep is -1, .* above 0"),
    "gravity": (_model(before='<option gravity="0 0 inf"/>'), "gravity of the options"),
    "position": (_model(body=' pos="nan 0 0"'), "body_pos of body arm is NaN"),
    "friction": (_model(geom=' friction="nan 1 1"'), "geom_friction of geom part is NaN"),
    "softness": (_model(geom=' solimp="nan 1 1"'), "geom_solimp of geom part is NaN"),
    "range": (_model(joint=' range="nan nan" limited="true"'), "jnt_range of joint lift is NaN"),
    "armature": (_model(joint=' armature="-5"'), "dof_armature of joint lift is negative"),
    "frictionloss": (_model(joint=' frictionloss="-1"'), "dof_frictionloss of joint lift"),
    "kp": (
        _model(after='<actuator><position name="servo" joint="lift" kp="nan"/></actuator>'),
        "actuator_.*prm of actuator servo is NaN",
    ),
    "keyframe": (
        _model(after='<keyframe><key name="up" qpos="nan"/></keyframe>'),
        "key_qpos of key up is NaN",
    ),
    "axis": (_model(joint=' axis="0 1e300 0"'), "jnt_axis of joint lift has no direction"),
    "quat": (_model(body=' quat="1e300 0 1e300 0"'), "body_quat of body arm has no direction"),
}

# Names that a file in Latin-1 may have.
NOT_UTF_8 = {
    "of a body": _model().replace('"arm"', '"ärm"'),
    "of a joint": _model().replace('"lift"', '"äft"'),
    "of a keyframe": _model(after='<keyframe><key name="ä" qpos="0"/></keyframe>'),
    "of the model": _model().replace("<mujoco", '<mujoco model="ä"'),
}
_SERVO = '<actuator><{}="-1" name="servo" joint="lift"/></actuator>'
# What engines take, and is seldom meant.
NEGATIVE = {
    "dof_damping of joint lift": _model(joint=' damping="-1"'),
    "jnt_stiffness of joint lift": _model(joint=' stiffness="-1"'),
    "geom_friction of geom part": _model(geom=' friction="-1 1 1"'),
    "kp of actuator servo": _model(after=_SERVO.format("position kp")),
    "kv of actuator servo": _model(after=_SERVO.format("velocity kv")),
}


@pytest.mark.filterwarnings("ignore::statemachine.errors.EngineWarning")
@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
@pytest.mark.parametrize("name", STRANGE)
def test_a_strange_number_is_refused_by_name(name: str, backend: str, tmp_path: Path) -> None:
    need_engine(backend)
    file = tmp_path / "m.xml"
    text, named = STRANGE[name]
    file.write_text(text)
    with pytest.raises(ModelError, match=f"m.xml.*{named}") as caught:
        sm.load(file, backend=backend)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
@pytest.mark.parametrize("name", NOT_UTF_8)
def test_a_name_that_is_not_utf_8_is_refused(name: str, backend: str, tmp_path: Path) -> None:
    need_engine(backend)
    file = tmp_path / "m.xml"
    file.write_bytes(NOT_UTF_8[name].encode("latin-1"))
    with pytest.raises(ModelError, match=r"m\.xml has a name that is not UTF-8: b'\\xe4") as caught:
        sm.load(file, backend=backend)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
@pytest.mark.parametrize("named", NEGATIVE)
def test_a_negative_number_that_engines_take_is_told(
    named: str, backend: str, tmp_path: Path
) -> None:
    need_engine(backend)
    file = tmp_path / "m.xml"
    file.write_text(NEGATIVE[named])
    with pytest.warns(EngineWarning, match=rf"m\.xml: {named} is negative$") as caught:
        sm.load(file, backend=backend)
    assert caught[0].filename == __file__


@pytest.mark.parametrize("ends", ["-inf 1", "0 inf", "-inf inf", "5 inf", "-1.5e308 1.5e308"])
def test_a_range_without_an_end_is_one_on_every_engine(ends: str, tmp_path: Path) -> None:
    need_engine("pybullet")
    file = tmp_path / "m.xml"
    file.write_text(_model(joint=f' armature=".1" limited="true" range="{ends}"'))
    model = sm.load(file, backend="pybullet")
    with sm.make_data(model) as data:
        sm.step(model, data, 20)
        assert np.isfinite(data.qpos).all()


def test_a_message_is_cut_and_keeps_its_ends(tmp_path: Path) -> None:
    file, name = tmp_path / "m.xml", "j" * 10**6
    file.write_text(_model(joint=' armature="-1"').replace("lift", name))
    with pytest.raises(ModelError) as caught:
        sm.load(file)
    message = str(caught.value)
    assert len(message) <= 2000
    assert message.startswith(str(file))
    assert message.endswith("j is negative")
    assert str(pickle.loads(pickle.dumps(caught.value))) == message
    file.write_text(_model(joint=' damping="-1"').replace("lift", name))
    with pytest.warns(EngineWarning) as warned:
        sm.load(file)
    assert len(str(warned[0].message)) <= 2000


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_what_compiling_warns_of_is_said_and_leaves_no_file(backend: str, tmp_path: Path) -> None:
    """MuJoCo takes the density for a mass that is no number, and says so in a log file."""
    need_engine(backend)
    (tmp_path / "m.xml").write_text(_model(geom=' mass="nan"'))
    code = f"""
import warnings
import statemachine as sm
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    model = sm.load("m.xml", backend="{backend}")
    with sm.make_data(model) as data:
        sm.step(model, data)
for each in caught:
    print(each.category.__name__, each.message)
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("EngineWarning MuJoCo")
    assert "contains a 'NaN'" in done.stdout
    if backend == "pybullet":
        assert "m.xml" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["m.xml"]


def test_a_load_gives_back_the_handler_of_others(tmp_path: Path) -> None:
    need_engine("pybullet")
    mujoco = pytest.importorskip("mujoco")
    file, heard = tmp_path / "m.xml", []
    file.write_text(_model(geom=' mass="nan"'))
    handler, before = heard.append, mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(handler)
    try:
        with pytest.warns(sm.errors.EngineWarning, match="m.xml"):
            sm.load(file, backend="pybullet")
        assert mujoco.get_mju_user_warning() is handler
    finally:
        mujoco.set_mju_user_warning(before)
