"""What no simulation can be made of: numbers and names in a file, arguments of the wrong kind."""

from __future__ import annotations

import pickle
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends.compiled.model import check_numbers
from statemachine.errors import EngineWarning, ModelError, StateMachineError

from .support.backends import each_of_both
from .support.claims import assert_in, refused, warnings_of
from .support.files import written
from .support.motions import opened
from .support.processes import in_its_own_python
from .support.small_models import model_of

_BODY = (
    '<body name="arm"{body}><joint name="lift"{joint}/><geom name="part" size="0.1"{geom}/></body>'
)


def _model(before: str = "", after: str = "", **parts: str) -> str:
    inside = _BODY.format(**{"body": "", "joint": "", "geom": "", **parts})
    return f"<mujoco>{before}<worldbody>{inside}</worldbody>{after}</mujoco>"


def _servo(attribute: str) -> str:
    return _model(after=f'<actuator><{attribute} name="servo" joint="lift"/></actuator>')


def _key(attribute: str) -> str:
    return _model(after=f'<keyframe><key name="up" {attribute}/></keyframe>')


# How the error names what is wrong, and the file.
STRANGE = {
    "timestep of <option> has 'nan'": _model('<option timestep="nan"/>'),
    "timestep is 0, .* above 0": _model('<option timestep="0"/>'),
    "timestep is -1, .* above 0": _model('<option timestep="-1"/>'),
    "gravity of <option> has '(nan|inf)'": _model('<option gravity="0 0 inf"/>'),
    "pos of <body name='arm'> has 'nan'": _model(body=' pos="nan 0 0"'),
    "mass of <geom name='part'> has 'inf'": _model(geom=' mass="inf"'),
    "inertia of body arm is infinite": _model().replace("0.1", "1e200"),
    "friction of <geom name='part'> has 'nan'": _model(geom=' friction="nan 1 1"'),
    "solimp of <geom name='part'> has 'nan'": _model(geom=' solimp="nan 1 1"'),
    "range of <joint name='lift'> has 'nan'": _model(joint=' range="nan nan" limited="true"'),
    "dof_armature of joint lift is negative": _model(joint=' armature="-5"'),
    "dof_frictionloss of joint lift": _model(joint=' frictionloss="-1"'),
    "kp of <position .*> has 'nan'": _servo('position kp="nan"'),
    "qpos of <key name='up'> has 'nan'": _key('qpos="nan"'),
    "time of <key name='up'> has 'nan'": _key('time="nan"'),
    "jnt_axis of joint lift has no direction": _model(joint=' axis="0 1e300 0"'),
    "body_quat of body arm has no direction": _model(body=' quat="1e300 0 1e300 0"'),
}
NAN_OF_A_USER = '<custom><numeric name="n" data="nan"/></custom>'
# Names that a file in Latin-1 may have.
NOT_UTF_8 = {
    "of a body": _model().replace('"arm"', '"ärm"'),
    "of a joint": _model().replace('"lift"', '"äft"'),
    "of a keyframe": _key('qpos="0"').replace('"up"', '"ä"'),
    "of the model": _model().replace("<mujoco", '<mujoco model="ä"'),
}
# What engines take, and is seldom meant.
NEGATIVE = {
    "dof_damping of joint lift": _model(joint=' damping="-1"'),
    "jnt_stiffness of joint lift": _model(joint=' stiffness="-1"'),
    "geom_friction of geom part": _model(geom=' friction="-1 1 1"'),
    "kp of actuator servo": _servo('position kp="-1"'),
    "kv of actuator servo": _servo('velocity kv="-1"'),
}


# What is unusual, and all right.
@pytest.mark.filterwarnings("ignore::statemachine.errors.EngineWarning")
@pytest.mark.parametrize("named", STRANGE)
def test_a_strange_number_is_refused_by_name(named: str, backend: str, tmp_path: Path) -> None:
    file = written(tmp_path / "m.xml", STRANGE[named])
    refused((ModelError, rf"m\.xml.*{named}", lambda: sm.load(file, backend=backend)))


@pytest.mark.parametrize(
    ("field", "value", "says"),
    [
        ("opt.timestep", np.nan, "timestep is nan"),
        ("opt.gravity", np.inf, "gravity of the options"),
        ("body_pos", np.nan, "body_pos of body .* is NaN"),
        ("body_mass", np.inf, "body_mass of body .* is infinite"),
        ("geom_friction", np.nan, "geom_friction of geom part is NaN"),
        ("jnt_range", np.nan, "jnt_range of joint lift is NaN"),
        ("key_qpos", np.nan, "key_qpos of key up is NaN"),
        ("key_time", np.inf, "key_time of key up is infinite"),
        ("key_time", -1e300, "time of key up is -1e.300"),
    ],
)
def test_a_strange_number_of_a_compiled_model_is_refused_by_name(
    field: str, value: float, says: str, tmp_path: Path
) -> None:
    """As of one that was written as binary, or changed in memory."""
    model = model_of(tmp_path, _key('qpos="0"'))
    holder, _, name = field.rpartition(".")
    owner = getattr(model.raw, holder) if holder else model.raw
    if isinstance(getattr(owner, name), float):
        setattr(owner, name, value)
    else:
        getattr(owner, name)[...] = value
    refused((ModelError, says, lambda: check_numbers(model.raw, "m.xml")))


@pytest.mark.parametrize("name", NOT_UTF_8)
def test_a_name_that_is_not_utf_8_is_refused(name: str, backend: str, tmp_path: Path) -> None:
    file = tmp_path / "m.xml"
    file.write_bytes(NOT_UTF_8[name].encode("latin-1"))
    refused(
        (
            ModelError,
            r"not UTF-8: b'\\xe4",
            lambda: sm.load(file, backend=backend),
        )
    )


@each_of_both  # whose loaders this package has: the line is that of who called `load`
@pytest.mark.parametrize("named", NEGATIVE)
def test_a_negative_number_that_engines_take_is_told(
    named: str, backend: str, tmp_path: Path
) -> None:
    with pytest.warns(EngineWarning, match=rf"m\.xml: {named} is negative$") as caught:
        sm.load(written(tmp_path / "m.xml", NEGATIVE[named]), backend=backend)
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    "text",
    [
        *(
            _model(joint=f' armature=".1" limited="true" range="{ends}"')
            for ends in ("-inf 1", "0 inf", "-inf inf", "5 inf", "-1.5e308 1.5e308")
        ),
        _servo('position kp="1" forcerange="-inf inf" forcelimited="true"'),
        _model('<option timestep="1e-6"/>', joint=' armature="0"'),
    ],
)
def test_an_unusual_number_is_taken(text: str, backend: str, tmp_path: Path) -> None:
    with opened(model_of(tmp_path, text, backend=backend), nstep=20) as (_, data):
        assert np.isfinite(data.qpos).all()


def test_public_models_are_taken(menagerie: Path) -> None:
    files = sorted(menagerie.glob("*/scene.xml"))
    assert files
    for file in files:
        sm.load(file)


def test_a_message_is_cut_and_keeps_its_ends(tmp_path: Path) -> None:
    def load(joint: str) -> sm.Model:
        return model_of(tmp_path, _model(joint=joint).replace("lift", "j" * 10**6))

    error = refused((ModelError, "j is negative$", lambda: load(' armature="-1"')))
    message = str(error)
    assert len(message) <= 2000
    assert message.startswith(str(tmp_path / "m.xml"))
    assert str(pickle.loads(pickle.dumps(error))) == message
    assert 0 < len(warnings_of(lambda: load(' damping="-1"'))[1]) <= 2000


@each_of_both  # which MuJoCo compiles for
def test_what_compiling_warns_of_is_said_and_leaves_no_file(backend: str, tmp_path: Path) -> None:
    """MuJoCo tells of the letters NaN, here in a user's own numbers, in a log file."""
    (tmp_path / "m.xml").write_text(_model().replace("<worldbody>", f"{NAN_OF_A_USER}<worldbody>"))
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
    done = in_its_own_python(code, tmp_path)
    assert (done.stdout[:20], done.stderr) == ("EngineWarning MuJoCo", "")
    assert_in(done.stdout, "contains a 'NaN'", *["m.xml"] * (backend == "pybullet"))
    assert [path.name for path in tmp_path.iterdir()] == ["m.xml"]


@pytest.mark.usefixtures("bullet")
def test_a_load_gives_back_the_handler_of_others(tmp_path: Path) -> None:
    handler, before = Mock(), mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(handler)
    try:
        text = _model().replace("<worldbody>", f"{NAN_OF_A_USER}<worldbody>")
        with pytest.warns(EngineWarning, match="m.xml"):
            model_of(tmp_path, text, backend="pybullet")
        assert mujoco.get_mju_user_warning() is handler
    finally:
        mujoco.set_mju_user_warning(before)


@pytest.mark.parametrize(
    ("load", "error", "says"),
    [
        *((partial(sm.load, model), TypeError, "a path")  # pyright: ignore
          for model in (5, None, b"so101", ["so101"], 1.5, object())),
        *((partial(sm.load, "so101", **{argument: word}), StateMachineError, f"no {argument} named")
          for argument in ("backend", "defaults")
          for word in ([], {}, None, 5, np.array([1, 2]), b"mujoco", "mujcoo")),
    ],
)  # fmt: skip
def test_what_is_no_name_of_a_model_a_backend_or_defaults(
    load: Any, error: type[Exception], says: str
) -> None:
    refused((error, says, lambda: load()))


@pytest.mark.parametrize(
    "option",
    ["gravity", "timestep", "substeps", "armature", "damping", "limits", "integrator"],
)
@pytest.mark.parametrize(
    "value",
    [10**400, [[1, 2], [3]], [10**400, 0, 0], np.array(["x", "y"]), np.zeros((2, 2, 2)), {}, "1",
     None, [None, 1, 2], np.full((40, 3), 7), object()],
)  # fmt: skip
def test_options_of_the_wrong_kind_are_one_line(
    mujoco_arm: sm.Model, option: str, value: Any
) -> None:
    refused((StateMachineError, "", lambda: mujoco_arm.replace(**{option: value})))


class Lines:
    """Something whose repr has many lines."""

    def __repr__(self) -> str:
        return "a\nb\x1b[31m" * 300


@pytest.mark.parametrize(
    "call",
    [
        lambda model, data, lines: sm.step(model, data, lines),
        lambda model, data, lines: sm.reset(model, data, lines),
        lambda model, data, lines: model.replace(limits=lines),
    ],
)
def test_a_repr_of_many_lines_is_one_line_of_a_message(call: Any) -> None:
    with opened(sm.load("so101")) as (model, data):
        error = refused((StateMachineError, "", lambda: call(model, data, Lines())))
    assert "\x1b" not in str(error)
