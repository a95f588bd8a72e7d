"""Numbers without end, and arguments of the wrong kind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import ModelError, StateMachineError

ARM = (
    "<body name='b' {body}><joint name='j' axis='0 1 0' {joint}/>"
    "<geom name='g' size='.1' {geom}/></body>"
)
SERVO = "<actuator><position name='a' joint='j' {}/></actuator>"
KEY = "<keyframe><key name='home' {}/></keyframe>"


def _text(before: str = "", after: str = "", **parts: str) -> str:
    body = ARM.format(**({"body": "", "joint": "", "geom": ""} | parts))
    return f"<mujoco>{before}<worldbody>{body}</worldbody>{after}</mujoco>"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (_text(geom="mass='inf'"), "of body b is infinite"),
        (_text().replace(".1", "1e200"), "of body b is infinite"),
        (_text(after=KEY.format("time='nan'")), "key_time of key home is NaN"),
    ],
)
def test_numbers_that_make_no_simulation_are_refused_by_name(
    tmp_path: Path, text: str, named: str
) -> None:
    file = tmp_path / "strange.xml"
    file.write_text(text)
    with pytest.raises(ModelError, match=named) as caught:
        sm.load(file)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        _text(joint="range='-inf inf' limited='true'"),
        _text(after=SERVO.format("kp='1' forcerange='-inf inf' forcelimited='true'")),
        _text("<option timestep='1e-6'/>", joint="armature='0' damping='-1'"),
    ],
)
def test_unusual_numbers_are_not(tmp_path: Path, text: str) -> None:
    file = tmp_path / "unusual.xml"
    file.write_text(text)
    assert sm.load(file).nq == 1


def test_public_models_are_not(menagerie: Path) -> None:
    files = sorted(menagerie.glob("*/scene.xml"))
    assert files
    for file in files:
        sm.load(file)


@pytest.mark.parametrize("model", [5, None, b"so101", ["so101"], 1.5, object()])
def test_what_is_no_name_of_a_model(model: Any) -> None:
    with pytest.raises(TypeError, match="its name or a path") as caught:
        sm.load(model)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("word", [[], {}, None, 5, np.array([1, 2]), b"mujoco"])
def test_what_is_no_name_of_a_backend_or_of_defaults(word: Any) -> None:
    for words in ({"backend": word}, {"defaults": word}):
        with pytest.raises(StateMachineError, match=r"no (backend|defaults) named"):
            sm.load("so101", **words)


@pytest.mark.parametrize(
    "option",
    ["gravity", "timestep", "substeps", "armature", "damping", "limits", "integrator"],
)
@pytest.mark.parametrize(
    "value",
    [10**400, [[1, 2], [3]], [10**400, 0, 0], np.array(["x", "y"]), np.zeros((2, 2, 2)), {}, "1",
     None, [None, 1, 2], np.full((40, 3), 7), object()],
)  # fmt: skip
def test_options_of_the_wrong_kind_are_one_line(option: str, value: Any) -> None:
    model = sm.load("so101")
    with pytest.raises(StateMachineError) as caught:
        model.replace(**{option: value})
    assert "\n" not in str(caught.value)


def test_a_repr_of_many_lines_is_one_line_of_a_message() -> None:
    class Lines:
        def __repr__(self) -> str:
            return "a\nb\x1b[31m" * 300

    model = sm.load("so101")
    with sm.make_data(model) as data:
        for call in (
            lambda: sm.step(model, data, Lines()),  # pyright: ignore[reportArgumentType]
            lambda: sm.reset(model, data, Lines()),  # pyright: ignore[reportArgumentType]
            lambda: model.replace(limits=Lines()),
        ):
            with pytest.raises(StateMachineError) as caught:
                call()
            assert len(str(caught.value).splitlines()) == 1
            assert "\x1b" not in str(caught.value)
